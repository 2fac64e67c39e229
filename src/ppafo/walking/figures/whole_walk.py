"""Figure of a whole walk over time: gas, toes, controller phase, assistance level; with failures, pauses and stop."""

from collections.abc import Mapping
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ppafo.model.helping import HELPS, LIFTS, PAUSED, STOPPED
from ppafo.report.kind import Kind, duration_kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import BLACK, GREY, VERMILION, font_size
from ppafo.signals.recording import Recording
from ppafo.walking.figures.axes import GAS, GROUND, THIN, TOES
from ppafo.walking.result import WalkResult
from ppafo.walking.safety_events import acting_phase, failure_times

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LEVELS = {
    HELPS: ("help", "#f0f6ee"),
    LIFTS: ("lift only", "#e6e2a8"),
    PAUSED: ("pause", "#e3bb63"),
    STOPPED: ("stop", "#c07777"),
}
"""Name and colour of each assistance level, darker for less assistance, to differ in greyscale."""
_PHASES = ("swing", "heel", "free", "push")
"""Names of the phases, which are numbered from 0."""
_NAMED_STRETCH = 0.06
"""Shortest interval at one assistance level that gets a label, as a fraction of the walk."""
_APART = 0.2
"""Failures within this fraction of the walk share a label; the other labels alternate between two rows."""
_ROW = 0.16
"""Distance between the two rows of labels, as a fraction of the panel height."""
_TURNS = 0.6
"""Time, as a fraction of the walk, after which a label is placed to the left of its line."""
_ROOM = 1.4
"""Height of the gas panel relative to its curve, to make room for the labels."""


def whole_walk_figure(result: WalkResult) -> "Figure":
    """Return gas, toe height, phase and assistance level over time, with faults, pauses and the stop marked."""
    recording, time = result.recording, result.recording.time
    end = float(time[-1])
    axis = duration_kind(end)
    failed = {name: failure for name, failure in failure_times(result.scenario).items() if failure < end}
    losses = [event.time for event in result.events if event.fault_flag is not None]
    lines = [Mark("at", loss, colour=VERMILION, style={"linewidth": 0.9}) for loss in losses]
    dashed = {"linewidth": 0.9, "linestyle": "--"}
    lines += [Mark("at", failure, colour=GREY, style=dashed) for failure in failed.values()]
    name_failures = partial(_name_failures, failed, end, axis)
    phase, look = Kind("Phase of the controller"), {"linewidth": 0.9, "drawstyle": "steps-post"}
    has_phases = "controller_phase" in recording
    phases = [Mark("line", time, acting_phase(recording), colour=BLACK, style=look)] if has_phases else []
    named = {"yticks": range(len(_PHASES)), "yticklabels": _PHASES, "ylim": (-0.3, len(_PHASES) - 0.7)}
    panels = [
        Panel(axis, GAS, [Mark("line", time, recording["supplied_mass"]), *lines], then=name_failures, shares_x=True),
        Panel(axis, TOES, [Mark("line", time, recording["toe_height"], style=THIN), GROUND, *lines], shares_x=True),
        Panel(axis, phase, [*phases, *lines], then=lambda axes: axes.set(**named), shares_x=True),
    ]
    if "safe_state" in recording:
        panels.append(_level_panel(recording, axis))
    title = f"{result.scenario.name}: the whole walk"
    figure = draw_panels(panels, size=(5.4, 1.5), title=title, kind=recording.kind)
    # Panels that share an axis take the limits of the one below when they are joined, so limits come last.
    figure.axes[0].set_xlim(0.0, float(axis.values(end)))
    return figure


def _name_failures(failed: Mapping[str, float], end: float, axis: Kind, axes: "Axes") -> None:
    """Label each failure next to its line, above the curve; ``failed`` and ``end`` are times [s]."""
    axes.set_ylim(top=_ROOM * axes.get_ylim()[1])
    # Labels of failures that are close would cover each other: they are named together, at the time of the first.
    labels: list[tuple[float, list[str]]] = []
    for part, time in failed.items():
        if not labels or time - labels[-1][0] >= _APART * end:
            labels.append((time, []))
        labels[-1][1].append(part.replace("_", " "))
    for number, (time, names) in enumerate(labels):
        axes.annotate(
            f"{', '.join(names)} {'fails' if len(names) == 1 else 'fail'}",
            (float(axis.values(time)), 0.98 - _ROW * (number % 2)),
            xycoords=("data", "axes fraction"),
            ha="left" if time < _TURNS * end else "right",
            va="top",
            fontsize=font_size(8.5),
            color=GREY,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
        )


def _level_panel(recording: Recording, axis: Kind) -> Panel:
    """Return the strip of assistance, pause and stop, with a label in each interval that is wide enough."""
    time, level = recording.time, recording["safe_state"]
    edges = np.flatnonzero(np.diff(level, prepend=-1.0, append=-1.0))
    marks: list[Mark] = []
    names: dict[float, str] = {}
    for first, last in pairwise(edges.tolist()):
        name, colour = _LEVELS[float(level[first])]
        begin, end = float(time[first]), float(time[min(last, time.size - 1)])
        marks.append(Mark("span", (begin, end), colour=colour, style={"alpha": 1.0}))
        if end - begin > _NAMED_STRETCH * time[-1]:
            names[float(axis.values(0.5 * (begin + end)))] = name

    def name_levels(axes: "Axes") -> None:
        for middle, name in names.items():
            axes.text(middle, 0.5, name, ha="center", va="center", fontsize=font_size(9.0))
        axes.set_ylim(0.0, 1.0)
        axes.set_yticks([])
        axes.grid(visible=False)

    return Panel(axis, Kind("Level of help"), marks, then=name_levels, tall=0.55, shares_x=True)
