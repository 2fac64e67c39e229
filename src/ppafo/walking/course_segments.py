"""What happened on each segment of a course: strides, help, gas, toes, and where the controller helped less."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ppafo.metrics import Metric
from ppafo.model.contact import FLAT, SWING
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.simulation.scenario import Scenario
from ppafo.walking.course_planning import PlannedCourse, Span
from ppafo.walking.gait_series import gait_timing
from ppafo.walking.motion import walk_of

LOADED_HEEL = 0.1
"""Body weights under the heel above which a push in plantarflexion is counted as one on a loaded heel."""


@dataclass(frozen=True, slots=True)
class SegmentResult:
    """One segment of a course, from ``start`` to ``end`` [s], SI units.

    ``strides`` begin in it with a strike, ``helped`` are those of them in which the controller was not in its safe
    state up to the next strike, or to the end. ``gas`` [kg], ``push_off_work`` [J] of the strides that begin in it,
    ``lowest_toes`` [m] over the ground in the middle of its swings, None without one. ``flat_push`` [N m] is the
    largest torque in plantarflexion with a loaded heel, ``safe_time`` [s] when the controller first helped less (lifted
    only, paused or stopped), None where it did not.
    """

    kind: str
    title: str
    start: float
    end: float
    strides: int
    helped: int
    gas: float
    push_off_work: float
    lowest_toes: float | None
    flat_push: float
    safe_time: float | None


def steady_strides(planned: PlannedCourse, strikes: Floats) -> NDArray[np.bool_]:
    """True for each whole stride, between strikes at times [s], at an even speed on level ground."""
    first, last = strikes[:-1], strikes[1:]
    steady = np.zeros(first.size, dtype=np.bool_)
    for start, end in planned.steady:
        steady |= (first >= start) & (last <= end)
    return steady


def segment_results(
    configuration: Scenario,
    planned: PlannedCourse,
    recording: Recording,
    works: Floats,
    starts: NDArray[np.intp],
) -> tuple[SegmentResult, ...]:
    """The segments that a recording reached; ``works`` [J] of its whole strides, between strikes at ``starts``."""
    end = float(recording.time[-1])
    reached = [span for span in planned.spans if float(span.start) < end]
    return tuple(_segment(configuration, span, recording, works, starts) for span in reached)


def _segment(
    configuration: Scenario, span: Span, recording: Recording, works: Floats, starts: NDArray[np.intp]
) -> SegmentResult:
    time = recording.time
    last = min(float(span.end), float(time[-1]))
    own = (time >= float(span.start)) & (time <= last)
    strikes = time[starts]
    begun = np.flatnonzero((strikes >= float(span.start)) & (strikes < last))
    gas = np.interp([float(span.start), last], time, recording["supplied_mass"])
    heel = (
        recording["heel_force"]
        > LOADED_HEEL * walk_of(configuration).wearer.body_mass * walk_of(configuration).wearer.leg().gravity
    )
    loaded = own & heel & (recording["contact"] <= FLAT) & (recording["contact"] != SWING)
    push = recording["torque"][loaded]
    return SegmentResult(
        kind=span.kind,
        title=span.title,
        start=float(span.start),
        end=last,
        strides=begun.size,
        helped=_helped(recording, begun, starts),
        gas=float(gas[1] - gas[0]),
        push_off_work=float(works[begun[begun < works.size]].sum()),
        lowest_toes=_lowest_toes(configuration, recording, own),
        flat_push=max(float(push.max()), 0.0) if push.size else 0.0,
        safe_time=_safe_time(recording, own),
    )


def _helped(recording: Recording, begun: NDArray[np.intp], starts: NDArray[np.intp]) -> int:
    """Number of strides without the safe state; none where no controller works."""
    if "safe_state" not in recording:
        return 0
    safe = recording["safe_state"] > 0.5
    edges = np.append(starts, recording.time.size)
    return sum(not safe[edges[stride] : edges[stride + 1]].any() for stride in begun)


def _lowest_toes(configuration: Scenario, recording: Recording, own: NDArray[np.bool_]) -> float | None:
    """Lowest toes [m] where they must clear the ground: as far into each swing as for the mean stride of a walk."""
    timing = gait_timing(walk_of(configuration).gait)
    swing = recording["contact"] == SWING
    edges = np.flatnonzero(np.diff(swing.astype(np.int8))) + 1
    found = []
    for first, last in pairwise(edges.tolist()):
        if not (swing[first] and own[first]):
            continue
        span = 1.0 - timing.toe_off
        middle = [first + round((last - first) * (at - timing.toe_off) / span) for at in timing[4:6]]
        found.append(float(recording["toe_height"][middle[0] : middle[1] + 1].min()))
    return min(found, default=None)


def _safe_time(recording: Recording, own: NDArray[np.bool_]) -> float | None:
    """When the controller first helped less within a segment [s]; None where it did not."""
    if "safe_state" not in recording:
        return None
    safe = recording["safe_state"] > 0.5
    begins = np.flatnonzero(own & safe & ~np.append(False, safe[:-1]))
    return float(recording.time[begins[0]]) if begins.size else None


_SAME_TIME = 0.05
"""Time [s] by which a recording may end before its course: its samples."""


def is_whole_course(walked: float, planned: float) -> bool:
    """True where a course of a planned time [s] was walked to its end, after a time [s] by its recording."""
    return walked >= planned - _SAME_TIME


def course_metrics(
    planned: PlannedCourse, segments: Sequence[SegmentResult], recording: Recording, steady: int
) -> dict[str, Metric]:
    """Numbers of a whole course by name, SI units, or of what was walked of it."""
    toes = [segment.lowest_toes for segment in segments if segment.lowest_toes is not None]
    # A walk may go on after its course.
    end = min(float(recording.time[-1]), float(planned.duration))
    gas = float(np.interp(end, recording.time, recording["supplied_mass"]))
    found = {
        "course_time": Metric(end, "s", "length of the course, as far as it was walked"),
        "course_planned_time": Metric(float(planned.duration), "s", "length of the whole course"),
        "steady_strides": Metric(float(steady), "-", "whole strides at an even speed on level ground"),
        "course_strides": Metric(float(sum(item.strides for item in segments)), "-", "strides of the course"),
        "course_gas": Metric(gas, "kg", "gas taken from the supply on the course"),
        "course_work": Metric(
            sum(item.push_off_work for item in segments), "J", "work of T_ex while the foot rolls over the toes"
        ),
        "course_flat_push": Metric(
            max((item.flat_push for item in segments), default=0.0),
            "N m",
            "largest torque in plantarflexion with a loaded heel",
        ),
    }
    if toes:
        found["course_lowest_toes"] = Metric(min(toes), "m", "lowest toes over the ground in the middle of a swing")
    if "walking_speed" in recording:
        way = float(np.trapezoid(recording["walking_speed"], recording.time))
        found["course_length"] = Metric(way, "m", "way on the course")
    return found
