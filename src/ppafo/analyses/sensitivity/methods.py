"""Methods of sensitivity analysis: Sobol and Shapley, each with design and indices; signed changes.

A design consists of blocks: a base point of Sobol with its exchanged copies, or an order of the values for Shapley. A
block is the smallest unit that can be left out.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import StudyError
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import Uncertainty, replicate_seed
from ppafo.studies.intervals import jackknife_reach

SCRAMBLES = 8
"""Number of independent scrambles of the Sobol sequence, to which base points are assigned in turn."""
_INNER = 3
"""Number of draws of the free values for each conditional variance (Song, Nelson and Staum, 2016)."""
_SMALLEST = 2.0**-53
"""Smallest fraction of a draw; normal scores are finite from this fraction to 1 minus this fraction."""
_ONE = 0.6827
"""Confidence level of an interval of plus and minus one standard deviation."""
_NEAREST = 0.2
"""Fraction of the runs, nearest to an end of a value, to which the parabola is fitted."""


@dataclass(frozen=True, slots=True)
class Indices:
    """Sensitivity indices by name, each (paths,), and the half widths of their bands; the first ranks the inputs.

    ``blocks``, ``used``: number of blocks of the part of the sample, and of those without a missing value
    """

    values: Mapping[str, Floats]
    bands: Mapping[str, Floats]
    blocks: int = 0
    used: int = 0

    @property
    def ranking(self) -> Floats:
        """Index that ranks the inputs, the first of them (paths,)."""
        return next(iter(self.values.values()))


@dataclass(frozen=True, slots=True)
class EvaluatedBlocks:
    """Complete blocks of a design with the values of a metric.

    ``inputs`` (rows, paths): values of the inputs [SI]
    ``values`` (rows,): values of the metric [SI]
    ``blocks``: numbers of the blocks
    ``ends`` (2, paths): 5 and 95 % quantile of each input [SI], nan for noise
    ``seed``: random seed of the design
    """

    inputs: Floats
    values: Floats
    blocks: NDArray[np.intp]
    ends: Floats
    seed: int


@dataclass(frozen=True, slots=True)
class Method:
    """Method of sensitivity analysis: design and evaluation.

    ``takes_dependent``: True if the indices are meaningful for correlated values
    ``fewest``, ``most``: limits of the number of blocks
    ``noun``: name of the blocks
    ``block_rows``: number of runs of a block for a number of values
    ``design``: function of uncertainty, number of blocks and seed; returns fractions in (0, 1), shape (blocks *
        block_rows, paths), block after block
    ``indices``: function of complete blocks and confidence; returns the indices with bands
    """

    name: str
    takes_dependent: bool
    fewest: int
    most: int
    noun: str
    block_rows: Callable[[int], int]
    design: Callable[[Uncertainty, int, int], Floats]
    indices: Callable[[EvaluatedBlocks, float], Indices]


def _sobol_design(uncertainty: Uncertainty, blocks: int, seed: int) -> Floats:
    """Return fractions in (0, 1) for a power of 2 of blocks; block b belongs to scramble b % SCRAMBLES."""
    if blocks & (blocks - 1):
        raise StudyError(f"samples = {blocks}: Sobol indices need a power of 2, for example {1 << blocks.bit_length()}")
    from scipy.stats import qmc

    dimensions, points_of_scramble = len(uncertainty.drawn), blocks // SCRAMBLES
    design = np.empty((points_of_scramble, SCRAMBLES, dimensions + 2, dimensions))
    exchanged = np.arange(dimensions)
    for number in range(SCRAMBLES):
        scramble_seed = replicate_seed(seed, number) % 2**32
        # Saltelli (2002): a point A, its copies in which value i comes from B, and B. `seed`, not `rng`: the points of
        # earlier studies.
        points = qmc.Sobol(2 * dimensions, scramble=True, seed=scramble_seed).random(points_of_scramble)
        design[:, number] = points[:, None, :dimensions]
        design[:, number, -1] = points[:, dimensions:]
        design[:, number, 1 + exchanged, exchanged] = points[:, dimensions:]
    return np.clip(design.reshape(-1, dimensions), _SMALLEST, 1.0 - _SMALLEST)


def _sobol_indices(evaluated: EvaluatedBlocks, confidence: float) -> Indices:
    """Return the indices ``first`` and ``total`` with bands."""
    # Points of one scramble depend on each other, scrambles do not: those are left out in turn.
    table = evaluated.values.reshape(evaluated.blocks.size, -1)
    scramble = evaluated.blocks % SCRAMBLES
    parts = [scramble != number for number in np.unique(scramble)]
    left_out = np.array([_sobol_total_and_first(table[members]) for members in parts])
    reach = jackknife_reach(left_out, confidence)
    total, first = _sobol_total_and_first(table)
    return Indices({"total": total, "first": first}, {"total": reach[0], "first": reach[1]})


def _sobol_total_and_first(table: Floats) -> Floats:
    """Return total and first-order Sobol indices (2, paths) from values (blocks, paths + 2).

    The columns are f(A), then f(AB_i) with value i from B for each path, then f(B). With V the variance of f(A) and
    f(B): total_i = mean (f(A) - f(AB_i))^2 / 2 V (Jansen, 1999), first_i = mean f(B) (f(AB_i) - f(A)) / V (Saltelli et
    al., 2010).
    """
    # Centred: the estimate of the first order is a mean of products, whose error grows with the mean of the metric.
    table = table - np.mean(table[:, [0, -1]])
    first, copies, second = table[:, :1], table[:, 1:-1], table[:, -1:]
    variance = float(np.mean(table[:, [0, -1]] ** 2))
    total = 0.5 * np.mean((first - copies) ** 2, axis=0)
    return np.stack([total, np.mean(second * (copies - first), axis=0)]) / (variance or math.nan)


SOBOL = Method(
    name="sobol",
    takes_dependent=False,
    fewest=64,
    most=2**17,
    noun="base points",
    block_rows=lambda dimensions: dimensions + 2,
    design=_sobol_design,
    indices=_sobol_indices,
)
"""Sobol indices, fractions of the variance: first-order (a value alone) and total (with all interactions).

Saltelli's design on independent scrambles of the Sobol sequence; estimators of Saltelli et al.
(2010) and Jansen (1999). The bands come from the spread between the scrambles, because the points of one sequence
are not independent and resampling them gives bands that are several times too wide.
"""


def _shapley_design(uncertainty: Uncertainty, blocks: int, seed: int) -> Floats:
    """Return fractions in (0, 1) of a design for Shapley effects.

    For each block and each prefix of its order of values, there are draws with the remaining values fixed.
    """
    from scipy.special import ndtr

    count = len(uncertainty.drawn)
    lower = np.eye(count) if uncertainty.scores is None else np.asarray(uncertainty.scores)
    covariance, random = lower @ lower.T, np.random.default_rng([seed, 1])
    scores = random.standard_normal((blocks, count - 1, 1, count)) @ lower.T
    scores = np.repeat(scores, _INNER, axis=2)
    fresh = random.standard_normal((blocks, count - 1, _INNER, count))
    # In pattern after pattern of which values are free, since all rows of one share a conditional distribution.
    places = np.argsort(_orders(count, blocks, seed), axis=1)
    free = places[:, None, :] <= np.arange(count - 1)[None, :, None]
    for pattern in np.unique(free.reshape(-1, count), axis=0):
        rows = np.all(free == pattern, axis=2)
        # What gives scores of free values from fixed ones: a matrix for the mean, a factor for the rest.
        across = covariance[np.ix_(pattern, ~pattern)]
        mean = np.linalg.solve(covariance[np.ix_(~pattern, ~pattern)], across.T).T
        factor = np.linalg.cholesky(covariance[np.ix_(pattern, pattern)] - mean @ across.T)
        drawn = scores[rows][..., ~pattern] @ mean.T + fresh[rows][..., pattern] @ factor.T
        part = scores[rows]
        part[..., pattern] = drawn
        scores[rows] = part
    uniform = ndtr(np.linalg.solve(lower, scores.reshape(-1, count).T).T)
    return np.asarray(np.clip(uniform, _SMALLEST, 1.0 - _SMALLEST))


def _shapley_indices(evaluated: EvaluatedBlocks, confidence: float) -> Indices:
    """Return the index ``shapley`` with bands by the delta method over the orders."""
    from scipy.special import stdtrit

    blocks, count = evaluated.blocks.size, evaluated.inputs.shape[1]
    table = evaluated.values.reshape(blocks, count - 1, _INNER)
    variances = np.mean((table - np.mean(table)) ** 2, axis=(1, 2))
    conditional = np.var(table, axis=2, ddof=1)
    ends = np.zeros((blocks, 1)), variances[:, None]
    gains = np.diff(np.concatenate([ends[0], conditional, ends[1]], axis=1), axis=1)
    orders = _orders(count, int(evaluated.blocks.max()) + 1, evaluated.seed)[evaluated.blocks]
    effects = np.take_along_axis(gains, np.argsort(orders, axis=1), axis=1)
    variance = float(np.mean(variances))
    fractions = np.mean(effects, axis=0) / variance
    deviations = (effects - fractions * variances[:, None]) / variance
    reach = float(stdtrit(blocks - 1, 0.5 + 0.5 * confidence)) * np.std(deviations, axis=0, ddof=1) / math.sqrt(blocks)
    return Indices({"shapley": fractions}, {"shapley": reach})


def _orders(count: int, blocks: int, seed: int) -> NDArray[np.intp]:
    """Return the order of the values in each block (blocks, count); a larger number of blocks keeps the first ones."""
    ranks = np.random.default_rng([seed, 2]).random((blocks, count))
    return np.argsort(ranks, axis=1)


SHAPLEY = Method(
    name="shapley",
    takes_dependent=True,
    fewest=64,
    most=2**17,
    noun="orders",
    block_rows=lambda dimensions: _INNER * (dimensions - 1),
    design=_shapley_design,
    indices=_shapley_indices,
)
"""Shapley effects: fractions of the variance that add up to 1, for independent and for correlated values.

Variance that two values explain together, by interaction or by correlation, is divided between them (Owen, 2014).
The values are added in random orders: each value gets its increase of the variance that remains when all later
values of the order are fixed (Song, Nelson and Staum, 2016). Fixed values are drawn from the Gaussian copula.
"""
METHODS = {method.name: method for method in (SOBOL, SHAPLEY)}
"""Methods of sensitivity analysis by name; a new method needs a design, indices, and an entry here."""


def changes(evaluated: EvaluatedBlocks, confidence: float) -> tuple[Floats, Floats]:
    """Return the change of the metric (paths,) from the 5 to the 95 % quantile of each value, and its half band.

    The change has the unit of the metric and is positive if the metric grows with the value; it is nan for noise. It is
    the difference between two conditional means of the metric, with the value at either quantile and all other values
    as drawn, so that correlated values change too. Each mean is the value of a parabola fitted to the nearest runs
    (Cleveland, 1979, without weights). The bands add two errors: the spread between parts of the blocks, one part for
    each scramble, and twice the difference from the change with the nearer half of these runs, as the error of the
    parabola.
    """
    part_of_block = np.unique(evaluated.blocks % SCRAMBLES, return_inverse=True)[1]
    part = np.repeat(part_of_block, evaluated.values.size // evaluated.blocks.size)
    # About the mean, because the sums of the lines below cancel.
    values = evaluated.values - np.mean(evaluated.values)
    whole, nearer = (
        np.array(
            [
                np.subtract(*(_levels(values, inputs, end, part, nearest) for end in ends[::-1]))
                for inputs, ends in zip(evaluated.inputs.T, evaluated.ends.T, strict=True)
            ]
        )
        for nearest in (_NEAREST, 0.5 * _NEAREST)
    )
    spread, bend_spread = jackknife_reach(whole[:, 1:].T, confidence), jackknife_reach((whole - nearer)[:, 1:].T, _ONE)
    # Of the square of the difference, what is chance on average is no bend.
    bend = np.sqrt(np.maximum((whole - nearer)[:, 0] ** 2 - bend_spread**2, 0.0))
    return whole[:, 0], spread + 2.0 * bend


def _levels(values: Floats, inputs: Floats, end: float, part: NDArray[np.intp], nearest: float) -> Floats:
    """Return the mean metric at the value ``end`` of an input: from all parts, then without each part (parts + 1,).

    ``nearest`` is the fraction of the runs, nearest to the end, to which the parabola is fitted.
    """
    count = int(part.max()) + 1
    if math.isnan(end):
        return np.full(count + 1, math.nan)
    distance = np.abs(inputs - end)
    rank = int(nearest * distance.size)
    near = distance <= np.partition(distance, rank)[rank]
    scaled = (inputs[near] - end) / (np.max(distance[near]) or 1.0)
    powers = np.stack([scaled**power for power in range(5)])
    moments = np.stack([np.bincount(part[near], power, count) for power in powers])
    mixed = np.stack([np.bincount(part[near], power * values[near], count) for power in powers[:3]])
    # All parts, and all but one in turn.
    total, mixed_total = np.sum(moments, axis=1, keepdims=True), np.sum(mixed, axis=1, keepdims=True)
    moments = np.concatenate([total, total - moments], axis=1)
    mixed = np.concatenate([mixed_total, mixed_total - mixed], axis=1)
    # A value of one or two levels needs no parabola: the pseudo-inverse leaves at 0 what they do not tell.
    normal = np.stack([moments[row : row + 3] for row in range(3)]).transpose(2, 0, 1)
    solved = np.linalg.pinv(normal, rcond=1.0e-9, hermitian=True) @ mixed.T[:, :, None]
    return np.asarray(solved[:, 0, 0])
