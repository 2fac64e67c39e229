"""Evaluation of a simulated walk: status, recording, strides, averages and metrics from the rows of the engine."""

from collections.abc import Mapping

import numpy as np

from ppafo.engine.lanes import BatchResult, Floats
from ppafo.engine.run import NEVER_FAILED, TOO_MANY_PARTS, Run, state_row_numbers
from ppafo.engine.step.lane import LaneResult
from ppafo.metrics import METRICS, evaluate
from ppafo.metrics.metric import MetricKind, Metrics
from ppafo.metrics.strides import SETTLING
from ppafo.signals.meter import LED_SHANK, REQUESTED
from ppafo.simulation.motion_kind import Measured
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Status
from ppafo.units.shown import in_units
from ppafo.walking.bottle.course import SupplyCourse
from ppafo.walking.contradictions import check_no_bottle
from ppafo.walking.planning import law_of, requests_torque
from ppafo.walking.recording import recording_of_walk
from ppafo.walking.result import WalkResult
from ppafo.walking.strides import mean_curves, per_stride, stride_starts, walk_metrics

REMEDY = "the time step may be too long, or a value unrealistic: try a smaller run.step, and check the wearer"


def result_of_walk(scenario: Scenario, run: Run, outcome: BatchResult, supply: SupplyCourse | None) -> WalkResult:
    """Return the result of a walk from the outcome of its run, up to a divergence; ``supply`` is its bottle."""
    rows = state_row_numbers(run)
    failed, too_many_parts = (float(outcome.states[rows[f"result.{name}"], 0]) for name in LaneResult._fields[1:])
    status = status_of_walk(failed, bool(too_many_parts), outcome.states)
    if status.is_completed and supply is not None and supply.ending.time < run.step * (run.step_count - 0.5):
        ended, whole = supply.ending, scenario.run.duration
        status = Status("ended early", ended.time, f"ended after {ended.time:.6g} of {whole:.6g} s: {ended.message}")
    time = np.arange(outcome.record.shape[0], dtype=np.float64) * (run.step * run.record_every)
    # A recording has at least one sample, also of a walk that fails at once.
    end = time.size if status.time is None else max(int(np.searchsorted(time, status.time)), 1)
    record = {name: outcome.record[:end, row, 0] for name, row in rows.items()}
    return _evaluated(scenario, run, time[:end], record, status, supply)


def status_of_walk(failed: float, too_many_parts: bool, states: Floats) -> Status:
    """Return the status of a walk from its time of failure [s], if any, and its last states."""
    if failed >= NEVER_FAILED and bool(np.isfinite(states).all()):
        return Status("completed", None, "completed")
    # A last state that is not finite, without a time of failure, discards the whole walk.
    time = failed if failed < NEVER_FAILED else 0.0
    remedy = TOO_MANY_PARTS if too_many_parts else REMEDY
    return Status("diverged", time, f"diverged at t = {time:.6g} s; {remedy}")


@in_units(lambda scenario, *_: scenario.device.shown)
def _evaluated(
    scenario: Scenario,
    run: Run,
    time: Floats,
    record: Mapping[str, Floats],
    status: Status,
    supply: SupplyCourse | None,
) -> WalkResult:
    """Return the result of a walk from its rows (samples,) by path at times [s], up to the time of a failure."""
    recording = recording_of_walk(scenario, run, time, record, supply)
    starts = stride_starts(record["walk.strides"])
    strides = per_stride(record, starts)
    averages = mean_curves(recording, starts[SETTLING:])
    metrics = walk_metrics(scenario, recording, strides, averages, starts)
    METRICS.load_all()
    others = [kind for name, kind in METRICS.items() if not METRICS.is_own(name) and not lacks(scenario, kind)]
    metrics |= evaluate(recording, others)
    return WalkResult(
        scenario=scenario,
        recording=recording,
        strides=strides,
        averages=averages,
        metrics=Metrics(metrics),
        status=status,
        starts=starts,
        supply=supply,
    )


def measured(scenario: Scenario, run: Run, time: Floats, record: Mapping[str, Floats]) -> Measured:
    """Return recording and metrics of a walk from its rows (samples,) by path, at these times [s]."""
    check_no_bottle(scenario)
    result = _evaluated(scenario, run, time, record, Status("completed", None, "completed"), None)
    # The catalogue lists metrics of plugins by module and object, a recording by the name of the metric.
    kinds = {kind.name: kind for kind in METRICS.values()}
    of_recording = evaluate(result.recording).items()
    available = {name: metric for name, metric in of_recording if not lacks(scenario, kinds[name])}
    return result.recording, {**available, **result.metrics}


def lacks(scenario: Scenario, kind: MetricKind) -> str:
    """Return the reason that a metric is not available for a walk; empty if it is available."""
    if kind.of_reference:
        return "a walk has no single torque reference; push_off_error is the error in push-off"
    if kind.traced:
        return "the metric needs the whole run over time, which a walk does not keep"
    if LED_SHANK in kind.needs:
        return "the metric needs a leg without ground contact, whose shank follows a gait"
    is_asked = not scenario.controller.is_outside or scenario.controller.settings
    if REQUESTED in kind.needs and not (is_asked and requests_torque(law_of(scenario))):
        return f"controller '{scenario.controller.kind}' requests no torque"
    return ""
