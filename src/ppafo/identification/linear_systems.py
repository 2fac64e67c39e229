"""Linear systems whose scale and rank come from their data, so that no computer solves a singular one in its own way.

What columns do not see is neither solved for nor said to be known.
"""

from typing import NamedTuple

import numpy as np

from ppafo.signals.recording import Floats

RANK = 1.0e-14
"""Fraction of the largest eigenvalue of products of columns of one size below which another is rounding."""


class Axes(NamedTuple):
    """Scale of each column, in its unit, and eigenvalues (growing) and vectors [-] of products of scaled columns."""

    scale: Floats
    values: Floats
    vectors: Floats

    @property
    def least(self) -> float:
        """Eigenvalue [-] below which columns see nothing of a direction."""
        return RANK * max(float(self.values[-1]), 1.0)


def axes_of(products: Floats) -> Axes:
    """Return the principal axes of the products of columns (columns, columns); a column of zeros has a scale of 1."""
    sizes = np.sqrt(np.maximum(np.diag(products), 0.0))
    scale = np.where(sizes > 0.0, sizes, 1.0)
    values, vectors = np.linalg.eigh(products / scale / scale[:, None])
    return Axes(scale, values, vectors)


def rank_of(products: Floats) -> int:
    """Return how many directions columns see."""
    axes = axes_of(products)
    return int((axes.values > axes.least).sum())


def solution_of(products: Floats, product: Floats) -> Floats:
    """Return the coefficients of columns, in their units, from their products with each other and with the values.

    They are 0 along a direction that the columns do not see.
    """
    axes = axes_of(products)
    seen = axes.values > axes.least
    along = axes.vectors[:, seen].T @ (product / axes.scale) / axes.values[seen]
    return np.asarray(axes.vectors[:, seen] @ along / axes.scale)


def inverse_of(products: Floats) -> Floats:
    """Return the inverse of the products of columns; huge, not 0, along a direction that the columns do not see."""
    axes = axes_of(products)
    whole = (axes.vectors / np.maximum(axes.values, axes.least)) @ axes.vectors.T
    return np.asarray(whole / axes.scale / axes.scale[:, None])


def inverse_of_steps(steps: Floats) -> Floats:
    """Return the inverse of independent steps, as columns, along coordinates whose units differ by powers of ten."""
    # By powers of two, which round nothing.
    scale = np.ldexp(1.0, np.frexp(np.max(np.abs(steps), axis=1, initial=0.0))[1])
    return np.asarray(np.linalg.inv(steps / scale[:, None]) / scale)
