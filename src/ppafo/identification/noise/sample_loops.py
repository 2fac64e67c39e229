"""Loops over the samples of a recording, which are compiled once for each computer: filters of noise, and their sums.

A loop writes what it finds into arrays that it is handed; ``found`` takes what is one number.
"""

import math
from functools import cache
from types import ModuleType

from ppafo.engine.loading import Table, Vector, array_module, load_source


@cache
def sample_loops() -> ModuleType:
    """Return the compiled module with the functions below, by the compiler that is chosen at the first call."""
    filters = (prediction_errors, innovations, sum_of_innovations, smooth, mixture_likelihood)
    return load_source(array_module((*filters, scales_of_t, sums_of_logs, likelihood_left)))


def prediction_errors(
    values: Table, weights: Vector, predictors: Table, spreads: Vector, errors: Table, found: Vector
) -> None:
    """Whiten columns by an autoregression; ``found``: the logarithm of the product of the samples' spreads."""
    count, width, order = values.shape[0], values.shape[1], spreads.shape[0] - 1
    total = 0.0
    for sample in range(count):
        stage = min(sample, order)
        root = math.sqrt(weights[sample]) / spreads[stage]
        total -= math.log(root)
        for column in range(width):
            errors[sample, column] = values[sample, column]
        for back in range(stage):
            coefficient = predictors[stage, back]
            for column in range(width):
                errors[sample, column] -= coefficient * values[sample - 1 - back, column]
        for column in range(width):
            errors[sample, column] *= root
    found[0] = total


def innovations(
    values: Table,
    weights: Vector,
    expected: Vector,
    errors: Table,
    found: Vector,
    memory: float,
    change: float,
    first: float,
) -> None:
    """Whiten columns by Kalman's filter of a drift; ``expected`` begins as 0 for each column.

    ``found``: the logarithm of the product of the samples' spreads.
    """
    unknown, logs = first, 0.0
    for sample in range(values.shape[0]):
        total = unknown + 1.0 / weights[sample]
        gain, spread = unknown / total, math.sqrt(total)
        logs += math.log(spread)
        for column in range(values.shape[1]):
            new = values[sample, column] - expected[column]
            errors[sample, column] = new / spread
            expected[column] = memory * (expected[column] + gain * new)
        unknown = memory * memory * unknown * (1.0 - gain) + change
    found[0] = logs


def sum_of_innovations(
    segment: Vector, weights: Vector, found: Vector, memory: float, change: float, first: float
) -> None:
    """The same filter of one column; ``found``: the sum of the squares of what it leaves, and that logarithm."""
    expected, unknown, squares, logs = 0.0, first, 0.0, 0.0
    for sample in range(segment.shape[0]):
        total = unknown + 1.0 / weights[sample]
        gain, new = unknown / total, segment[sample] - expected
        squares += new * new / total
        logs += 0.5 * math.log(total)
        expected = memory * (expected + gain * new)
        unknown = memory * memory * unknown * (1.0 - gain) + change
    found[0] = squares
    found[1] = logs


def smooth(
    values: Vector,
    variances: Vector,
    normals: Vector,
    path: Vector,
    spread: Vector,
    memory: float,
    change: float,
    first: float,
) -> None:
    """Draw the ``path`` of a drift given the samples, and find its variance, by a smoother backwards in time.

    On the way there ``path`` and ``spread`` hold what the filter forwards knows of the drift at each sample.
    """
    count = values.shape[0]
    expected, unknown = 0.0, first
    for sample in range(count):
        gain = unknown / (unknown + variances[sample])
        path[sample] = expected + gain * (values[sample] - expected)
        spread[sample] = unknown * (1.0 - gain)
        expected = memory * path[sample]
        unknown = memory * memory * spread[sample] + change
    path[count - 1] += math.sqrt(spread[count - 1]) * normals[count - 1]
    for back in range(1, count):
        sample = count - 1 - back
        mean, left = path[sample], spread[sample]
        ahead = memory * memory * left + change
        gain = memory * left / ahead
        own = left * change / ahead
        path[sample] = mean + gain * (path[sample + 1] - memory * mean) + math.sqrt(own) * normals[sample]
        spread[sample] = own + gain * gain * spread[sample + 1]


def mixture_likelihood(
    values: Vector, weights: Vector, nodes: Vector, found: Vector, memory: float, change: float, first: float
) -> None:
    """The filter of a drift under white noise that is a sum of normal distributions; ``found``: the log likelihood."""
    expected, unknown, total = 0.0, first, 0.0
    for sample in range(values.shape[0]):
        new = values[sample] - expected
        density, mean, square = 0.0, 0.0, 0.0
        for part in range(nodes.shape[0]):
            spread = unknown + 1.0 / nodes[part]
            chance = weights[part] * math.exp(-0.5 * new * new / spread) / math.sqrt(2.0 * math.pi * spread) + 1.0e-300
            gain = unknown / spread
            density += chance
            mean += chance * gain * new
            square += chance * (unknown * (1.0 - gain) + (gain * new) * (gain * new))
        mean /= density
        left = max(square / density - mean * mean, 1.0e-12 * unknown)
        total += math.log(density)
        expected = memory * (expected + mean)
        unknown = memory * memory * left + change
    found[0] = total


def scales_of_t(squares: Vector, freedoms: Vector, variances: Vector, rounds: int) -> None:
    """Improve the variance of a t distribution of each of the degrees of freedom in some rounds."""
    count = squares.shape[0]
    for place in range(freedoms.shape[0]):
        freedom = freedoms[place]
        for _ in range(rounds):
            inverse, total = 1.0 / variances[place], 0.0
            for sample in range(count):
                total += squares[sample] / (freedom + squares[sample] * inverse)
            variances[place] = total * (freedom + 1.0) / count


def sums_of_logs(squares: Vector, scales: Vector, totals: Vector, largest: float) -> None:
    """Sum log(1 + square / scale) for each scale; products of many, up to ``largest``, need one logarithm."""
    for place in range(scales.shape[0]):
        inverse, product, total = 1.0 / scales[place], 1.0, 0.0
        for sample in range(squares.shape[0]):
            product *= 1.0 + squares[sample] * inverse
            if product > largest:
                total += math.log(product)
                product = 1.0
        totals[place] = total + math.log(product)


def likelihood_left(whole: Table, root: Table, found: Vector, smallest: float) -> None:
    """The log likelihood from Cholesky's factor ``root`` of products of columns and, last, of residuals.

    ``found`` stays as it is where a pivot is below ``smallest`` of its column: columns, or the residuals, are nearly
    those of others. The last pivot is what is left of the residuals when the columns have taken their part.
    """
    count, logs = whole.shape[0], 0.0
    for row in range(count):
        for column in range(row):
            total = whole[row, column]
            for before in range(column):
                total -= root[row, before] * root[column, before]
            root[row, column] = total / root[column, column]
        pivot = whole[row, row]
        for before in range(row):
            pivot -= root[row, before] * root[row, before]
        # Not a number is not above, either.
        if not pivot > smallest * smallest * whole[row, row]:
            break
        root[row, row] = math.sqrt(pivot)
        if row < count - 1:
            logs += math.log(root[row, row])
        else:
            found[0] = -0.5 * (root[row, row] * root[row, row]) - logs
