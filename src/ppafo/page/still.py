"""The picture of a page for browsers that run no scripts: the first panel of what it opens with, as SVG."""

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from ppafo.model.controlled import CONTROLLED
from ppafo.report.display_units import axis_unit, display_value, quantity_of_unit
from ppafo.report.style import BLACK, GREY, PAGE_COLOURS

_WIDTH, _HEIGHT = 720.0, 340.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 56.0, 12.0, 30.0, 44.0
_NAMES = {
    "torque": "Torque",
    "angle": "Angle of the ankle",
    "pressure_1": "Pressure in chamber 1",
    "pressure_2": "Pressure in chamber 2",
}
_UNITS = {name: CONTROLLED[name].level.unit for name in _NAMES}
_STEPS = (1.0, 2.0, 5.0, 10.0)


def still_of(
    tab: Mapping[str, Any], openings: Sequence[Mapping[str, Any]], programs: Sequence[Mapping[str, Any]]
) -> str:
    """Return the first panel of a tab as the text of an SVG: a curve for each configuration, and the reference."""
    lead = next((name for name in _NAMES if all(name in opening["courses"] for opening in openings)), "")
    if not lead:
        return ""
    quantity = quantity_of_unit(_UNITS[lead])

    def course(opening: Mapping[str, Any], name: str) -> list[tuple[float, float]]:
        both = zip(opening["times"], opening["courses"][name], strict=True)
        return [(time, display_value(value, quantity)) for time, value in both if value is not None]

    curves = [(course(opening, lead), colour) for opening, colour in zip(openings, _colours(programs), strict=False)]
    reference = CONTROLLED[lead].reference
    required = course(openings[0], reference) if reference in openings[0]["courses"] else []
    points = [point for curve in (required, *(points for points, _ in curves)) for point in curve]
    if not points:
        return ""
    across, up = _ticks([time for time, _ in points]), _ticks([value for _, value in points])
    wide, high = _WIDTH - _LEFT - _RIGHT, _HEIGHT - _TOP - _BOTTOM

    def x(time: float) -> str:
        return f"{_LEFT + wide * (time - across[0]) / (across[-1] - across[0]):.1f}"

    def y(value: float) -> str:
        return f"{_TOP + high * (up[-1] - value) / (up[-1] - up[0]):.1f}"

    def line(curve: Sequence[tuple[float, float]], look: str) -> str:
        places = [(x(time), y(value)) for time, value in curve]
        # Of a level stretch its two ends are enough.
        levels = [up for _, up in places]
        same = zip(levels, levels[1:], levels[2:], strict=False)
        kept = [True, *(not before == here == after for before, here, after in same), True]
        shown = " ".join(f"{across},{up}" for (across, up), is_kept in zip(places, kept, strict=False) if is_kept)
        return f'<polyline fill="none" {look} points="{shown}"/>'

    def text(words: str, where: str) -> str:
        return f"<text {where}>{escape(words)}</text>"

    bottom, names, at = _HEIGHT - _BOTTOM, [program["label"] for program in programs], _LEFT
    parts = [f'<path stroke="#e3e3e3" d="{"".join(f"M{_LEFT} {y(tick)}h{wide}" for tick in up)}"/>']
    parts += [text(f"{tick:g}", f'x="{_LEFT - 6}" y="{float(y(tick)) + 4:.1f}" text-anchor="end"') for tick in up]
    parts += [text(f"{tick:g}", f'x="{x(tick)}" y="{bottom + 16}" text-anchor="middle"') for tick in across]
    parts.append(text("Time (s)", f'x="{_LEFT + wide / 2}" y="{_HEIGHT - 8}" text-anchor="middle"'))
    label = f"{_NAMES[lead]} ({axis_unit(quantity)})"
    parts.append(text(label, f'transform="translate(14 {_TOP + high / 2}) rotate(-90)" text-anchor="middle"'))
    parts += [line(curve, f'stroke="{colour}" stroke-width="2"') for curve, colour in curves]
    if required:
        parts.append(line(required, f'stroke="{BLACK}" stroke-width="1.5" stroke-dasharray="6 4"'))
    for name, colour in [
        *zip(names, (colour for _, colour in curves), strict=False),
        *([("required", BLACK)] if required else []),
    ]:
        parts.append(
            f'<path stroke="{colour}" stroke-width="3" d="M{at} 14h18"/>' + text(name, f'x="{at + 24}" y="18"')
        )
        at += 50.0 + 7.0 * len(name)
    said = escape(f"{tab['title']}: {label} over time, as the page opens", quote=True)
    look = f'font-family="sans-serif" font-size="12" fill="{GREY}" role="img" aria-label="{said}"'
    box = f'xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" width="{_WIDTH:g}"'
    return f"<svg {box} {look}>{''.join(parts)}</svg>"


def _colours(programs: Sequence[Mapping[str, Any]]) -> list[str]:
    """The colours that the page gives to configurations: of a valve its own, once, of others what is left."""
    looks = [program["look"] for program in programs]
    free = [number for number in range(1, len(PAGE_COLOURS) + 1) if number not in looks]
    colours = []
    for place, look in enumerate(looks):
        number = look if look and looks.index(look) == place else free.pop(0)
        colours.append(PAGE_COLOURS[number - 1])
    return colours


def _ticks(values: Sequence[float]) -> list[float]:
    """Round numbers that enclose some values, five to ten of them."""
    low, high = min(values), max(values)
    # A level line has no height of its own.
    size = (high - low) / 8.0 or 1.0
    decade = 10.0 ** math.floor(math.log10(size))
    # The small share lets a size that is a round number but for rounding be one.
    step = next(step * decade for step in _STEPS if step * decade >= size * (1.0 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [step * number for number in range(first, max(last, first + 1) + 1)]
