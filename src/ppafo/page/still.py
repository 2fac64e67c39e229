"""Static SVG picture of a page for browsers without scripts: first panel of the initial state."""

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any, NamedTuple

from ppafo.model.controlled import CONTROLLED
from ppafo.parameters.joint import ANKLE
from ppafo.report.display_units import axis_unit, display_value
from ppafo.report.style import BLACK, GREY, PAGE_COLOURS
from ppafo.units.shown import quantity_of_unit

Points = list[tuple[float, float]]
"""Points of a curve: time [s] and value in its display unit."""

_WIDTH, _HEIGHT = 720.0, 340.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 56.0, 12.0, 30.0, 44.0
"""Size of the picture, and margins around its axes [pixels]."""
_NAMES = {
    "torque": "Torque",
    "angle": "Angle of the ankle",
    "pressure_1": "Pressure in chamber 1",
    "pressure_2": "Pressure in chamber 2",
}
_UNITS = {name: CONTROLLED[name].level.unit for name in _NAMES}
_STEPS = (1.0, 2.0, 5.0, 10.0)


class _Axes(NamedTuple):
    """Axes with their ticks in time [s] and value; the picture spans the ticks."""

    times: list[float]
    values: list[float]

    def x(self, time: float) -> str:
        """Return the horizontal position of a time [pixels]."""
        width = _WIDTH - _LEFT - _RIGHT
        return f"{_LEFT + width * (time - self.times[0]) / (self.times[-1] - self.times[0]):.1f}"

    def y(self, value: float) -> str:
        """Return the vertical position of a value [pixels]."""
        height = _HEIGHT - _TOP - _BOTTOM
        return f"{_TOP + height * (self.values[-1] - value) / (self.values[-1] - self.values[0]):.1f}"


def still_of(
    tab: Mapping[str, Any],
    openings: Sequence[Mapping[str, Any]],
    programs: Sequence[Mapping[str, Any]],
    joint: str = ANKLE.name,
) -> str:
    """Draw the first panel of a tab as SVG: a curve for each configuration, and the reference.

    ``openings`` and ``programs`` belong to the initial configurations of the tab, in order. Empty if these have no
    common channel for a panel.
    """
    channel = next((name for name in _NAMES if all(name in opening["courses"] for opening in openings)), "")
    if not channel:
        return ""
    quantity, reference = quantity_of_unit(_UNITS[channel]), CONTROLLED[channel].reference
    curves = [_points(opening, channel, quantity) for opening in openings]
    required = _points(openings[0], reference, quantity) if reference in openings[0]["courses"] else []
    points = [point for curve in (required, *curves) for point in curve]
    if not points:
        return ""
    axes = _Axes(_ticks([time for time, _ in points]), _ticks([value for _, value in points]))
    # The colours that the page gives to configurations: to a valve its own, once, to others what is left.
    looks = [program["look"] for program in programs]
    unused = [number for number in range(1, len(PAGE_COLOURS) + 1) if number not in looks]
    numbers = [look if look and looks.index(look) == index else unused.pop(0) for index, look in enumerate(looks)]
    colours = [PAGE_COLOURS[number - 1] for number in numbers]
    label = f"{_NAMES[channel].replace(ANKLE.name, joint)} ({axis_unit(quantity)})"
    parts = _frame(axes, label)
    parts += [
        _line(axes, curve, f'stroke="{colour}" stroke-width="2"')
        for curve, colour in zip(curves, colours, strict=False)
    ]
    legend = list(zip((program["label"] for program in programs), colours, strict=False))
    if required:
        parts.append(_line(axes, required, f'stroke="{BLACK}" stroke-width="1.5" stroke-dasharray="6 4"'))
        legend.append(("required", BLACK))
    # A short line and a name for each curve, side by side above the axes.
    x = _LEFT
    for name, colour in legend:
        parts.append(f'<path stroke="{colour}" stroke-width="3" d="M{x} 14h18"/>')
        parts.append(_text(name, f'x="{x + 24}" y="18"'))
        x += 50.0 + 7.0 * len(name)
    description = escape(f"{tab['title']}: {label} over time, as the page opens", quote=True)
    attributes = f'font-family="sans-serif" font-size="12" fill="{GREY}" role="img" aria-label="{description}"'
    box = f'xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" width="{_WIDTH:g}"'
    return f"<svg {box} {attributes}>{''.join(parts)}</svg>"


def _points(opening: Mapping[str, Any], channel: str, quantity: str) -> Points:
    """Return the points of a channel's initial curve, without missing samples."""
    samples = zip(opening["times"], opening["courses"][channel], strict=True)
    return [(time, display_value(value, quantity)) for time, value in samples if value is not None]


def _frame(axes: _Axes, label: str) -> list[str]:
    """Return SVG grid lines, tick labels and axis titles."""
    below, middle = _HEIGHT - _BOTTOM + 16, _LEFT + (_WIDTH - _LEFT - _RIGHT) / 2
    lines = "".join(f"M{_LEFT} {axes.y(tick)}h{_WIDTH - _LEFT - _RIGHT}" for tick in axes.values)
    turned = f"translate(14 {_TOP + (_HEIGHT - _TOP - _BOTTOM) / 2}) rotate(-90)"
    return [
        f'<path stroke="#e3e3e3" d="{lines}"/>',
        *(
            _text(f"{tick:g}", f'x="{_LEFT - 6}" y="{float(axes.y(tick)) + 4:.1f}" text-anchor="end"')
            for tick in axes.values
        ),
        *(_text(f"{tick:g}", f'x="{axes.x(tick)}" y="{below}" text-anchor="middle"') for tick in axes.times),
        _text("Time (s)", f'x="{middle}" y="{_HEIGHT - 8}" text-anchor="middle"'),
        _text(label, f'transform="{turned}" text-anchor="middle"'),
    ]


def _line(axes: _Axes, curve: Points, look: str) -> str:
    """Return the SVG of a curve; constant intervals are reduced to their end points."""
    points = [(axes.x(time), axes.y(value)) for time, value in curve]
    heights = [height for _, height in points]
    ends = (0, len(points) - 1)
    kept = [
        f"{x},{y}"
        for index, (x, y) in enumerate(points)
        if index in ends or not heights[index - 1] == y == heights[index + 1]
    ]
    return f'<polyline fill="none" {look} points="{" ".join(kept)}"/>'


def _text(words: str, attributes: str) -> str:
    return f"<text {attributes}>{escape(words)}</text>"


def _ticks(values: Sequence[float]) -> list[float]:
    """Return five to ten round numbers that enclose values."""
    low, high = min(values), max(values)
    # A level line has no height of its own.
    size = (high - low) / 8.0 or 1.0
    decade = 10.0 ** math.floor(math.log10(size))
    # The small share lets a size that is a round number but for rounding be one.
    step = next(step * decade for step in _STEPS if step * decade >= size * (1.0 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [step * number for number in range(first, max(last, first + 1) + 1)]
