"""Execution of the batches of an ensemble, with metrics read from meters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from ppafo.control.kind import PythonController
from ppafo.engine.compilers import Effort
from ppafo.engine.lanes import Batch, BatchResult, Count, Floats, load_programs, run_blocks
from ppafo.engine.metering import add_meters, meters_of
from ppafo.engine.rows import group_of
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
        batch, members = task.batch, task.members
        states = np.empty_like(batch.states)
        read_from_traces = {name: np.full(members.size, np.nan) for name, kind in task.metrics.items() if kind.traced}

        def store(runs: slice, result: BatchResult) -> None:
            states[:, runs] = result.states
            for name, values in read_from_traces.items():
                values[runs] = _read(task, name, task.readings(states[:, runs], runs, result.record))
            for name in self.request.bands:
                trace = result.record[:: task.band_stride, batch.program.traced.index(name)]
                self.traces[name][: len(trace), members[runs]] = trace

        if self.request.custom is None:
            run_blocks(batch, store, threads, count=self._count)
        else:
            # An object has one state, so that it cannot be in charge of two runs at a time.
            for run in range(members.size):
                column = slice(run, run + 1)
                single = Batch(batch.program, batch.clock, batch.parameters[:, column], batch.states[:, column])
                store(column, run_sampled(single, self.request.custom))
                self._count(1)
        # By the rule for a single run: valid throughout, and finite at the end. Meters stand below the rows of a plain
        # batch, and what they come to says nothing about the run.
        result = group_of("result", batch.program.state_rows(), states)
        completed = (result.failure_time >= NEVER_FAILED) & np.isfinite(states[: task.physical]).all(axis=0)
        self.is_completed[members] = completed
        self.too_many_parts[members] = result.too_many_parts != 0.0
        # Without a time of failure the last sample is the best that is known.
        end = task.interval * (task.samples - 1)
        time = np.where(result.failure_time < NEVER_FAILED, result.failure_time, end)
        self.failure_time[members] = np.where(completed, np.nan, time)
        for trace in self.traces.values():
            trace[:, members[~completed]] = np.nan
        readings = task.readings(states, slice(None), None)
        for name in task.metrics:
            values = read_from_traces[name] if name in read_from_traces else _read(task, name, readings)
            self.metrics[name][members] = np.where(completed, values, np.nan)


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

    def readings(self, states: Floats, runs: slice, record: Floats | None) -> Readings:
        """Meter readings of runs, from their final states and recorded traces."""
        program = self.batch.program
        groups = program.state_rows()
        traces = {} if record is None else {name: record[:, row] for row, name in enumerate(program.traced)}
        return Readings(
            meters=meters_of(program, states),
            course=group_of("course", groups, states) if program.follows_reference else (),
            interval=self.interval[runs],
            samples=self.samples,
            traces=traces,
        )


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
    program = plain.program
    available = {name: kind for name, kind in request.metrics.items() if has_channels(program, kind)}
    # In one order, so that the same metrics are one program in whatever order they are requested.
    meters = sorted({meter.name: meter for kind in available.values() for meter in kind.meters}.items())
    read_from_traces = dict.fromkeys(channel for kind in available.values() for channel in kind.traced)
    interval = intervals(plain)
    stride = max(1, round(request.every / float(interval[0]))) if request.bands else 1
    # Runs of one batch may have other steps, but traces are rows of one array.
    if request.bands and np.abs(stride * interval - request.every).max() > _SAME_INTERVAL * request.every:
        raise ScenarioError(
            f"traces every {request.every:.6g} s need one run.output_interval for all runs, a divisor of "
            f"{request.every:.6g} s, not {interval.min():.6g} to {interval.max():.6g} s; change run.output_interval"
        )
    traced = sorted({*read_from_traces, *request.bands})
    # Bands alone need the samples at which they are shown, metrics of traces every one.
    trace_every = 1 if read_from_traces else stride
    batch = add_meters(plain, [meter for _, meter in meters], traced, trace_every if traced else 0)
    band_stride = stride if read_from_traces else 1
    return _MeteredBatch(batch, members, len(plain.states), available, interval, plain.clock.samples, band_stride)


def intervals(batch: Batch) -> Floats:
    """Time between two samples [s] of each run of a batch without meters."""
    timing = group_of("timing", batch.program.parameter_rows(), batch.parameters)
    return np.asarray(timing.step * batch.clock.record_every)


def _read(task: _MeteredBatch, name: str, readings: Readings) -> Floats:
    """Values of a metric; arbitrary for failed runs."""
    with np.errstate(all="ignore"):
        return np.asarray(task.metrics[name].read(readings))
