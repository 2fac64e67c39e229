"""Execution of the batches of an ensemble, with metrics read from meters."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from ppafo.control.kind import PythonController
from ppafo.engine.compilers import Effort
from ppafo.engine.lanes import Batch, BatchResult, Count, Floats, load_programs, run_blocks
from ppafo.engine.rows import group_of, row_numbers
from ppafo.engine.run import NEVER_FAILED, Members
from ppafo.errors import ScenarioError
from ppafo.metrics import METRICS, has_channels
from ppafo.metrics.gas import WITH_ENERGY_BALANCE
from ppafo.metrics.metric import MetricKind, Readings
from ppafo.progress import report_nothing
from ppafo.signals.recording import OF_SECOND_CHAMBER
from ppafo.simulation.python_controller import run_sampled
from ppafo.simulation.scenario import Scenario

_SAME_INTERVAL = 1.0e-6
"""Relative difference up to which two intervals count as the same [-]."""


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
        self.request, self._count = request, count
        self.failure_time = np.full(runs, np.nan)
        self.is_completed = np.zeros(runs, dtype=bool)
        self.too_many_parts = np.zeros(runs, dtype=bool)
        self.metrics = {name: np.full(runs, np.nan) for name in request.metrics}
        self.traces = {name: np.full((request.times.size, runs), np.nan) for name in request.bands}

    def run_all(self, batches: Sequence[tuple[Members, Batch]], threads: int | None) -> None:
        """Run batches one after the other, each with the indices of its runs in the ensemble."""
        tasks = [_meter_batch(batch, members, self.request) for members, batch in batches]
        # Several programs are compiled side by side before the first batch runs.
        load_programs((task.batch.program, Effort.FULL) for task in tasks)
        for task in tasks:
            self._run(task, threads)

    def _run(self, task: "_MeteredBatch", threads: int | None) -> None:
        """Run a batch and store the results of its runs at their indices in the ensemble."""
        batch, runs_of_batch = task.batch, task.members.size
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
            run_blocks(batch, store, threads, count=self._count)
        else:
            # A Python controller has one state: it controls one run after the other.
            for run in range(runs_of_batch):
                column = slice(run, run + 1)
                single = replace(batch, parameters=batch.parameters[:, column], states=batch.states[:, column])
                store(column, run_sampled(single, self.request.custom))
                self._count(1)
        from_meters = [name for name in task.metrics if name not in metrics]
        metrics |= task.read(from_meters, states, slice(None), None)
        members, result = task.members, group_of("result", task.batch.program.state_rows(), states)
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
        groups, interval = program.state_rows(), self.interval[runs]
        # The final state of each meter: arrays (runs,) in meter units.
        meters = {kind.name: group_of(group, groups, states) for group, kind in program.meter_groups.items()}
        readings = Readings(meters=meters, course=course, interval=interval, samples=self.samples, traces=traces)
        with np.errstate(all="ignore"):
            return {name: np.asarray(self.metrics[name].read(readings)) for name in names}


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
