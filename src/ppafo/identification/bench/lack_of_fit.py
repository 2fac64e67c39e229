"""Does a fitted law miss the readings by more than they scatter? If so, by how much its intervals have to be widened.

Readings side by side are put into blocks. Were the law right, the means of blocks of m readings would scatter by
1/sqrt(m) of what single readings do; a misfit that lasts over many readings makes them scatter more. The test is that
of lack of fit (between over within blocks, F distributed; Draper and Smith, Applied Regression Analysis, ch. 2). Where
it fails, the variance is that between blocks, with as many degrees of freedom as there are blocks less parameters:
the Birge ratio (Birge, Phys. Rev. 40, 1932) of the block means, and batch means for readings that follow each other.

What a law absorbs of its own misfit no residual shows. So the fit is repeated without each block in turn: a law that
misses gives other values on other parts of a recording (jackknife over blocks; Kuensch, Ann. Statist. 17, 1989).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.identification.bench.regression import CHANCE, exceeds_chance, quantile
from ppafo.signals.recording import Floats

Indices = NDArray[np.intp]

_FEWEST_BLOCKS = 8
_MOST_BLOCKS = 64
"""More would find what follows from sample to sample, for which there is an interval of its own."""

_FEWEST_IN_A_BLOCK = 2
_DRAWS = 4000


@dataclass(frozen=True, slots=True)
class LackOfFit:
    """Mean square of the block means times their size, its degrees of freedom, and the blocks (indices of samples).

    Without blocks the law misses by no more than the scatter, and the mean square is that of the residuals.
    """

    mean_square: float
    freedom: int
    blocks: tuple[Indices, ...]

    @property
    def is_seen(self) -> bool:
        """Whether the law misses by more than the scatter."""
        return bool(self.blocks)

    def deviation(self, confidence: float) -> float:
        """Return half the width of an interval for a reading's mean error, in the unit of the residuals."""
        return quantile(confidence, self.freedom) * float(np.sqrt(self.mean_square))


def lack_of_fit(residuals: Floats, parameters: int, confidence: float, along: Sequence[Floats] = ()) -> LackOfFit:
    """Return the lack of fit that widens intervals most, over numbers of blocks, in the order of samples and others.

    ``along`` are variables over which a misfit may run besides, such as a pressure. Readings that have some are steady
    ones, whose noise may differ from place to place; in a course of time a misfit may fill one block alone.
    """
    freedom = max(1, residuals.size - parameters)
    widest = LackOfFit(float(residuals @ residuals) / freedom, freedom, ())
    orders = [np.arange(residuals.size), *(np.argsort(values, kind="stable") for values in along)]
    counts = _block_counts(residuals.size, parameters)
    chance = CHANCE / max(1, len(counts) * len(orders))
    for order in orders:
        for count in counts:
            found = _missing(residuals, tuple(np.array_split(order, count)), parameters, chance)
            if found is None or (
                along and not _exceeds_uneven_noise([residuals[block] for block in found.blocks], chance)
            ):
                continue
            if found.deviation(confidence) > widest.deviation(confidence):
                widest = found
    return widest


def jackknifed(values_without: Sequence[Floats], confidence: float) -> Floats:
    """Return half widths from the values that were fitted without each block in turn."""
    stacked = np.array(values_without)
    count = stacked.shape[0]
    variance = (count - 1) / count * ((stacked - stacked.mean(axis=0)) ** 2).sum(axis=0)
    return np.asarray(quantile(confidence, count - 1) * np.sqrt(variance))


def _block_counts(size: int, parameters: int) -> list[int]:
    """Return the numbers of blocks to try: from few to as many as leave two readings in each, and a limit."""
    counts: list[int] = []
    count = max(_FEWEST_BLOCKS, 2 * parameters)
    while count * _FEWEST_IN_A_BLOCK <= size and (not counts or count <= _MOST_BLOCKS):
        counts.append(count)
        count *= 2
    return counts


def _missing(residuals: Floats, blocks: tuple[Indices, ...], parameters: int, chance: float) -> LackOfFit | None:
    """Return the lack of fit between blocks where it is larger than chance allows, else None."""
    freedom, inner = len(blocks) - parameters, residuals.size - len(blocks)
    parts = [residuals[block] for block in blocks]
    between = sum(float(part.sum()) ** 2 / part.size for part in parts) / freedom
    within = sum(float(((part - part.mean()) ** 2).sum()) for part in parts) / inner
    is_missing = exceeds_chance(between, within, freedom, inner, chance)
    return LackOfFit(between, freedom, blocks) if is_missing else None


def _exceeds_uneven_noise(parts: list[Floats], chance: float) -> bool:
    """Return whether the blocks' means scatter more than noise does that is larger in some blocks than in others.

    The F test takes one variance for all. Here each block has its own: were all errors independent, the sum of the
    squared means times their size would be one of squared normal numbers, weighted by the blocks' mean squares.
    """
    weights = np.array([float(part @ part) / part.size for part in parts])
    seen = sum(float(part.sum()) ** 2 / part.size for part in parts)
    draws = np.random.default_rng(1).standard_normal((_DRAWS, weights.size))
    return bool(np.mean(draws**2 @ weights >= seen) <= chance)
