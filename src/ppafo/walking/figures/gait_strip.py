"""Strip of gait phases as in figure 1A of the paper: legs, controller, foot, valve and pressures over the stride."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ppafo.model.valves.kind import VENTS_ABOVE
from ppafo.report.display_units import axis_unit, display_value, display_values
from ppafo.report.style import GREY, FigureMargins, figure_of_panels, font_size, house_style, mark_kind
from ppafo.signals.recording import Floats
from ppafo.walking.figures.legs import CHAMBERS, GHOST, draw_ground, last_phases, leg_artists, legs_of
from ppafo.walking.figures.mean_stride import WITH
from ppafo.walking.result import WalkResult
from ppafo.walking.strides import PHASES, settled, times_of_phases

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (9.4, 6.0)
"""Width and height [inch]."""
_MARGINS = FigureMargins(left=1.3, right=0.2, top=0.55, bottom=0.52, row_gap=0.22, label=0.5)
_HEIGHTS = (1.75, 0.7, 0.7, 0.7, 1.35)
"""Heights of the rows relative to each other: legs, three bands, pressures."""
_PERCENT = 100.0 * PHASES
_FRAMES = 8
"""Number of legs over the stride."""
_NARROW, _NARROWEST = 9.0, 2.5
"""Width of a block [percent of the stride] below which its name is vertical, and below which the name is left out."""


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
        width, height = _SIZE
        title = f"{result.scenario.name}: functional tasks of the paper's figure 1A over the stride"
        figure.text(0.12 / width, 1.0 - 0.12 / height, title, ha="left", va="top", fontweight="bold")
        remark = "height of each colour: fraction of strides"
        figure.text(0.12 / width, 1.0 - 0.34 / height, remark, ha="left", va="top", fontsize=font_size(8.5), color=GREY)
        mark_kind(figure, result.recording.kind)
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
    for state, fraction in zip(states, fractions, strict=True):
        axes.fill_between(_PERCENT, below, below + fraction, color=state.colour, linewidth=0.0, step="mid")
        # Write the name into every block that is wide enough and holds for most strides.
        middle = below + 0.5 * fraction
        inside = np.flatnonzero(np.diff(np.concatenate([[0], (fraction > 0.5).astype(int), [0]])))
        for first, last in zip(inside[::2], inside[1::2], strict=True):
            left, right = _PERCENT[first], _PERCENT[last - 1]
            x, y = 0.5 * (left + right), float(np.mean(middle[first:last]))
            if right - left >= _NARROW:
                axes.text(x, y, state.name, ha="center", va="center", fontsize=font_size(9.0))
            elif right - left >= _NARROWEST:
                axes.text(x, y, state.short, ha="center", va="center", fontsize=font_size(8.0), rotation=90)
        below = below + fraction
    if not below.any():
        axes.text(
            50.0,
            0.5,
            "no gait phases in this controller",
            ha="center",
            va="center",
            fontsize=font_size(9.0),
            color=GREY,
        )
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([])
    axes.grid(visible=False)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="x", length=0.0)
    axes.set_ylabel(label, rotation=0, ha="right", va="center")
    axes.yaxis.set_label_coords(-0.012, 0.5)


def _draw_legs(axes: "Axes", result: WalkResult) -> None:
    """Draw stick figures above the strip, each at its instant, in axes scaled in metres over the same percent axis."""
    turns = last_phases(result, 1, _FRAMES) + 0.5 / _FRAMES
    legs = legs_of(result, turns)
    panel_width = _SIZE[0] - _MARGINS.left - _MARGINS.right
    panel_height = axes.get_position().height * _SIZE[1]
    height = 0.7
    metres = height * panel_width / panel_height
    inner = axes.inset_axes((0.0, 0.0, 1.0, 1.0))
    draw_ground(inner, 0.0, metres)
    for index in range(turns.size):
        offset = legs.healthy.ankle[index, 0] - metres * (turns[index] % 1.0)
        leg_artists(inner, GHOST, 1.6, is_ghost=True).place(legs.healthy, index, offset)
        leg_artists(inner, WITH, 2.6).place(legs.worn, index, offset)
    inner.set_xlim(0.0, metres)
    inner.set_ylim(-0.12, height - 0.12)
    inner.set_axis_off()
    axes.set_axis_off()


def _draw_pressures(axes: "Axes", result: WalkResult) -> None:
    atmosphere = result.scenario.device.supply.atmospheric_pressure
    for channel, name, look in CHAMBERS:
        if channel in result.averages:
            mean = display_values(result.averages[channel].mean, "pressure")
            axes.plot(_PERCENT, mean, color=look.colour, linestyle=look.line, label=name)
    axes.axhline(display_value(atmosphere, "pressure"), color=GREY, linewidth=0.8)
    axes.set_ylabel(f"Chambers\n({axis_unit('pressure')})", rotation=0, ha="right", va="center")
    axes.yaxis.set_label_coords(-0.045, 0.5)
    axes.locator_params(axis="y", nbins=4)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2, borderaxespad=0.1, handlelength=1.6)
