"""Where completions are likely to agree with the paper: a mixture that they are drawn from, found beforehand.

Each part of the mixture has a bell with heavy tails over the numbers (Student's t, in the scale in which the even
spread is a normal distribution) and a probability for each choice. Its density is known, so that every completion is
weighed for how likely it was drawn, and the mixture decides how many draws an answer needs, never what it is.
``python scripts/unreported_proposal.py`` finds it by another method, a population that wanders, and writes the file.
"""

import math
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
from scipy.special import ndtr, ndtri

from ppafo.questions.unreported.settings import CELLS, Floats

FREEDOM = 6.0
"""Degrees of freedom of the tails."""
_EDGE = 1.0e-12
"""How near to a side of the cube a point is taken to lie at most, where the scale has no end."""
_FILE = resources.files("ppafo.questions.unreported") / "proposal.csv"


@dataclass(frozen=True, slots=True)
class Proposal:
    """A mixture over the unit cube; ``cells`` of a choice, 0 for a number.

    ``weights`` (parts,) add up to 1; ``centres`` (parts, numbers) and ``shapes`` (parts, numbers, numbers), lower
    Cholesky factors, are in the normal scale; ``shares`` has for each choice the probabilities (parts, choices).
    """

    weights: Floats
    centres: Floats
    shapes: Floats
    shares: tuple[Floats, ...]
    cells: tuple[int, ...]

    @property
    def numbers(self) -> list[int]:
        """Columns that are numbers."""
        return [column for column, cells in enumerate(self.cells) if not cells]

    @property
    def choices(self) -> list[int]:
        """Columns that are choices."""
        return [column for column, cells in enumerate(self.cells) if cells]

    def draw(self, count: int, chance: np.random.Generator) -> Floats:
        """Return ``count`` points in the cube (count, settings)."""
        part = chance.choice(self.weights.size, count, p=self.weights)
        spread = np.sqrt(FREEDOM / chance.chisquare(FREEDOM, (count, 1)))
        steps = np.einsum("nij,nj->ni", self.shapes[part], chance.standard_normal((count, len(self.numbers))) * spread)
        points = np.empty((count, len(self.cells)))
        points[:, self.numbers] = np.clip(ndtr(self.centres[part] + steps), 0.0, 1.0 - _EDGE)
        for column, shares in zip(self.choices, self.shares, strict=True):
            cells = self.cells[column]
            chosen = (chance.random((count, 1)) > np.cumsum(shares, axis=1)[part]).sum(axis=1)
            points[:, column] = (np.minimum(chosen, cells - 1) + chance.random(count)) / cells
        return points

    def density(self, points: Floats) -> Floats:
        """Density (points,) over the even spread, of points in the cube."""
        at = normal_scale(points[:, self.numbers])
        chosen = [np.floor(points[:, column] * self.cells[column]).astype(np.intp) for column in self.choices]
        size, total = at.shape[1], np.zeros(len(points))
        scale = math.lgamma(0.5 * (FREEDOM + size)) - math.lgamma(0.5 * FREEDOM) - 0.5 * size * math.log(0.5 * FREEDOM)
        of_even = 0.5 * (at**2).sum(axis=1)
        for number, weight in enumerate(self.weights):
            away = np.linalg.solve(self.shapes[number], (at - self.centres[number]).T)
            logarithm = of_even + scale - np.log(np.diag(self.shapes[number])).sum()
            logarithm -= 0.5 * (FREEDOM + size) * np.log1p((away**2).sum(axis=0) / FREEDOM)
            part = weight * np.exp(logarithm)
            for column, choice, shares in zip(self.choices, chosen, self.shares, strict=True):
                part *= self.cells[column] * shares[number, choice]
            total += part
        return total


def normal_scale(fractions: Floats) -> Floats:
    """Fractions from 0 to 1 in the scale in which evenly spread ones are normally distributed."""
    return np.asarray(ndtri(np.clip(fractions, _EDGE, 1.0 - _EDGE)))


@cache
def shipped_proposal() -> Proposal:
    """Return the mixture that comes with the package."""
    with _FILE.open() as file:
        return from_rows(np.loadtxt(file, delimiter=",", ndmin=2), CELLS)


def from_rows(rows: Floats, cells: tuple[int, ...]) -> Proposal:
    """Return a mixture from a row for each part: weight, centre, shape row by row, probabilities choice by choice."""
    size = cells.count(0)
    lower = np.tril_indices(size)
    weights, centres, shape, shares = np.split(rows, np.cumsum([1, size, lower[0].size]), axis=1)
    shapes = np.zeros((len(rows), size, size))
    shapes[:, lower[0], lower[1]] = shape
    ends = np.cumsum([count for count in cells if count])[:-1]
    # Written to some digits, they no longer add up exactly.
    parts = tuple(part / part.sum(axis=1, keepdims=True) for part in np.split(shares, ends, axis=1))
    return Proposal(weights[:, 0] / weights.sum(), centres, shapes, parts, cells)


def to_rows(proposal: Proposal) -> Floats:
    """Return the rows that ``from_rows`` reads."""
    lower = np.tril_indices(proposal.centres.shape[1])
    shape = proposal.shapes[:, lower[0], lower[1]]
    return np.hstack([proposal.weights[:, None], proposal.centres, shape, *proposal.shares])
