"""A whole walk over time: gas, toes and phases with the safe state; a course with its segments; the bottle."""

import textwrap
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.gait.gait import clinical_angle
from ppafo.model.helping import HELPS, LIFTS, PAUSED, STOPPED
from ppafo.model.source import Regulator
from ppafo.report.display_units import axis_unit, display_value, display_values
from ppafo.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILION,
    Margins,
    figure_of_panels,
    house_style,
    label_lines,
    mark_kind,
)
from ppafo.signals.recording import Floats, Recording
from ppafo.simulation.scenario import Scenario
from ppafo.walking.figures.mean_stride import WITH, WITHOUT
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import gait_sensors_of
from ppafo.walking.preparation import NEVER
from ppafo.walking.result import WalkResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (9.4, 5.6)
_MARGINS = Margins(left=1.3, right=0.2, top=0.62, bottom=0.55, row_gap=0.16, label=0.6)
_HEIGHTS, _STRIP = (1.0, 1.2, 1.0), 0.35
_LEVELS = {
    HELPS: ("help", "#cfe3c9"),
    LIFTS: ("lift", "#e6e2a8"),
    PAUSED: ("pause", "#f3d27a"),
    STOPPED: ("stop", "#e08a8a"),
}
_PHASES = ("swing", "heel", "free", "push")
_FREE, _PUSH = 2.0, 3.0
_LONG = 120.0
"""Time [s] above which the axis is in minutes."""

_FAULT_SUFFIX = "_fault"
_APART = 0.2
"""Fraction of a walk within which failures have one label; others are in two rows in turn."""
_LABEL_ROW = 0.15

_COURSE_WIDTH = 9.4
_COURSE_MARGINS = Margins(left=0.75, right=0.2, top=0.95, bottom=0.5, row_gap=0.32, label=0.55)
_COURSE_PANEL = 1.05
_TITLES = (
    "Walking speed (m/s)",
    "Ankle angle (deg, 0 neutral, dorsiflexion positive)",
    "Force under heel and toes (N)",
    "Actuator torque (N m, plantarflexion positive); strip: controller",
    "Toe height above ground (cm)",
    "Gas taken (g)",
)
_SHADED = "#f3f3f3"
_COURSE_PHASES = {1.0: "#f6d5bd", 2.0: "#e4e4e4", 3.0: "#8fbfe0", 0.0: "#f0b48a"}
_PHASE_NAMES = {1.0: "landing", 2.0: "mid-stance", 3.0: "push-off", 0.0: "swing"}
_SAFE = "#cc3311"
_NARROWEST = 0.045
"""Fraction of the course below which the name of a segment stands upright."""

_BOTTLE_WIDTH, _BOTTLE_PANEL, _REMARK_LINE, _REMARK_WIDTH = 8.4, 1.35, 0.17, 118
_BOTTLE_MARGINS = Margins(left=0.75, right=0.2, top=0.75, bottom=0.62, row_gap=0.4, label=0.55)
_PANELS = 5
_BOTTLE_LONG = 120.0
"""Time [s] above which the axis is in minutes."""


def failures(configuration: Scenario) -> dict[str, float]:
    """Return when which sensor or part of the plant fails [s], by its name, in this order; {} where all are sound."""
    sensors = gait_sensors_of(configuration)._asdict()
    found = {
        name.removesuffix(_FAULT_SUFFIX): fault.time
        for name, fault in sensors.items()
        if name.endswith(_FAULT_SUFFIX) and fault.time < NEVER
    }
    found |= {part: fault.numbers["time"] for part, fault in walk_of(configuration).broken.items()}
    return dict(sorted(found.items(), key=lambda item: item[1]))


def over_time_figure(result: WalkResult) -> "Figure":
    """Return gas, toe height, phase and level of help over the time of a walk, with faults, pauses and the stop."""
    recording = result.recording
    scale, unit = (60.0, "min") if recording.time[-1] > _LONG else (1.0, "s")
    time = recording.time / scale
    with house_style():
        heights = (*_HEIGHTS, *([_STRIP] if "safe_state" in recording else []))
        figure, grid = figure_of_panels(_SIZE, _MARGINS, len(heights), heights=heights)
        rows = [axes for (axes,) in grid]
        gas, toes, phases, *level = rows
        gas.plot(time, GRAMS_PER_KILOGRAM * recording["supplied_mass"], color=BLUE)
        gas.set_ylabel("Gas\n(g)")
        toes.plot(time, 100.0 * recording["toe_height"], color=BLUE, linewidth=0.9)
        toes.axhline(0.0, color=GREY, linewidth=0.8)
        toes.set_ylabel("Toes over\nthe ground (cm)")
        phases.set_ylabel("Controller")
        phases.set_yticks(range(len(_PHASES)), _PHASES)
        phases.set_ylim(-0.3, len(_PHASES) - 0.7)
        if "controller_phase" in result.recording:
            phases.step(time, acting_phase(result.recording), where="post", color=BLACK, linewidth=0.9)
        for axes in level:
            _levels(axes, recording["safe_state"], time)
        rows[-1].set_xlabel(f"Time ({unit})")
        rows[-1].set_xlim(0.0, float(time[-1]))
        _marks(rows[: len(_HEIGHTS)], result, scale)
        width, height = _SIZE
        title = f"{result.scenario.name}: the whole walk"
        figure.text(0.12 / width, 1.0 - 0.12 / height, title, ha="left", va="top", fontweight="bold")
        mark_kind(figure, recording.kind)
        return figure


def acting_phase(recording: Recording) -> Floats:
    """Return the phase of each sample in which the device acts: none pushes in a lift, and a paused one is free."""
    seen = recording["controller_phase"]
    level = recording["safe_state"] if "safe_state" in recording else np.zeros(seen.size)
    is_idle = (level > LIFTS) | ((level == LIFTS) & (seen == _PUSH))
    return np.where(is_idle, _FREE, seen)


def _levels(axes: "Axes", found: Floats, time: Floats) -> None:
    """Paint the strip of help, pause and stop, and name each stretch that is wide enough."""
    edges = np.flatnonzero(np.diff(found, prepend=-1.0, append=-1.0))
    for first, last in pairwise(edges.tolist()):
        name, colour = _LEVELS[float(found[first])]
        begin, end = time[first], time[min(last, time.size - 1)]
        axes.axvspan(begin, end, color=colour, linewidth=0.0)
        if end - begin > 0.06 * time[-1]:
            axes.text(0.5 * (begin + end), 0.5, name, ha="center", va="center", fontsize=9.0)
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([])
    axes.grid(visible=False)


def _marks(rows: "list[Axes]", result: WalkResult, scale: float) -> None:
    """Draw a line at each pause and stop, and a dashed one with names where something fails."""
    for event in result.events:
        if event.fault_flag is not None:
            for axes in rows:
                axes.axvline(event.time / scale, color=VERMILION, linewidth=0.9)
    end = float(result.recording.time[-1])
    named: list[tuple[float, list[str]]] = []
    for part, begin in failures(result.scenario).items():
        if begin >= end:
            continue
        for axes in rows:
            axes.axvline(begin / scale, color=GREY, linestyle="--", linewidth=0.9)
        word = part.replace("_", " ")
        if named and begin - named[-1][0] < _APART * end:
            named[-1][1].append(word)
        else:
            named.append((begin, [word]))
    for number, (begin, words) in enumerate(named):
        rows[0].annotate(
            f"{', '.join(words)} {'fails' if len(words) == 1 else 'fail'}",
            (begin / scale, 1.02 + _LABEL_ROW * (number % 2)),
            xycoords=("data", "axes fraction"),
            ha="left" if begin < 0.6 * end else "right",
            va="bottom",
            fontsize=8.5,
            color=GREY,
        )


def course_figure(worn: WalkResult, bare: WalkResult) -> "Figure":
    """Return a course over time with the device (and without it); needs a recording of at least two samples."""
    height = (
        len(_TITLES) * _COURSE_PANEL
        + (len(_TITLES) - 1) * _COURSE_MARGINS.row_gap
        + _COURSE_MARGINS.top
        + _COURSE_MARGINS.bottom
    )
    with house_style():
        figure, grid = figure_of_panels((_COURSE_WIDTH, height), _COURSE_MARGINS, len(_TITLES))
        panels = [row[0] for row in grid]
        for axes, title in zip(panels, _TITLES, strict=True):
            axes.set_title(title)
            axes.locator_params(axis="y", nbins=4)
            # Every other segment on grey, and a line where the controller helps less.
            for segment in worn.segments[1::2]:
                axes.axvspan(segment.start, segment.end, color=_SHADED, zorder=0, linewidth=0.0)
            for segment in worn.segments:
                if segment.safe_time is not None:
                    axes.axvline(segment.safe_time, color=_SAFE, linewidth=1.2)
        _speed(panels[0], worn)
        _both(panels[1], worn, bare)
        _forces(panels[2], worn)
        panels[3].plot(worn.recording.time, worn.recording["torque"], color=WITH, linewidth=0.8)
        _toes(panels[4], worn, bare)
        panels[5].plot(worn.recording.time, 1.0e3 * worn.recording["supplied_mass"], color=WITH)
        _course_phases(panels[3], worn)
        panels[-1].set_xlabel("Time (s)")
        panels[-1].set_xlim(0.0, float(worn.recording.time[-1]))
        _segment_names(panels[0], worn)
        _head(figure, worn, height)
        mark_kind(figure, worn.recording.kind)
        return figure


def _speed(axes: "Axes", worn: WalkResult) -> None:
    recording = worn.recording
    has_speed = "walking_speed" in recording
    values = recording["walking_speed" if has_speed else "stride_frequency"]
    axes.plot(recording.time, values, color=BLACK)
    # Room above the curve for the names of the segments.
    axes.set_ylim(-0.05 * float(values.max()), 1.9 * float(values.max()) + 0.01)
    if not has_speed:
        axes.set_title("Strides per second (Hz)")


def _both(axes: "Axes", worn: WalkResult, bare: WalkResult) -> None:
    for result, colour in ((bare, WITHOUT), (worn, WITH)):
        angle = np.degrees(clinical_angle(result.recording["angle"]))
        axes.plot(result.recording.time, angle, color=colour, linewidth=0.8)


def _forces(axes: "Axes", worn: WalkResult) -> None:
    axes.plot(worn.recording.time, worn.recording["heel_force"], color=BLACK, linewidth=0.8, label="heel")
    axes.plot(worn.recording.time, worn.recording["toe_force"], color=GREY, linewidth=0.8, label="toes")
    _legend(axes, 2)


def _toes(axes: "Axes", worn: WalkResult, bare: WalkResult) -> None:
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    for result, colour in ((bare, WITHOUT), (worn, WITH)):
        axes.plot(result.recording.time, 100.0 * result.recording["toe_height"], color=colour, linewidth=0.8)


def _course_phases(axes: "Axes", worn: WalkResult) -> None:
    """The phase that the controller sees, as a strip under the curve."""
    if "controller_phase" not in worn.recording:
        return
    time, seen = worn.recording.time, acting_phase(worn.recording)
    low, high = axes.get_ylim()
    strip = low - 0.18 * (high - low)
    for phase, colour in _COURSE_PHASES.items():
        name = _PHASE_NAMES[phase]
        axes.fill_between(time, strip, low, where=seen == phase, color=colour, linewidth=0.0, step="post", label=name)
    axes.set_ylim(strip, high)
    _legend(axes, 4)


def _legend(axes: "Axes", columns: int) -> None:
    """Beside the title of a panel, where no curve is."""
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.1,
        ncols=columns,
        fontsize=8,
        handlelength=1.2,
        columnspacing=1.0,
    )


def _segment_names(axes: "Axes", worn: WalkResult) -> None:
    whole = float(worn.recording.time[-1])
    for segment in worn.segments:
        narrow = segment.end - segment.start < _NARROWEST * whole
        axes.text(
            0.5 * (segment.start + segment.end),
            0.96,
            segment.kind,
            transform=axes.get_xaxis_transform(),
            rotation=90.0 if narrow else 0.0,
            ha="center",
            va="top",
            fontsize=8,
            color=GREY,
        )


def _head(figure: "Figure", worn: WalkResult, height: float) -> None:
    course = walk_of(worn.scenario).course
    title = f"{worn.scenario.name}, course {'' if course is None else course.name}"
    figure.text(0.12 / _COURSE_WIDTH, 1.0 - 0.12 / height, title, ha="left", va="top", fontweight="bold")
    remark = "blue: with the device; orange: without it; red line: the controller helps less"
    figure.text(0.12 / _COURSE_WIDTH, 1.0 - 0.34 / height, remark, ha="left", va="top", fontsize=8.5, color=GREY)


def peak_torques(result: WalkResult) -> Floats:
    """Return the largest torque [N m] of each whole stride (strides,)."""
    edges = result.starts
    if edges.size < 2:
        return np.zeros(0)
    return np.maximum.reduceat(result.recording["torque"], edges)[:-1]


def bottle_figure(result: WalkResult) -> "Figure":
    """Return the figure of a walk on its bottle; below it stands what ended it."""
    supply = result.supply
    assert supply is not None, "drawn for a walk on a bottle"
    ending, bottle = supply.ending, supply.supply.bottle
    remarks = textwrap.wrap(f"End: {ending.message}.", _REMARK_WIDTH)
    bottom = _BOTTLE_MARGINS.bottom + _REMARK_LINE * len(remarks)
    margins = replace(_BOTTLE_MARGINS, bottom=bottom)
    height = _BOTTLE_MARGINS.top + _PANELS * _BOTTLE_PANEL + (_PANELS - 1) * _BOTTLE_MARGINS.row_gap + bottom
    end = float(result.recording.time[-1])
    scale, unit = (60.0, "min") if end > _BOTTLE_LONG else (1.0, "s")
    with house_style():
        figure, rows = figure_of_panels((_BOTTLE_WIDTH, height), margins, _PANELS)
        grid = [axes for (axes,) in rows]
        _draw_supply(grid[0], result, scale)
        times = supply.times / scale
        draw_bottle_pressure(grid[1], times, supply.values["bottle_pressure"], bottle.regulator)
        _draw_temperatures(grid[2], result, scale)
        _draw_torque(grid[3], result, scale)
        draw_gas_left(grid[4], times, supply.values, supply.supply.mass)
        for axes in grid:
            axes.locator_params(axis="y", nbins=5)
            axes.axvline(ending.time / scale, color=VERMILION, linewidth=1.0)
        grid[-1].set_xlabel(f"Time ({unit})")
        grid[-1].set_xlim(0.0, 1.005 * end / scale)
        title = f"{result.scenario.name} on {bottle.name}"
        figure.text(0.12 / _BOTTLE_WIDTH, 1.0 - 0.12 / height, title, va="top", fontsize=13, fontweight="bold")
        figure.text(0.12 / _BOTTLE_WIDTH, 0.1 / height, "\n".join(remarks), va="bottom", fontsize=9, color=VERMILION)
        mark_kind(figure, result.recording.kind)
        return figure


def _draw_supply(axes: "Axes", result: WalkResult, scale: float) -> None:
    """Draw what the line behind the regulator has: highest and lowest of each stride, and what is held at most."""
    recording, supply, edges = result.recording, result.supply, result.starts
    assert supply is not None, "drawn for a walk on a bottle"
    held = display_values(supply.values["regulated_pressure"], "pressure")
    axes.plot(supply.times / scale, held, color=GREY, linestyle="--", linewidth=1.2, label="delivered at most")
    line = display_values(recording["line_pressure_1"], "pressure")
    if edges.size > 1:
        times = recording.time[edges[:-1]] / scale
        lowest, highest = (pick.reduceat(line, edges)[:-1] for pick in (np.minimum, np.maximum))
        axes.fill_between(times, lowest, highest, color=BLUE, alpha=0.3, linewidth=0.0, label="line, in a stride")
    axes.set_title(f"Pressure behind the regulator ({axis_unit('pressure')})")
    label_lines(axes)


def draw_bottle_pressure(axes: "Axes", time: Floats, pressure: Floats, regulator: Regulator) -> None:
    """Draw the pressure [Pa] of a bottle over time, in the unit of the axis, and what its regulator needs."""
    needed = regulator.set_pressure + regulator.pressure_margin
    axes.axhline(display_value(needed, "pressure"), color=VERMILION, linestyle="--", linewidth=1.2, label="needed")
    axes.plot(time, display_values(pressure, "pressure"), color=BLUE, label="bottle")
    axes.set_ylim(0.0, 1.06 * display_value(float(np.max(pressure)), "pressure"))
    axes.set_title(f"Pressure in the bottle ({axis_unit('pressure')})")
    label_lines(axes)


def _draw_temperatures(axes: "Axes", result: WalkResult, scale: float) -> None:
    supply = result.supply
    assert supply is not None, "drawn for a walk on a bottle"
    lines = (
        ("bottle_temperature", "bottle", BLUE, "-"),
        ("regulator_temperature", "regulator", BLACK, "-"),
        ("outlet_temperature", "gas behind it", ORANGE, "-"),
        ("gas_temperature", "gas at the device", GREEN, "-"),
    )
    for name, label, colour, style in lines:
        values = display_values(supply.values[name], "temperature")
        axes.plot(supply.times / scale, values, color=colour, linestyle=style, label=label)
    if supply.supply.line.freezes > 0.5:
        ice = display_value(supply.supply.line.temperatures[0], "temperature")
        axes.axhline(ice, color=VERMILION, linestyle="--", linewidth=1.2, label="dry ice")
    axes.set_title(f"Temperature ({axis_unit('temperature')})")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=5, borderaxespad=0.1, handlelength=1.2)


def _draw_torque(axes: "Axes", result: WalkResult, scale: float) -> None:
    peaks = peak_torques(result)
    times = result.recording.time[result.starts[:-1]] / scale if peaks.size else peaks
    axes.plot(times, peaks, color=BLUE, marker=".", markersize=2.5, linewidth=0.8)
    axes.set_ylim(0.0, 1.1 * float(peaks.max(initial=0.1)))
    axes.set_title("Peak torque of each stride (N m)")


def draw_gas_left(axes: "Axes", time: Floats, gas: Recording | Mapping[str, Floats], full: float) -> None:
    """Draw what is left in a bottle over time, in the unit of the axis, of the mass of a full one [kg]."""
    for name, label, colour in (("bottle_mass", "total gas", BLUE), ("liquid_mass", "liquid", GREEN)):
        if name in gas:
            axes.plot(time, display_values(gas[name], "gas mass"), color=colour, label=label)
    axes.set_ylim(0.0, 1.06 * display_value(full, "gas mass"))
    axes.set_title(f"Left in the bottle ({axis_unit('gas mass')})")
    label_lines(axes)
