"""Draws completions of the experiments, runs each with both valves, and weighs them by what the paper reports.

A quarter is spread evenly, the rest comes from a mixture found beforehand (``proposal``). Every completion is weighed
as if all had been drawn from both together, so that the mixture decides how many count and not what they say
(deterministic mixture; Owen and Zhou, J. Am. Stat. Assoc. 95 (2000) 135). The draws are shared out to replicates, and
the spread between these is the error.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import ScenarioError
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.unreported.answer import REPLICATES, Family
from ppafo.questions.unreported.proposal import shipped_proposal
from ppafo.questions.unreported.settings import (
    FALL,
    METRICS,
    PLATEAU,
    PROPORTIONAL,
    RISE,
    SOLENOID,
    STEP,
    STEP_RUN,
    TEXT_OF_SOLENOID,
    TEXT_OF_STEP,
    Draws,
    Floats,
    agreement_with,
    columns,
    spread,
    step_columns,
    step_observables,
    values_of,
)
from ppafo.simulation.ensemble import COMPLETED, run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.studies.draws import replicate_seed

CHUNK = 32_768
EVEN = 0.25
"""Fraction of the draws that is spread evenly."""
FEWEST, MOST = 1_000, 20_000_000


def infer_settings(draws: int = 262_144, seed: int = 2011, progress: Report | None = None) -> Family:
    """Return completions of the paper's torque task, each run with both valves, weighed by what the paper reports.

    A quarter is spread evenly, the others are drawn where completions are likely to agree. ``seed`` is the random
    seed. The arrays of the result have shape (completions,): settings in the units of ``settings.SETTINGS``, metrics
    in SI, weights [-] that add up to 1. ScenarioError for fewer than 1000 draws or more than 20 million.
    """
    if not FEWEST <= draws <= MOST:
        raise ScenarioError(f"draws = {draws}: must be from {FEWEST} to {MOST}")
    report, started = progress or report_nothing, time.monotonic()
    proposal, each = shipped_proposal(), draws // REPLICATES
    even = int(EVEN * each)
    seeds = [replicate_seed(seed, number) for number in range(REPLICATES)]
    evenly = np.concatenate([spread(even, own) for own in seeds])
    near = np.concatenate([proposal.draw(each - even, np.random.default_rng(own)) for own in seeds])
    parts, done = [], 0
    for points, all_of_it in ((evenly, True), (near, False)):
        for first in range(0, len(points), CHUNK):
            chunk = points[first : first + CHUNK]
            parts.append(run_completions(chunk, all_of_it))
            done += len(chunk)
            report(Progress("", done, draws, elapsed=time.monotonic() - started, noun="completions"))
    ran, points = _join(parts), np.concatenate([evenly, near])
    kept = np.flatnonzero(ran.completed)
    replicate = np.concatenate([np.repeat(np.arange(REPLICATES), count) for count in (even, each - even)])
    return Family(
        values_of(points[kept]),
        ran.part(ran.completed).metrics,
        (even + (each - even) * proposal.density(points[kept])) / each,
        replicate[kept],
        int(np.count_nonzero(kept < len(evenly))),
        len(points),
        seed,
    )


@dataclass(frozen=True, slots=True)
class Ran:
    """What came of completions: metrics by experiment and name, and which completed all of them; each (draws,)."""

    metrics: dict[str, dict[str, Floats]]
    completed: NDArray[np.bool_]

    def part(self, rows: NDArray[np.bool_]) -> "Ran":
        """Return some of them."""
        metrics = {valve: {name: item[rows] for name, item in of.items()} for valve, of in self.metrics.items()}
        return Ran(metrics, self.completed[rows])


def _join(parts: Sequence[Ran]) -> Ran:
    metrics = {
        valve: {name: np.concatenate([part.metrics[valve][name] for part in parts]) for name in of}
        for valve, of in parts[0].metrics.items()
    }
    return Ran(metrics, np.concatenate([part.completed for part in parts]))


NEGLIGIBLE = 1.0e-6
"""What agrees less than this with the text (1 is in full) counts for nothing, and its other experiments are not run."""


def run_completions(points: Floats, all_of_it: bool) -> Ran:
    """Run completions: the cheapest experiment first, the next where the text leaves it any weight.

    ``all_of_it`` runs every experiment of all.
    """
    draws, counts = values_of(points), np.ones(len(points), dtype=bool)
    metrics = {STEP: step_metrics(step_columns(draws))}
    if not all_of_it:
        counts &= agreement_with(TEXT_OF_STEP, metrics) > NEGLIGIBLE
    for valve in (SOLENOID, PROPORTIONAL):
        metrics[valve], completed = _task_metrics(draws, valve, counts)
        counts &= completed
        if valve == SOLENOID and not all_of_it:
            counts &= agreement_with(TEXT_OF_SOLENOID, metrics) > NEGLIGIBLE
    return Ran(metrics, counts)


def _task_metrics(draws: Draws, valve: str, chosen: NDArray[np.bool_]) -> tuple[dict[str, Floats], NDArray[np.bool_]]:
    """Return metrics of the torque task with a valve, nan where a completion is not chosen, and which completed it."""
    metrics = {name: np.full(chosen.size, np.nan) for name in METRICS}
    completed = np.zeros(chosen.size, dtype=bool)
    if chosen.any():
        varied = columns({name: values[chosen] for name, values in draws.items()}, valve)
        result = run_ensemble(load_scenario(f"torque-task-{valve}"), varied, METRICS)
        completed[chosen] = result.status == COMPLETED
        for name, values in metrics.items():
            values[chosen] = result.metrics[name]
    return metrics, completed


STEP_METRICS = (PLATEAU, FALL, RISE)
STEP_CHUNK = 4096
"""Step responses whose traces are kept at once."""


def step_metrics(varied: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return what step responses show of the text of figure 7 [ms], [psi], by name (runs,), from columns in SI."""
    base = load_scenario("step-response", STEP_RUN)
    supply = base.device.supply
    count = next(iter(varied.values())).size
    parts = []
    for first in range(0, count, STEP_CHUNK):
        part = {path: values[first : first + STEP_CHUNK] for path, values in varied.items()}
        result = run_ensemble(base, part, (), ("angle", "pressure_1", "pressure_2"))
        parts.append(step_observables(result.times, result.traces, supply.pressure, supply.atmospheric_pressure))
    return {name: np.concatenate([np.empty(0), *(part[name] for part in parts)]) for name in STEP_METRICS}
