"""Ensemble runs of a scenario or model over columns of values, with metrics accumulated in one table."""

import math
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import Count
from ppafo.errors import ScenarioError, StudyError
from ppafo.metrics import metric_kind
from ppafo.metrics.settled import MOST_REVERSALS, VERDICT_METRICS
from ppafo.metrics.tracking import ONE_INSTANT
from ppafo.progress import Progress, Report, report_nothing
from ppafo.simulation.clock import TIMES
from ppafo.simulation.ensemble import COMPLETED, run_ensemble
from ppafo.simulation.ensemble.columns import absolute
from ppafo.simulation.ensemble.running import lacking
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking import most_reversals
from ppafo.simulation.tracking.rule import TrackingExcess, command_turning, needed_metrics, tracking_excess
from ppafo.simulation.tracking.settled import smallest_change
from ppafo.studies.distributions import Floats
from ppafo.studies.limits import check_metrics
from ppafo.study.blocks import runs_at_once
from ppafo.study.executing import computed_by

Rows = dict[str, NDArray[Any]]
"""Columns of one length: metrics by name [SI], nan if a run lacks the metric; and ``failed``, True for a failed run."""
Evaluation = Callable[[Mapping[str, Floats]], tuple[Rows, str]]
"""Function from columns of varied values to rows of metrics, and the reason why the first run failed ("" if none)."""
_BLOCKS, _FEWEST_OF_BLOCK = 64, 256
"""Number of blocks in which runs are submitted to an executor, and smallest number of runs of a block."""
FAILED = "failed"
_AT_ONCE, _SLOW_AT_ONCE = 16_384, 32
"""Largest number of runs between two progress reports: in general, and with a Python controller."""
_FIRST_AT_ONCE, _BETWEEN_REPORTS = 1024, 3.0
"""Largest number of runs of the first part, and target time of later parts [s]."""
_BETWEEN_COUNTS = 1.0
"""Smallest time between two reports of the runs that ended within a part [s]."""


@final
class RunCounter:
    """Counter of runs for progress reports, starting from ``done``; the total ``runs`` doubles if exceeded."""

    def __init__(self, runs: int, progress: Report | None, done: int = 0, failed: int = 0) -> None:
        self._total, self._report, self._started = max(1, runs), progress, 0.0
        self.done, self.failed, self._earlier = done, failed, 0
        self._ended, self._reported = 0, 0.0

    def add(self, runs: int, failed: int) -> None:
        """Count finished runs; the reported rate excludes the first batch, whose time may include compilation."""
        self.done += runs
        self.failed += failed
        # Those that the next part has ended meanwhile stay counted.
        self._ended = max(0, self._ended - runs)
        done, self._reported = self.done + self._ended, time.monotonic()
        if not self._earlier:
            self._earlier, self._started = done, self._reported
        # A search does not know how many runs it will take: a total that follows would always say 'nearly done'.
        while self._total < done:
            self._total *= 2
        if self._report is not None:
            elapsed = self._reported - self._started
            self._report(Progress("", done, self._total, self.failed, self._earlier, elapsed))

    def count_ended(self, runs: int) -> None:
        """Count runs that have ended in a part that ``add`` will count as a whole; report at most every second."""
        self._ended += runs
        if self._ended and time.monotonic() - self._reported >= _BETWEEN_COUNTS:
            self.add(0, 0)


@final
class Runs:
    """Runs of one scenario or model: ``run(columns)`` returns their rows.

    ``evaluate`` computes the rows of at most ``at_once`` runs, here or on the workers of an ``executor``. ``count`` is
    the number of finished runs, ``failures`` the number of runs that diverged or were refused; ``reason`` says why the
    first of these failed.
    """

    def __init__(
        self,
        evaluate: Evaluation,
        metrics: Sequence[str],
        counter: RunCounter,
        at_once: int,
        executor: Executor | None = None,
    ) -> None:
        self.metrics = tuple(metrics)
        self.count, self.failures, self.reason = 0, 0, ""
        self._evaluate, self._counter, self._at_once, self._executor = evaluate, counter, at_once, executor

    def run(self, columns: Mapping[str, Floats]) -> Rows:
        """Run the model with values [SI] by path, each column (runs,), and return the rows of metrics."""
        if not self._counter.done:
            # A model may be compiled before the first run ends.
            self._counter.add(0, 0)
        runs, parts = len(next(iter(columns.values()))), dict[int, tuple[Rows, str]]()
        for number, part in self._parts(columns, runs):
            parts[number] = part
            count, failures = part[0][FAILED].size, int(part[0][FAILED].sum())
            self.count += count
            self.failures += failures
            self._counter.add(count, failures)
        found = [parts[number] for number in sorted(parts)]
        self.reason = self.reason or next((reason for _, reason in found if reason), "")
        return joined([rows for rows, _ in found])

    def _parts(self, columns: Mapping[str, Floats], runs: int) -> Iterator[tuple[int, tuple[Rows, str]]]:
        """Yield the results of parts of the runs, each with a number by which they are in order."""
        if self._executor is not None:
            size = min(self._at_once, max(_FEWEST_OF_BLOCK, math.ceil(runs / _BLOCKS)))
            blocks = [
                {path: values[first : first + size] for path, values in columns.items()}
                for first in range(0, runs, size)
            ]
            yield from computed_by(self._executor, self._evaluate, blocks)
            return
        first, size = 0, min(self._at_once, _FIRST_AT_ONCE)
        while first < runs:
            started = time.monotonic()
            yield first, self._evaluate({path: values[first : first + size] for path, values in columns.items()})
            # Numbers that follow the varied ones may take longer than the runs, which no estimate knows.
            first, rate = first + size, size / max(time.monotonic() - started, 1.0e-6)
            size = max(1, min(self._at_once, int(_BETWEEN_REPORTS * rate)))

    def check(self, rows: Rows, maximum_failed: float, subject: str, metrics: Sequence[str] = ()) -> None:
        """Raise StudyError if more than the fraction ``maximum_failed`` of the rows failed or lacks one of the metrics.

        Statistics of the remaining runs would be biased. ``subject`` names the rows in the message.
        """
        failures, runs = int(rows[FAILED].sum()), rows[FAILED].size
        if failures > maximum_failed * runs:
            raise StudyError(
                f"{subject}: {failures:,} of {runs:,} runs failed ({100.0 * failures / runs:.3g} %), more than the "
                f"{100.0 * maximum_failed:.3g} % allowed; the first: {self.reason}"
            )
        for name in metrics:
            missing = int(np.count_nonzero(~np.isfinite(rows[name])))
            if missing > maximum_failed * runs:
                raise StudyError(f"{subject}: {missing:,} of {runs:,} runs have no '{name}'; choose another metric")


def scenario_runs(
    scenario: Scenario,
    metrics: Sequence[str],
    counter: RunCounter,
    gauge: Collection[str] = (),
    threads: int | None = None,
    executor: Executor | None = None,
) -> Runs:
    """Return the runs of a scenario; StudyError for a metric that does not exist or that the scenario cannot have.

    Paths in ``gauge`` hold gauge pressures relative to the atmosphere of each run.
    """
    check_metrics([name for name in metrics if name not in VERDICT_METRICS], scenario)

    evaluate = partial(_rows_of, scenario, tuple(metrics), frozenset(gauge))
    if executor is None:
        evaluate = partial(evaluate, threads, count=counter.count_ended)
    else:
        evaluate = partial(evaluate, threads or 1)
    is_slow = scenario.controller.custom is not None
    at_once = _SLOW_AT_ONCE if is_slow else runs_at_once(scenario, _AT_ONCE)
    return Runs(evaluate, metrics, counter, at_once, executor)


def _rows_of(
    scenario: Scenario,
    metrics: Sequence[str],
    gauge: Collection[str],
    threads: int | None,
    columns: Mapping[str, Floats],
    count: Count = report_nothing,
) -> tuple[Rows, str]:
    """Return the rows of runs of a scenario, and the reason why the first run failed."""
    try:
        result = run_ensemble(scenario, columns, metrics, threads=threads, gauge=gauge, count=count)
    except ScenarioError as error:  # its message names the scenario
        raise StudyError(str(error)) from error
    unknown = np.full(result.status.size, np.nan)
    values: Rows = {name: result.metrics.get(name, unknown) for name in metrics}
    reason = result.reasons[min(result.reasons)] if result.reasons else ""
    return {**values, FAILED: result.status != COMPLETED}, reason


def unvaried(scenario: Scenario, runs: int) -> dict[str, Floats]:
    """Return columns that leave a scenario unchanged, because an ensemble needs at least one column."""
    return {"supply.pressure": np.full(runs, scenario.device.supply.pressure)}


def joined(parts: Sequence[Rows]) -> Rows:
    """Concatenate tables of rows in order."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def with_companions(metrics: Sequence[str], scenario: Scenario) -> tuple[str, ...]:
    """Return the metric names, extended by the metrics that decide whether the scenario follows its reference."""
    offered = (name for name in needed_metrics(scenario) if (kind := metric_kind(name)) and not lacking(scenario, kind))
    return tuple(dict.fromkeys((*metrics, *offered)))


def excess(
    rows: Mapping[str, Floats], scenario: Scenario, columns: Mapping[str, Floats], gauge: Collection[str] = ()
) -> TrackingExcess:
    """Return the tracking criteria of each run, divided by their limits (runs,).

    ``columns`` are the values of the runs by path; paths in ``gauge`` hold gauge pressures.
    """
    if not set(needed_metrics(scenario)) & set(rows):
        unknown = np.full(next(iter(rows.values())).size, np.nan)
        return TrackingExcess(unknown, unknown, np.zeros_like(unknown), unknown > 0.0)
    varied = {path: column for path, column in absolute(scenario, columns, gauge).items() if path not in TIMES}
    least = smallest_change(scenario) if scenario.follows_reference else 0.0
    return tracking_excess(with_numbers(scenario, varied), rows, most_reversals(scenario), least)


def tracking_violation(
    rows: Mapping[str, Floats], scenario: Scenario, columns: Mapping[str, Floats], gauge: Collection[str] = ()
) -> Floats:
    """Return the relative excess of each run over the tracking limits (runs,); 0 if it follows or is unknown.

    A run whose reference is beyond reach on purpose counts as one that follows.
    """
    found = excess(rows, scenario, columns, gauge)
    return np.where(found.excused, 0.0, np.fmax(found.largest - 1.0, 0.0))


def oscillating(rows: Mapping[str, Floats], scenario: Scenario) -> NDArray[np.bool_]:
    """Return flags of oscillating loops (runs,), by the reversals of the command; False for unknown reversals."""
    return np.asarray(command_turning(scenario, rows, most_reversals(scenario)) > 1.0)


def settled(rows: Rows, metric: str) -> Floats:
    """Return a metric for evaluation; in sustained oscillation, a final error becomes the RMS error, if larger."""
    if metric not in ONE_INSTANT or "settled_turns" not in rows:
        return rows[metric]
    swings = (rows["settled_turns"] > MOST_REVERSALS) & (rows["settled_error"] > rows[metric])
    return np.where(swings, rows["settled_error"], rows[metric])
