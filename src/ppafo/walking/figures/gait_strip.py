"""Strip of gait phases as in figure 1A of the paper: legs, controller, foot, valve and pressures over the stride."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ppafo.model.valves.kind import VENTS_ABOVE
from ppafo.report.display_units import axis_unit, display_value, display_values
from ppafo.report.style import (
    GREY,
    FigureMargins,
    figure_of_panels,
    font_size,
    house_style,
    print_scale,
    printed_width,
    write_head,
)
from ppafo.signals.recording import Floats
from ppafo.walking.figures.legs import CHAMBERS, GHOST, draw_ground, last_phases, leg_artists, legs_of
from ppafo.walking.figures.mean_stride import WITH
from ppafo.walking.result import WalkResult
from ppafo.walking.strides import PHASES, settled, times_of_phases

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (5.7, 6.1)
"""Width and height at full width [inch]."""
_MARGINS = FigureMargins(left=0.85, right=0.22, top=0.62, bottom=0.52, row_gap=0.34, label=0.42)
_HEIGHTS = (1.5, 0.72, 0.72, 0.72, 1.3)
"""Heights of the rows relative to each other: legs, three bands, pressures."""
_PERCENT = 100.0 * PHASES
_FRAMES, _FEW_FRAMES = 8, 5
"""Number of legs over the stride, and in a narrower figure."""
_EDGE, _GROUND, _HEIGHT, _OVER = 0.04, 0.12, 0.7, 0.03
"""Strip at either side that legs may use [widths]; depth of the ground, least height, space over the knee [m]."""
_LETTER, _LINE = 0.082, 0.14
"""Width of a letter and height of a text line in a block at full width [inches]."""


@dataclass(frozen=True, slots=True)
class _StateBand:
    """State in a row of the strip: name, abbreviation for a narrow block, colour, and predicate on channel values."""

    name: str
    short: str
    colour: str
    holds: Callable[[Floats], NDArray[np.bool_]]


def _is(value: float) -> Callable[[Floats], NDArray[np.bool_]]:
    return lambda values: values == value


_FREE, _DORSI, _PLANTAR = "#e4e4e4", "#f0b48a", "#8fbfe0"
_ROWS: Mapping[str, tuple[str, tuple[_StateBand, ...]]] = {
    "Controller": (
        "controller_phase",
        (
            _StateBand("1 heel strike", "1 heel", "#f6d5bd", _is(1.0)),
            _StateBand("4 free motion", "4 free", _FREE, _is(2.0)),
            _StateBand("2 push-off", "2 push", _PLANTAR, _is(3.0)),
            _StateBand("3 swing", "3 swing", _DORSI, _is(0.0)),
        ),
    ),
    "Foot": (
        "contact",
        (
            _StateBand("on the heel", "heel", "#cfe3c9", _is(1.0)),
            _StateBand("flat", "flat", "#9fcf94", _is(2.0)),
            _StateBand("on the toes", "toes", "#63ad59", _is(3.0)),
            _StateBand("in the air", "air", "#f3f3f3", _is(0.0)),
        ),
    ),
    "Valve": (
        "command",
        (
            _StateBand("vented", "vented", _FREE, lambda command: command > VENTS_ABOVE),
            _StateBand("closed", "closed", "#ffffff", _is(0.0)),
            _StateBand(
                "plantarflexion", "plantar", _PLANTAR, lambda command: (command > 0.0) & (command <= VENTS_ABOVE)
            ),
            _StateBand("dorsiflexion", "dorsi", _DORSI, lambda command: command < 0.0),
        ),
    ),
}


def strip_figure(result: WalkResult) -> "Figure":
    """Return the strip of gait phases of a walk; where strides differ, colours show the fraction of the strides."""
    with house_style():
        figure, grid = figure_of_panels(_SIZE, _MARGINS, len(_HEIGHTS), heights=_HEIGHTS)
        rows = [axes for (axes,) in grid]
        _draw_legs(rows[0], result)
        for axes, (label, (channel, states)) in zip(rows[1:4], _ROWS.items(), strict=True):
            _draw_band(axes, label, _shares(result, channel, states), states)
        _draw_pressures(rows[4], result)
        rows[4].set_xlabel("Stride (%)")
        rows[4].set_xlim(0.0, 100.0)
        remark = "height of each colour: fraction of strides"
        write_head(figure, f"{result.scenario.name}: tasks over the stride", remark, result.recording.kind)
        return figure


def _shares(result: WalkResult, channel: str, states: tuple[_StateBand, ...]) -> Floats:
    """Return the fraction of assisted strides in each state at ``PHASES``, shape (states, phases); 0 without data."""
    chosen = settled(result.helped)
    if channel not in result.recording or not chosen.any():
        return np.zeros((len(states), PHASES.size))
    time = result.recording.time
    stride = np.searchsorted(time, times_of_phases(time, result.starts)[chosen], side="right") - 1
    values = result.recording[channel][stride]
    return np.array([np.mean(state.holds(values), axis=0) for state in states])


def _draw_band(axes: "Axes", label: str, fractions: Floats, states: tuple[_StateBand, ...]) -> None:
    below = np.zeros(PHASES.size)
    centred: dict[str, Any] = {"ha": "center", "va": "center"}
    for state, fraction in zip(states, fractions, strict=True):
        axes.fill_between(_PERCENT, below, below + fraction, color=state.colour, linewidth=0.0, step="mid")
        # Write the name into every block that holds for most strides, as it fits: whole, short, upright, or not.
        middle = below + 0.5 * fraction
        inside = np.flatnonzero(np.diff(np.concatenate([[0], (fraction > 0.5).astype(int), [0]])))
        for first, last in zip(inside[::2], inside[1::2], strict=True):
            left, right = _PERCENT[first], _PERCENT[last - 1]
            x, y = 0.5 * (left + right), float(np.mean(middle[first:last]))
            space = 0.01 * (right - left) * (printed_width(_SIZE[0]) / print_scale() - _MARGINS.left - _MARGINS.right)
            fitting = [name for name in (state.name, state.short) if _LETTER * len(name) <= space]
            if fitting:
                axes.text(x, y, fitting[0], fontsize=font_size(9.0), **centred)
            elif space >= _LINE:
                axes.text(x, y, state.short, fontsize=font_size(8.0), rotation=90, **centred)
        below = below + fraction
    if not below.any():
        axes.text(50.0, 0.5, "no gait phases in this controller", fontsize=font_size(9.0), color=GREY, **centred)
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([])
    axes.grid(visible=False)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="x", length=0.0)
    axes.set_title(label, pad=3.0, fontsize=font_size(10.0))


def _draw_legs(axes: "Axes", result: WalkResult) -> None:
    """Draw stick figures above the strip, each at its instant, in axes scaled in metres over the same percent axis."""
    frames = _FRAMES if printed_width(_SIZE[0]) >= _SIZE[0] else _FEW_FRAMES
    turns = last_phases(result, 1, frames) + 0.5 / frames
    legs, shares, box = legs_of(result, turns), turns % 1.0, axes.get_window_extent()
    points = np.array([[leg.knee, leg.heel, leg.toe] for leg in (legs.healthy, legs.worn)]).reshape(-1, turns.size, 2)
    reach, top = points[..., 0] - legs.healthy.ankle[:, 0], float(points[..., 1].max()) + _OVER
    # The width of the stride [m] at which no leg passes the edges of the picture, however long it is.
    sides = np.maximum(-reach / (shares + _EDGE), reach / (1.0 - shares + _EDGE))
    metres = max(float(sides.max()), max(_HEIGHT, top + _GROUND) * box.width / box.height)
    inner = axes.inset_axes((-_EDGE, 0.0, 1.0 + 2.0 * _EDGE, 1.0))
    draw_ground(inner, 0.0, metres)
    for index in range(turns.size):
        offset = legs.healthy.ankle[index, 0] - metres * shares[index]
        leg_artists(inner, GHOST, 1.6, is_ghost=True).place(legs.healthy, index, offset)
        leg_artists(inner, WITH, 2.6).place(legs.worn, index, offset)
    inner.set_xlim(-_EDGE * metres, (1.0 + _EDGE) * metres)
    inner.set_ylim(-_GROUND, metres * box.height / box.width - _GROUND)
    inner.set_axis_off()
    axes.set_axis_off()


def _draw_pressures(axes: "Axes", result: WalkResult) -> None:
    atmosphere = result.scenario.device.supply.atmospheric_pressure
    for channel, name, look in CHAMBERS:
        if channel in result.averages:
            mean = display_values(result.averages[channel].mean, "pressure")
            axes.plot(_PERCENT, mean, color=look.colour, linestyle=look.line, label=name)
    axes.axhline(display_value(atmosphere, "pressure"), color=GREY, linewidth=0.8)
    axes.set_ylabel(f"Pressure\n({axis_unit('pressure')})")
    axes.locator_params(axis="y", nbins=4)
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.02, 1.0), ncols=2, borderaxespad=0.1, handlelength=1.6, columnspacing=1.0
    )
