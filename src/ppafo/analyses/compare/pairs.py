"""Paired statistics of two configurations over the same draws, and the Pareto front."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.metrics.tracking import ONE_INSTANT, TRACKING
from ppafo.report.kind import ConfidenceInterval
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import REPLICATES
from ppafo.studies.intervals import effective_sample_size, noise_interval, replicates_interval, share_interval

Masks = NDArray[np.bool_]
OUTER_QUANTILES = (0.05, 0.95)
"""Quantiles over the draws that tables show next to the median."""
RMS_ERRORS = (*(name for name in TRACKING if name.startswith("rms_") and name.endswith("_error")), "torque_error")
"""Metrics of the error of each quantity that a loop may control, over the whole run; of a walk the last."""
COMPARED: dict[str, int] = {
    **{name: -1 for name in TRACKING if name not in ONE_INSTANT},
    "gas_supplied": -1,
    "mechanical_work": 0,
    "gas_per_work": -1,
    "switchings": -1,
    "peak_torque": 0,
    "command_reversals": 0,
    "gas": -1,
    "positive_push_off_work": 1,
    "net_push_off_work": 1,
    "push_off_error": -1,
    "torque_error": -1,
    "toe_clearance": 1,
}
"""Metrics that are always compared, by name: -1 if smaller is better, 1 if larger is better, 0 if neither."""


@dataclass(frozen=True, slots=True)
class PairedMetric:
    """Paired statistics of a metric of a configuration against the baseline, over the pairs in which both have a value.

    ``pairs``: number of pairs
    ``difference``: mean of configuration minus baseline [SI], with confidence interval
    ``change``: median over the draws of this difference divided by the baseline value, nan if the baseline is 0
    ``change_low``, ``change_high``: 5 and 95 % quantile of the same ratio; more draws do not narrow this range
    ``better``: probability that the configuration is better in a draw, with confidence interval; None for a metric
        without preferred direction
    ``equal``: fraction of draws in which both values are equal
    ``effective_size``: effective sample size of the mean difference
    ``noise``: fraction of the variance of the difference that is due to sensor noise; None without noise
    """

    metric: str
    pairs: int
    difference: ConfidenceInterval
    change: float
    change_low: float
    change_high: float
    better: ConfidenceInterval | None
    equal: float
    effective_size: float
    noise: ConfidenceInterval | None = None


def pareto_front(points: Floats) -> Masks:
    """Return a mask of the points (points, goals) that no other point dominates; every goal is minimised."""
    front = np.zeros(len(points), dtype=np.bool_)
    for row, point in enumerate(points):
        if np.all(np.isfinite(point)):
            is_dominating = np.all(points <= point, axis=1) & np.any(points < point, axis=1)
            front[row] = not bool(np.any(is_dominating))
    return front


def compare_pairs(
    metric: str,
    baseline: Floats,
    other: Floats,
    better: int,
    confidence: float,
    other_noise: tuple[Floats, Floats] | None = None,
) -> PairedMetric | None:
    """Return the paired statistics of values (draws,) [SI], nan for a missing value; None without any pair.

    Draws are assigned to the replicates in turn. ``other_noise`` has the values of both configurations for the first
    draws, repeated with other noise. ``better`` is -1 if a smaller value is better, 1 if a larger value is better, 0 if
    neither. A draw with equal values counts for neither configuration.
    """
    both = np.isfinite(baseline) & np.isfinite(other)
    baseline_values, other_values = baseline[both], other[both]
    if baseline_values.size == 0:
        return None
    # Relative to the size of the baseline, so that the sign is the difference's; a baseline of 0 has no fractions.
    change = (other_values - baseline_values)[baseline_values != 0.0] / np.abs(baseline_values[baseline_values != 0.0])
    low, middle, high = (
        np.quantile(change, (OUTER_QUANTILES[0], 0.5, OUTER_QUANTILES[1])) if change.size else (np.nan,) * 3
    )
    difference = other - baseline
    noise = None
    if other_noise is not None:
        noise = noise_interval(difference, other_noise[1] - other_noise[0], confidence)
    # A tie is no win on either side: of equal configurations neither is better in any draw.
    wins = np.where(both, better * (other - baseline) > 0.0, np.nan)
    return PairedMetric(
        metric=metric,
        pairs=baseline_values.size,
        difference=replicates_interval(difference, REPLICATES, confidence),
        change=float(middle),
        change_low=float(low),
        change_high=float(high),
        better=share_interval(wins, REPLICATES, confidence) if better else None,
        equal=float(np.mean(baseline_values == other_values)),
        effective_size=effective_sample_size(other_values - baseline_values),
        noise=noise,
    )


def best_probabilities(values: Sequence[Floats], better: int, confidence: float) -> list[ConfidenceInterval]:
    """Return the probability of each configuration to be the best in a draw; a tie counts for all of the best."""
    table = better * np.stack(values)
    known = np.all(np.isfinite(table), axis=0)
    if not known.any():
        return []
    # Draws in which one has no value say nothing about which is the best.
    is_best = np.where(known, table == np.max(table, axis=0), np.nan)
    return [share_interval(row, REPLICATES, confidence) for row in is_best]
