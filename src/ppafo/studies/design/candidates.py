"""Candidates of a search: a choice among whole numbers and a place in the unit cube for each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Choices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """``choice`` (candidates,) counts from 0; ``places`` (candidates, variables) are from 0 to 1."""

    choice: Choices
    places: Floats

    def __len__(self) -> int:
        """Return the number of candidates."""
        return self.choice.size

    def at(self, members: NDArray[np.bool_] | NDArray[np.intp]) -> "Candidates":
        """Return some of the candidates."""
        return Candidates(self.choice[members], self.places[members])

    def with_more(self, more: "Candidates") -> "Candidates":
        """Return these candidates and then the others."""
        return Candidates(np.concatenate([self.choice, more.choice]), np.concatenate([self.places, more.places]))


@dataclass(frozen=True, slots=True, eq=False)
class Worth:
    """What candidates are worth.

    ``objectives`` (candidates, objectives) are to be small; nan where a candidate could not be evaluated. ``violation``
    (candidates,) is 0 where all constraints are kept, infinite where a run failed.
    """

    objectives: Floats
    violation: Floats

    @property
    def is_feasible(self) -> NDArray[np.bool_]:
        """Which candidates keep all constraints."""
        return np.asarray(self.violation == 0.0)

    def at(self, members: NDArray[np.bool_] | NDArray[np.intp]) -> "Worth":
        """Return the worth of some of the candidates."""
        return Worth(self.objectives[members], self.violation[members])

    def with_more(self, more: "Worth") -> "Worth":
        """Return this and then the other."""
        return Worth(
            np.concatenate([self.objectives, more.objectives]), np.concatenate([self.violation, more.violation])
        )


def evenly_spread(count: int, choices: int, variables: int, seed: int) -> Candidates:
    """Return candidates of a scrambled Sobol sequence; a choice is one more dimension, so that each is met as often."""
    from scipy.stats import qmc

    sequence = qmc.Sobol(variables + 1, rng=np.random.default_rng(seed))
    points = sequence.random_base2(max(0, int(np.ceil(np.log2(count)))))[:count]
    return Candidates(np.minimum((points[:, 0] * choices).astype(np.int64), choices - 1), points[:, 1:])
