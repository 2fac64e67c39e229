"""A study as frozen values in SI units, and which run has which configuration, grid point and draw."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from ppafo.simulation.scenario import Scenario
from ppafo.studies.distributions import Distribution
from ppafo.studies.outputs import Outputs

SamplingMethod = Literal["random", "latin_hypercube", "sobol"]


@dataclass(frozen=True, slots=True)
class Configuration:
    """A base scenario under the name that tables and figures give it."""

    name: str
    scenario: Scenario


@dataclass(frozen=True, slots=True)
class Axis:
    """The values of a grid or list [SI], in the order of the study file."""

    path: str
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Drawn:
    """A path and the distribution of its values [SI]."""

    path: str
    distribution: Distribution


@dataclass(frozen=True, slots=True)
class Sample:
    """Method, number of draws and seed; one draw, without a method, where nothing has a distribution."""

    method: SamplingMethod | None
    runs: int
    seed: int


@dataclass(frozen=True, slots=True, repr=False)
class Study:
    """Configurations, each run at every grid point with every draw.

    ``same`` has the path that a path follows, by path; ``units`` the SI unit of every varied path, ``only`` the
    configurations of those that do not vary in all; values of the paths in ``gauge`` count from the atmosphere of their
    run [Pa], all others are absolute; ``scores`` is the lower Cholesky factor of the correlation of the
    normal scores, None where there is none; ``runs_of_chunk`` is how many runs are computed together, None for a
    choice that keeps memory small; ``document`` is the study file as plain data, with what was changed on the command
    line; ``text`` the bytes of the file, none where the study came as data.
    """

    name: str
    description: str
    configurations: tuple[Configuration, ...]
    axes: tuple[Axis, ...]
    drawn: tuple[Drawn, ...]
    same: Mapping[str, str]
    scores: tuple[tuple[float, ...], ...] | None
    sample: Sample
    outputs: Outputs
    runs_of_chunk: int | None
    units: Mapping[str, str]
    only: Mapping[str, tuple[str, ...]]
    document: Mapping[str, Any]
    text: bytes
    gauge: frozenset[str] = frozenset()

    def __repr__(self) -> str:
        """Return name, number of runs, configurations and varied paths."""
        return f"Study '{self.name}': {self.runs} runs of {len(self.configurations)} configurations over {self.paths}"

    @property
    def paths(self) -> tuple[str, ...]:
        """The varied paths: grid and lists first, then distributions."""
        return (*(axis.path for axis in self.axes), *(item.path for item in self.drawn))

    @property
    def grid_points(self) -> int:
        """Number of points of the grid, 1 where there is none."""
        points = 1
        for axis in self.axes:
            points *= len(axis.values)
        return points

    @property
    def runs_of_configuration(self) -> int:
        """Number of runs of every configuration."""
        return self.grid_points * self.sample.runs

    @property
    def runs(self) -> int:
        """Number of all runs."""
        return len(self.configurations) * self.runs_of_configuration

    def same_in(self, configuration: str) -> dict[str, str]:
        """Return the path that a path follows, by path, in a configuration."""
        return {path: other for path, other in self.same.items() if self.varies(path, configuration)}

    def varies(self, path: str, configuration: str) -> bool:
        """Tell whether a path is varied in a configuration."""
        return path not in self.only or configuration in self.only[path]


def with_followers(columns: Mapping[str, Any], same: Mapping[str, str]) -> dict[str, Any]:
    """Return the columns, and beside them those of the paths that follow one of them."""
    return {**columns, **{path: columns[other] for path, other in same.items() if other in columns}}
