"""Figures 7 and 8 of the paper: the step response and the torque task, simulated, beside synthetic measurements."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ppafo.analyses.reproduce.step_response import Levels, StepEvents
from ppafo.constants import GRAMS_PER_KILOGRAM, PASCALS_PER_PSI
from ppafo.report.style import (
    ACTUAL,
    CHAMBER_1,
    CHAMBER_2,
    EXPERIMENT,
    GREY,
    PROPORTIONAL,
    REFERENCE,
    SOLENOID,
    Look,
    Margins,
    figure_of_panels,
    house_style,
    mark_kind,
)
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MILLISECONDS = 1.0e3
_DOTTED = (0, (1, 2))
_STEP_SIZE, _TASK_SIZE = (7.6, 7.4), (7.6, 10.4)
_STEP_MARGINS = Margins(left=0.68, right=0.15, top=0.5, bottom=0.82, row_gap=0.34, column_gap=0.78)
_TASK_MARGINS = Margins(left=0.68, right=0.15, top=0.42, bottom=1.75, row_gap=0.36)
"""Inches."""
_STEP_HEIGHTS, _TASK_HEIGHTS = (3.0, 1.0, 3.0, 1.0), (3.0, 0.9, 3.0, 0.9, 1.6, 1.8)
_SHOWN_BEFORE_STEP = 0.03
"""Fraction of the time axis before the step, so that a rise within the first milliseconds does not hide in the axis."""
_SHOWN_AFTER_STOP = 0.8
"""Fraction of the time until the stop that is shown beyond it; what follows is rest."""
_ENLARGED = 40.0
"""First milliseconds after the step that are shown enlarged."""
_BIN = 3.0
"""Milliseconds over which the band of a measurement reaches from its least to its largest reading."""


class _Panel(NamedTuple):
    """One panel of figure 7: its name, unit and look, and its room for the first milliseconds (x, y, width, height)."""

    name: str
    unit: str
    look: Look
    inset: tuple[float, float, float, float] | None


_PANELS = (
    _Panel(name="Vane angle", unit="deg", look=ACTUAL, inset=(0.66, 0.26, 0.31, 0.34)),
    _Panel(name="Pressure difference, $P_1 - P_2$", unit="psi", look=ACTUAL, inset=(0.69, 0.14, 0.29, 0.34)),
    _Panel(name="Chamber 1 (plantarflexion), $P_1$", unit="psig", look=CHAMBER_1, inset=(0.3, 0.12, 0.34, 0.34)),
    _Panel(name="Chamber 2 (dorsiflexion), $P_2$", unit="psig", look=CHAMBER_2, inset=(0.69, 0.3, 0.29, 0.4)),
)


def step_response_figure(
    recording: Recording, levels: Levels, events: StepEvents | None, synthetic: Recording | None = None
) -> "Figure":
    """Return figure 7: angle, pressure difference, and both pressures over time; ``events`` are marked where known.

    ``synthetic`` is a measurement on the simulated bench: a thin line and the band of its readings; below each panel
    stands what it differs from the model.
    """
    with house_style():
        rows, heights = (2, (1.0, 1.0)) if synthetic is None else (4, _STEP_HEIGHTS)
        size = (_STEP_SIZE[0], 5.8) if synthetic is None else _STEP_SIZE
        figure, grid = figure_of_panels(size, _STEP_MARGINS, rows=rows, columns=2, heights=heights)
        each = rows // 2
        panels = [grid[each * row][column] for row in (0, 1) for column in (0, 1)]
        last = _MILLISECONDS * _last_time(recording, events)
        for letter, axes, panel, values in zip("ABCD", panels, _PANELS, _curves(recording, levels), strict=True):
            axes.plot(_MILLISECONDS * recording.time, values, color=panel.look.colour, label="model", zorder=3)
            axes.set_title(f"$\\bf{{{letter}}}$   {panel.name}", fontsize=10.5)
            axes.set_ylabel(panel.unit)
            axes.margins(y=0.06)
        for axes in grid[-1]:
            axes.set_xlabel("Time after the step (ms)")
        panels[0].set_xlim(-_SHOWN_BEFORE_STEP * last, last)
        if synthetic is not None:
            differences = [grid[each * row + 1][column] for row in (0, 1) for column in (0, 1)]
            _add_measurement(panels, differences, recording, synthetic, levels)
        for axes, panel in zip(panels, _PANELS, strict=True):
            if panel.inset is not None:
                _enlarge(axes, panel.inset)
        if events is not None:
            _mark([axes for row in grid for axes in row], panels[0], events)
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="lower right", ncols=3, bbox_to_anchor=(0.985, 0.0))
        mark_kind(figure, recording.kind if synthetic is None else synthetic.kind)
        return figure


def _curves(recording: Recording, levels: Levels) -> tuple[Floats, ...]:
    """Return what the panels show, in their order and units."""
    first, second = recording["pressure_1"], recording["pressure_2"]
    gauge = ((pressure - levels.atmosphere) / PASCALS_PER_PSI for pressure in (first, second))
    return (np.degrees(recording["angle"]), (first - second) / PASCALS_PER_PSI, *gauge)


def _last_time(recording: Recording, events: StepEvents | None) -> float:
    last = float(recording.time[-1])
    return last if events is None else min(last, events.stop_time * (1.0 + _SHOWN_AFTER_STOP))


def _add_measurement(
    panels: "Sequence[Axes]", differences: "Sequence[Axes]", model: Recording, synthetic: Recording, levels: Levels
) -> None:
    """Draw a measurement as a line with the band of its readings, and below it what it differs from the model."""
    times = _MILLISECONDS * synthetic.time
    first = np.flatnonzero(np.diff(np.floor(times / _BIN), prepend=-np.inf) > 0.0)
    curves = zip(_PANELS, _curves(synthetic, levels), _curves(model, levels), strict=True)
    for axes, below, (panel, values, expected) in zip(panels, differences, curves, strict=True):
        low, high = np.minimum.reduceat(values, first), np.maximum.reduceat(values, first)
        axes.fill_between(
            times[first] + 0.5 * _BIN, low, high, color=EXPERIMENT.colour, alpha=0.3, linewidth=0.0, zorder=1
        )
        axes.plot(times, values, color=EXPERIMENT.colour, linewidth=0.8, zorder=2, label="synthetic measurement")
        apart = values - np.interp(synthetic.time, model.time, expected)
        below.plot(times, apart, color=EXPERIMENT.colour, linewidth=0.9)
        below.axhline(0.0, color=panel.look.colour, linewidth=1.0)
        below.set_ylabel(f"Δ {panel.unit.replace('psig', 'psi')}")
        below.locator_params(axis="y", nbins=4)


def _enlarge(axes: "Axes", place: tuple[float, float, float, float]) -> None:
    """Show the first milliseconds of a panel enlarged, inside it."""
    inset = axes.inset_axes(place)
    for line in axes.lines:
        times, values = (np.asarray(data, dtype=np.float64) for data in line.get_data())
        shown = times <= _ENLARGED
        (copied,) = inset.plot(times[shown], values[shown], color=line.get_color(), zorder=line.get_zorder())
        copied.set_linewidth(line.get_linewidth())
    inset.margins(y=0.08)
    inset.set_xlim(-0.05 * _ENLARGED, _ENLARGED)
    inset.tick_params(labelsize=7.0, length=2.0)
    inset.set_xticks([0.0, 0.5 * _ENLARGED, _ENLARGED])
    inset.locator_params(axis="y", nbins=3)
    inset.set_title(f"first {_ENLARGED:.0f} ms", fontsize=7.5, color=GREY, loc="center", pad=2.0)


def _mark(every: "Sequence[Axes]", named: "Axes", events: StepEvents) -> None:
    """Mark breakaway and stop in every panel, and name them in one."""
    for axes in every:
        for time in (events.breakaway_time, events.stop_time):
            axes.axvline(_MILLISECONDS * time, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)), alpha=0.7, zorder=0.5)
    for time, name, height in (
        (events.breakaway_time, "vane breaks away", 0.93),
        (events.stop_time, "vane at rest", 0.07),
    ):
        named.annotate(
            name,
            (_MILLISECONDS * time, height),
            xycoords=("data", "axes fraction"),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=8.5,
            color=GREY,
        )


def torque_task_figure(
    solenoid: Recording,
    proportional: Recording,
    ceiling: float,
    gas_in_paper: tuple[float, float],
    synthetic: tuple[Recording, Recording] | None = None,
) -> "Figure":
    """Return figure 8: torque and reference with each valve, what the valve does below, error and gas at the bottom.

    ``ceiling`` is the torque that the supply can hold [N m], ``gas_in_paper`` what the paper states for the solenoid
    valves and for the proportional valve [g]. ``synthetic`` is the same task on the simulated bench, with the one and
    with the other.
    """
    runs = (solenoid, proportional)
    with house_style():
        figure, rows = figure_of_panels(_TASK_SIZE, _TASK_MARGINS, rows=len(_TASK_HEIGHTS), heights=_TASK_HEIGHTS)
        grid = [axes for (axes,) in rows]
        for place, recording, title, look in (
            (0, solenoid, "Solenoid valves, on or off", SOLENOID),
            (2, proportional, "Proportional valve", PROPORTIONAL),
        ):
            measured = None if synthetic is None else synthetic[place // 2]
            _torque(grid[place], recording, title, look, ceiling, measured)
        _states(grid[1], solenoid)
        grid[3].plot(proportional.time, proportional["command"], color=PROPORTIONAL.colour)
        grid[3].set_ylim(-0.08 if proportional["command"].min() >= 0.0 else -1.1, 1.08)
        grid[3].set_ylabel("Opening")
        for recording, look in zip(runs, (SOLENOID, PROPORTIONAL), strict=True):
            grid[4].plot(recording.time, recording["reference"] - recording["torque"], color=look.colour)
        grid[4].axhline(0.0, color=GREY, linewidth=0.8)
        grid[4].set_title("Error: reference less torque, both valves")
        grid[4].set_ylabel("Error (N m)")
        _gas(grid[5], runs, gas_in_paper)
        grid[5].set_xlabel("Time (s)")
        grid[5].set_xlim(float(solenoid.time[0]), float(solenoid.time[-1]))
        limits = [axes.get_ylim() for axes in (grid[0], grid[2])]
        for axes in (grid[0], grid[2]):
            axes.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))
        width, height = _TASK_SIZE
        left, right = _TASK_MARGINS.left + 0.35, _TASK_MARGINS.right
        _whereabouts(
            figure.add_axes((left / width, 0.34 / height, (width - left - right) / width, 0.56 / height)), runs
        )
        mark_kind(figure, solenoid.kind)
        return figure


def _torque(
    axes: "Axes", recording: Recording, title: str, look: Look, ceiling: float, synthetic: Recording | None
) -> None:
    axes.axhline(ceiling, color=GREY, linewidth=0.9, linestyle=_DOTTED, zorder=0.9)
    axes.plot(
        recording.time, recording["reference"], REFERENCE.line, color=REFERENCE.colour, linewidth=1.3, label="reference"
    )
    if synthetic is not None:
        axes.plot(
            synthetic.time,
            synthetic["torque"],
            color=EXPERIMENT.colour,
            linewidth=2.6,
            alpha=0.45,
            label="torque, synthetic experiment",
        )
    axes.plot(recording.time, recording["torque"], look.line, color=look.colour, label="torque, simulated")
    axes.set_title(title)
    axes.set_ylabel("Torque (N m)")
    axes.annotate(
        f"maximum that the supply can hold: {ceiling:.1f} N m",
        (1.0, ceiling),
        xycoords=("axes fraction", "data"),
        xytext=(-2, -4),
        textcoords="offset points",
        ha="right",
        va="top",
        fontsize=8.5,
        color=GREY,
    )
    axes.legend(loc="lower right")


def _states(axes: "Axes", recording: Recording) -> None:
    """Show which of the two valves is on, as bars in the colour of the chamber that it fills."""
    for row, valve, look in ((1, 1.0, CHAMBER_1), (0, -1.0, CHAMBER_2)):
        is_on = np.concatenate(([False], np.sign(recording["command"][:-1]) == valve, [False]))
        edges = recording.time[np.flatnonzero(np.diff(is_on))]
        spans = [(float(start), float(end - start)) for start, end in zip(edges[::2], edges[1::2], strict=True)]
        axes.broken_barh(spans, (row + 0.12, 0.76), color=look.colour, linewidth=0.0)
    axes.set_ylim(0.0, 2.0)
    axes.set_yticks((0.5, 1.5), ("2 fills", "1 fills"))
    axes.tick_params(axis="y", length=0.0, labelsize=8.5)
    axes.grid(visible=False)
    axes.set_ylabel("Chamber", labelpad=14.0)


def _gas(axes: "Axes", runs: tuple[Recording, Recording], in_paper: tuple[float, float]) -> None:
    for recording, name, look, stated in zip(
        runs, ("solenoid valves", "proportional valve"), (SOLENOID, PROPORTIONAL), in_paper, strict=True
    ):
        supplied = GRAMS_PER_KILOGRAM * recording["supplied_mass"]
        axes.plot(recording.time, supplied, color=look.colour)
        axes.axhline(stated, color=look.colour, linewidth=0.9, linestyle=_DOTTED, zorder=0.9)
        axes.annotate(
            f"{name}: {supplied[-1]:.2f} g simulated, {stated:g} g in the paper (dotted)",
            (1.0, max(float(supplied[-1]), stated)),
            xycoords=("axes fraction", "data"),
            xytext=(-2, 4),
            textcoords="offset points",
            ha="right",
            va="bottom",
            fontsize=8.5,
            color=look.colour,
        )
    axes.set_title("Gas taken from the supply")
    axes.set_ylabel("CO$_2$ (g)")
    axes.set_ylim(0.0, 1.3 * max(in_paper[0], GRAMS_PER_KILOGRAM * float(runs[0]["supplied_mass"][-1])))


def _whereabouts(axes: "Axes", runs: tuple[Recording, Recording]) -> None:
    """Show where the supplied gas is at the end: in the chambers, or let out; and what of it leaked past the vane."""
    for row, (recording, look) in enumerate(zip(runs, (SOLENOID, PROPORTIONAL), strict=True)):
        supplied, vented, leaked = (
            GRAMS_PER_KILOGRAM * float(recording[name][-1]) for name in ("supplied_mass", "vented_mass", "leaked_mass")
        )
        filled = supplied - vented
        axes.barh(1 - row, filled, height=0.5, color=look.colour)
        axes.barh(1 - row, vented, left=filled, height=0.5, color=look.colour, alpha=0.35)
        axes.barh(1 - row - 0.36, leaked, left=supplied - leaked, height=0.1, color=GREY)
        axes.text(
            supplied,
            1 - row,
            f"  {filled:.2f} g in the chambers, {vented:.2f} g vented (pale); {leaked:.2f} g leaked (grey)",
            va="center",
            fontsize=8.0,
        )
    axes.set_yticks((1, 0), ("solenoid", "proportional"), fontsize=8.5)
    axes.set_ylim(-0.55, 1.45)
    axes.set_xlim(0.0, 2.7 * GRAMS_PER_KILOGRAM * max(float(item["supplied_mass"][-1]) for item in runs))
    axes.set_xticks([])
    axes.spines["bottom"].set_visible(False)
    axes.grid(visible=False)
    axes.set_title("Where that gas is at the end", fontsize=10.5)
