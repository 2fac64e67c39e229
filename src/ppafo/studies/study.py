"""Study as frozen values in SI units: configurations, grid points, draws, runs, and outputs."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from ppafo.engine.channels import TRACED
from ppafo.errors import PpafoError, StudyError, refused_as
from ppafo.loading import with_overrides
from ppafo.metrics import METRICS
from ppafo.model.controlled import CONTROLLED
from ppafo.model.declaration import Number, Quantity
from ppafo.parameters.declared import Many, Words
from ppafo.parameters.parameter_set import PATHS_THAT_SET_UNITS, chosen_units
from ppafo.parameters.records import keyed
from ppafo.simulation.ensemble import lacking, offered
from ppafo.simulation.scenario import LARGEST_SEED, Scenario
from ppafo.studies.distributions import Distribution
from ppafo.wording import first_twice, known_names

MAXIMUM_RUNS = 2**32
"""Largest number of draws: the period of a 32-bit Sobol sequence; no other method needs a lower limit."""
DEFAULT_SEED = 1
"""Default random seed of the draws of a study."""
_QUANTILES = Many(Quantity("", "", "", None, 0.0, 1.0, plain=True), "of the bands; from 0 to 1", least=1)
_METRICS = Many(Words("", True), "names of metrics, or 'all'", words=("all",))
NO_SAMPLE = "'sample' is missing: distributions need [sample] with method and runs"
"""Error message for a study with distributions but without a number of draws."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outputs:
    """Outputs of a study that are kept of every run: metrics, channels of every run, and channels as quantile bands."""

    metrics: tuple[str, ...] = keyed(_METRICS, ())
    trajectories: tuple[str, ...] = keyed("channels kept for every run", ())
    bands: tuple[str, ...] = keyed("channels whose quantiles over all runs are kept", ())
    errors: bool = keyed("estimated error of each metric from the steps, in five times the time", False)
    every: float = keyed(Number("s", "time between two kept samples", minimum=0.0, minimum_allowed=False), 0.01)
    quantiles: tuple[float, ...] = keyed(_QUANTILES, (0.05, 0.25, 0.5, 0.75, 0.95))

    @property
    def traces(self) -> tuple[str, ...]:
        """Channels needed over time, for trajectories or bands, without duplicates."""
        return tuple(dict.fromkeys((*self.trajectories, *self.bands)))


def valid_outputs(asked: Outputs, scenarios: Sequence[Scenario]) -> Outputs:
    """Return the outputs of a study file with the metrics that some scenario has; StudyError for an unknown name."""
    # The word 'all' stands in the place of the names.
    has_all = str(asked.metrics) == "all"
    metrics = tuple(METRICS) if has_all else asked.metrics
    apply = dict.fromkeys(name for scenario in scenarios for name in offered(scenario))
    requests = (
        ("metrics", "metric", metrics, METRICS, apply),
        ("trajectories", "channel", asked.trajectories, TRACED, TRACED),
        ("bands", "channel", asked.bands, TRACED, TRACED),
    )
    for key, noun, names, known, shown in requests:
        for name in names:
            if name not in known:
                raise StudyError(f"outputs.{key}: there is no {noun} '{name}'{known_names(name, shown or known)}")
        if (repeated := first_twice(names)) is not None:
            raise StudyError(f"outputs.{key}: '{repeated}' is named twice; name it once")
    channels = (*asked.trajectories, *asked.bands)
    controlled = {each.controlled for each in scenarios if not each.controller.is_open_loop}
    for name, kind in CONTROLLED.items():
        if kind.reference in channels and name not in controlled:
            raise StudyError(
                f"outputs: '{kind.reference}' needs a controller with reference.of = '{name}'; none has one"
            )
    # A metric that one configuration has is kept, empty for the others; 'all' takes those that any has.
    has = {name: [lacking(scenario, METRICS[name]) for scenario in scenarios] for name in metrics}
    missing = {name: reasons[0] for name, reasons in has.items() if all(reasons)}
    if missing and not has_all:
        name, reason = next(iter(missing.items()))
        raise StudyError(f"outputs: no scenario has '{name}': {reason}")
    shortest = min(scenario.run.duration for scenario in scenarios)
    if channels and asked.every > shortest:
        raise StudyError(f"outputs.every = {asked.every:g} s must be at most run.duration = {shortest:g} s")
    kept = tuple(name for name in metrics if name not in missing)
    return replace(asked, metrics=kept, quantiles=tuple(sorted(set(map(float, asked.quantiles)))))


SamplingMethod = Literal["random", "latin_hypercube", "sobol"]


@dataclass(frozen=True, slots=True)
class Configuration:
    """Configuration of a study: base scenario, and its name in tables and figures."""

    name: str
    scenario: Scenario


@dataclass(frozen=True, slots=True)
class Axis:
    """Varied path with the values of its grid or list [SI], in the order of the study file."""

    path: str
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class RandomValue:
    """Varied path with the distribution of its values [SI]."""

    path: str
    distribution: Distribution


@dataclass(frozen=True, slots=True)
class SamplingPlan:
    """Sampling plan: method, number of draws and seed; one draw without a method if there are no distributions."""

    method: SamplingMethod | None = keyed("how numbers are drawn")
    runs: int = keyed(
        Number("", "draws; each is run in every configuration", minimum=1, maximum=MAXIMUM_RUNS, whole=True)
    )
    seed: int = keyed(Number("", "", minimum=0, maximum=LARGEST_SEED, whole=True), DEFAULT_SEED)


@dataclass(frozen=True, slots=True, repr=False)
class Study:
    """Study: configurations, each of them run at every grid point with every draw.

    ``axes`` are grids and lists, ``drawn`` the paths with distributions, ``sample`` the sampling plan. ``same`` maps a
    path to the path whose values it shares. ``scores`` is the lower Cholesky factor of the correlation of the normal
    scores, None for none. ``runs_of_chunk`` is the number of runs computed together, None for a number that keeps
    memory small. ``units`` maps each varied path to its SI unit. ``only`` maps a path to its configurations, if it does
    not vary in all. ``document`` is the study file as plain data, with changes from the command line; ``text`` is the
    file in bytes, empty for a study from data. Paths in ``gauge`` hold gauge pressures [Pa] relative to the atmosphere
    of each run, all others absolute ones. ``given`` maps a path to the unit in which its values were given, if not the
    package's own. ``changes`` are the caller's overrides.
    """

    name: str
    description: str
    configurations: tuple[Configuration, ...]
    axes: tuple[Axis, ...]
    drawn: tuple[RandomValue, ...]
    same: Mapping[str, str]
    scores: tuple[tuple[float, ...], ...] | None
    sample: SamplingPlan
    outputs: Outputs
    runs_of_chunk: int | None
    units: Mapping[str, str]
    only: Mapping[str, tuple[str, ...]]
    document: Mapping[str, Any]
    text: bytes
    gauge: frozenset[str] = frozenset()
    given: Mapping[str, str] = field(default_factory=dict)
    changes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return name, number of runs, configurations and varied paths."""
        return f"Study '{self.name}': {self.runs} runs of {len(self.configurations)} configurations over {self.paths}"

    @property
    def paths(self) -> tuple[str, ...]:
        """Varied paths: grids and lists first, then distributions."""
        return (*(axis.path for axis in self.axes), *(number.path for number in self.drawn))

    @property
    def runs_of_configuration(self) -> int:
        """Number of runs of each configuration: draws times grid points."""
        return math.prod(len(axis.values) for axis in self.axes) * self.sample.runs

    @property
    def runs(self) -> int:
        """Number of runs of all configurations."""
        return len(self.configurations) * self.runs_of_configuration

    def shown_for(self, scenario: Scenario) -> dict[str, str]:
        """Return the display unit by SI unit for a scenario: the units given in the study, else the device's units."""
        given = (f"0 {unit}" for path, unit in self.given.items() if path.startswith(PATHS_THAT_SET_UNITS))
        return {**scenario.device.shown, **chosen_units(given)}

    def same_in(self, configuration: str) -> dict[str, str]:
        """Map each path that shares the values of another path to this other path, for one configuration."""
        return {path: other for path, other in self.same.items() if self.varies(path, configuration)}

    def varies(self, path: str, configuration: str) -> bool:
        """Return True if a path is varied in a configuration."""
        return path not in self.only or configuration in self.only[path]


def with_followers(columns: Mapping[str, Any], same: Mapping[str, str]) -> dict[str, Any]:
    """Return the columns, with a copy for each path that shares the values of another path."""
    return {**columns, **{path: columns[other] for path, other in same.items() if other in columns}}


def configurations_with(configurations: Sequence[Configuration], overrides: Iterable[str]) -> tuple[Configuration, ...]:
    """Apply overrides to all configurations, or to a single configuration if addressed as ``NAME:PATH=VALUE``.

    Raises StudyError for an address that no configuration has, and for an override that a configuration refuses.
    """
    names = [configuration.name for configuration in configurations]
    own: dict[str, list[str]] = {name: [] for name in names}
    for text in overrides:
        typed, equals, value = text.partition("=")
        name, colon, path = (part.strip() for part in typed.rpartition(":"))
        if colon and name not in own:
            raise StudyError(f"override '{text}': there is no configuration '{name}'{known_names(name, names)}")
        for addressed in [name] if colon else names:
            own[addressed].append(f"{path}{equals}{value}" if colon else text)
    changed = []
    for configuration in configurations:
        with refused_as(StudyError, f"configuration '{configuration.name}'", PpafoError):
            changed.append(
                replace(configuration, scenario=with_overrides(configuration.scenario, own[configuration.name]))
            )
    return tuple(changed)
