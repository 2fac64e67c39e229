"""Draws completions of the torque task, runs each with both valves, and weighs them by what the paper reports.

Rounds that follow what agreed so far may all miss the same corner, which no count of effective draws shows. So the
draws are shared out to replicates, none of which knows where another looks, and the spread between them is the error.
"""

import os
import time
from collections.abc import Collection, Sequence
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
    STEP_TIME,
    Draws,
    Floats,
    Proposal,
    agreement,
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
    searches = [_Search(np.random.default_rng(own), rounds, spread(rounds[0], own)) for own in seeds]
    added = [search.points for search in searches]
    for number in range(ROUNDS + 1):
        _run_together(searches, added)
        done = sum(len(search.points) for search in searches)
        report(Progress("", done, draws, elapsed=time.monotonic() - started, noun="completions"))
        if number < ROUNDS:
            # Every third round looks where the improvement does not count, so that it can be judged by the rest.
            left_out = (IMPROVEMENT,) if number % 3 == 1 else ()
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                added = list(pool.map(_Search.next_points, searches, repeat(number + 1), repeat(left_out)))
    return _family(searches, seed)


@final
class _Search:
    """One search: the points so far, what came of them, the proposals and how densely each draws at the points."""

    def __init__(self, chance: np.random.Generator, rounds: Sequence[int], points: Floats) -> None:
        self.chance, self.rounds, self.points = chance, rounds, points
        self.ran: _Ran | None = None
        self.proposals: list[Proposal | None] = [None]
        self.known = [np.ones(len(points))]

    @property
    def size(self) -> int:
        """How many points were requested from its proposals."""
        return sum(self.rounds[: len(self.proposals)])

    def next_points(self, number: int, left_out: Collection[str]) -> Floats:
        """Draw the points of a round near what agreed best so far; none where no completion agrees."""
        assert self.ran is not None, "the points so far have been run"
        agrees = np.where(self.ran.completed, agreement(self.ran.metrics, left_out), 0.0)
        proposal = next_proposal(self.points, agrees / _mixture(self.known, self.rounds), CELLS, self.chance)
        if proposal is None or len(self.proposals) < number:
            return np.empty((0, self.points.shape[1]))
        added = proposal.draw(self.rounds[number], self.chance)
        earlier = zip(self.known, self.proposals, strict=True)
        self.known = [np.concatenate([known, _density(one, added)]) for known, one in earlier]
        self.points = np.concatenate([self.points, added])
        self.proposals.append(proposal)
        self.known.append(_density(proposal, self.points))
        return added

    def density(self, points: Floats) -> Floats:
        """How densely this search draws at points, over the even spread."""
        return _mixture([_density(one, points) for one in self.proposals], self.rounds)


def _run_together(searches: Sequence[_Search], added: Sequence[Floats]) -> None:
    """Run the new points of all searches, which is quicker together, and hand each its own."""
    whole, ends = _run(np.concatenate(added)), np.cumsum([len(points) for points in added])
    for search, first, last in zip(searches, [0, *ends[:-1].tolist()], ends.tolist(), strict=True):
        part = whole.part(slice(first, last))
        search.ran = part if search.ran is None else search.ran.join(part)


def _family(searches: Sequence[_Search], seed: int) -> Family:
    """Return all searches as one family, what each drew evenly first."""
    ran, replicate, is_even = [], [], []
    for number, search in enumerate(searches):
        assert search.ran is not None, "every search has run"
        ran.append(search.ran)
        replicate.append(np.full(len(search.points), number))
        is_even.append(np.arange(len(search.points)) < search.rounds[0])
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        densities = list(pool.map(_densities, searches, repeat(searches)))
    whole, even = _join(ran), np.concatenate(is_even)
    rows = np.flatnonzero(whole.completed)
    rows = rows[np.argsort(~even[rows], kind="stable")]
    points = np.concatenate([search.points for search in searches])
    metrics = {valve: {name: item[rows] for name, item in of.items()} for valve, of in whole.metrics.items()}
    sizes = np.array([search.size for search in searches], dtype=np.float64)
    return Family(
        values_of(points[rows]),
        metrics,
        np.concatenate(densities)[rows],
        sizes,
        np.concatenate(replicate)[rows],
        int(np.count_nonzero(even[rows])),
        len(points),
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
    """What came of completions: metrics by valve and name, and which were completed with both valves; each (draws,)."""

    metrics: dict[str, dict[str, Floats]]
    completed: NDArray[np.bool_]

    def join(self, later: "_Ran") -> "_Ran":
        return _join([self, later])

    def part(self, rows: slice) -> "_Ran":
        metrics = {valve: {name: item[rows] for name, item in of.items()} for valve, of in self.metrics.items()}
        return _Ran(metrics, self.completed[rows])


def _join(parts: Sequence[_Ran]) -> _Ran:
    metrics = {
        valve: {name: np.concatenate([part.metrics[valve][name] for part in parts]) for name in of}
        for valve, of in parts[0].metrics.items()
    }
    return _Ran(metrics, np.concatenate([part.completed for part in parts]))


def _run(points: Floats) -> _Ran:
    """Run completions with both valves, chunk by chunk."""
    parts = []
    for first in range(0, max(1, len(points)), CHUNK):
        draws = values_of(points[first : first + CHUNK])
        completed = np.ones(len(points[first : first + CHUNK]), dtype=bool)
        metrics = {valve: {name: np.empty(0) for name in METRICS} for valve in (SOLENOID, PROPORTIONAL)}
        for valve in metrics if completed.size else ():
            result = run_ensemble(load_scenario(f"torque-task-{valve}"), columns(draws, valve), METRICS)
            completed &= result.status == COMPLETED
            metrics[valve] = result.metrics
        metrics[STEP] = _step_metrics(draws) if completed.size else {name: np.empty(0) for name in STEP_METRICS}
        parts.append(_Ran(metrics, completed))
    return _join(parts)


STEP_METRICS = (PLATEAU, FALL, RISE)
STEP_CHUNK = 4096
"""Step responses whose traces are kept at once."""


def _step_metrics(draws: Draws) -> dict[str, Floats]:
    """What the step response of each completion shows of the text of figure 7."""
    # Without the leg, whose attitude on the fixture is not among the settings yet.
    base = load_scenario("step-response", ["motion.kind=free", f"run.duration={STEP_TIME} s"])
    supply = base.device.supply
    varied = step_columns(draws)
    count = next(iter(varied.values())).size
    parts = []
    for first in range(0, count, STEP_CHUNK):
        part = {path: values[first : first + STEP_CHUNK] for path, values in varied.items()}
        result = run_ensemble(base, part, (), ("angle", "pressure_1", "pressure_2"))
        parts.append(step_observables(result.times, result.traces, supply.pressure, supply.atmospheric_pressure))
    return {name: np.concatenate([part[name] for part in parts]) for name in STEP_METRICS}


def _density(proposal: Proposal | None, points: Floats) -> Floats:
    """How densely a proposal draws at points, over the even spread, which None is."""
    return np.ones(len(points)) if proposal is None else proposal.density(points)


def _mixture(densities: Sequence[Floats], sizes: Sequence[int]) -> Floats:
    """How densely points were drawn, over the even spread, from the mixture of the proposals used so far."""
    used = sizes[: len(densities)]
    total = sum(size * density for density, size in zip(densities, used, strict=True))
    return np.asarray(total / sum(used))
