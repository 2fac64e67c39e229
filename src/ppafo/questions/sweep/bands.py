"""Quantiles over all runs at each time, from counts in fixed bins.

Counts of two chunks add up to those of both, exactly and in any order, so that bands do not depend on how the runs were
divided. The bins are fixed before the first chunk by trial runs spread over the whole study; what lies outside
them is counted at their ends.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.studies.distributions import Floats

BINS = 1000
_MARGIN = 0.5
"""How far the bins reach beyond the trial runs on each side, as a fraction of their range."""

Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Bins:
    """Equal bins from ``low`` to ``high`` [SI], and one at each end for all that lies beyond."""

    low: float
    high: float

    @property
    def width(self) -> float:
        """Width of a bin, which bounds the error of a quantile [SI]."""
        return (self.high - self.low) / BINS

    def edges(self) -> Floats:
        """Return the BINS + 1 edges [SI]."""
        return np.asarray(self.low + self.width * np.arange(BINS + 1), dtype=np.float64)


def bins_around(traces: Floats) -> Bins:
    """Return bins with room around trial traces (times, runs) [SI]; failed runs are nan."""
    finite = traces[np.isfinite(traces)]
    if finite.size == 0:
        return Bins(-1.0, 1.0)
    low, high = float(finite.min()), float(finite.max())
    room = _MARGIN * (high - low) or max(abs(high), 1.0) * 1.0e-3
    return Bins(low - room, high + room)


def counts_of(traces: Floats, bins: Bins) -> Counts:
    """Return how many runs are in each bin at each time, shape (times, BINS + 2), for traces (times, runs) [SI]."""
    counts = np.empty((traces.shape[0], BINS + 2), dtype=np.int64)
    for number, values in enumerate(traces):
        known = values[np.isfinite(values)]
        place = np.clip(np.floor((known - bins.low) / bins.width), -1, BINS).astype(np.int64) + 1
        counts[number] = np.bincount(place, minlength=BINS + 2)
    return counts


def quantiles_of(counts: Counts, bins: Bins, fractions: Sequence[float]) -> dict[float, Floats]:
    """Return, for each fraction, the value at each time below which that fraction of runs lies [SI]; nan without runs.

    Inside a bin the runs are taken to lie evenly; beyond the bins the value is their end.
    """
    edges = np.concatenate(([bins.low], bins.edges(), [bins.high]))
    cumulated = np.concatenate((np.zeros((counts.shape[0], 1)), np.cumsum(counts, axis=1)), axis=1)
    total = cumulated[:, -1]
    found = {fraction: np.full(counts.shape[0], np.nan) for fraction in fractions}
    for row in np.flatnonzero(total):
        for fraction in fractions:
            found[fraction][row] = _value_at(fraction * total[row], cumulated[row], edges)
    return found


def _value_at(wanted: float, cumulated: Floats, edges: Floats) -> float:
    """Return where the cumulated counts reach a number: the first bin that gets there, and the part of it."""
    place = max(1, int(np.searchsorted(cumulated, wanted, side="left")))
    while cumulated[place] == cumulated[place - 1]:
        place += 1
    inside = (wanted - cumulated[place - 1]) / (cumulated[place] - cumulated[place - 1])
    return float(edges[place - 1] + inside * (edges[place] - edges[place - 1]))


def outside_fraction(counts: Mapping[str, Counts]) -> float:
    """Return the fraction of values beyond the bins, over all channels and times."""
    total = sum(int(item.sum()) for item in counts.values())
    beyond = sum(int(item[:, 0].sum() + item[:, -1].sum()) for item in counts.values())
    return beyond / total if total else 0.0
