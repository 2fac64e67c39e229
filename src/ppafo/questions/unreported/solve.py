"""Draws completions of the experiments, runs each with both valves, and weighs them by what the paper reports.

Rounds that follow what agreed so far may all miss the same corner, which no count of effective draws shows. So the
draws are shared out to replicates, none of which knows where another looks, and the spread between them is the error.
"""

import os
import time
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import repeat
from typing import final

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import ScenarioError
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.unreported.answer import REPLICATES, Family
from ppafo.questions.unreported.settings import (
    CELLS,
    FALL,
    GAS,
    IMPROVEMENT,
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
    Proposal,
    agreement,
    agreement_with,
    aim_of,
    columns,
    next_proposal,
    spread,
    step_columns,
    step_observables,
    values_of,
)
from ppafo.simulation.ensemble import COMPLETED, run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.studies.draws import replicate_seed

CHUNK = 32_768
ROUNDS = 12
FEWEST, MOST = 1_000, 20_000_000


def infer_settings(draws: int = 262_144, seed: int = 2011, progress: Report | None = None) -> Family:
    """Return completions of the paper's torque task, each run with both valves, weighed by what the paper reports.

    They are divided among searches. A quarter of each is spread evenly; the rest follows in rounds, each drawn near
    what agreed best so far in that search. In the end every completion is weighed as if all had been drawn from the
    mixture of all searches. ``seed`` is the random seed. The arrays of the result have shape (completions,): settings
    in the units of ``settings.SETTINGS``, metrics in SI, weights [-] that add up to 1. ScenarioError for fewer than
    1000 draws or more than 20 million.
    """
    if not FEWEST <= draws <= MOST:
        raise ScenarioError(f"draws = {draws}: must be from {FEWEST} to {MOST}")
    report, started = progress or report_nothing, time.monotonic()
    each = draws // REPLICATES
    even = each // 4
    rounds = [even, *[(each - even) // ROUNDS] * ROUNDS]
    seeds = [replicate_seed(seed, number) for number in range(REPLICATES)]
    searches = [_Search(np.random.default_rng(own), rounds) for own in seeds]
    added = [spread(even, own) for own in seeds]
    done = 0
    for number in range(ROUNDS + 1):
        _run_together(searches, added, all_of_it=number == 0)
        done += sum(map(len, added))
        report(Progress("", done, draws, elapsed=time.monotonic() - started, noun="completions"))
        if number < ROUNDS:
            # Every third round looks where the improvement does not count, so that it can be judged by the rest.
            left_out = (IMPROVEMENT,) if number % 3 == 1 else ()
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                added = list(pool.map(_Search.next_points, searches, repeat(number + 1), repeat(left_out)))
    return _family(searches, seed)


@final
class _Search:
    """One search: the points that count so far, what came of them, the proposals and how densely each draws there."""

    def __init__(self, chance: np.random.Generator, rounds: Sequence[int]) -> None:
        self.chance, self.rounds = chance, rounds
        self.points = np.empty((0, len(CELLS)))
        self.ran: _Ran | None = None
        self.proposals: list[Proposal | None] = [None]
        self.known = [np.empty(0)]
        self.drawn = self.even = 0

    @property
    def size(self) -> int:
        """How many points were requested from its proposals."""
        return sum(self.rounds[: len(self.proposals)])

    def take(self, added: Floats, ran: "_Ran") -> None:
        """Keep those of the new points that count, with what came of them."""
        kept = ran.part(ran.completed)
        points = added[ran.completed]
        self.drawn += len(added)
        self.even = self.even or len(points)
        self.ran = kept if self.ran is None else self.ran.join(kept)
        pairs = zip(self.known, self.proposals, strict=True)
        self.known = [np.concatenate([known, _density(one, points)]) for known, one in pairs]
        self.points = np.concatenate([self.points, points])

    def next_points(self, number: int, left_out: Collection[str]) -> Floats:
        """Draw the points of a round near what agreed best so far; none where no completion agrees."""
        assert self.ran is not None, "the points so far have been run"
        agrees = agreement(self.ran.metrics, left_out)
        weights, aim = agrees / _mixture(self.known, self.rounds), aim_of(self.ran.metrics, left_out)
        proposal = next_proposal(self.points, weights, CELLS, self.chance, aim)
        if proposal is None or len(self.proposals) < number:
            return np.empty((0, self.points.shape[1]))
        self.proposals.append(proposal)
        self.known.append(_density(proposal, self.points))
        return proposal.draw(self.rounds[number], self.chance)

    def density(self, points: Floats) -> Floats:
        """How densely this search draws at points, over the even spread."""
        return _mixture([_density(one, points) for one in self.proposals], self.rounds)


def _run_together(searches: Sequence[_Search], added: Sequence[Floats], all_of_it: bool) -> None:
    """Run the new points of all searches, which is quicker together, and hand each its own."""
    whole, ends = _run(np.concatenate(added), all_of_it), np.cumsum([len(points) for points in added])
    for search, points, last in zip(searches, added, ends.tolist(), strict=True):
        search.take(points, whole.part(slice(last - len(points), last)))


def _family(searches: Sequence[_Search], seed: int) -> Family:
    """Return all searches as one family, what each drew evenly first."""
    ran, replicate, is_even = [], [], []
    for number, search in enumerate(searches):
        assert search.ran is not None, "every search has run"
        ran.append(search.ran)
        replicate.append(np.full(len(search.points), number))
        is_even.append(np.arange(len(search.points)) < search.even)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        densities = list(pool.map(_densities, searches, repeat(searches)))
    whole, even = _join(ran), np.concatenate(is_even)
    rows = np.argsort(~even, kind="stable")
    points = np.concatenate([search.points for search in searches])
    metrics = {valve: {name: item[rows] for name, item in of.items()} for valve, of in whole.metrics.items()}
    sizes = np.array([search.size for search in searches], dtype=np.float64)
    return Family(
        values_of(points[rows]),
        metrics,
        np.concatenate(densities)[rows],
        sizes,
        np.concatenate(replicate)[rows],
        int(np.count_nonzero(even)),
        sum(search.drawn for search in searches),
        seed,
    )


def _densities(search: _Search, searches: Sequence[_Search]) -> Floats:
    """How densely each search draws at the points of one (points, searches)."""
    assert search.ran is not None, "every search has run"
    # What contradicts the text has no weight, whatever its density.
    counts = np.flatnonzero(agreement(search.ran.metrics, (IMPROVEMENT, *GAS)) > 0.0)
    density = np.ones((len(search.points), len(searches)))
    for column, other in enumerate(searches):
        if other is search:
            density[:, column] = _mixture(search.known, search.rounds)
        else:
            density[counts, column] = other.density(search.points[counts])
    return density


@dataclass(frozen=True, slots=True)
class _Ran:
    """What came of completions: metrics by experiment and name, and which completed all of them; each (draws,)."""

    metrics: dict[str, dict[str, Floats]]
    completed: NDArray[np.bool_]

    def join(self, later: "_Ran") -> "_Ran":
        return _join([self, later])

    def part(self, rows: slice | NDArray[np.bool_]) -> "_Ran":
        metrics = {valve: {name: item[rows] for name, item in of.items()} for valve, of in self.metrics.items()}
        return _Ran(metrics, self.completed[rows])


def _join(parts: Sequence[_Ran]) -> _Ran:
    metrics = {
        valve: {name: np.concatenate([part.metrics[valve][name] for part in parts]) for name in of}
        for valve, of in parts[0].metrics.items()
    }
    return _Ran(metrics, np.concatenate([part.completed for part in parts]))


NEGLIGIBLE = 1.0e-6
"""What agrees less than this with the text (1 is in full) counts for nothing, and its other experiments are not run."""


def _run(points: Floats, all_of_it: bool) -> _Ran:
    """Run completions, chunk by chunk: the cheapest experiment first, the next where the text leaves it any weight.

    ``all_of_it`` runs every experiment of all.
    """
    parts = []
    for first in range(0, max(1, len(points)), CHUNK):
        draws = values_of(points[first : first + CHUNK])
        counts = np.ones(len(points[first : first + CHUNK]), dtype=bool)
        metrics = {STEP: step_metrics(step_columns(draws))}
        if not all_of_it:
            counts &= agreement_with(TEXT_OF_STEP, metrics) > NEGLIGIBLE
        for valve in (SOLENOID, PROPORTIONAL):
            metrics[valve], completed = _task_metrics(draws, valve, counts)
            counts &= completed
            if valve == SOLENOID and not all_of_it:
                counts &= agreement_with(TEXT_OF_SOLENOID, metrics) > NEGLIGIBLE
        parts.append(_Ran(metrics, counts))
    return _join(parts)


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


def _density(proposal: Proposal | None, points: Floats) -> Floats:
    """How densely a proposal draws at points, over the even spread, which None is."""
    return np.ones(len(points)) if proposal is None else proposal.density(points)


def _mixture(densities: Sequence[Floats], sizes: Sequence[int]) -> Floats:
    """How densely points were drawn, over the even spread, from the mixture of the proposals used so far."""
    used = sizes[: len(densities)]
    total = sum(size * density for density, size in zip(densities, used, strict=True))
    return np.asarray(total / sum(used))
