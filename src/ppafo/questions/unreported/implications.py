"""What a family of completions implies about each setting and each conclusion, with the error between replicates."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.questions.unreported.evidence import GAS, IMPROVEMENT, improvement, saving
from ppafo.questions.unreported.proposal import effective
from ppafo.questions.unreported.settings import SETTINGS, Floats, Setting
from ppafo.questions.unreported.solve import Family
from ppafo.studies.intervals import jackknife_reach

FEWEST_REPLICATES = 3
TOO_FEW = "too few to say"
IMPLIED, NARROWED = 0.5, 0.8
"""A setting is implied (narrowed) where what is left of its range is below this fraction of what was allowed."""


@dataclass(frozen=True, slots=True)
class Implication:
    """What the results say about one setting: its median and 90 % interval, what is left of its range, in words.

    For a choice, ``fractions`` are the weights of the choices and the numbers are nan. ``error`` is the half width of
    the 95 % interval of each number, by its name, from the spread between the replicates.
    """

    setting: Setting
    median: float
    low: float
    high: float
    left: float
    fractions: tuple[float, ...]
    verdict: str
    error: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True, slots=True)
class Conclusion:
    """A statement of the paper, and in which fraction of all completions, and of their weight, it holds [-].

    ``by_the_rest`` is the fraction of the weight that follows without the results that already say it, and
    ``rest_effective`` the number of completions that equal weights would need to say as much about that. ``error`` are
    the half widths of the 95 % intervals of the three fractions, from the spread between the replicates.
    """

    statement: str
    of_all: float
    of_weight: float
    by_the_rest: float
    rest_effective: float
    error: tuple[float, float, float]


def implications_of(family: Family) -> list[Implication]:
    """What the results imply for each setting, in their order; no verdict where too few completions agree."""
    others = family.without_each()
    found = []
    for setting in SETTINGS:
        item = _implication(setting, family)
        left_out = [_implication(setting, other) for other in others]
        error = {
            name: _error([_numbers(each, name) for each in left_out]) for name in ("median", "low", "high", "left")
        }
        error["shares"] = _error([each.fractions for each in left_out])
        ends = [_verdict(item.left + sign * error["left"][0]) for sign in (-1.0, 1.0)]
        verdict = item.verdict if len(set(ends)) == 1 else " or ".join(ends)
        found.append(replace(item, verdict=verdict if family.is_enough else TOO_FEW, error=error))
    return found


def _numbers(item: Implication, name: str) -> tuple[float, ...]:
    number: float = getattr(item, name)
    return (number,)


def _error(left_out: Sequence[Sequence[float]]) -> tuple[float, ...]:
    """Return half widths of 95 % intervals from estimates without each replicate in turn; nan from too few."""
    if len(left_out) < FEWEST_REPLICATES:
        return (math.nan,) * len(left_out[0]) if left_out else ()
    return tuple(jackknife_reach(np.array(left_out, dtype=np.float64), 0.95).tolist())


def _implication(setting: Setting, family: Family) -> Implication:
    values, weight = family.draws[setting.name], family.weights
    if setting.choices:
        fractions = tuple(float(weight[values == choice].sum()) for choice in setting.choices)
        left = spread_of(fractions)
        return Implication(setting, np.nan, np.nan, np.nan, left, fractions, _verdict(left), {})
    low, median, high = weighted_quantiles(values, weight, (0.05, 0.5, 0.95))
    scale = np.log if setting.is_logarithmic else np.asarray
    left = float((scale(high) - scale(low)) / (0.9 * (scale(setting.high) - scale(setting.low))))
    return Implication(setting, median, low, high, left, (), _verdict(left), {})


def spread_of(fractions: Sequence[float]) -> float:
    """How far weights spread over choices, 0 for one alone to 1 for all alike, by their perplexity; nan for none."""
    if not sum(fractions) > 0.0:
        return float("nan")
    entropy = -sum(fraction * math.log(fraction) for fraction in fractions if fraction > 0.0)
    return (math.exp(entropy) - 1.0) / (len(fractions) - 1)


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
    others = family.without_each()
    found = []
    for statement, left_out in _STATEMENTS.items():
        fractions = _fractions(family, statement, left_out)
        error = _error([_fractions(other, statement, left_out) for other in others])
        rest = effective(family.weights_without(left_out))
        found.append(Conclusion(statement, *fractions, rest, (error[0], error[1], error[2])))
    return found


_BETTER, _LESS = "The proportional valve tracks better.", "The proportional valve uses less gas."
_STATEMENTS: dict[str, tuple[str, ...]] = {
    _BETTER: (IMPROVEMENT,),
    _LESS: GAS,
    "It does both.": (IMPROVEMENT, *GAS),
}
"""What the paper concludes, and the results that already say it."""


def _fractions(family: Family, statement: str, left_out: Collection[str]) -> tuple[float, float, float]:
    """In which fraction of all completions, of the weight, and of that without some results a statement holds [-]."""
    better, less = improvement(family.metrics) > 0.0, saving(family.metrics) > 0.0
    holds = {_BETTER: better, _LESS: less}.get(statement, better & less)
    weights = (family.weights, family.weights_without(left_out))
    of_weight, by_the_rest = (float(weight[holds].sum()) for weight in weights)
    return float(holds[: family.even].mean()), of_weight, by_the_rest


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
