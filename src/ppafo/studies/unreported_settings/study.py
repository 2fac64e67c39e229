"""Draws completions of the torque task, runs each with both valves, and weighs them by what the paper reports."""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import ScenarioError
from ppafo.simulation.ensemble import COMPLETED, run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.studies.unreported_settings.evidence import (
    GAS,
    IMPROVEMENT,
    METRICS,
    Metrics,
    agreement,
    improvement,
    saving,
)
from ppafo.studies.unreported_settings.proposal import Proposal, effective, next_proposal
from ppafo.studies.unreported_settings.settings import (
    CELLS,
    PROPORTIONAL,
    SETTINGS,
    SOLENOID,
    Draws,
    Setting,
    columns,
    spread,
    values_of,
)

Floats = NDArray[np.float64]

CHUNK = 32_768
ROUNDS = 12
FEWEST, MOST = 1_000, 20_000_000
DEFAULT_DRAWS = 262_144
DEFAULT_SEED = 2011

ENOUGH = 100.0
TOO_FEW = "too few to say"
IMPLIED, NARROWED = 0.5, 0.8
"""A setting is implied (narrowed) where what is left of its range is below this share of what was allowed."""


@dataclass(frozen=True, slots=True)
class Family:
    """All completions that could be run: settings by name, metrics by valve and name, and how densely they were drawn.

    Each (draws,). The first ``even`` are spread evenly over what is allowed, the others lie where the results agree.
    ``drawn`` counts also those that no run can have or that failed.
    """

    draws: Draws
    metrics: Metrics
    density: Floats
    even: int
    drawn: int
    seed: int

    @property
    def weights(self) -> Floats:
        """Weight of each completion by all that is reported; they add up to 1, or are all 0."""
        return self.weights_without(())

    def weights_without(self, left_out: Collection[str]) -> Floats:
        """Weights where some of what is reported does not count."""
        raw = agreement(self.metrics, left_out) / self.density
        total = raw.sum()
        return np.asarray(raw / total if total > 0.0 else raw)

    @property
    def is_enough(self) -> bool:
        """True where enough completions agree for a verdict on a setting."""
        return self.effective >= ENOUGH

    @property
    def effective(self) -> float:
        """Number of completions [-] that equal weights would need to say as much."""
        return effective(self.weights)


@dataclass(frozen=True, slots=True)
class Implied:
    """What the results say about one setting: its median and 90 % interval, what is left of its range, in words.

    For a choice, ``shares`` are the weights of the choices and the numbers are nan.
    """

    setting: Setting
    median: float
    low: float
    high: float
    left: float
    shares: tuple[float, ...]
    verdict: str


@dataclass(frozen=True, slots=True)
class Conclusion:
    """A statement of the paper, and in which share of all completions, and of their weight, it holds [-].

    ``by_the_rest`` is the share of the weight that follows without the results that already say it, and
    ``rest_effective`` the number of completions that equal weights would need to say as much about that.
    """

    statement: str
    of_all: float
    of_weight: float
    by_the_rest: float
    rest_effective: float


def infer_settings(
    count: int = DEFAULT_DRAWS, seed: int = DEFAULT_SEED, say: Callable[[str], None] = lambda _: None
) -> Family:
    """Run ``count`` completions with both valves and weigh them. ScenarioError for a count that is of no use.

    A third is spread evenly; the rest follows in rounds, each drawn near what agreed best so far.
    """
    if not FEWEST <= count <= MOST:
        raise ScenarioError(f"{count} draws: from {FEWEST} to {MOST} are of use")
    chance = np.random.default_rng(seed)
    rounds = [count // 3, *[(count - count // 3) // ROUNDS] * ROUNDS]
    points = spread(rounds[0], seed)
    proposals: list[Proposal | None] = [None]
    densities = [_density(None, points)]
    ran = _run(points, say, 0, count)
    even = int(ran.completed.sum())
    for number, size in enumerate(rounds[1:]):
        # Every third round looks where the improvement does not count, so that it can be judged by the rest.
        left_out = (IMPROVEMENT,) if number % 3 == 1 else ()
        agrees = np.where(ran.completed, agreement(ran.metrics, left_out), 0.0)
        proposal = next_proposal(points, agrees / _mixture(densities, rounds), CELLS, chance)
        if proposal is None:
            break
        added = proposal.drawn(size, chance)
        ran = ran.joined(_run(added, say, len(points), count))
        points = np.concatenate([points, added])
        earlier = zip(densities, proposals, strict=True)
        densities = [np.concatenate([known, _density(one, added)]) for known, one in earlier]
        proposals.append(proposal)
        densities.append(_density(proposal, points))
    density = _mixture(densities, rounds)[ran.completed]
    metrics = {valve: {name: column[ran.completed] for name, column in of.items()} for valve, of in ran.metrics.items()}
    return Family(values_of(points[ran.completed]), metrics, density, even, len(points), seed)


@dataclass(frozen=True, slots=True)
class _Ran:
    """What came of completions: metrics by valve and name, and which were completed with both valves; each (draws,)."""

    metrics: dict[str, dict[str, Floats]]
    completed: NDArray[np.bool_]

    def joined(self, later: "_Ran") -> "_Ran":
        metrics = {
            valve: {name: np.concatenate([column, later.metrics[valve][name]]) for name, column in of.items()}
            for valve, of in self.metrics.items()
        }
        return _Ran(metrics, np.concatenate([self.completed, later.completed]))


def _run(points: Floats, say: Callable[[str], None], before: int, count: int) -> _Ran:
    """Run completions with both valves, chunk by chunk."""
    ran: _Ran | None = None
    for first in range(0, len(points), CHUNK):
        draws = values_of(points[first : first + CHUNK])
        completed = np.ones(len(points[first : first + CHUNK]), dtype=bool)
        metrics = {}
        for valve in (SOLENOID, PROPORTIONAL):
            result = run_ensemble(load_scenario(f"torque-task-{valve}"), columns(draws, valve), METRICS)
            completed &= result.status == COMPLETED
            metrics[valve] = result.metrics
        part = _Ran(metrics, completed)
        ran = part if ran is None else ran.joined(part)
        say(f"{before + first + completed.size} of {count} completions")
    assert ran is not None, "there is at least one completion"
    return ran


def _density(proposal: Proposal | None, points: Floats) -> Floats:
    """How densely a proposal draws at points, over the even spread, which None is."""
    return np.ones(len(points)) if proposal is None else proposal.density(points)


def _mixture(densities: Sequence[Floats], sizes: Sequence[int]) -> Floats:
    """How densely points were drawn, over the even spread, from the mixture of the proposals used so far."""
    used = sizes[: len(densities)]
    total = sum(size * density for density, size in zip(densities, used, strict=True))
    return np.asarray(total / sum(used))


def implied(family: Family) -> list[Implied]:
    """What the results imply for each setting, in their order; no verdict where too few completions agree."""
    found = [_of_setting(setting, family.draws[setting.name], family.weights) for setting in SETTINGS]
    return found if family.is_enough else [replace(item, verdict=TOO_FEW) for item in found]


def _of_setting(setting: Setting, values: Floats, weight: Floats) -> Implied:
    if setting.choices:
        shares = tuple(float(weight[values == choice].sum()) for choice in setting.choices)
        left = spread_of(shares)
        return Implied(setting, np.nan, np.nan, np.nan, left, shares, _verdict(left))
    low, median, high = weighted_quantiles(values, weight, (0.05, 0.5, 0.95))
    scale = np.log if setting.is_logarithmic else np.asarray
    left = float((scale(high) - scale(low)) / (0.9 * (scale(setting.high) - scale(setting.low))))
    return Implied(setting, median, low, high, left, (), _verdict(left))


def spread_of(shares: Sequence[float]) -> float:
    """How far weights spread over choices, 0 for one alone to 1 for all alike, by their perplexity; nan for none."""
    if not sum(shares) > 0.0:
        return float("nan")
    entropy = -sum(share * math.log(share) for share in shares if share > 0.0)
    return (math.exp(entropy) - 1.0) / (len(shares) - 1)


def _verdict(left: float) -> str:
    if math.isnan(left):
        return "nothing agrees"
    if left < IMPLIED:
        return "implied"
    return "narrowed" if left < NARROWED else "left open"


def weighted_quantiles(values: Floats, weight: Floats, levels: tuple[float, ...]) -> list[float]:
    """Quantiles of weighted values; nan where there is no weight."""
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    if total.size == 0 or total[-1] <= 0.0:
        return [float("nan")] * len(levels)
    places = np.searchsorted(total, np.array(levels) * total[-1])
    return [float(values[order[min(place, order.size - 1)]]) for place in places]


def conclusions(family: Family) -> list[Conclusion]:
    """How firmly the paper's conclusions hold over all completions."""
    better, less = improvement(family.metrics) > 0.0, saving(family.metrics) > 0.0
    said: dict[str, tuple[NDArray[np.bool_], tuple[str, ...]]] = {
        "The proportional valve tracks better.": (better, (IMPROVEMENT,)),
        "The proportional valve uses less gas.": (less, GAS),
        "It does both.": (better & less, (IMPROVEMENT, *GAS)),
    }
    found = []
    for statement, (holds, left_out) in said.items():
        rest = family.weights_without(left_out)
        of_all, of_weight = float(holds[: family.even].mean()), float(family.weights[holds].sum())
        found.append(Conclusion(statement, of_all, of_weight, float(rest[holds].sum()), effective(rest)))
    return found


def strongest_links(family: Family, count: int = 4) -> list[tuple[str, str, float]]:
    """Pairs of settings that the results tie together most, with their weighted correlation of ranks [-]."""
    names = [setting.name for setting in SETTINGS if len(setting.choices) != 2]
    ranks = np.array([_ranks(family.draws[name]) for name in names])
    total = family.weights.sum()
    if total <= 0.0:
        return []
    away = ranks - (ranks * family.weights).sum(axis=1, keepdims=True) / total
    covariance = (away * family.weights) @ away.T / total
    spread = np.sqrt(np.diag(covariance))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = np.nan_to_num(covariance / np.outer(spread, spread))
    pairs = [
        (names[one], names[two], float(correlation[one, two]))
        for one in range(len(names))
        for two in range(one + 1, len(names))
    ]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))[:count]


def _ranks(values: Floats) -> Floats:
    """Ranks from 0 to 1; equal values share one."""
    _, places, counts = np.unique(values, return_inverse=True, return_counts=True)
    middle = np.cumsum(counts) - 0.5 * counts
    return np.asarray(middle[places] / values.size)
