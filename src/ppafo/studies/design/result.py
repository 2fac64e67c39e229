"""What a design study finds: the front as designs in words and SI numbers, the one to look at first, and the doubts."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ppafo.parameters.parts import Part
from ppafo.studies.design.candidates import Floats
from ppafo.studies.design.problem import DesignProblem


@dataclass(frozen=True, slots=True)
class DesignPoint:
    """A design that no other one found beats: parts, chosen numbers [SI] by path, error [N m], gas and mass [kg].

    ``tasks`` has error and gas of each task by its name.
    """

    valve: Part
    actuator: Part
    numbers: Mapping[str, float]
    error: float
    gas: float
    mass: float
    tasks: Mapping[str, tuple[float, float]]

    @property
    def objectives(self) -> tuple[float, float, float]:
        """Error [N m], gas per task [kg], mass [kg]."""
        return self.error, self.gas, self.mass


@dataclass(frozen=True, slots=True)
class Design:
    """The result of a design study.

    ``front`` is in order of error. ``shown`` are places in it that stand for all of it in a table, ``knee`` is the
    place of the suggestion and ``reason`` says why. ``growth`` has pairs of designs evaluated and hypervolume [-];
    ``failures`` maps the reason of a failed run to the task it failed in.
    """

    problem: DesignProblem
    front: tuple[DesignPoint, ...]
    shown: tuple[int, ...]
    knee: int
    reason: str
    growth: tuple[tuple[int, float], ...]
    settled: bool
    designs: int
    runs: int
    failed: int
    failures: Mapping[str, str]
    seconds: float

    @property
    def doubtful(self) -> tuple[tuple[Part, str], ...]:
        """Figures that are quoted or assumed, of the parts on the front and of those that every design carries."""
        used = {part.name for point in self.front for part in (point.valve, point.actuator)}
        used |= {part.name for part in self.problem.carried}
        return tuple((part, name) for part in self.problem.parts if part.name in used for name in part.doubtful)


def objective_table(front: tuple[DesignPoint, ...]) -> Floats:
    """Return the objectives of designs, (designs, 3)."""
    return np.array([point.objectives for point in front]).reshape(-1, 3)
