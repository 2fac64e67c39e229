"""Where to draw next: near the completions that agreed so far, and, for a share, anywhere.

Completions are points in the unit cube, evenly spread before anything is compared. A proposal is a mixture of bells
around some points (wrapped round the edges, so that no density is lost there), and of the even spread; a choice is
kept with some probability or drawn anew. Its density is known, so every completion can be weighed as if all had been
drawn from the mixture of all proposals (deterministic mixture; Owen and Zhou, J. Am. Stat. Assoc. 95 (2000) 135).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ANYWHERE = 0.2
KEEPS_CHOICE = 0.7
CENTRES = 400
NARROWEST, WIDEST = 0.02, 0.3
ENOUGH = 300.0
"""Effective number of completions that the bells are laid around; weights are tempered until there are as many."""
_ROWS = 2048


@dataclass(frozen=True, slots=True)
class Proposal:
    """Bells around ``centres`` (bells, dimensions) of widths (dimensions,); ``cells`` of a choice, 0 for a number."""

    centres: Floats
    widths: Floats
    cells: tuple[int, ...]

    def drawn(self, count: int, chance: np.random.Generator) -> Floats:
        """Points (count, dimensions)."""
        chosen = self.centres[chance.integers(len(self.centres), size=count)]
        near = (chosen + self.widths * chance.standard_normal(chosen.shape)) % 1.0
        for column, cells in enumerate(self.cells):
            if cells:
                within = (np.floor(chosen[:, column] * cells) + chance.random(count)) / cells
                anew = chance.random(count) > KEEPS_CHOICE
                near[:, column] = np.where(anew, chance.random(count), within)
        anywhere = chance.random(count) < ANYWHERE
        return np.asarray(np.where(anywhere[:, None], chance.random(chosen.shape), near))

    def density(self, points: Floats) -> Floats:
        """Density (points,) over the even spread."""
        parts = [self._density(points[first : first + _ROWS]) for first in range(0, len(points), _ROWS)]
        return np.concatenate(parts)

    def _density(self, points: Floats) -> Floats:
        total = np.ones((len(points), len(self.centres)))
        for column, cells in enumerate(self.cells):
            here, there = points[:, column, None], self.centres[None, :, column]
            if cells:
                same = np.floor(here * cells) == np.floor(there * cells)
                total *= (1.0 - KEEPS_CHOICE) + KEEPS_CHOICE * cells * same
            else:
                total *= _wrapped_bell(here - there, float(self.widths[column]))
        return np.asarray(ANYWHERE + (1.0 - ANYWHERE) * total.mean(axis=1))


def _wrapped_bell(distance: Floats, width: float) -> Floats:
    images = (distance - 1.0, distance, distance + 1.0)
    scale = 1.0 / (width * math.sqrt(2.0 * math.pi))
    return np.asarray(scale * sum(np.exp(-0.5 * (image / width) ** 2) for image in images))


def effective(weights: Floats) -> float:
    """Number of points [-] that equal weights would need to say as much."""
    squares = float((weights**2).sum())
    return float(weights.sum()) ** 2 / squares if squares > 0.0 else 0.0


def tempered(weights: Floats) -> Floats:
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
    flat = tempered(weights)
    centres = points[chance.choice(len(points), size=CENTRES, p=flat)]
    mean = flat @ points
    spread = np.sqrt(flat @ (points - mean) ** 2)
    narrowing = effective(flat) ** (-1.0 / (len(cells) + 4.0))
    return Proposal(centres, np.clip(spread * narrowing, NARROWEST, WIDEST), cells)
