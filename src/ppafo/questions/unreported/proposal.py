"""Where to draw next: near the completions that agreed so far, and, for a fraction, anywhere.

Completions are points in the unit cube, evenly spread before anything is compared. A proposal is a mixture of bells
around some points, with the spread and the correlations of those that agreed, and of the even spread; a choice is kept
with some probability or drawn anew. What falls outside the cube is no completion and is dropped. The density is known,
so every completion can be weighed as if all had been drawn from the mixture of all proposals (deterministic mixture;
Owen and Zhou, J. Am. Stat. Assoc. 95 (2000) 135).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ANYWHERE = 0.2
KEEPS_CHOICE = 0.7
CENTRES = 200
NARROWEST = 0.02
"""Smallest standard deviation of a bell along any direction, of the side of the cube."""
ENOUGH = 100.0
"""Effective number of completions that the bells are laid around; weights are tempered until there are as many."""
_ROWS = 512
"""Points whose densities are computed together: few enough that their table of bells stays in the cache of a core."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """Bells around ``centres`` (bells, dimensions); ``cells`` of a choice, 0 for a number.

    ``shape`` (numbers, numbers) is the lower Cholesky factor of the bells' covariance over the numbers.
    """

    centres: Floats
    shape: Floats
    cells: tuple[int, ...]

    @property
    def numbers(self) -> list[int]:
        """Columns that are numbers, not choices."""
        return [column for column, cells in enumerate(self.cells) if not cells]

    def draw(self, count: int, chance: np.random.Generator) -> Floats:
        """Those of ``count`` drawn points that lie in the cube (points, dimensions)."""
        chosen = self.centres[chance.integers(len(self.centres), size=count)]
        near = chosen.copy()
        steps = chance.standard_normal((count, len(self.numbers))) @ self.shape.T
        near[:, self.numbers] += steps
        for column, cells in enumerate(self.cells):
            if cells:
                within = (np.floor(chosen[:, column] * cells) + chance.random(count)) / cells
                anew = chance.random(count) > KEEPS_CHOICE
                near[:, column] = np.where(anew, chance.random(count), within)
        anywhere = chance.random(count) < ANYWHERE
        points = np.where(anywhere[:, None], chance.random(chosen.shape), near)
        return np.asarray(points[((points >= 0.0) & (points < 1.0)).all(axis=1)])

    def density(self, points: Floats) -> Floats:
        """Density (points,) over the even spread, of points in the cube."""
        parts = [self._density(points[first : first + _ROWS]) for first in range(0, len(points), _ROWS)]
        return np.concatenate(parts)

    def _density(self, points: Floats) -> Floats:
        here, there = (np.linalg.solve(self.shape, rows[:, self.numbers].T).T for rows in (points, self.centres))
        squares = (here**2).sum(axis=1)[:, None] + (there**2).sum(axis=1)[None, :] - 2.0 * here @ there.T
        scale = (2.0 * math.pi) ** (-0.5 * len(self.numbers)) / np.prod(np.diag(self.shape))
        total = scale * np.exp(-0.5 * np.maximum(squares, 0.0))
        for column, cells in enumerate(self.cells):
            if cells:
                same = np.floor(points[:, column, None] * cells) == np.floor(self.centres[None, :, column] * cells)
                total *= (1.0 - KEEPS_CHOICE) + KEEPS_CHOICE * cells * same
        return np.asarray(ANYWHERE + (1.0 - ANYWHERE) * total.mean(axis=1))


def effective(weights: Floats) -> float:
    """Number of points [-] that equal weights would need to say as much."""
    squares = float((weights**2).sum())
    return float(weights.sum()) ** 2 / squares if squares > 0.0 else 0.0


def temper(weights: Floats) -> Floats:
    """The weights, flattened by the least power that leaves enough of them; they add up to 1."""
    power = 1.0
    positive = weights > 0.0
    enough = min(ENOUGH, 0.5 * float(positive.sum()))
    flat = weights
    while power > 0.01:
        flat = np.where(positive, np.where(positive, weights, 1.0) ** power, 0.0)
        if effective(flat) >= enough:
            break
        power *= 0.8
    return np.asarray(flat / flat.sum())


def next_proposal(
    points: Floats, weights: Floats, cells: tuple[int, ...], chance: np.random.Generator
) -> Proposal | None:
    """The proposal after points with weights; None where nothing has any weight."""
    if not weights.sum() > 0.0:
        return None
    flat = temper(weights)
    centres = points[chance.choice(len(points), size=CENTRES, p=flat)]
    numbers = points[:, [column for column, count in enumerate(cells) if not count]]
    away = numbers - flat @ numbers
    covariance = (flat[:, None] * away).T @ away
    narrowing = effective(flat) ** (-1.0 / (numbers.shape[1] + 4.0))
    return Proposal(
        centres, np.linalg.cholesky(narrowing**2 * covariance + NARROWEST**2 * np.eye(len(covariance))), cells
    )
