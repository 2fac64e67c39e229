"""Figures 7 and 8 of the paper: simulated step response and torque task, with synthetic measurements."""

from functools import partial
from operator import methodcaller
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.analyses.reproduce.step_response import StepEvents
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
    font_size,
)
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MILLISECONDS = 1.0e3
_AFTER_STEP = Kind("Time after the step", "ms")
_TORQUE, _ERROR = Kind("Torque", "N m", "torque"), Kind("Error", "N m", "torque")
_GAS = Kind("CO$_2$", "kg", "gas mass")
_SHOWN_BEFORE_STEP = 0.03
"""Fraction of the time axis before the step, so that the rise within the first milliseconds stays visible."""
_SHOWN_AFTER_STOP = 0.8
"""Fraction of the time until the stop that is shown after the stop; the vane then rests."""
_ENLARGED = 40.0
"""Time after the step that is shown enlarged [ms]."""
_BIN = 3.0
"""Interval [ms] for the band from the smallest to the largest reading of a measurement."""
_EVENT: dict[str, Any] = {"linewidth": 0.8, "linestyle": (0, (4, 3)), "alpha": 0.7, "zorder": 0.5}
_LEVEL: dict[str, Any] = {"linewidth": 0.9, "linestyle": (0, (1, 2)), "zorder": 0.9}
_WORDS: dict[str, Any] = {"fontsize": 8.5, "va": "center"}
_THIN: dict[str, Any] = {"linestyle": "-", "linewidth": 0.8, "zorder": 2}
_SMALL_WORDS: dict[str, Any] = {"fontsize": 7.5, "va": "center"}


_PRESSURE = Kind("Pressure", "psig")
_STEP_PANELS = (
    ("$\\bf{A}$   Vane angle", Kind("Angle", "deg"), ACTUAL.colour, (0.66, 0.36, 0.31, 0.34)),
    (
        "$\\bf{B}$   Pressure difference, $P_1 - P_2$",
        Kind("Difference", "psi"),
        ACTUAL.colour,
        (0.69, 0.14, 0.29, 0.34),
    ),
    ("$\\bf{C}$   Chamber 1 (plantarflexion), $P_1$", _PRESSURE, CHAMBER_1.colour, (0.22, 0.12, 0.3, 0.34)),
    ("$\\bf{D}$   Chamber 2 (dorsiflexion), $P_2$", _PRESSURE, CHAMBER_2.colour, (0.69, 0.3, 0.29, 0.4)),
)
"""Panels of figure 7: title with the letter of the paper, kind, colour of the model, and frame of the inset.

The inset with the first milliseconds has x, y, width and height as fractions of the panel.
"""


def step_response_figure(
    recording: Recording, atmosphere: float, events: StepEvents | None, synthetic: Recording | None = None
) -> "Figure":
    """Return figure 7: angle, pressure difference and both pressures over time, with ``events`` marked if known.

    Gauge pressures count from ``atmosphere`` [Pa absolute]. ``synthetic`` is a recording of the simulated bench, drawn
    as a thin line with a band from the smallest to the largest readings; a further panel below each curve shows the
    measurement less the model.
    """
    end = _MILLISECONDS * float(recording.time[-1])
    if events is not None:
        end = min(end, _MILLISECONDS * events.stop_time * (1.0 + _SHOWN_AFTER_STOP))
    limits = -_SHOWN_BEFORE_STEP * end, end
    event_times = () if events is None else (events.breakaway_time, events.stop_time)
    event_lines = [Mark("at", x=_MILLISECONDS * time, colour=GREY, style=_EVENT) for time in event_times]
    # The first panel has the names of the events, at angles [deg] where nothing else is drawn at their time.
    event_names = [
        Mark("text", _MILLISECONDS * time + 0.01 * end, angle, label=name, colour=GREY, style=_SMALL_WORDS)
        for time, angle, name in zip(event_times, (120.0, 25.0), ("breaks away", "at rest"), strict=False)
    ]
    signals, errors = list[Panel](), list[Panel]()
    readings = [None] * len(_STEP_PANELS) if synthetic is None else _curves(synthetic, atmosphere)
    for (title, axis, colour, inset), model, measured in zip(
        _STEP_PANELS, _curves(recording, atmosphere), readings, strict=True
    ):
        line = Mark("line", _MILLISECONDS * recording.time, model, label="model", colour=colour, style={"zorder": 3})
        marks = [line]
        if synthetic is not None and measured is not None:
            time = _MILLISECONDS * synthetic.time
            marks += _measured_marks(time, measured)
            error = measured - np.interp(synthetic.time, recording.time, model)
            beside = [
                Mark("line", time, error, colour=EXPERIMENT.colour, style={"linewidth": 0.9}),
                Mark("level", y=0.0, colour=colour, style={"linewidth": 1.0}),
                *event_lines,
            ]
            # The difference of two gauge pressures is no gauge pressure.
            kind = Kind("Error", "psi" if axis == _PRESSURE else axis.unit)
            until = methodcaller("set_xlim", *limits)
            errors.append(
                Panel(_AFTER_STEP, kind, beside, "Measurement less model", then=until, tall=0.85, shares_x=True)
            )
        # The first panel has the legend of all panels.
        marks += event_lines if signals else [*event_lines, *event_names]
        legend, enlarged = "" if signals else "figure", partial(_enlarge, inset, limits)
        signals.append(Panel(_AFTER_STEP, axis, marks, title, None, legend, enlarged, tall=2.3, shares_x=True))
    panels = [*signals[:2], *errors[:2], *signals[2:], *errors[2:]]
    return draw_panels(panels, 2, (3.15, 1.0), kind=(synthetic or recording).kind)


def _curves(recording: Recording, atmosphere: float) -> tuple[Floats, ...]:
    """Return the values (samples,) of the panels of figure 7, in the order and units of ``_STEP_PANELS``."""
    first, second = recording["pressure_1"], recording["pressure_2"]
    gauge = ((pressure - atmosphere) / PASCALS_PER_PSI for pressure in (first, second))
    return (np.degrees(recording["angle"]), (first - second) / PASCALS_PER_PSI, *gauge)


def _measured_marks(time: Floats, readings: Floats) -> list[Mark]:
    """Return a line of the readings over time [ms], and the band from their smallest to their largest per ``_BIN``."""
    starts = np.flatnonzero(np.diff(np.floor(time / _BIN), prepend=-np.inf) > 0.0)
    band = np.minimum.reduceat(readings, starts), np.maximum.reduceat(readings, starts)
    pale = {"alpha": 0.3, "zorder": 1}
    return [
        Mark("line", time, readings, (), "synthetic measurement", EXPERIMENT.colour, _THIN),
        Mark("band", time[starts] + 0.5 * _BIN, band, colour=EXPERIMENT.colour, style=pale),
    ]


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
    opening = Mark("line", proportional.time, proportional["command"], colour=PROPORTIONAL.colour)
    torques, gas, errors = (
        list[list[Mark]](),
        list[Mark](),
        [Mark("level", y=0.0, colour=GREY, style={"linewidth": 0.8})],
    )
    for valve, look, run, experiment, in_paper in zip(
        ("solenoid", "proportional"),
        (SOLENOID, PROPORTIONAL),
        (solenoid, proportional),
        synthetic or (None, None),
        gas_in_paper,
        strict=True,
    ):
        colour, dashed = look.colour, {"linestyle": REFERENCE.line, "linewidth": 1.3}
        marks = [
            Mark("line", run.time, run["reference"], label="reference", colour=REFERENCE.colour, style=dashed),
            Mark("level", y=ceiling, label=f"maximum: {ceiling:.1f} N m", colour=GREY, style=_LEVEL),
        ]
        if experiment is not None:
            # Broader than the simulated torque and darker than the grid, so that it is visible where both agree.
            broad = {"linestyle": "-", "linewidth": 4.5, "alpha": 0.75}
            readings = experiment.time, experiment["torque"]
            marks.append(Mark("line", *readings, (), "synthetic", EXPERIMENT.colour, broad))
        torques.append([*marks, Mark("line", run.time, run["torque"], label="simulated", colour=colour)])
        errors.append(Mark("line", run.time, run["reference"] - run["torque"], colour=colour))
        supplied = run["supplied_mass"]
        label = f"{valve}: {GRAMS_PER_KILOGRAM * supplied[-1]:.2f} g, in the paper {in_paper:g} g"
        gas.append(Mark("line", run.time, supplied, label=label, colour=colour))
        gas.append(Mark("level", y=in_paper / GRAMS_PER_KILOGRAM, colour=colour, style=_LEVEL))
    most_gas = GRAMS_PER_KILOGRAM * max(float(run["supplied_mass"][-1]) for run in (solenoid, proportional))
    limits = partial(methodcaller, "set", xlim=(float(solenoid.time[0]), float(solenoid.time[-1])))
    # All torque panels have the same limits, 5 % beyond their marks.
    drawn = [mark.y for marks in torques for mark in marks]
    low, high = min(float(np.min(values)) for values in drawn), max(float(np.max(values)) for values in drawn)
    torque_limits = limits(ylim=(low - 0.05 * (high - low), high + 0.05 * (high - low)))
    chambers = limits(ylim=(0.0, 2.0), yticks=(0.5, 1.5), yticklabels=("2", "1"))
    opening_limits = limits(ylim=(-0.08 if proportional["command"].min() >= 0.0 else -1.1, 1.08))
    gas_limits = limits(ylim=(0.0, 1.1 * max(most_gas, *gas_in_paper)))
    panel = partial(Panel, TIME, shares_x=True)
    command_panel = partial(panel, Kind(), legend="", tall=0.7)
    panels = [
        panel(_TORQUE, torques[0], "Torque with solenoid valves, on or off", tall=2.3, then=torque_limits),
        command_panel(_filling_marks(solenoid), "Chamber that the solenoid valves fill", then=chambers),
        panel(_TORQUE, torques[1], "Torque with the proportional valve", tall=2.3, then=torque_limits),
        command_panel([opening], "Opening of the proportional valve", then=opening_limits),
        panel(_ERROR, errors, "Error: reference less torque, both valves", legend="", tall=1.3, then=limits()),
        panel(_GAS, gas, "CO$_2$ from the supply (dotted: the paper)", tall=1.3, then=gas_limits),
        _gas_panel(solenoid, proportional, most_gas),
    ]
    return draw_panels(panels, 1, (6.3, 1.0), kind=solenoid.kind)


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


def _gas_panel(solenoid: Recording, proportional: Recording, most: float) -> Panel:
    """Return the panel of the supplied gas at the end [kg]: bars in the chambers and vented, and below them leaked.

    Gas that leaks past the vane is vented from the other chamber. ``most`` is the larger supplied gas [g].
    """
    # Grey in the legend, as the bars have the colours of the valves.
    names = ("in chambers", GREY, 1.0), ("vented", GREY, 0.35), ("leaked (part of vented)", BLACK, 1.0)
    none = (0.0, 0.0)
    marks = [
        Mark("band", none, (none, none), label=label, colour=colour, style={"alpha": alpha})
        for label, colour, alpha in names
    ]
    for run, colour, height in ((solenoid, SOLENOID.colour, 1.0), (proportional, PROPORTIONAL.colour, 0.0)):
        supplied, vented, leaked = (float(run[name][-1]) for name in ("supplied_mass", "vented_mass", "leaked_mass"))
        inside = supplied - vented
        kept, lost = (f"{GRAMS_PER_KILOGRAM * mass:.2f}" for mass in (inside, vented))
        broad = (height - 0.25,) * 2, (height + 0.25,) * 2
        thin = (height - 0.36 - 0.05,) * 2, (height - 0.36 + 0.05,) * 2
        past_vane = supplied - leaked, supplied
        marks += [
            Mark("text", supplied, height, label=f"   {kept} + {lost} g", colour=BLACK, style=_WORDS),
            Mark("band", (0.0, inside), broad, colour=colour, style={"alpha": 1.0}),
            Mark("band", (inside, supplied), broad, colour=colour, style={"alpha": 0.35}),
            Mark("band", past_vane, thin, colour=BLACK, style={"alpha": 1.0}),
        ]
    # To the right of the longer bar there is space for the amounts.
    ticks = {"yticks": (1.0, 0.0), "yticklabels": ("solenoid", "proportional")}
    set_limits = methodcaller("set", xlim=(0.0, 1.8 * most), **ticks)
    return Panel(_GAS, Kind(), marks, "Location of this gas at the end", then=set_limits, tall=0.75)
