"""Runs a walk and collects its results, stride by stride and on average."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import STEPS_PER_CALL, Batch, BatchResult, Floats, begin_block
from ppafo.engine.program import LaneResult
from ppafo.engine.run import NEVER_FAILED, TOO_MANY_PARTS, batch_of
from ppafo.errors import ScenarioError
from ppafo.gait.opensim_names import opensim_recording
from ppafo.metrics import Metric
from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.simulation.result import Status
from ppafo.simulation.sampled import state_row_numbers
from ppafo.storage.opensim import write_opensim
from ppafo.walking.configuration import Configuration
from ppafo.walking.course_planning import PlannedCourse
from ppafo.walking.course_segments import SegmentResult, course_metrics, segment_results, steady_strides
from ppafo.walking.fixed_point import controller_of
from ppafo.walking.loading import load_walk
from ppafo.walking.on_bottle import SupplyCourse, run_on_bottle
from ppafo.walking.planning import WalkPlan, course_of_walk, plan_walk
from ppafo.walking.recorded import SAFE_ROW, recording_of_walk
from ppafo.walking.safety_events import SafetyEvent, safety_events
from ppafo.walking.strides import Curves, helped_strides, mean_curves, per_stride, stride_starts
from ppafo.walking.walk_metrics import settled, stride_metrics, walk_metrics

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHORTEST_STRIDES = 5
SHORTEST_COURSE = 1.0
DEFAULT_MINUTES = 1.0
BOTTLE_MINUTES = 10.0
"""Minutes of a walk on a bottle, unless given or ended by the bottle before."""

LONGEST_MINUTES = 60.0
REMEDY = "the step may be too long, or a value unrealistic: try a smaller run.step, and check the wearer"


Progress = Callable[[float, float], None]


def silent(done: float, total: float) -> None:  # both are there for those who listen
    """Ignore the progress."""


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

    configuration: Configuration
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
        head = f"Walk '{self.configuration.name}', {self.recording.time[-1] / 60.0:.3g} min: {self.status.message}"
        return "\n".join([head, *lines])

    def plot(self) -> "Figure":
        """Return a figure of the mean stride with the healthy gait beside it; ``.savefig(...)`` writes it."""
        from ppafo.walking.figures.mean_stride import walk_figure

        return walk_figure({self.configuration.name: self})

    def save_opensim(self, path: str | Path) -> Path:
        """Write the recording as a ``.sto`` file in OpenSim's names, zero and signs, right leg; returns the path."""
        named, _ = opensim_recording(self.recording, body_mass=self.configuration.wearer.body_mass)
        return write_opensim(path, named)


def walk(
    configuration: Configuration | str | Path,
    minutes: float | None = None,
    overrides: Iterable[str] = (),
    gait: str | Path | None = None,
    progress: Progress = silent,
    course: str | Path | None = None,
    bottle: str | Path | None = None,
) -> WalkResult:
    """Walk for ``minutes`` [min]: a configuration, the name of a shipped one, or a file; overrides as for the command.

    Unless ``minutes`` are given it is the whole course, or one minute where there is none, and up to ten on a bottle,
    which may end it before. ``gait``, ``course`` and ``bottle`` stand in place of those of a name or a file.
    A walk that diverges is a result with that status, up to the time of failure. ScenarioError or ParameterError for
    bad input. ``progress`` gets the minutes done and the minutes in all, part by part.
    """
    is_loaded = isinstance(configuration, Configuration)
    chosen = configuration
    if not isinstance(chosen, Configuration):
        chosen = load_walk(chosen, overrides, gait, course, bottle)
    if is_loaded and (any(item is not None for item in (gait, course, bottle)) or tuple(overrides)):
        raise ScenarioError(
            "overrides, a gait, a course and a bottle go with a name or a file; a Configuration takes them in load_walk"
        )
    run = plan_walk(plan_of(chosen, walk_duration(chosen, minutes)))
    supply = None
    if chosen.bottle is None:
        outcome = _run_in_parts(batch_of(run), run.step, progress)
    else:
        outcome, supply = run_on_bottle(run, chosen.bottle, chosen.gait.stride_time, progress)
    rows = state_row_numbers(run)
    record = {name: outcome.record[:, row, 0] for name, row in rows.items()}
    failed, too_many_parts = (float(outcome.states[rows[f"result.{name}"], 0]) for name in LaneResult._fields[1:])
    status = _status(failed, bool(too_many_parts), outcome.states)
    time = np.arange(outcome.record.shape[0], dtype=np.float64) * (run.step * run.record_every)
    if status.time is not None:
        kept = time < status.time
        kept[0] = True
        time, record = time[kept], {name: values[kept] for name, values in record.items()}
    recording = recording_of_walk(chosen, run, time, record, supply)
    starts = stride_starts(record["walk.strides"])
    return replace(_walk_result(chosen, recording, record, starts, status), supply=supply)


def integral_of_a_stride(result: WalkResult, values: Floats) -> float:
    """Return the integral of a channel over the ankle angle, in its unit times rad, mean over the counted strides."""
    turned = np.diff(result.recording["angle"])
    done = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * turned)])
    planned = course_of_walk(result.configuration)
    counted = result.helped & _counted(planned, result.recording, result.starts)
    return float(np.diff(done[result.starts])[counted].mean())


def walk_duration(configuration: Configuration, minutes: float | None = None) -> float:
    """Length of a walk [s], that of its course or a minute unless given; ScenarioError if too short or too long."""
    course = course_of_walk(configuration)
    if minutes is None and course is not None:
        minutes = float(course.duration) / 60.0
    if minutes is None:
        minutes = DEFAULT_MINUTES if configuration.bottle is None else BOTTLE_MINUTES
    seconds = 60.0 * minutes
    shortest = SHORTEST_STRIDES * configuration.gait.stride_time if course is None else SHORTEST_COURSE
    if not shortest <= seconds <= 60.0 * LONGEST_MINUTES:
        raise ScenarioError(
            f"a walk of {minutes:.6g} min: must be {shortest / 60.0:.2g} min "
            f"({f'{SHORTEST_STRIDES} strides' if course is None else 'a second of a course'}) or more, and "
            f"at most {LONGEST_MINUTES:g} min"
        )
    return seconds


def _run_in_parts(batch: Batch, step: float, progress: Progress) -> BatchResult:
    """Run in parts short enough for an interrupt to be seen and for progress to be told."""
    block = begin_block(batch)
    count = batch.clock.step_count
    for done in range(0, count, STEPS_PER_CALL):
        block.advance(min(STEPS_PER_CALL, count - done))
        progress(min(done + STEPS_PER_CALL, count) * step / 60.0, count * step / 60.0)
    return block.result()


def record_interval(seconds: float) -> float:
    """Time [s] between two samples of the record of a walk of this length [s]; an hour of milliseconds does not fit."""
    return 1.0e-3 if seconds <= 61.0 else (5.0e-3 if seconds <= 601.0 else 2.0e-2)


def plan_of(configuration: Configuration, seconds: float) -> WalkPlan:
    """The plan of a walk of this length [s]."""
    controller, settings = controller_of(configuration)
    return WalkPlan(
        device=_fed_device(configuration),
        wearer=configuration.wearer,
        gait=configuration.gait,
        controller=controller,
        settings=settings,
        sensors=configuration.sensors,
        gait_sensors=configuration.gait_sensors,
        has_ideal_sensors=configuration.has_ideal_sensors,
        duration=seconds,
        period=configuration.period,
        step=configuration.step,
        record_interval=record_interval(seconds),
        supply_lines=configuration.supply_lines,
        thermal=configuration.thermal,
        course=configuration.course,
    )


def _fed_device(configuration: Configuration) -> Device:
    """Return the device with the gas that its supply has at the start: cold gas where it hangs on a bottle."""
    bottle = configuration.bottle
    return configuration.device if bottle is None else bottle.device_at_start(configuration.device)


def _walk_result(
    configuration: Configuration,
    recording: Recording,
    record: Mapping[str, Floats],
    starts: NDArray[np.intp],
    status: Status,
) -> WalkResult:
    strides = per_stride(record, starts)
    helped = helped_strides(record.get(SAFE_ROW, np.zeros(recording.time.size)), starts)
    planned = course_of_walk(configuration)
    steady = _counted(planned, recording, starts)
    averages, vented = (mean_curves(recording, starts, chosen & steady) for chosen in (helped, ~helped))
    metrics = walk_metrics(configuration, recording, strides, averages, starts, helped, steady)
    without = ~helped & steady
    apart = stride_metrics(configuration, strides, vented, without) if without.any() else {}
    events = safety_events(configuration, recording.time, record)
    segments: tuple[SegmentResult, ...] = ()
    if planned is not None:
        segments = segment_results(configuration, planned, recording, strides["push_off_work"], starts)
        metrics |= course_metrics(planned, segments, recording, int((helped & steady).sum()))
    return WalkResult(
        configuration, recording, strides, averages, metrics, status, starts, helped, apart, events, segments
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
