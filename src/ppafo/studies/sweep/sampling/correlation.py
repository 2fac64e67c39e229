"""A Gaussian copula: uniform numbers whose normal scores have given correlations, each distribution as it was."""

from collections.abc import Mapping, Sequence

import numpy as np

from ppafo.studies.sweep.sampling.distributions import Floats

Factor = tuple[tuple[float, ...], ...]


def correlation_matrix(paths: Sequence[str], coefficients: Mapping[tuple[str, str], float]) -> Floats:
    """Return the correlation of the normal scores, shape (paths, paths)."""
    matrix = np.eye(len(paths))
    for (one, other), coefficient in coefficients.items():
        row, column = paths.index(one), paths.index(other)
        matrix[row, column] = matrix[column, row] = coefficient
    return matrix


def cholesky_factor(matrix: Floats) -> Factor | None:
    """Return the lower factor, row by row; None where the matrix is not positive definite."""
    try:
        factor = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return None
    return tuple(tuple(float(number) for number in row) for row in factor)


def correlated(uniform: Floats, factor: Factor) -> Floats:
    """Return uniform numbers of the same shape (draws, paths) with correlated normal scores.

    Summed term by term: a matrix product may round otherwise for another number of draws.
    """
    from scipy.special import ndtr, ndtri

    scores = ndtri(uniform)
    columns = []
    for row in factor:
        total = row[0] * scores[:, 0]
        for column in range(1, len(row)):
            if row[column] != 0.0:
                total = total + row[column] * scores[:, column]
        columns.append(total)
    smallest = 2.0**-53
    return np.asarray(np.clip(ndtr(np.stack(columns, axis=1)), smallest, 1.0 - smallest))
