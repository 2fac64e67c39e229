"""The results of a walk: its recording, stride by stride and on average."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import BatchResult, Floats
from ppafo.engine.program import LaneResult
from ppafo.engine.run import NEVER_FAILED, TOO_MANY_PARTS, Run
from ppafo.gait.opensim_names import opensim_recording
from ppafo.metrics import METRICS, Metric, evaluate
from ppafo.metrics.metric import REQUEST, STEADY, MetricKind
from ppafo.signals import Recording
from ppafo.simulation.sampled import state_row_numbers
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Scenario
from ppafo.simulation.simulate import Status
from ppafo.storage.opensim import write_opensim
from ppafo.walking.contradictions import check_no_bottle
from ppafo.walking.course_planning import PlannedCourse
from ppafo.walking.course_segments import SegmentResult, course_metrics, segment_results, steady_strides
from ppafo.walking.motion import walk_of
from ppafo.walking.on_bottle import SupplyCourse
from ppafo.walking.person import as_drawn
from ppafo.walking.planning import course_of_walk, law_of
from ppafo.walking.recorded import SAFE_ROW, recording_of_walk
from ppafo.walking.safety_events import SafetyEvent, safety_events
from ppafo.walking.strides import Curves, helped_strides, mean_curves, per_stride, stride_starts
from ppafo.walking.walk_metrics import settled, stride_metrics, walk_metrics

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REMEDY = "the step may be too long, or a value unrealistic: try a smaller run.step, and check the wearer"


@dataclass(frozen=True, slots=True, repr=False, eq=False)
class WalkResult:
    """A finished walk: recording, numbers of each stride (strides,), curves over the stride, and numbers of the whole.

    ``averages`` and ``metrics`` are those of the strides with help, without the first ones, in which the controller
    learns; ``vented_metrics`` those of the strides with less help (lifted only, paused or stopped), {} without such.
    ``starts`` are the samples of the recording right after each heel strike, ``helped`` is True for each stride with
    help throughout, and ``events`` are the pauses, the stop and the returns of help. ``segments`` are those of a
    course, none without one; means are then over its strides at an even speed on level ground.
    ``supply`` is the bottle over the walk, None where the device hangs on none.
    """

    scenario: Scenario
    recording: Recording
    strides: Mapping[str, Floats]
    averages: Mapping[str, Curves]
    metrics: Mapping[str, Metric]
    status: Status
    starts: NDArray[np.intp]
    helped: NDArray[np.bool_]
    vented_metrics: Mapping[str, Metric]
    events: tuple[SafetyEvent, ...]
    segments: tuple[SegmentResult, ...] = ()
    supply: SupplyCourse | None = None

    @property
    def is_helped(self) -> bool:
        """True where at least half of the whole strides had help."""
        return 2 * int(self.helped.sum()) >= self.helped.size

    def __repr__(self) -> str:
        """Return name, status, duration and one line a metric, in SI units."""
        width = max((len(name) for name in self.metrics), default=0)
        lines = [f"  {name:<{width}}  {item.value:.4g} {item.unit}" for name, item in self.metrics.items()]
        head = f"Walk '{self.scenario.name}', {self.recording.time[-1] / 60.0:.3g} min: {self.status.message}"
        return "\n".join([head, *lines])

    def plot(self) -> "Figure":
        """Return a figure of the mean stride with the healthy gait beside it; ``.savefig(...)`` writes it."""
        from ppafo.walking.figures.mean_stride import walk_figure

        return walk_figure({self.scenario.name: self})

    def save_opensim(self, path: str | Path) -> Path:
        """Write the recording as a ``.sto`` file in OpenSim's names, zero and signs, right leg; returns the path."""
        named, _ = opensim_recording(self.recording, body_mass=walk_of(self.scenario).wearer.body_mass)
        return write_opensim(path, named)


def result_of_walk(scenario: Scenario, run: Run, outcome: BatchResult, supply: SupplyCourse | None) -> WalkResult:
    """The result of what a run of a walk came to, up to where it diverged; ``supply`` is its bottle's course."""
    rows = state_row_numbers(run)
    record = {name: outcome.record[:, row, 0] for name, row in rows.items()}
    failed, too_many_parts = (float(outcome.states[rows[f"result.{name}"], 0]) for name in LaneResult._fields[1:])
    status = _status(failed, bool(too_many_parts), outcome.states)
    time = np.arange(outcome.record.shape[0], dtype=np.float64) * (run.step * run.record_every)
    if status.time is not None:
        kept = time < status.time
        kept[0] = True
        time, record = time[kept], {name: values[kept] for name, values in record.items()}
    return _walk_result(scenario, run, time, record, status, supply)


def measured(
    scenario: Scenario, run: Run, time: Floats, record: Mapping[str, Floats]
) -> tuple[Recording, Mapping[str, Metric]]:
    """Recording and metrics of a walk from its rows (samples,) by path, at these times [s]."""
    check_no_bottle(scenario)
    result = _walk_result(scenario, run, time, record, Status("completed"), None)
    of_recording = evaluate(result.recording)
    offered = {name: metric for name, metric in of_recording.items() if not lacks(scenario, METRICS[name])}
    return result.recording, {**offered, **result.metrics}


def lacks(scenario: Scenario, kind: MetricKind) -> str:
    """Why a walk has not what a metric needs, an empty text where it has."""
    if "reference" in kind.channels:
        return "a walk has no one reference that its torque follows: push_off_error is the error in push-off"
    if kind.traced:
        return "it needs the course of the whole run, which is not kept of a walk"
    if STEADY in kind.needs and walk_of(scenario).course is not None:
        return "it is a mean over equal strides, and a course has others: leave the course out"
    is_outside = scenario.control.kind == PYTHON_CONTROLLER
    if REQUEST in kind.needs and (is_outside or not hasattr(law_of(scenario).initial, "request")):
        return f"its controller '{scenario.control.kind}' requests no torque"
    return ""


def integral_of_a_stride(result: WalkResult, values: Floats) -> float:
    """Return the integral of a channel over the ankle angle, in its unit times rad, mean over the counted strides."""
    turned = np.diff(result.recording["angle"])
    done = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * turned)])
    planned = course_of_walk(result.scenario)
    counted = result.helped & _counted(planned, result.recording, result.starts)
    return float(np.diff(done[result.starts])[counted].mean())


def _walk_result(
    scenario: Scenario,
    run: Run,
    time: Floats,
    record: Mapping[str, Floats],
    status: Status,
    supply: SupplyCourse | None,
) -> WalkResult:
    walked, motion = scenario, walk_of(scenario)
    # Whom it is healthy for is the person who walked; what was planned stays in the result.
    gait, wearer = as_drawn(motion.gait, motion.wearer, motion.person)
    scenario = replace(scenario, motion=replace(motion, gait=gait, wearer=wearer))
    recording = recording_of_walk(scenario, run, time, record, supply)
    starts = stride_starts(record["walk.strides"])
    strides = per_stride(record, starts)
    helped = helped_strides(record.get(SAFE_ROW, np.zeros(recording.time.size)), starts)
    planned = course_of_walk(scenario)
    steady = _counted(planned, recording, starts)
    averages, vented = (mean_curves(recording, starts, chosen & steady) for chosen in (helped, ~helped))
    metrics = walk_metrics(scenario, recording, strides, averages, starts, helped, steady)
    without = ~helped & steady
    apart = stride_metrics(scenario, strides, vented, without) if without.any() else {}
    events = safety_events(scenario, recording.time, record)
    segments: tuple[SegmentResult, ...] = ()
    if planned is not None:
        segments = segment_results(scenario, planned, recording, strides["push_off_work"], starts)
        metrics |= course_metrics(planned, segments, recording, int((helped & steady).sum()))
    return WalkResult(
        scenario=walked,
        recording=recording,
        strides=strides,
        averages=averages,
        metrics=metrics,
        status=status,
        starts=starts,
        helped=helped,
        vented_metrics=apart,
        events=events,
        segments=segments,
        supply=supply,
    )


def _counted(planned: PlannedCourse | None, recording: Recording, starts: NDArray[np.intp]) -> NDArray[np.bool_]:
    """True for each whole stride that counts for means: not the first ones, of a course those at an even speed."""
    if planned is not None:
        return steady_strides(planned, recording.time[starts])
    return settled(np.ones(max(starts.size - 1, 0), dtype=np.bool_))


def _status(failed: float, too_many_parts: bool, states: Floats) -> Status:
    if failed >= NEVER_FAILED and bool(np.isfinite(states).all()):
        return Status("completed", None, "completed")
    time = failed if failed < NEVER_FAILED else 0.0
    return Status("diverged", time, f"diverged at t = {time:.6g} s; {TOO_MANY_PARTS if too_many_parts else REMEDY}")
