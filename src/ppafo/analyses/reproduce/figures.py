"""Figures 7 and 8 of the paper: simulated step response and torque task, with synthetic measurements."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from operator import methodcaller
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.analyses.reproduce.step_response import StepEvents, SupplyLevels
from ppafo.constants import GRAMS_PER_KILOGRAM, PASCALS_PER_PSI
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import (
    ACTUAL,
    BLACK,
    CHAMBER_1,
    CHAMBER_2,
    EXPERIMENT,
    GREY,
    PROPORTIONAL,
    REFERENCE,
    SOLENOID,
    DrawingStyle,
    font_size,
)
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MILLISECONDS = 1.0e3
_AFTER_STEP = Kind("Time after the step", "ms")
_SHOWN_BEFORE_STEP = 0.03
"""Fraction of the time axis before the step, so that the rise within the first milliseconds stays visible."""
_SHOWN_AFTER_STOP = 0.8
"""Fraction of the time until the stop that is shown after the stop; the vane then rests."""
_ENLARGED = 40.0
"""Time after the step that is shown enlarged [ms]."""
_BIN = 3.0
"""Interval [ms] for the band from the smallest to the largest reading of a measurement."""
_CURVES = (
    ("Vane angle", "Angle", "deg", ACTUAL.colour, (0.66, 0.36, 0.31, 0.34)),
    ("Pressure difference, $P_1 - P_2$", "Difference", "psi", ACTUAL.colour, (0.69, 0.14, 0.29, 0.34)),
    ("Chamber 1 (plantarflexion), $P_1$", "Pressure", "psig", CHAMBER_1.colour, (0.22, 0.12, 0.3, 0.34)),
    ("Chamber 2 (dorsiflexion), $P_2$", "Pressure", "psig", CHAMBER_2.colour, (0.69, 0.3, 0.29, 0.4)),
)
"""Panels of figure 7: name, quantity, unit, colour, and frame of the enlarged part (x, y, width, height)."""
_EVENT: dict[str, Any] = {"linewidth": 0.8, "linestyle": (0, (4, 3)), "alpha": 0.7, "zorder": 0.5}
_LEVEL: dict[str, Any] = {"linewidth": 0.9, "linestyle": (0, (1, 2)), "zorder": 0.9}
_WORDS: dict[str, Any] = {"fontsize": 8.5, "va": "center"}
_THIN: dict[str, Any] = {"linestyle": "-", "linewidth": 0.8, "zorder": 2}
_SMALL_WORDS: dict[str, Any] = {"fontsize": 7.5, "va": "center"}


def step_response_figure(
    recording: Recording, levels: SupplyLevels, events: StepEvents | None, synthetic: Recording | None = None
) -> "Figure":
    """Return figure 7: angle, pressure difference and both pressures over time, with ``events`` marked if known.

    ``synthetic`` is a recording of the simulated bench, drawn as a thin line with a band from the smallest to the
    largest readings; below each panel, the difference from the model is stated.
    """
    time, last = _MILLISECONDS * recording.time, _MILLISECONDS * float(recording.time[-1])
    if events is not None:
        last = min(last, _MILLISECONDS * events.stop_time * (1.0 + _SHOWN_AFTER_STOP))
    time_limits = -_SHOWN_BEFORE_STEP * last, last
    event_lines, event_names = _event_marks(events, last)
    signals: list[Panel] = []
    errors: list[Panel] = []
    for letter, (name, quantity, unit, colour, inset_frame), model in zip(
        "ABCD", _CURVES, _curves(recording, levels), strict=True
    ):
        marks = [Mark("line", time, model, label="model", colour=colour, style={"zorder": 3})]
        if synthetic is not None:
            measured = _curves(synthetic, levels)[len(errors)]
            marks += _measured_marks(_MILLISECONDS * synthetic.time, measured)
            error = measured - np.interp(synthetic.time, recording.time, model)
            error_marks = [
                Mark("line", _MILLISECONDS * synthetic.time, error, colour=EXPERIMENT.colour, style={"linewidth": 0.9}),
                Mark("level", y=0.0, colour=colour, style={"linewidth": 1.0}),
                *event_lines,
            ]
            kind, limit = Kind("Error", unit.replace("psig", "psi")), methodcaller("set_xlim", *time_limits)
            errors.append(
                Panel(_AFTER_STEP, kind, error_marks, "Measurement less model", then=limit, tall=0.85, shares_x=True)
            )
        # The first panel has the names of the events, and the legend of all panels.
        marks += event_lines if signals else [*event_lines, *event_names]
        legend, title = "" if signals else "figure", f"$\\bf{{{letter}}}$   {name}"
        enlarge = partial(_enlarge, inset_frame, time_limits)
        signals.append(
            Panel(_AFTER_STEP, Kind(quantity, unit), marks, title, None, legend, enlarge, 2.3, shares_x=True)
        )
    panels = [*signals[:2], *errors[:2], *signals[2:], *errors[2:]]
    return draw_panels(panels, 2, (3.15, 1.0), kind=(synthetic or recording).kind)


def _event_marks(events: StepEvents | None, last: float) -> tuple[list[Mark], list[Mark]]:
    """Return upright lines at the events, and their names, for panels that end at ``last`` [ms]."""
    if events is None:
        return [], []
    # Names at angles [deg] at which nothing else is drawn at that time.
    named = ((events.breakaway_time, 120.0, "breaks away"), (events.stop_time, 25.0, "at rest"))
    times = [_MILLISECONDS * time for time, _, _ in named]
    return [Mark("at", x=time, colour=GREY, style=_EVENT) for time in times], [
        Mark("text", time + 0.01 * last, angle, label=name, colour=GREY, style=_SMALL_WORDS)
        for time, (_, angle, name) in zip(times, named, strict=True)
    ]


def _measured_marks(time: Floats, readings: Floats) -> list[Mark]:
    """Return a line of the readings over time [ms], and the band from their smallest to their largest per ``_BIN``."""
    starts = np.flatnonzero(np.diff(np.floor(time / _BIN), prepend=-np.inf) > 0.0)
    band = np.minimum.reduceat(readings, starts), np.maximum.reduceat(readings, starts)
    pale = {"alpha": 0.3, "zorder": 1}
    return [
        Mark("line", time, readings, (), "synthetic measurement", EXPERIMENT.colour, _THIN),
        Mark("band", time[starts] + 0.5 * _BIN, band, colour=EXPERIMENT.colour, style=pale),
    ]


def _curves(recording: Recording, levels: SupplyLevels) -> tuple[Floats, ...]:
    """Return the curves of the panels of figure 7, in the order and units of ``_CURVES``."""
    first, second = recording["pressure_1"], recording["pressure_2"]
    gauge = ((pressure - levels.atmosphere) / PASCALS_PER_PSI for pressure in (first, second))
    return (np.degrees(recording["angle"]), (first - second) / PASCALS_PER_PSI, *gauge)


def _enlarge(frame: tuple[float, float, float, float], ends: tuple[float, float], axes: "Axes") -> None:
    """Limit a panel to two times [ms], and show the first milliseconds enlarged in an inset."""
    axes.margins(y=0.06)
    axes.set_xlim(*ends)
    inset = axes.inset_axes(frame)
    for line in axes.lines:
        times, values = (np.asarray(data, dtype=np.float64) for data in line.get_data())
        early = times <= _ENLARGED
        # The upright line of an event, at one time, is no curve.
        if times[0] < times[-1]:
            (copied,) = inset.plot(times[early], values[early], color=line.get_color(), zorder=line.get_zorder())
            copied.set_linewidth(line.get_linewidth())
    inset.margins(y=0.08)
    inset.set_xlim(-0.05 * _ENLARGED, _ENLARGED)
    inset.tick_params(labelsize=font_size(7.0), length=2.0)
    inset.set_xticks([0.0, 0.5 * _ENLARGED, _ENLARGED])
    inset.locator_params(axis="y", nbins=3)
    inset.set_title(f"first {_ENLARGED:.0f} ms", fontsize=font_size(7.5), color=GREY, loc="center", pad=2.0)


_TORQUE, _GAS = Kind("Torque", "N m", "torque"), Kind("CO$_2$", "kg", "gas mass")


def torque_task_figure(
    solenoid: Recording,
    proportional: Recording,
    ceiling: float,
    gas_in_paper: tuple[float, float],
    synthetic: tuple[Recording, Recording] | None = None,
) -> "Figure":
    """Return figure 8: torque and reference with each valve, valve commands below, error and gas at the bottom.

    ``ceiling`` is the largest torque for the supply pressure [N m], ``gas_in_paper`` the gas that the paper states for
    the solenoid valves and for the proportional valve [g]. ``synthetic`` are recordings of the same task on the
    simulated bench with both valves.
    """
    runs = ((solenoid, SOLENOID, "solenoid"), (proportional, PROPORTIONAL, "proportional"))
    torques = [
        _torque_marks(run, style, ceiling, bench)
        for (run, style, _), bench in zip(runs, synthetic or (None, None), strict=True)
    ]
    errors = [
        Mark("level", y=0.0, colour=GREY, style={"linewidth": 0.8}),
        *(Mark("line", run.time, run["reference"] - run["torque"], colour=style.colour) for run, style, _ in runs),
    ]
    gas: list[Mark] = []
    for (run, style, name), stated in zip(runs, gas_in_paper, strict=True):
        supplied = run["supplied_mass"]
        label = f"{name}: {GRAMS_PER_KILOGRAM * supplied[-1]:.2f} g, in the paper {stated:g} g"
        gas.append(Mark("line", run.time, supplied, label=label, colour=style.colour))
        gas.append(Mark("level", y=stated / GRAMS_PER_KILOGRAM, colour=style.colour, style=_LEVEL))
    opening = Mark("line", proportional.time, proportional["command"], colour=PROPORTIONAL.colour)
    drawn = [mark.y for marks in torques for mark in marks]
    low, high = min(float(np.min(values)) for values in drawn), max(float(np.max(values)) for values in drawn)
    margin = 0.05 * (high - low)
    most_gas = GRAMS_PER_KILOGRAM * max(float(run["supplied_mass"][-1]) for run, _, _ in runs)
    torque_limits = {"ylim": (low - margin, high + margin)}
    chambers = {"ylim": (0.0, 2.0), "yticks": (0.5, 1.5), "yticklabels": ("2", "1")}
    opening_limits = {"ylim": (-0.08 if proportional["command"].min() >= 0.0 else -1.1, 1.08)}
    gas_limits = {"ylim": (0.0, 1.1 * max(most_gas, *gas_in_paper))}
    over_time: tuple[tuple[Kind, list[Mark], str, str, float, dict[str, Any]], ...] = (
        (_TORQUE, torques[0], "Torque with solenoid valves, on or off", "above", 2.3, torque_limits),
        (Kind(), _filling_marks(solenoid), "Chamber that the solenoid valves fill", "", 0.7, chambers),
        (_TORQUE, torques[1], "Torque with the proportional valve", "above", 2.3, torque_limits),
        (Kind(), [opening], "Opening of the proportional valve", "", 0.7, opening_limits),
        (replace(_TORQUE, words="Error"), errors, "Error: reference less torque, both valves", "", 1.3, {}),
        (_GAS, gas, "CO$_2$ from the supply (dotted: the paper)", "above", 1.3, gas_limits),
    )
    time_limits = float(solenoid.time[0]), float(solenoid.time[-1])
    panels = [
        Panel(TIME, kind, marks, title, None, legend, methodcaller("set", xlim=time_limits, **limits), tall, True)
        for kind, marks, title, legend, tall, limits in over_time
    ]
    return draw_panels([*panels, _gas_panel(runs, most_gas)], 1, (6.3, 1.0), kind=solenoid.kind)


def _torque_marks(recording: Recording, style: DrawingStyle, ceiling: float, synthetic: Recording | None) -> list[Mark]:
    """Return marks of reference, torque and largest torque, over the broad line of a synthetic experiment."""
    time, dashed = recording.time, {"linestyle": REFERENCE.line, "linewidth": 1.3}
    ceiling_label = f"maximum at this pressure: {ceiling:.1f} N m"
    marks = [
        Mark("line", time, recording["reference"], label="reference", colour=REFERENCE.colour, style=dashed),
        Mark("level", y=ceiling, label=ceiling_label, colour=GREY, style=_LEVEL),
        Mark("line", time, recording["torque"], label="simulated", colour=style.colour),
    ]
    if synthetic is not None:
        named: dict[str, Any] = {"label": "synthetic experiment", "colour": EXPERIMENT.colour}
        # Broader than what is simulated and darker than the grid: seen where both agree, too.
        broad = {"linestyle": "-", "linewidth": 4.5, "alpha": 0.75}
        marks.insert(2, Mark("line", synthetic.time, synthetic["torque"], style=broad, **named))
    return marks


def _filling_marks(recording: Recording) -> list[Mark]:
    """Return bars for the times at which each of the two valves is on, in the colour of its chamber."""
    marks = []
    for row, valve, style in ((1, 1.0, CHAMBER_1), (0, -1.0, CHAMBER_2)):
        is_on = np.sign(recording["command"]) == valve
        # A command holds until the next sample, so that a bar reaches to the first sample at which the valve is off.
        is_filling = is_on | np.concatenate(([False], is_on[:-1]))
        edges = np.full((2, is_on.size), [[row + 0.12], [row + 0.88]])
        marks.append(
            Mark("band", recording.time, edges, colour=style.colour, style={"where": is_filling, "alpha": 1.0})
        )
    return marks


def _gas_panel(runs: Sequence[tuple[Recording, DrawingStyle, str]], most: float) -> Panel:
    """Return the panel of the supplied gas at the end: bars in the chambers, vented, and below them leaked.

    The first of two runs is above, with labels for the legend; ``most`` is the larger gas [g].
    """
    marks: list[Mark] = []
    rows = (1.0, ("in the chambers", "vented", "leaked past the vane")), (0.0, ("", "", ""))
    for (run, style, _), (height, labels) in zip(runs, rows, strict=True):
        supplied, vented, leaked = (float(run[name][-1]) for name in ("supplied_mass", "vented_mass", "leaked_mass"))
        inside = supplied - vented
        amounts = ", ".join(f"{GRAMS_PER_KILOGRAM * mass:.2f}" for mass in (inside, vented, leaked))
        marks.append(Mark("text", supplied, height, label=f"  {amounts} g", colour=BLACK, style=_WORDS))
        bars = (
            (0.0, inside, height, 0.25, style.colour, 1.0),
            (inside, supplied, height, 0.25, style.colour, 0.35),
            (supplied - leaked, supplied, height - 0.36, 0.05, GREY, 1.0),
        )
        for label, (start, end, middle, half, colour, alpha) in zip(labels, bars, strict=True):
            edges = (middle - half,) * 2, (middle + half,) * 2
            marks.append(Mark("band", (start, end), edges, label=label, colour=colour, style={"alpha": alpha}))
    # Room to the right of the longer bar for the amounts.
    limits = {"xlim": (0.0, 1.8 * most), "yticks": (1.0, 0.0), "yticklabels": [name for _, _, name in runs]}
    set_limits = methodcaller("set", **limits)
    return Panel(_GAS, Kind(), marks, "Location of this gas at the end", then=set_limits, tall=0.75)
