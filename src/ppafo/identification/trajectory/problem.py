"""A trajectory fit as values: which numbers are free, which recordings they are to explain, and how to search."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.trajectory.paths import declaration_of, full_path, number_at
from ppafo.signals import Recording
from ppafo.simulation.scenario import PYTHON_CONTROLLER, FreeMotion, Scenario

FITTED_CHANNELS = ("angle", "pressure_1", "pressure_2")
"""What a recording is compared in [rad], [Pa], [Pa]."""

INPUTS = ("supply_pressure", "command")
"""Channels that a scenario may take from the recording, as constants."""

Scale = Literal["log", "linear"]
Loss = Literal["linear", "soft_l1", "huber"]
InitialState = Literal["scenario", "recording"]

_FURTHEST = 100.0
_ADDED = frozenset({"friction", "motion", "initial", "supply"})
"""Sections whose numbers add up in the equations: their likelihood is normal in themselves, not in their logarithms."""


@dataclass(frozen=True, slots=True)
class Prior:
    """What is known of a number beforehand: a normal distribution, in SI units."""

    mean: float
    standard_deviation: float


@dataclass(frozen=True, slots=True)
class FreeParameter:
    """A number to be fitted, by its path such as ``friction.viscous_damping`` or ``initial.pressure_1``; SI units.

    ``start`` None begins at the value of the scenario. On the ``log`` scale, for positive numbers, steps and intervals
    are ratios; ``scale`` None takes it for volumes, conductances, areas and the inertia, and ``linear`` for friction,
    pressures and motion. Bounds left out are the declared ones, at most a factor of 100 from the start. ``recordings``
    limits the number to some experiments, by label: an initial pressure belongs to one.
    """

    path: str
    start: float | None = None
    low: float | None = None
    high: float | None = None
    scale: Scale | None = None
    prior: Prior | None = None
    recordings: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The path, with the experiments where it is limited to some."""
        return f"{self.path} of {', '.join(self.recordings)}" if self.recordings else self.path


@dataclass(frozen=True, slots=True)
class Experiment:
    """A recording and the scenario that is to explain it; time ``start`` [s] of the recording is time 0 of the run.

    ``noise`` is the standard deviation by channel [rad], [Pa]; channels without one have it estimated from the
    recording. ``channels`` are those that are compared. ``inputs`` names measured channels that replace the scenario's
    own constants: the mean ``supply_pressure`` and the ``command``. ``initial_state`` takes angle and pressures at the
    start from the scenario or, as means of the samples up to the start, from the recording. ``source`` names the file
    and its hash.
    """

    label: str
    scenario: Scenario
    recording: Recording
    start: float = 0.0
    channels: tuple[str, ...] = FITTED_CHANNELS
    noise: Mapping[str, float] = field(default_factory=dict)
    inputs: tuple[str, ...] = ()
    initial_state: InitialState = "scenario"
    source: str = ""


@dataclass(frozen=True, slots=True)
class Search:
    """How to look for the optimum: loss, number of starts besides the first, seed of their draws, and limits.

    A robust loss counts residuals beyond 1.345 standard deviations less. ``identified`` and ``weak`` are the half
    widths of an interval, relative to the number, up to which it is called so.
    """

    loss: Loss = "linear"
    other_starts: int = 0
    seed: int = 1
    most_evaluations: int = 60
    confidence: float = 0.95
    identified: float = 0.2
    weak: float = 1.0


@dataclass(frozen=True, slots=True)
class TrajectoryProblem:
    """Numbers to be fitted to recordings. IdentificationError for a problem that makes no sense."""

    parameters: tuple[FreeParameter, ...]
    experiments: tuple[Experiment, ...]
    search: Search = Search()

    def __post_init__(self) -> None:
        if not self.parameters or not self.experiments:
            raise IdentificationError("a trajectory fit needs at least one parameter and at least one recording")
        _refuse_twice("experiment", [item.label for item in self.experiments])
        for experiment in self.experiments:
            _check_experiment(experiment)
        labels = [item.label for item in self.experiments]
        for parameter in self.parameters:
            for label in parameter.recordings:
                if label not in labels:
                    hint = nearest_name(label, labels)
                    raise IdentificationError(f"{parameter.path}: there is no experiment '{label}'{hint}")
        _refuse_twice("parameter", [item.name for item in ranges_of(self)])

    def experiments_with(self, parameter: FreeParameter) -> tuple[Experiment, ...]:
        """Return the experiments in which a parameter acts."""
        return tuple(
            item for item in self.experiments if not parameter.recordings or item.label in parameter.recordings
        )


@dataclass(frozen=True, slots=True)
class Range:
    """A parameter with everything settled: full path, unit, scale, start and bounds, SI units.

    ``size`` is what one unit of the coordinate of a linear parameter stands for.
    """

    path: str
    name: str
    unit: str
    scale: Scale
    start: float
    low: float
    high: float
    size: float
    prior: Prior | None
    recordings: tuple[str, ...]

    def coordinate(self, number: float) -> float:
        """Return the coordinate [-] in which the search goes: a logarithm, or the number over its size."""
        return math.log(number) if self.scale == "log" else number / self.size

    def number(self, coordinate: float) -> float:
        """Return the number in SI units at a coordinate."""
        return math.exp(coordinate) if self.scale == "log" else float(coordinate * self.size)

    def slope(self, coordinate: float) -> float:
        """Return the change of the number per change of its coordinate."""
        return math.exp(coordinate) if self.scale == "log" else self.size


def ranges_of(problem: TrajectoryProblem) -> tuple[Range, ...]:
    """Return all parameters of a problem with start, bounds and scale settled; refuses those that contradict."""
    return tuple(_range(problem, parameter) for parameter in problem.parameters)


def _range(problem: TrajectoryProblem, parameter: FreeParameter) -> Range:
    scenarios = [item.scenario for item in problem.experiments_with(parameter)]
    paths = {full_path(parameter.path, scenario) for scenario in scenarios}
    if len(paths) > 1:
        raise IdentificationError(
            f"{parameter.path} means {' and '.join(sorted(paths))} in these experiments; name one, and its recordings"
        )
    path = paths.pop()
    quantity = [declaration_of(path, scenario) for scenario in scenarios][-1]
    start = number_at(scenarios[0], path) if parameter.start is None else parameter.start
    is_ratio = start > 0.0 and quantity.minimum >= 0.0 and path.partition(".")[0] not in _ADDED
    scale = parameter.scale or ("log" if is_ratio else "linear")
    low = max(quantity.minimum, start / _FURTHEST) if scale == "log" and start > 0.0 else quantity.minimum
    high = min(quantity.maximum, start * _FURTHEST) if start > 0.0 else quantity.maximum
    low, high = (low if parameter.low is None else parameter.low), (high if parameter.high is None else parameter.high)
    _check_range(parameter, scale, start, low, high)
    if low < quantity.minimum or high > quantity.maximum:
        raise IdentificationError(
            f"{parameter.name}: bounds {low:.6g} to {high:.6g} leave what is allowed, "
            f"{quantity.minimum:.6g} to {quantity.maximum:.6g} {quantity.unit}".rstrip()
        )
    unit = quantity.unit.removesuffix("_a") or "-"
    size = abs(start) or (0.5 * (high - low))
    name = full_path(parameter.name, scenarios[0])
    return Range(path, name, unit, scale, start, low, high, size, parameter.prior, parameter.recordings)


def _check_range(parameter: FreeParameter, scale: Scale, start: float, low: float, high: float) -> None:
    if not all(math.isfinite(number) for number in (start, low)) or math.isnan(high):
        raise IdentificationError(f"{parameter.name}: start and bounds must be finite numbers")
    if not low < high or not low <= start <= high:
        raise IdentificationError(
            f"{parameter.name}: start {start:.6g} must lie between the bounds {low:.6g} and {high:.6g}"
        )
    if scale == "log" and low <= 0.0:
        raise IdentificationError(
            f"{parameter.name}: the log scale needs a start and bounds above 0; give them, or scale 'linear'"
        )
    if start == 0.0 and (parameter.high is None or not math.isfinite(high - low)):
        raise IdentificationError(f"{parameter.name}: a start at 0 needs bounds, because they say what a small step is")
    if parameter.prior is not None and not parameter.prior.standard_deviation > 0.0:
        raise IdentificationError(f"{parameter.name}: the standard deviation of a prior must be above 0")
    if parameter.prior is not None and scale == "log" and parameter.prior.mean <= 0.0:
        raise IdentificationError(f"{parameter.name}: on the log scale the mean of a prior must be above 0")


def _check_experiment(experiment: Experiment) -> None:
    said = f"experiment '{experiment.label}'"
    for name in experiment.channels:
        if name not in FITTED_CHANNELS:
            raise IdentificationError(f"{said}: channel '{name}' cannot be fitted; {', '.join(FITTED_CHANNELS)} can")
        if name not in experiment.recording:
            have = ", ".join(experiment.recording.names)
            raise IdentificationError(f"{said}: {experiment.recording.label} has no channel '{name}'; it has {have}")
    if not experiment.channels:
        raise IdentificationError(f"{said}: no channel is to be compared")
    if experiment.channels == ("angle",) and not isinstance(experiment.scenario.motion, FreeMotion):
        raise IdentificationError(f"{said}: the vane is led, so its angle says nothing; add a pressure")
    if experiment.scenario.control.kind == PYTHON_CONTROLLER:
        raise IdentificationError(f"{said}: a Python controller cannot run in lanes; use one of the catalogue")
    _check_given(experiment, said)


def _check_given(experiment: Experiment, said: str) -> None:
    for name in experiment.inputs:
        if name not in INPUTS:
            raise IdentificationError(f"{said}: '{name}' is no measured input; {', '.join(INPUTS)} are")
    for name, deviation in experiment.noise.items():
        if not (math.isfinite(deviation) and deviation > 0.0):
            raise IdentificationError(f"{said}: the noise of '{name}' must be above 0, not {deviation!r}")


def _refuse_twice(what: str, names: list[str]) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise IdentificationError(f"{what} '{twice[0]}' is named twice")
