"""A whole walk over time: gas, toes and phases, and where the controller helps, pauses and has stopped."""

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.style import BLACK, BLUE, GREY, VERMILION, Margins, figure_of_panels, house_style, mark_kind
from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.control.walking.signs import HELPS, LIFTS, PAUSED, STOPPED
from ppafo.signals.recording import Floats
from ppafo.simulation.scenario import Scenario
from ppafo.walking.planning import gait_sensors_of
from ppafo.walking.result import WalkResult
from ppafo.walking.sensor_settings import NEVER

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (9.4, 5.6)
_MARGINS = Margins(left=1.3, right=0.2, top=0.62, bottom=0.55, row_gap=0.16, label=0.6)
_HEIGHTS = (1.0, 1.2, 1.0, 0.35)
_LEVELS = {
    HELPS: ("help", "#cfe3c9"),
    LIFTS: ("lift", "#e6e2a8"),
    PAUSED: ("pause", "#f3d27a"),
    STOPPED: ("stop", "#e08a8a"),
}
_PHASES = ("swing", "heel", "free", "push")
_LONG = 120.0
"""Time [s] above which the axis is in minutes."""

_FAULT_SUFFIX = "_fault"


def failures(configuration: Scenario) -> dict[str, float]:
    """Return when which sensor fails [s], by its name; {} where all are sound."""
    sensors = gait_sensors_of(configuration)._asdict()
    return {
        name.removesuffix(_FAULT_SUFFIX): fault.time
        for name, fault in sensors.items()
        if name.endswith(_FAULT_SUFFIX) and fault.time < NEVER
    }


def over_time_figure(result: WalkResult) -> "Figure":
    """Return gas, toe height, phase and level of help over the time of a walk, with faults, pauses and the stop."""
    recording = result.recording
    scale, unit = (60.0, "min") if recording.time[-1] > _LONG else (1.0, "s")
    time = recording.time / scale
    with house_style():
        figure, grid = figure_of_panels(_SIZE, _MARGINS, len(_HEIGHTS), heights=_HEIGHTS)
        gas, toes, phases, level = (axes for (axes,) in grid)
        gas.plot(time, GRAMS_PER_KILOGRAM * recording["supplied_mass"], color=BLUE)
        gas.set_ylabel("Gas\n(g)")
        toes.plot(time, 100.0 * recording["toe_height"], color=BLUE, linewidth=0.9)
        toes.axhline(0.0, color=GREY, linewidth=0.8)
        toes.set_ylabel("Toes over\nthe ground (cm)")
        _phases(phases, result, time)
        _levels(level, result, time)
        level.set_xlabel(f"Time ({unit})")
        level.set_xlim(0.0, float(time[-1]))
        _marks(grid[0][0], [row[0] for row in grid], result, scale)
        width, height = _SIZE
        title = f"{result.scenario.name}: the whole walk"
        figure.text(0.12 / width, 1.0 - 0.12 / height, title, ha="left", va="top", fontweight="bold")
        mark_kind(figure, recording.kind)
        return figure


def _phases(axes: "Axes", result: WalkResult, time: Floats) -> None:
    axes.set_ylabel("Controller")
    axes.set_yticks(range(len(_PHASES)), _PHASES)
    axes.set_ylim(-0.3, len(_PHASES) - 0.7)
    if "controller_phase" in result.recording:
        axes.step(time, result.recording["controller_phase"], where="post", color=BLACK, linewidth=0.9)


def _levels(axes: "Axes", result: WalkResult, time: Floats) -> None:
    """Paint the strip of help, pause and stop, and name each stretch that is wide enough."""
    found = result.recording["safe_state"] if "safe_state" in result.recording else np.zeros(time.size)
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


def _marks(top: "Axes", rows: "list[Axes]", result: WalkResult, scale: float) -> None:
    """Draw a line at each pause and stop, and a dashed one with its name where a sensor fails."""
    for event in result.events:
        if event.sign is not None:
            for axes in rows[:3]:
                axes.axvline(event.time / scale, color=VERMILION, linewidth=0.9)
    for sensor, begin in failures(result.scenario).items():
        if begin < result.recording.time[-1]:
            for axes in rows[:3]:
                axes.axvline(begin / scale, color=GREY, linestyle="--", linewidth=0.9)
            top.annotate(
                f"{sensor} fails",
                (begin / scale, 1.02),
                xycoords=("data", "axes fraction"),
                ha="right",
                va="bottom",
                fontsize=8.5,
                color=GREY,
            )
