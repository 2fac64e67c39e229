"""Confidence intervals of means, fractions and quantiles of the draws of a study."""

import math

import numpy as np

from ppafo.report.kind import ConfidenceInterval
from ppafo.studies.distributions import Floats


def replicates_interval(values: Floats, replicates: int, confidence: float) -> ConfidenceInterval:
    """Return the mean with Student's confidence interval from the spread between replicates.

    Value j belongs to replicate j % ``replicates``; nan stands for a missing value. If a replicate has no value, the
    interval is infinite.
    """
    from scipy.special import stdtrit

    known = np.isfinite(values)
    parts = [values[number::replicates][known[number::replicates]] for number in range(replicates)]
    mean = float(np.mean(values[known])) if known.any() else math.nan
    if min(part.size for part in parts) == 0:
        return ConfidenceInterval(mean, -math.inf, math.inf)
    error = float(np.std([np.mean(part) for part in parts], ddof=1)) / math.sqrt(replicates)
    reach = float(stdtrit(replicates - 1, 0.5 + 0.5 * confidence)) * error
    return ConfidenceInterval(mean, mean - reach, mean + reach)


def jackknife_reach(left_out: Floats, confidence: float) -> Floats:
    """Return the half width of the confidence interval of an estimate from independent replicates (Student).

    ``left_out`` (replicates, ...) is the estimate without each replicate in turn (Tukey's jackknife); the estimate may
    be a ratio or a quantile of all replicates together.
    """
    from scipy.special import stdtrit

    count = len(left_out)
    away = left_out - np.mean(left_out, axis=0)
    error = np.sqrt((count - 1.0) / count * np.sum(away**2, axis=0))
    return np.asarray(float(stdtrit(count - 1, 0.5 + 0.5 * confidence)) * error)


def effective_sample_size(values: Floats) -> float:
    """Return the effective number of draws for the mean: their number divided by max(1, squared skewness).

    The coverage error of a confidence interval by the central limit theorem is about a quarter of the inverse of this
    number (Hall, The Bootstrap and Edgeworth Expansion, 1992, section 2.6). The number is 1 if a single draw dominates.
    """
    away = values - np.mean(values)
    square = float(np.mean(away**2))
    if square == 0.0:
        return float(values.size)
    skewness = float(np.mean(away**3)) / square**1.5
    return float(values.size / max(1.0, skewness**2))


def noise_interval(values: Floats, others: Floats, confidence: float) -> ConfidenceInterval | None:
    """Return the fraction of the variance due to noise, with its confidence interval; None if nothing varies.

    ``others`` (draws,) repeats the first draws of ``values`` with an independent noise stream: half the mean square of
    the difference is the variance within a draw. The interval of this ratio of means is by the delta method.
    """
    from scipy.special import ndtri

    values = values[: others.size]
    both = np.isfinite(values) & np.isfinite(others)
    first = values[both]
    second = others[both]
    if first.size < 2:
        return None
    mean = 0.5 * float(np.mean(first + second))
    within = 0.5 * (first - second) ** 2
    whole = 0.5 * ((first - mean) ** 2 + (second - mean) ** 2)
    scale = float(np.mean(whole))
    if scale == 0.0:
        return None
    share = float(np.mean(within)) / scale
    error = math.sqrt(float(np.mean((within - share * whole) ** 2)) / first.size) / scale
    reach = float(ndtri(0.5 + 0.5 * confidence)) * error
    return ConfidenceInterval(*(min(1.0, max(0.0, value)) for value in (share, share - reach, share + reach)))


def fraction_interval(hits: int, draws: int, confidence: float) -> ConfidenceInterval:
    """Return a fraction with the exact confidence interval of Clopper and Pearson (1934)."""
    from scipy.special import betaincinv

    tail = 0.5 - 0.5 * confidence
    low = float(betaincinv(hits, draws - hits + 1, tail)) if hits > 0 else 0.0
    high = float(betaincinv(hits + 1, draws - hits, 1.0 - tail)) if hits < draws else 1.0
    return ConfidenceInterval(hits / draws, low, high)


def share_interval(hits: Floats, replicates: int, confidence: float) -> ConfidenceInterval:
    """Return the fraction of draws with a property, with a confidence interval from the spread between replicates.

    ``hits`` (draws,) is 1 for a draw with the property, 0 without, nan if unknown. If fewer than two draws per
    replicate have the property, or lack it, the spread is not reliable, and the interval is the exact one for
    independent draws.
    """
    known = hits[np.isfinite(hits)]
    count = int(np.count_nonzero(known))
    # With fewer, a replicate often has none at all, and Student's interval of 16 small counts is too narrow.
    if min(count, known.size - count) < 2 * replicates:
        return fraction_interval(count, known.size, confidence)
    interval = replicates_interval(hits, replicates, confidence)
    return ConfidenceInterval(interval.value, max(0.0, interval.low), min(1.0, interval.high))
