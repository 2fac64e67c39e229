"""From an optimum and its covariance to an estimate with a verdict in words."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from ppafo.identification.estimate import Estimate, Verdict
from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.problem import Search
from ppafo.identification.trajectory.ranges import Range
from ppafo.identification.trajectory.search import is_at_bound

STRONG = 0.8
"""Correlation from which two numbers are said to trade against each other."""

_MOST_PARTNERS = 3
_LARGEST_LOGARITHM = 300.0
_FREED = 0.5
"""An interval that would shrink below this share with all others known is wide because of a trade."""
_FROM_PRIOR = 0.8
"""A standard error above this share of the prior's says that the recordings added little to it."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """What a verdict is made of, in coordinates: point, information of data and priors, covariance, bounds, sources.

    ``interval`` has the ends of the intervals. ``misfit`` says why the model is wrong, empty where it is not; ``alone``
    names for each parameter the only channel that speaks of it, empty where several do.
    """

    ranges: tuple[Range, ...]
    point: Floats
    interval: tuple[Floats, Floats]
    information: Floats
    covariance: Floats
    correlation: Floats
    low: Floats
    high: Floats
    prior_deviation: Floats
    inflation: float
    residual_check: str
    misfit: str
    alone: tuple[str, ...]
    sources: tuple[tuple[str, ...], ...]
    search: Search


def estimate_of(evidence: Evidence, index: int) -> Estimate:
    """Return the estimate of one parameter."""
    item, at = evidence.ranges[index], float(evidence.point[index])
    half = half_width(evidence, index)
    furthest = _LARGEST_LOGARITHM if item.scale == "log" else math.inf
    low, high = (item.number(float(np.clip(end[index], -furthest, furthest))) for end in evidence.interval)
    share = relative(evidence, index, half)
    verdict = _verdict(evidence, index, share)
    return Estimate(
        path=item.name,
        value=item.number(at),
        unit=item.unit,
        low=max(min(low, high), item.low),
        high=min(max(low, high), item.high),
        verdict=verdict,
        explanation=_explanation(evidence, index, verdict, share),
        recordings=evidence.sources[index],
        confidence=evidence.search.confidence,
    )


def half_width(evidence: Evidence, index: int) -> float:
    """Return half the width of the interval, in coordinates."""
    return 0.5 * float(evidence.interval[1][index] - evidence.interval[0][index])


def interval_factor(confidence: float) -> float:
    """Return the standard errors on each side of an interval with this confidence, 1.96 for 95 %."""
    return NormalDist().inv_cdf(0.5 + 0.5 * confidence)


def relative(evidence: Evidence, index: int, half: float) -> float:
    """Return a half width in coordinates relative to the number; to its range where the search began at zero."""
    return relative_to_number(evidence.ranges[index], float(evidence.point[index]), half)


def relative_to_number(item: Range, at: float, half: float) -> float:
    """Return a half width in coordinates relative to the number at a coordinate, as ``relative`` does."""
    if item.scale == "log":
        return half
    value = abs(item.number(at))
    reference = max(value, item.size) if item.start == 0.0 else value
    return half * item.size / reference if reference > 0.0 else math.inf


def partners(evidence: Evidence, index: int) -> list[tuple[str, float]]:
    """Return the parameters that trade against one, with the correlation, strongest first."""
    row = evidence.correlation[index]
    order = [int(other) for other in np.argsort(-np.abs(row)) if other != index and abs(row[other]) >= STRONG]
    return [(evidence.ranges[other].name, float(row[other])) for other in order[:_MOST_PARTNERS]]


def alone(evidence: Evidence, index: int) -> float:
    """Return half the width that the interval would have if all other parameters were known."""
    information = float(evidence.information[index, index])
    factor = interval_factor(evidence.search.confidence)
    return factor * math.sqrt(evidence.inflation / information) if information > 0.0 else math.inf


def _verdict(evidence: Evidence, index: int, share: float) -> Verdict:
    # A number that the data do not hold may end anywhere, at a bound too.
    if _is_prior_alone(evidence, index) or share > evidence.search.weak:
        return "not identifiable"
    if is_at_bound(evidence.point, evidence.ranges)[index]:
        return "at its bound"
    if evidence.misfit:
        return "holds for this model only"
    return "identified" if share <= evidence.search.identified else "weak"


def _is_prior_alone(evidence: Evidence, index: int) -> bool:
    deviation = float(evidence.prior_deviation[index])
    error = math.sqrt(float(evidence.covariance[index, index]) / evidence.inflation)
    return math.isfinite(deviation) and error > _FROM_PRIOR * deviation


def _explanation(evidence: Evidence, index: int, verdict: Verdict, share: float) -> str:
    sentences = {
        "identified": _identified,
        "weak": _loose,
        "not identifiable": _loose,
        "at its bound": _bound,
        "holds for this model only": _capped,
    }
    said = sentences[verdict](evidence, index, share)
    return f"{said}." if verdict == "holds for this model only" else f"{said}; {evidence.residual_check}."


def _identified(evidence: Evidence, index: int, share: float) -> str:
    others = partners(evidence, index)
    along = f", correlated with {_names(others)}" if others else ""
    return f"The recordings fix it to {_percent(share)}{along}"


def _loose(evidence: Evidence, index: int, share: float) -> str:
    if _is_prior_alone(evidence, index):
        return "The recordings add little to the prior, which decides the value"
    others, free = partners(evidence, index), relative(evidence, index, alone(evidence, index))
    if free > _FREED * share:
        prior = "; no residual shows it, so it wants a prior" if share > evidence.search.weak else ""
        return f"The recordings hardly react to it: they fix it only to {_percent(share)}{prior}"
    against = _names(others) if others else "several others at once"
    return f"It trades against {against}: fixed to {_percent(share)}, and to {_percent(free)} if these were known"


def _capped(evidence: Evidence, index: int, share: float) -> str:
    told = f"Fixed to {_percent(share)} if the model were right: {evidence.misfit}"
    if not evidence.alone[index]:
        return told
    return f"{told}. Only {evidence.alone[index]} shows it, so nothing else here checks it: it wants a prior"


def _bound(evidence: Evidence, index: int, _share: float) -> str:
    item, at = evidence.ranges[index], float(evidence.point[index])
    is_lower = at - evidence.low[index] < evidence.high[index] - at
    side, bound = ("lower", item.low) if is_lower else ("upper", item.high)
    return f"The search ended at the {side} bound, {bound:.6g} {item.unit}; the interval counts only inside the bounds"


def _names(others: Sequence[tuple[str, float]]) -> str:
    return ", ".join(f"{name} (correlation {number:+.2f})" for name, number in others)


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %" if share < 10.0 else "no useful precision"
