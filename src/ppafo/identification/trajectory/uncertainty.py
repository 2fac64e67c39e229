"""How far estimates may be from the truth, and the verdict of each in words."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.identification.estimate import Estimate, Verdict, interval_factor
from ppafo.identification.trajectory.information import Mixture, covariance, data_information, prior_information
from ppafo.identification.trajectory.misfit import Misfit, misfit_of
from ppafo.identification.trajectory.posterior import DRAWS, HEAVY_DRAWS, draw_posterior
from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.problem import Range, Search
from ppafo.identification.trajectory.search import is_at_bound
from ppafo.identification.trajectory.weighing import Sensor, WhitenedFit
from ppafo.units import percentage

STRONG = 0.8
"""Correlation from which two numbers are reported as trading off against each other."""

_MAXIMUM_PARTNERS = 3
_LARGEST_LOGARITHM = 300.0
_FREED = 0.5
"""An interval that would shrink below this fraction with all others known is wide because of a trade."""
FROM_PRIOR = 0.8
"""A standard error above this fraction of the prior's says that the recordings added little to it."""


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
    fraction = relative_half_width(evidence, index, half)
    verdict = _verdict(evidence, index, fraction)
    return Estimate(
        path=item.name,
        value=item.number(at),
        unit=item.unit,
        low=max(min(low, high), item.low),
        high=min(max(low, high), item.high),
        verdict=verdict,
        explanation=_explanation(evidence, index, verdict, fraction),
        recordings=evidence.sources[index],
        confidence=evidence.search.confidence,
    )


def half_width(evidence: Evidence, index: int) -> float:
    """Return half the width of the interval, in units of the coordinate."""
    return 0.5 * float(evidence.interval[1][index] - evidence.interval[0][index])


def relative_half_width(evidence: Evidence, index: int, half: float) -> float:
    """Return a half width in coordinates over the number [-]; over its range where the search began at zero."""
    return relative_to_number(evidence.ranges[index], float(evidence.point[index]), half)


def relative_to_number(item: Range, at: float, half: float) -> float:
    """Return a half width in coordinates relative to the number at a coordinate, as ``relative`` does."""
    if item.scale == "log":
        return half
    value = abs(item.number(at))
    reference = max(value, item.size) if item.start == 0.0 else value
    return half * item.size / reference if reference > 0.0 else math.inf


def partners(evidence: Evidence, index: int) -> list[tuple[str, float]]:
    """Return the parameters that trade against one, with the correlation [-], strongest first."""
    row = evidence.correlation[index]
    order = [int(other) for other in np.argsort(-np.abs(row)) if other != index and abs(row[other]) >= STRONG]
    return [(evidence.ranges[other].name, float(row[other])) for other in order[:_MAXIMUM_PARTNERS]]


def half_width_alone(evidence: Evidence, index: int) -> float:
    """Return half the width of the interval, in units of the coordinate, if all other parameters were known."""
    information = float(evidence.information[index, index])
    factor = interval_factor(evidence.search.confidence)
    return factor * math.sqrt(evidence.inflation / information) if information > 0.0 else math.inf


def _verdict(evidence: Evidence, index: int, fraction: float) -> Verdict:
    # A number that the data do not hold may end anywhere, at a bound too.
    if _is_prior_alone(evidence, index) or fraction > evidence.search.weak:
        return "not identifiable"
    if is_at_bound(evidence.point, evidence.ranges)[index]:
        return "at its bound"
    if evidence.misfit:
        return "holds for this model only"
    return "identified" if fraction <= evidence.search.identified else "weak"


def _is_prior_alone(evidence: Evidence, index: int) -> bool:
    deviation = float(evidence.prior_deviation[index])
    # Uncertain noise widens what the recordings say, never the prior: the error is that of the posterior as it is.
    error = math.sqrt(float(evidence.covariance[index, index]))
    return math.isfinite(deviation) and error > FROM_PRIOR * deviation


def _explanation(evidence: Evidence, index: int, verdict: Verdict, fraction: float) -> str:
    sentences = {
        "identified": _explain_identified,
        "weak": _explain_loose,
        "not identifiable": _explain_loose,
        "at its bound": _explain_at_bound,
        "holds for this model only": _explain_model_only,
    }
    said = sentences[verdict](evidence, index, fraction)
    return f"{said}." if verdict == "holds for this model only" else f"{said}; {evidence.residual_check}."


def _explain_identified(evidence: Evidence, index: int, fraction: float) -> str:
    others = partners(evidence, index)
    along = f", correlated with {_names(others)}" if others else ""
    return f"The recordings determine it to {_percent(fraction)}{along}"


def _explain_loose(evidence: Evidence, index: int, fraction: float) -> str:
    if _is_prior_alone(evidence, index):
        return "The recordings add little to the prior, which decides the value"
    others, free = partners(evidence, index), relative_half_width(evidence, index, half_width_alone(evidence, index))
    if free > _FREED * fraction:
        prior = "; no residual shows it, so it needs a prior" if fraction > evidence.search.weak else ""
        return f"The recordings are hardly sensitive to it: they determine it only to {_percent(fraction)}{prior}"
    against = _names(others) if others else "several others at once"
    return (
        f"It trades off against {against}: determined to {_percent(fraction)}, "
        f"and to {_percent(free)} if these were known"
    )


def _explain_model_only(evidence: Evidence, index: int, fraction: float) -> str:
    description = f"Determined to {_percent(fraction)} if the model were right: {evidence.misfit}"
    if not evidence.alone[index]:
        return description
    return f"{description}. Only {evidence.alone[index]} shows it, so nothing else here checks it: it needs a prior"


def _explain_at_bound(evidence: Evidence, index: int, _fraction: float) -> str:
    item, at = evidence.ranges[index], float(evidence.point[index])
    is_lower = at - evidence.low[index] < evidence.high[index] - at
    side, bound = ("lower", item.low) if is_lower else ("upper", item.high)
    return (
        f"The search ended at the {side} bound, {bound:.6g} {item.unit}; the interval is valid only inside the bounds"
    )


def _names(others: Sequence[tuple[str, float]]) -> str:
    return ", ".join(f"{name} (correlation {number:+.2f})" for name, number in others)


def _percent(fraction: float) -> str:
    return percentage(fraction, 2) if fraction < 10.0 else "no useful precision"


_TOLD = 1.5


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Distribution of the coordinates about the point of the optimum, and what it is made of.

    ``curvature`` is the information of the recordings with the noise as estimated; ``inflation`` [-] the median over
    all coordinates of the variance over the inverse of that, because the noise is itself uncertain; ``widening`` [-]
    how many times as wide the intervals are as white noise of the size from sample to sample would have them.
    ``low`` and ``high`` are the ends of the intervals in coordinates, ``centre`` the means.
    """

    mixture: Mixture
    covariance: Floats
    curvature: Floats
    inflation: float
    widening: float
    centre: Floats
    low: Floats
    high: Floats
    sensors: tuple[Sensor, ...]
    misfit: Misfit

    @property
    def residual_check(self) -> str:
        """What the intervals rest on, in half a sentence."""
        names = dict.fromkeys(f"{one.channel} {one.in_words}" for one in self.sensors)
        description = f"noise: {'; '.join(names)}"
        if self.widening < _TOLD:
            return description
        return f"{description}; so the interval is {self.widening:.2g} times as wide as with white noise alone"


def uncertainty_of(found: WhitenedFit, search: Search, low: Floats, high: Floats) -> Uncertainty:
    """Return the uncertainty at an optimum of known noise; ``low`` and ``high`` [unit] bound the coordinates."""
    point = found.optimum.point
    kept = len(point)
    count = HEAVY_DRAWS if any(noise.is_heavy for noise in found.noises) else DRAWS
    mixture, shown = draw_posterior(found.model, found.noises, kept, search.seed, count=count)
    matrix, curvature = mixture.covariance, found.optimum.information
    tail = 0.5 - 0.5 * search.confidence
    ends = [
        [
            point[index] + mixture.quantile(index, fraction, low[index] - point[index], high[index] - point[index])
            for index in range(kept)
        ]
        for fraction in (tail, 1.0 - tail)
    ]
    residuals = found.optimum.residuals
    slopes = found.model.slopes[:, :kept]
    white = data_information(slopes, np.ones(len(slopes))) + prior_information(residuals)
    centre = np.clip(point + mixture.mean, low, high)
    return Uncertainty(
        mixture=mixture,
        covariance=matrix,
        curvature=curvature,
        inflation=float(np.median(np.diag(matrix) / np.diag(covariance(curvature)))),
        widening=float(np.sqrt(np.median(np.diag(matrix) / np.diag(covariance(white))))),
        centre=np.clip(centre, ends[0], ends[1]),
        low=np.array(ends[0]),
        high=np.array(ends[1]),
        sensors=found.sensors,
        misfit=misfit_of(found, shown, search.seed),
    )
