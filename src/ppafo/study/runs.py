"""Ensemble runs of a scenario or model over columns of values, with metrics accumulated in one table."""

import math
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import ScenarioError, StudyError
from ppafo.metrics import metric_kind
from ppafo.metrics.settled import MOST_REVERSALS
from ppafo.metrics.tracking import ONE_INSTANT
from ppafo.progress import Progress, Report
from ppafo.simulation.ensemble import COMPLETED, lacking, run_ensemble
from ppafo.simulation.ensemble.planning import absolute
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.rule import (
    ON_PURPOSE,
    TrackingExcess,
    needed_metrics,
    tracking_excess,
)
from ppafo.studies.distributions import Floats
from ppafo.studies.limits import check_metrics
from ppafo.study.blocks import runs_at_once
from ppafo.study.executing import computed_by

Rows = dict[str, NDArray[Any]]
"""Columns of one length, as ``run_judged`` returns them."""
Evaluation = Callable[[Mapping[str, Floats]], Rows]
"""Function from columns of varied values to rows."""
# Number of blocks in which runs are submitted to an executor, and smallest number of runs of a block.
_BLOCKS = 64
_FEWEST_OF_BLOCK = 256
# Name of the column of failed runs, and suffix of the name of a column with a trace.
FAILED = "failed"
OVER_TIME = "_over_time"
# Names of the columns of the verdict on a run beside ``ON_PURPOSE``: the loop oscillates; it follows its reference.
OSCILLATES = "oscillates"
FOLLOWS = "follows"
# Largest number of runs between two progress reports: in general, and with a Python controller.
_AT_ONCE = 16_384
_SLOW_AT_ONCE = 32
# Largest number of runs of the first part, and target time of later parts [s].
_FIRST_AT_ONCE = 1024
_BETWEEN_REPORTS = 3.0
_BETWEEN_COUNTS = 1.0
"""Smallest time between two reports of the runs that ended within a part [s]."""


@final
class RunCounter:
    """Counter of runs for progress reports, starting from ``done``; the total ``runs`` doubles if exceeded."""

    def __init__(self, runs: int, progress: Report | None, done: int = 0, failed: int = 0) -> None:
        self._total = max(1, runs)
        self._report = progress
        self._started = 0.0
        self.done = done
        self.failed = failed
        self._earlier = 0
        self._ended = 0
        self._reported = 0.0

    def add(self, runs: int, failed: int) -> None:
        """Count finished runs; the reported rate excludes the first batch, whose time may include compilation."""
        self.done += runs
        self.failed += failed
        # Those that the next part has ended meanwhile stay counted.
        self._ended = max(0, self._ended - runs)
        done = self.done + self._ended
        self._reported = time.monotonic()
        if not self._earlier:
            self._earlier = done
            self._started = self._reported
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
        self, evaluate: Evaluation, counter: RunCounter, at_once: int, executor: Executor | None = None
    ) -> None:
        self.count = 0
        self.failures = 0
        self.reason = ""
        self._evaluate = evaluate
        self._counter = counter
        self._at_once = at_once
        self._executor = executor

    def run(self, columns: Mapping[str, Floats]) -> Rows:
        """Run the model with values [SI] by path, each column (runs,), and return its rows."""
        if not self._counter.done:
            # A model may be compiled before the first run ends.
            self._counter.add(0, 0)
        parts = {}
        for number, part in self._parts(columns, len(next(iter(columns.values())))):
            parts[number] = part
            count = part[FAILED].size
            failures = int(part[FAILED].sum())
            self.count += count
            self.failures += failures
            self._counter.add(count, failures)
        rows = joined([parts[number] for number in sorted(parts)])
        self.reason = self.reason or next(filter(None, rows["reason"].tolist()), "")
        return rows

    def _parts(self, columns: Mapping[str, Floats], runs: int) -> Iterator[tuple[int, Rows]]:
        """Yield the rows of parts of the runs, each with a number by which they are in order."""

        def part(first: int, size: int) -> dict[str, Floats]:
            return {path: values[first : first + size] for path, values in columns.items()}

        if self._executor is not None:
            size = min(self._at_once, max(_FEWEST_OF_BLOCK, math.ceil(runs / _BLOCKS)))
            blocks = [part(first, size) for first in range(0, runs, size)]
            yield from computed_by(self._executor, self._evaluate, blocks)
            return
        first = 0
        size = min(self._at_once, _FIRST_AT_ONCE)
        while first < runs:
            started = time.monotonic()
            yield first, self._evaluate(part(first, size))
            # Numbers that follow the varied ones may take longer than the runs, which no estimate knows.
            first = first + size
            rate = size / max(time.monotonic() - started, 1.0e-6)
            size = max(1, min(self._at_once, int(_BETWEEN_REPORTS * rate)))

    def check(self, rows: Rows, maximum_failed: float, subject: str, metrics: Sequence[str] = ()) -> None:
        """Raise StudyError if more than the fraction ``maximum_failed`` of the rows failed or lacks one of the metrics.

        Statistics of the remaining runs would be biased. ``subject`` names the rows in the message.
        """
        failures = int(rows[FAILED].sum())
        runs = rows[FAILED].size
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
    """Return the runs of a scenario, judged; StudyError for a metric that does not exist or that it cannot have.

    Paths in ``gauge`` hold gauge pressures relative to the atmosphere of each run.
    """
    check_metrics(metrics, scenario)
    judged = partial(run_judged, scenario, tuple(metrics), frozenset(gauge))
    evaluate = (
        partial(judged, threads, count=counter.count_ended) if executor is None else partial(judged, threads or 1)
    )
    is_slow = scenario.controller.custom is not None
    at_once = _SLOW_AT_ONCE if is_slow else runs_at_once(scenario, _AT_ONCE)
    return Runs(evaluate, counter, at_once, executor)


def run_judged(
    scenario: Scenario,
    metrics: Sequence[str],
    gauge: Collection[str],
    threads: int | None,
    columns: Mapping[str, Floats],
    **more: Any,
) -> Rows:
    """Run a scenario with values [SI] by path, and return metrics, end and verdict of each run.

    Paths in ``gauge`` hold gauge pressures; ``more`` are further arguments of ``run_ensemble``. Columns are the metrics
    [SI], nan if a run lacks one, those of ``verdicts``, and:

    - ``failed``, ``status``, ``failure_time``, ``reason``: as in ``EnsembleResult``, the reason None for a good run
    - ``unusable``: True for a run that failed, or whose command turns too often
    - ``judged_NAME``: metric to judge by; of a loop that swings, an error at the end is the RMS error, if larger
    - ``NAME_error``, ``NAME_over_time``: requested errors of metrics, and traces of channels (runs, samples)
    """
    needed = [name for name in needed_metrics(scenario) if (kind := metric_kind(name)) and not lacking(scenario, kind)]
    try:
        result = run_ensemble(
            scenario, columns, tuple(dict.fromkeys((*metrics, *needed))), threads=threads, gauge=gauge, **more
        )
    except ScenarioError as error:  # its message names the scenario
        raise StudyError(str(error)) from error
    failed = result.status != COMPLETED
    found = result.metrics
    judged = verdicts(found, scenario, columns, gauge)
    return {
        **{name: found[name] for name in metrics},
        **{f"judged_{name}": settled(found, name) for name in metrics},
        **{f"{name}_error": error for name, error in result.errors.items() if name in metrics},
        **{f"{name}{OVER_TIME}": trace.T for name, trace in result.traces.items()},
        **judged,
        FAILED: failed,
        "unusable": failed | judged["turning"],
        "status": result.status,
        "failure_time": result.failure_time,
        "reason": np.array([result.reasons.get(run) for run in range(failed.size)], dtype=object),
    }


def joined(parts: Sequence[Rows]) -> Rows:
    """Concatenate tables of rows in order."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def verdicts(
    metrics: Mapping[str, Floats], scenario: Scenario, columns: Mapping[str, Floats], gauge: Collection[str] = ()
) -> Rows:
    """Return the verdict on each run (runs,), given by its metrics and by its values by path.

    - ``excess``: largest tracking number over its limit [-]: up to 1 the run follows its reference; nan if unknown
    - ``off``: excess above 1; 0 if unknown or on purpose
    - ``follows``, ``oscillates``: 1 or 0, nan if unknown
    - ``beyond_reach_on_purpose``: True for a run that does not follow for that reason alone
    - ``turning``: True where the command alone turns too often
    - ``beyond_reach``: requested torque that the actuator cannot give [N m]
    """
    if set(needed_metrics(scenario)) & set(metrics):
        found = tracking_excess(scenario, absolute(scenario, columns, gauge), metrics)
    else:
        unknown = np.full(len(next(iter(columns.values()))), np.nan)
        found = TrackingExcess(unknown, unknown, np.zeros_like(unknown), unknown > 0.0, unknown > 0.0)
    return {
        "excess": found.largest,
        # No controller can do better than a run whose reference is beyond reach on purpose.
        "off": np.where(found.on_purpose, 0.0, np.fmax(found.largest - 1.0, 0.0)),
        FOLLOWS: found.follows,
        OSCILLATES: found.oscillates,
        ON_PURPOSE: found.on_purpose,
        "turning": found.turns_often,
        "beyond_reach": found.beyond_reach,
    }


@dataclass(frozen=True, slots=True)
class TrackingCounts:
    """Numbers of completed ``runs`` by the state of their tracking; those without a verdict apart."""

    runs: int
    follow: int
    do_not_follow: int
    beyond_reach_on_purpose: int
    without_verdict: int

    @property
    def sentence(self) -> str:
        """Counts in words."""
        unknown = f"; without a verdict: {self.without_verdict:,}" if self.without_verdict > 0 else ""
        return (
            f"the reference is followed in {self.follow:,} of {self.runs:,} runs, not in {self.do_not_follow:,}; "
            f"beyond reach on purpose: {self.beyond_reach_on_purpose:,}{unknown}"
        )


def tracking_counts(rows: Mapping[str, Floats], completed: int) -> TrackingCounts:
    """Return the counts of ``completed`` runs by their columns ``follows`` and ``beyond_reach_on_purpose``."""
    follow, missed = (int(np.count_nonzero(rows[FOLLOWS] == truth)) for truth in (1.0, 0.0))
    on_purpose = int(np.count_nonzero(rows[ON_PURPOSE]))
    return TrackingCounts(completed, follow, missed - on_purpose, on_purpose, completed - follow - missed)


def settled(rows: Mapping[str, Floats], metric: str) -> Floats:
    """Return a metric for evaluation; in sustained oscillation, a final error becomes the RMS error, if larger."""
    if metric not in ONE_INSTANT or "settled_turns" not in rows:
        return rows[metric]
    swings = (rows["settled_turns"] > MOST_REVERSALS) & (rows["settled_error"] > rows[metric])
    return np.where(swings, rows["settled_error"], rows[metric])
