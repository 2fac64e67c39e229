"""Ensemble: many variants of one scenario, with metrics computed during the runs and no trajectory stored."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from ppafo.control.kind import PythonController
from ppafo.engine.channels import TRACED
from ppafo.engine.compilers import Effort
from ppafo.engine.lanes import Batch, BatchResult, Count, Floats, load_programs, run_blocks
from ppafo.engine.rows import group_of, row_numbers
from ppafo.engine.run import NEVER_FAILED, TOO_MANY_PARTS, Members
from ppafo.errors import KindError, ScenarioError
from ppafo.metrics import METRICS, MetricKind, has_channels, metric_kind
from ppafo.metrics.gas import WITH_ENERGY_BALANCE
from ppafo.metrics.metric import Readings
from ppafo.model.controlled import CONTROLLED
from ppafo.progress import report_nothing
from ppafo.signals.recording import OF_SECOND_CHAMBER
from ppafo.simulation.check import MARGIN, finer
from ppafo.simulation.ensemble.planning import check_columns, plan_ensemble
from ppafo.simulation.python_controller import run_sampled
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import REMEDY
from ppafo.wording import nearest_name

_SAME_INTERVAL = 1.0e-6
"""Relative difference up to which two intervals count as the same [-]."""
# End of a run of an ensemble; REFUSED for an impossible combination of values.
COMPLETED = 0
DIVERGED = 1
REFUSED = 2
_ROUNDING = 1.0e-9
"""Relative tolerance for the end of a run that rounding puts before the last time of its traces."""


@dataclass(frozen=True, slots=True)
class OutputRequest:
    """Outputs requested for every run.

    ``metrics`` maps names to metrics, ``bands`` are the channels to trace, ``every`` is the interval and ``times`` are
    the times of the traces [s]. ``custom`` is the Python object that controls the runs one after the other, None for a
    compiled controller.
    """

    metrics: Mapping[str, MetricKind]
    bands: tuple[str, ...]
    every: float
    times: Floats
    custom: PythonController | None = None


@final
class MeteredRuns:
    """Results of all runs so far: arrays that batches fill by column; nan for runs not yet made."""

    def __init__(self, runs: int, request: OutputRequest, count: Count = report_nothing) -> None:
        self.request = request
        self._count = count
        self.failure_time = np.full(runs, np.nan)
        self.is_completed = np.zeros(runs, dtype=bool)
        self.too_many_parts = np.zeros(runs, dtype=bool)
        self.metrics = {name: np.full(runs, np.nan) for name in request.metrics}
        self.traces = {name: np.full((request.times.size, runs), np.nan) for name in request.bands}

    def run_all(
        self, batches: Sequence[tuple[Members, Batch]], threads: int | None, effort: Effort = Effort.FULL
    ) -> None:
        """Run batches one after the other, each with the indices of its runs in the ensemble."""
        tasks = [_meter_batch(batch, members, self.request) for members, batch in batches]
        # Several programs are compiled side by side before the first batch runs.
        load_programs((task.batch.program, effort) for task in tasks)
        for task in tasks:
            self._run(task, threads, effort)

    def _run(self, task: "_MeteredBatch", threads: int | None, effort: Effort) -> None:
        """Run a batch and store the results of its runs at their indices in the ensemble."""
        batch = task.batch
        runs_of_batch = task.members.size
        states = np.empty_like(batch.states)
        metrics = {name: np.full(runs_of_batch, np.nan) for name, kind in task.metrics.items() if kind.traced}

        def store(runs: slice, result: BatchResult) -> None:
            states[:, runs] = result.states
            for name, values in task.read(metrics, result.states, runs, result.record).items():
                metrics[name][runs] = values
            for name in self.request.bands:
                trace = result.record[:: task.band_stride, batch.program.traced.index(name)]
                self.traces[name][: len(trace), task.members[runs]] = trace

        if self.request.custom is None:
            run_blocks(batch, store, threads, effort, self._count)
        else:
            # A Python controller has one state: it controls one run after the other.
            for run in range(runs_of_batch):
                column = slice(run, run + 1)
                single = replace(batch, parameters=batch.parameters[:, column], states=batch.states[:, column])
                store(column, run_sampled(single, self.request.custom))
                self._count(1)
        from_meters = [name for name in task.metrics if name not in metrics]
        metrics |= task.read(from_meters, states, slice(None), None)
        members = task.members
        result = group_of("result", task.batch.program.state_rows(), states)
        # As for a single run: valid throughout, and finite at the end. The rows of meters do not matter.
        is_completed = (result.failure_time >= NEVER_FAILED) & np.isfinite(states[: task.physical]).all(axis=0)
        # If the time of failure is unknown, it is the time of the last sample.
        last_sample = task.interval * (task.samples - 1)
        failure_time = np.where(result.failure_time < NEVER_FAILED, result.failure_time, last_sample)
        self.is_completed[members] = is_completed
        self.too_many_parts[members] = result.too_many_parts != 0.0
        self.failure_time[members] = np.where(is_completed, np.nan, failure_time)
        for trace in self.traces.values():
            trace[:, members[~is_completed]] = np.nan
        for name, values in metrics.items():
            self.metrics[name][members] = np.where(is_completed, values, np.nan)


@dataclass(frozen=True, slots=True)
class _MeteredBatch:
    """Batch with meters: indices of its runs in the ensemble, metrics, sample interval [s], number of samples.

    The first ``physical`` rows of its states belong to the physical model, the others to meters. ``band_stride`` is the
    number of recorded rows per time of a trace.
    """

    batch: Batch
    members: Members
    physical: int
    metrics: Mapping[str, MetricKind]
    interval: Floats
    samples: int
    band_stride: int

    def read(self, names: Collection[str], states: Floats, runs: slice, record: Floats | None) -> dict[str, Floats]:
        """Values of some metrics for ``runs``, from final states and recorded traces; arbitrary for failed runs."""
        if not names:
            return {}
        program = self.batch.program
        course = group_of("course", program.state_rows(), states) if program.follows_reference else ()
        traces = {} if record is None else {name: record[:, row] for row, name in enumerate(program.traced)}
        groups = program.state_rows()
        interval = self.interval[runs]
        # The final state of each meter: arrays (runs,) in meter units.
        meters = {kind.name: group_of(group, groups, states) for group, kind in program.meter_groups.items()}
        readings = Readings(meters=meters, course=course, interval=interval, samples=self.samples, traces=traces)
        with np.errstate(all="ignore"):
            values = {name: np.asarray(self.metrics[name].read(readings)) for name in names}
        for name, numbers in values.items():
            if numbers.shape != interval.shape:
                raise KindError(
                    f"metric '{name}': read(readings) must return a number for each run, an array of shape "
                    f"{interval.shape}, not {numbers.shape}"
                )
        return values


def lacking(scenario: Scenario, kind: MetricKind) -> str:
    """Reason why a metric does not apply to a scenario; "" if it applies."""
    if scenario.device.actuator.has_one_chamber and not OF_SECOND_CHAMBER.isdisjoint(kind.channels):
        return f"'{scenario.device.name}' has only one chamber"
    return scenario.motion.motion_kind.lacks(scenario, kind)


def offered(scenario: Scenario) -> dict[str, MetricKind]:
    """Metrics that apply to a scenario, for messages: walk metrics for a walk only, vane metrics for a vane alone."""
    missing: frozenset[str] = frozenset() if scenario.gas_model is not None else WITH_ENERGY_BALANCE
    return {
        name: kind
        for name, kind in METRICS.items()
        if not lacking(scenario, kind) and not missing.intersection(kind.channels)
    }


def _meter_batch(plain: Batch, members: Members, request: OutputRequest) -> _MeteredBatch:
    """Batch with the meters and traces that its metrics and bands need."""
    metrics = {name: kind for name, kind in request.metrics.items() if has_channels(plain.program, kind)}
    # In one order, so that the same metrics are one program in whatever order they are requested.
    meters = sorted({meter.name: meter for kind in metrics.values() for meter in kind.meters}.items())
    read_from_traces = {channel for kind in metrics.values() for channel in kind.traced}
    interval = intervals(plain)
    stride = max(1, round(request.every / float(interval[0]))) if request.bands else 1
    # Runs of one batch may have other steps, but traces are rows of one array.
    if request.bands and np.abs(stride * interval - request.every).max() > _SAME_INTERVAL * request.every:
        found = f"{interval.min():.6g} to {interval.max():.6g} s"
        raise ScenarioError(f"run.output_interval = {found}: all runs need one that divides {request.every:.6g} s")
    # Metrics read from traces need every sample; bands alone need only those at which they are drawn.
    trace_every, band_stride = (1, stride) if read_from_traces else (stride, 1)
    traced = sorted({*read_from_traces, *request.bands})
    # Meters are read at every sample that would have been recorded; none is recorded.
    program = replace(plain.program, meters=tuple(meter for _, meter in meters), traced=tuple(traced))
    trace = trace_every if traced else 0
    clock = replace(plain.clock, record_every=0, measure_every=plain.clock.record_every, trace_every=trace)
    # Meters begin with zeros; their first sample fills them.
    states = np.zeros((len(row_numbers(program.state_rows())), plain.states.shape[1]))
    states[: plain.states.shape[0]] = plain.states
    batch = Batch(program, clock, plain.parameters, states)
    return _MeteredBatch(batch, members, len(plain.states), metrics, interval, plain.clock.samples, band_stride)


def intervals(batch: Batch) -> Floats:
    """Time between two samples [s] of each run of a batch without meters."""
    timing = group_of("timing", batch.program.parameter_rows(), batch.parameters)
    return np.asarray(timing.step * batch.clock.record_every)


@dataclass(frozen=True, slots=True)
class EnsembleResult:
    """Results of the runs of an ensemble, in the order of the columns.

    ``status`` (runs,) is COMPLETED, DIVERGED or REFUSED. ``failure_time`` (runs,) [s] is nan for runs that did not
    diverge. ``reasons`` maps the index of each run that diverged or was refused to a line that says why. ``metrics``
    maps a name to values (runs,) in SI units, nan for failed runs and runs without this metric. ``times`` (times,) [s]
    and ``traces``, channel to values (times, runs), are for the requested channels; nan for failed runs. ``errors``
    maps a metric to its estimated time-stepping error (runs,), if requested: inf if the run with finer steps failed.
    """

    status: NDArray[np.int8]
    failure_time: Floats
    reasons: dict[int, str]
    metrics: dict[str, Floats]
    times: Floats
    traces: dict[str, Floats]
    errors: dict[str, Floats]


def run_ensemble(
    base: Scenario,
    columns: Mapping[str, Floats],
    meters: Sequence[str],
    bands: Sequence[str] = (),
    every: float = 0.0,
    threads: int | None = None,
    gauge: Collection[str] = (),
    errors: bool = False,
    count: Count = report_nothing,
    effort: Effort = Effort.FULL,
) -> EnsembleResult:
    """Run ``base`` once for each row of values; each run gives exactly the same result as alone.

    ``columns`` maps dotted paths, as in overrides (``supply.pressure``, ``valve.area``, ``reference.level``), to values
    in SI units, shape (runs,). Pressures are absolute, except for the paths in ``gauge``, which are relative to the
    atmosphere of each run. ``meters`` names metrics of ``ppafo.metrics``. ``bands`` names channels whose traces are
    kept every ``every`` [s] (default: the output interval) up to the end of the longest run. Raises ScenarioError for
    unknown paths, metrics and channels, and for columns of different lengths; a run whose values are out of range is
    REFUSED and the others continue. Memory grows with the number of runs: use chunks of some ten thousand runs.
    ``errors`` repeats all runs with a sixteenth of the allowed error, which takes four times as long again.
    ``count`` is called in between with the number of runs that have ended since the last call. ``effort`` is the
    optimisation level of a program that is not yet compiled: quick compilation suits some hundred short runs.

    If a Python object controls ``base``, the runs are made one after the other: some 30 ms each.

    Numbers that follow a varied number change with it, as in a file: a gauge pressure with the atmosphere, an initial
    pressure with the supply that it names, the second regulator with the first.
    """
    metrics: dict[str, MetricKind] = {}
    for name in meters:
        kind = metric_kind(name)
        if kind is None:
            raise ScenarioError(f"{base.name}: there is no metric '{name}'{_hint(name, offered(base))}")
        metrics[name] = kind
    for name in bands:
        _check_channel(base, name)
    interval = every or base.run.output_interval
    if not interval > 0.0:
        raise ScenarioError(f"{base.name}: the interval of traces is {interval:g} s; it must be above 0 s")
    checked = check_columns(base, columns, gauge)
    plan = plan_ensemble(checked)
    times: Floats = np.empty(0)
    if bands and plan.batches:
        longest = max(float((intervals(batch) * (batch.clock.samples - 1)).max()) for _, batch in plan.batches)
        times = np.arange(int(longest / interval * (1.0 + _ROUNDING)) + 1, dtype=np.float64) * interval
    request = OutputRequest(metrics, tuple(dict.fromkeys(bands)), interval, times, base.controller.custom)
    # The runs with finer steps take most of the time.
    runs = MeteredRuns(checked.runs, request, report_nothing if errors else count)
    runs.run_all(plan.batches, threads, effort)
    estimated = {}
    if errors:
        # For the metrics alone: nobody asks for the error of a trace.
        metrics_alone = OutputRequest(metrics, (), interval, np.empty(0), base.controller.custom)
        fine = MeteredRuns(checked.runs, metrics_alone, count)
        fine.run_all(plan_ensemble(checked, finer).batches, threads, effort)
        for name, values in runs.metrics.items():
            # Where the finer run has no value this one may be wrong by anything; without a value it has no error.
            changes = np.where(np.isfinite(fine.metrics[name]), np.abs(fine.metrics[name] - values), np.inf)
            estimated[name] = np.where(np.isfinite(values), MARGIN * changes, np.nan)
    status = np.where(runs.is_completed, COMPLETED, DIVERGED).astype(np.int8)
    # Runs that were refused are in no batch, so that until here they count as diverged.
    status[list(plan.reasons)] = REFUSED
    reasons = dict(plan.reasons)
    for run in np.flatnonzero(status == DIVERGED).tolist():
        remedy = TOO_MANY_PARTS if runs.too_many_parts[run] else REMEDY
        reasons[run] = f"diverged at t = {runs.failure_time[run]:.6g} s; {remedy}"
    return EnsembleResult(
        status=status,
        failure_time=runs.failure_time,
        reasons=dict(sorted(reasons.items())),
        metrics=runs.metrics,
        times=times,
        traces=runs.traces,
        errors=estimated,
    )


def _check_channel(base: Scenario, name: str) -> None:
    if name not in TRACED:
        raise ScenarioError(f"{base.name}: the channel '{name}' cannot be traced{_hint(name, TRACED)}")
    controlled = next((kind.name for kind in CONTROLLED.values() if kind.reference == name), base.controlled)
    if controlled != base.controlled:
        raise ScenarioError(f"{base.name}: '{name}' cannot be traced: reference.of = '{base.controlled}'")
    if name == CONTROLLED[controlled].reference and base.controller.is_open_loop:
        raise ScenarioError(f"{base.name}: '{name}' cannot be traced: a constant command has no reference")
    if name in OF_SECOND_CHAMBER and base.device.actuator.has_one_chamber:
        raise ScenarioError(f"{base.name}: '{name}' cannot be traced: {base.device.name} has only one chamber")
    if name.startswith("temperature_") and base.gas_model is None:
        raise ScenarioError(f"{base.name}: '{name}' needs an energy balance: gas_model.kind = 'thermal'")


def _hint(name: str, known: Mapping[str, object]) -> str:
    return nearest_name(name, known) or f"; available: {', '.join(known)}"
