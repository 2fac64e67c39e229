"""A whole walk over time: gas, toes and phases with the safe state; a task sequence with its segments; the bottle."""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.gait.gait import clinical_angle
from ppafo.model.helping import HELPS, LIFTS, PAUSED, STOPPED
from ppafo.report.display_units import display_value
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILION
from ppafo.signals.recording import Floats, Recording
from ppafo.simulation.scenario import Scenario
from ppafo.walking.figures.mean_stride import ANGLE, WITH, WITHOUT
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import gait_sensors_of
from ppafo.walking.preparation import NEVER
from ppafo.walking.result import WalkResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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

_TASK_SEQUENCE_PHASES = {
    1.0: ("landing", "#f6d5bd"),
    2.0: ("mid-stance", "#e4e4e4"),
    3.0: ("push-off", "#8fbfe0"),
    0.0: ("swing", "#f0b48a"),
}
_SHADED, _SAFE = "#f3f3f3", "#cc3311"
_NARROWEST = 0.045
"""Fraction of the task sequence below which the name of a segment stands upright."""

_GAS = Kind("Gas taken", "kg", "gas mass")
_TOES = Kind("Toe height above ground", "m", "body length")
_ZERO = Mark("level", y=0.0, colour=GREY, style={"linewidth": 0.8})
_THIN = {"linewidth": 0.8}


def failures(configuration: Scenario) -> dict[str, float]:
    """Return when which sensor or part of the plant fails [s], by its name, in this order; {} where all are sound."""
    sensors = gait_sensors_of(configuration)._asdict()
    failures_by_part = {
        name.removesuffix(_FAULT_SUFFIX): fault.time
        for name, fault in sensors.items()
        if name.endswith(_FAULT_SUFFIX) and fault.time < NEVER
    }
    failures_by_part |= {part: fault.numbers["time"] for part, fault in walk_of(configuration).broken.items()}
    return dict(sorted(failures_by_part.items(), key=lambda failure: failure[1]))


def over_time_figure(result: WalkResult) -> "Figure":
    """Return gas, toe height, phase and level of help over the time of a walk, with faults, pauses and the stop."""
    recording, time = result.recording, result.recording.time
    scale = 60.0 if time[-1] > _LONG else 1.0
    end, less = float(time[-1]), [event.time for event in result.events if event.fault_flag is not None]
    failed = {part: begin for part, begin in failures(result.scenario).items() if begin < end}
    lines = [Mark("at", begin, colour=VERMILION, style={"linewidth": 0.9}) for begin in less]
    lines += [Mark("at", begin, colour=GREY, style={"linewidth": 0.9, "linestyle": "--"}) for begin in failed.values()]
    phases = []
    if "controller_phase" in recording:
        look = {"linewidth": 0.9, "drawstyle": "steps-post"}
        phases.append(Mark("line", time, acting_phase(recording), colour=BLACK, style=look))

    def name_failures(axes: "Axes") -> None:
        # Room above the curve of the gas for the names.
        axes.set_ylim(top=1.4 * axes.get_ylim()[1])
        named: list[tuple[float, list[str]]] = []
        for part, begin in failed.items():
            # Labels of failures that are close would cover each other.
            if named and begin - named[-1][0] < _APART * end:
                named[-1][1].append(part.replace("_", " "))
            else:
                named.append((begin, [part.replace("_", " ")]))
        for number, (begin, words) in enumerate(named):
            fail = "fails" if len(words) == 1 else "fail"
            axes.annotate(
                f"{', '.join(words)} {fail}",
                (begin / scale, 0.98 - 0.16 * (number % 2)),
                xycoords=("data", "axes fraction"),
                ha="left" if begin < 0.6 * end else "right",
                va="top",
                fontsize=8.5,
                color=GREY,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
            )

    def name_phases(axes: "Axes") -> None:
        axes.set_yticks(range(len(_PHASES)), _PHASES)
        axes.set_ylim(-0.3, len(_PHASES) - 0.7)

    x = _time_of(end)
    panels = [
        Panel(x, _GAS, [Mark("line", time, recording["supplied_mass"]), *lines], then=name_failures, shares_x=True),
        Panel(x, _TOES, [Mark("line", time, recording["toe_height"], style=_THIN), _ZERO, *lines], shares_x=True),
        Panel(x, Kind("Phase of the controller"), [*phases, *lines], then=name_phases, shares_x=True),
    ]
    if "safe_state" in recording:
        panels.append(_levels(recording, x))
    title = f"{result.scenario.name}: the whole walk"
    figure = draw_panels(panels, size=(9.1, 1.5), title=title, kind=recording.kind)
    # Panels that share an axis take the limits of the one below when they are joined, so limits come last.
    figure.axes[0].set_xlim(0.0, end / scale)
    return figure


def _time_of(end: float) -> Kind:
    return Kind("Time", "s", "duration") if end > _LONG else TIME


def acting_phase(recording: Recording) -> Floats:
    """Return the phase of each sample in which the device acts: none pushes in a lift, and a paused one is free."""
    seen = recording["controller_phase"]
    level = recording["safe_state"] if "safe_state" in recording else np.zeros(seen.size)
    is_idle = (level > LIFTS) | ((level == LIFTS) & (seen == _PUSH))
    return np.where(is_idle, _FREE, seen)


def _levels(recording: Recording, x: Kind) -> Panel:
    """Return the strip of help, pause and stop, with the name of each stretch that is wide enough."""
    time, state = recording.time, recording["safe_state"]
    edges = np.flatnonzero(np.diff(state, prepend=-1.0, append=-1.0))
    marks, names = [], []
    for first, last in pairwise(edges.tolist()):
        name, colour = _LEVELS[float(state[first])]
        begin, end = float(time[first]), float(time[min(last, time.size - 1)])
        marks.append(Mark("span", (begin, end), colour=colour, style={"alpha": 1.0}))
        if end - begin > 0.06 * time[-1]:
            names.append((0.5 * (begin + end), name))

    def name_levels(axes: "Axes") -> None:
        for middle, name in names:
            axes.text(float(x.values(middle)), 0.5, name, ha="center", va="center", fontsize=9.0)
        axes.set_ylim(0.0, 1.0)
        axes.set_yticks([])
        axes.grid(visible=False)

    return Panel(x, Kind("Level of help"), marks, then=name_levels, tall=0.55, shares_x=True)


def task_sequence_figure(worn: WalkResult, bare: WalkResult) -> "Figure":
    """Return a task sequence over time with the device (and without it); needs a recording of at least two samples."""
    recording, time = worn.recording, worn.recording.time
    # Every other segment on grey, and a line where the controller helps less.
    shaded: dict[str, Any] = {"alpha": 1.0, "zorder": 0}
    common = [Mark("span", (part.start, part.end), colour=_SHADED, style=shaded) for part in worn.segments[1::2]]
    safe = [part.safe_time for part in worn.segments if part.safe_time is not None]
    common += [Mark("at", begin, colour=_SAFE, style={"linewidth": 1.2}) for begin in safe]
    has_speed = "walking_speed" in recording
    pace = Kind("Walking speed", "m/s", "velocity") if has_speed else Kind("Strides per second", "Hz", "frequency")
    speed = recording["walking_speed" if has_speed else "stride_frequency"]

    def name_segments(axes: "Axes") -> None:
        for segment in worn.segments:
            is_narrow = segment.end - segment.start < _NARROWEST * float(time[-1])
            axes.text(
                0.5 * (segment.start + segment.end),
                0.96,
                segment.kind,
                transform=axes.get_xaxis_transform(),
                rotation=90.0 if is_narrow else 0.0,
                ha="center",
                va="top",
                fontsize=8,
                color=GREY,
            )
        # Room above the curve for the names.
        axes.set_ylim(-0.05 * float(speed.max()), 2.2 * float(speed.max()) + 0.01)
        set_limits(axes)

    def set_limits(axes: "Axes") -> None:
        axes.set_xlim(0.0, float(time[-1]))
        axes.locator_params(axis="y", nbins=4)

    both = ((bare.recording, WITHOUT), (worn.recording, WITH))
    angles = [Mark("line", of.time, clinical_angle(of["angle"]), colour=shade, style=_THIN) for of, shade in both]
    toes = [Mark("line", of.time, of["toe_height"], colour=shade, style=_THIN) for of, shade in both]
    forces = [
        Mark("line", time, recording["heel_force"], label="heel", colour=BLACK, style=_THIN),
        Mark("line", time, recording["toe_force"], label="toes", colour=GREY, style=_THIN),
    ]
    torque = [Mark("line", time, recording["torque"], colour=WITH, style=_THIN), *_phase_strip(recording)]
    drawn: list[tuple[Kind, list[Mark]]] = [
        (ANGLE, angles),
        (Kind("Force under heel and toes", "N", "force"), forces),
        (Kind("Actuator torque; strip: controller", "N m", "torque"), torque),
        (_TOES, [_ZERO, *toes]),
        (_GAS, [Mark("line", time, recording["supplied_mass"], colour=WITH)]),
    ]
    panels = [Panel(TIME, pace, [*common, Mark("line", time, speed, colour=BLACK)], then=name_segments, shares_x=True)]
    panels += [Panel(TIME, kind, [*common, *marks], then=set_limits, shares_x=True) for kind, marks in drawn]
    sequence = walk_of(worn.scenario).task_sequence
    return draw_panels(
        panels,
        size=(9.1, 1.45),
        title=f"{worn.scenario.name}, task sequence {'' if sequence is None else sequence.name}",
        note="blue: with the device; orange: without it; red line: the controller helps less",
        kind=recording.kind,
    )


def _phase_strip(recording: Recording) -> list[Mark]:
    """Return the phase that the controller sees, as a strip under the curve of the torque."""
    if "controller_phase" not in recording:
        return []
    seen, torque = acting_phase(recording), recording["torque"]
    # A torque that is 0 throughout leaves the strip a height.
    height = max(float(np.ptp(torque)), 1.0e-3)
    low = np.full(seen.size, float(torque.min()) - 0.05 * height)
    return [
        Mark(
            "band",
            recording.time,
            (low - 0.18 * height, low),
            label=name,
            colour=colour,
            style={"alpha": 1.0, "where": seen == phase, "step": "post"},
        )
        for phase, (name, colour) in _TASK_SEQUENCE_PHASES.items()
    ]


def peak_torques(result: WalkResult) -> Floats:
    """Return the largest torque [N m] of each whole stride (strides,)."""
    edges = result.starts
    if edges.size < 2:
        return np.zeros(0)
    return np.maximum.reduceat(result.recording["torque"], edges)[:-1]


def bottle_figure(result: WalkResult) -> "Figure":
    """Return the figure of a walk on its bottle; below it stands what ended it."""
    supply, recording, edges = result.supply, result.recording, result.starts
    assert supply is not None, "drawn for a walk on a bottle"
    bottle, values, end = supply.supply.bottle, supply.values, float(recording.time[-1])
    dashed = {"linestyle": "--", "linewidth": 1.2}
    held = [
        Mark("line", supply.times, values["regulated_pressure"], label="delivered at most", colour=GREY, style=dashed)
    ]
    if edges.size > 1:
        # Highest and lowest of each stride of what the line behind the regulator has.
        lowest, highest = (pick.reduceat(recording["line_pressure_1"], edges)[:-1] for pick in (np.minimum, np.maximum))
        look = {"alpha": 0.3}
        held.append(Mark("band", recording.time[edges[:-1]], (lowest, highest), label="line, in a stride", style=look))
    needed = bottle.regulator.set_pressure + bottle.regulator.pressure_margin
    inside = [
        Mark("level", y=needed, label="needed", colour=VERMILION, style=dashed),
        Mark("line", supply.times, values["bottle_pressure"], label="bottle"),
    ]
    parts = (
        ("bottle_temperature", "bottle", BLUE),
        ("regulator_temperature", "regulator", BLACK),
        ("outlet_temperature", "gas behind it", ORANGE),
        ("gas_temperature", "gas at the device", GREEN),
    )
    warmth = [Mark("line", supply.times, values[name], label=label, colour=shade) for name, label, shade in parts]
    if supply.supply.line.freezes > 0.5:
        ice = supply.supply.line.temperatures[0]
        warmth.append(Mark("level", y=ice, label="dry ice", colour=VERMILION, style=dashed))
    peaks = peak_torques(result)
    dots = {"marker": ".", "markersize": 2.5, "linewidth": 0.8}
    torque = [Mark("line", recording.time[edges[:-1]] if peaks.size else peaks, peaks, style=dots)]
    masses = (("bottle_mass", "total gas", BLUE), ("liquid_mass", "liquid", GREEN))
    left = [
        Mark("line", supply.times, values[name], label=label, colour=shade)
        for name, label, shade in masses
        if name in values
    ]
    drawn: list[tuple[Kind, list[Mark], float | None]] = [
        (Kind("Pressure behind the regulator", "Pa_a", "pressure"), held, None),
        (Kind("Pressure in the bottle", "Pa_a", "pressure"), inside, float(np.max(values["bottle_pressure"]))),
        (Kind("Temperature", "K", "temperature"), warmth, None),
        (Kind("Peak torque of each stride", "N m", "torque"), torque, float(peaks.max(initial=0.1))),
        (Kind("Left in the bottle", "kg", "gas mass"), left, supply.supply.mass),
    ]
    ended = Mark("at", supply.ending.time, colour=VERMILION, style={"linewidth": 1.0})

    def panel(kind: Kind, marks: list[Mark], most: float | None) -> Panel:
        def set_limits(axes: "Axes") -> None:
            axes.set_xlim(0.0, 1.005 * float(_time_of(end).values(end)))
            axes.locator_params(axis="y", nbins=5)
            if len(marks) > 3:
                axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=5, borderaxespad=0.1, handlelength=1.2)
            if most is not None:
                axes.set_ylim(0.0, 1.08 * display_value(most, kind.quantity))

        return Panel(_time_of(end), kind, [*marks, ended], then=set_limits, shares_x=True)

    return draw_panels(
        [panel(*each) for each in drawn],
        size=(8.1, 1.75),
        title=f"{result.scenario.name} on {bottle.name}",
        note=f"End: {supply.ending.message}.",
        kind=recording.kind,
    )
