"""A trajectory fit as values: which numbers are free, which recordings they are to explain, and how to search."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from ppafo.errors import IdentificationError, first_twice, nearest_name
from ppafo.identification.source import Use, double_use
from ppafo.identification.trajectory.experiment import (
    TIME_OFFSET,
    Experiment,
    check_experiment,
    declaration_of,
    full_path,
    number_at,
    scenario_of,
)
from ppafo.model.declaration import Quantity
from ppafo.simulation.recorded.inputs import DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY, supply_paths

Scale = Literal["log", "linear"]

LONGEST_TIME_OFFSET = 0.02
"""Bounds [s] of a fitted time offset where none are given: a trigger or a sensor, not another experiment."""

_FURTHEST = 100.0
_ADDED = frozenset({"friction", "motion", "initial", "supply"})
"""Sections whose numbers add up in the equations: their likelihood is normal in themselves, not in their logarithms."""

_STATE = frozenset({"motion", "initial"})
"""Sections that say how a run begins, which the recording may say better."""

_SUPPLIES = {
    "supply.pressure": "plant.supply_pressure",
    "supply.dorsiflexion_pressure": "plant.dorsiflexion_pressure",
}


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
    limits the number to some experiments, by label: an initial pressure belongs to one, and so does
    ``recording.time_offset`` [s], by which its samples are later than the run.
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

    def acts_in(self, label: str) -> bool:
        """Return whether the number acts in the experiment with this label."""
        return not self.recordings or label in self.recordings

    def coordinate(self, number: float) -> float:
        """Return the coordinate [-] in which the search goes: a logarithm, or the number over its size."""
        return math.log(number) if self.scale == "log" else number / self.size

    def number(self, coordinate: float) -> float:
        """Return the number in SI units at a coordinate."""
        return math.exp(coordinate) if self.scale == "log" else float(coordinate * self.size)

    def slope(self, coordinate: float) -> float:
        """Return the change of the number [SI] per change of its coordinate."""
        return math.exp(coordinate) if self.scale == "log" else self.size


def range_of(parameter: FreeParameter, experiments: Sequence[Experiment]) -> Range:
    """Return a parameter with all of it settled; ``experiments`` are those it acts in. Refuses what contradicts.

    IdentificationError for a contradiction.
    """
    scenarios = [item.scenario for item in experiments]
    paths = {full_path(parameter.path, scenario) for scenario in scenarios}
    if len(paths) > 1:
        raise IdentificationError(
            f"{parameter.path} means {' and '.join(sorted(paths))} in these experiments; name one, and its recordings"
        )
    path = paths.pop()
    quantity = [declaration_of(path, scenario) for scenario in scenarios][-1]
    for experiment in experiments:
        _refuse_followed(parameter, path, experiment)
    start = _usual_start(path, experiments[0]) if parameter.start is None else parameter.start
    is_ratio = start > 0.0 and quantity.minimum >= 0.0 and path.partition(".")[0] not in _ADDED
    scale = parameter.scale or ("log" if is_ratio else "linear")
    low, high = _default_bounds(path, quantity, start, scale)
    low, high = (low if parameter.low is None else parameter.low), (high if parameter.high is None else parameter.high)
    _check_range(parameter, scale, start, low, high)
    if low < quantity.minimum or high > quantity.maximum:
        raise IdentificationError(
            f"{parameter.name}: bounds {low:.6g} to {high:.6g} exceed what is allowed, "
            f"{quantity.minimum:.6g} to {quantity.maximum:.6g} {quantity.unit}".rstrip()
        )
    unit = quantity.unit.removesuffix("_a") or "-"
    size = 0.5 * (high - low) if start == 0.0 or path == TIME_OFFSET else abs(start)
    name = full_path(parameter.name, scenarios[0])
    return Range(path, name, unit, scale, start, low, high, size, parameter.prior, parameter.recordings)


def is_nuisance(item: Range) -> bool:
    """Return whether a number belongs to one recording's beginning and is fitted only because nobody knows it."""
    return bool(item.recordings) and (item.path == TIME_OFFSET or item.path.startswith("initial."))


def reach_of(ranges: Sequence[Range]) -> float:
    """Return the largest time offset [s] among the bounds of parameters; 0 where none is fitted."""
    reaches = [max(abs(item.low), abs(item.high)) for item in ranges if item.path == TIME_OFFSET]
    return max(reaches, default=0.0)


def _usual_start(path: str, experiment: Experiment) -> float:
    """Return where a number begins that was given no start: what the recording says of the state, else the scenario."""
    is_state = path.partition(".")[0] in _STATE
    return number_at(scenario_of(experiment) if is_state else experiment.scenario, path)


def _default_bounds(path: str, quantity: Quantity, start: float, scale: Scale) -> tuple[float, float]:
    """Return the bounds of a number that was given none."""
    if path == TIME_OFFSET:
        return -LONGEST_TIME_OFFSET, LONGEST_TIME_OFFSET
    low = max(quantity.minimum, start / _FURTHEST) if scale == "log" and start > 0.0 else quantity.minimum
    return low, min(quantity.maximum, start * _FURTHEST) if start > 0.0 else quantity.maximum


def _refuse_followed(parameter: FreeParameter, path: str, experiment: Experiment) -> None:
    """Refuse a number that a run takes from its recording instead."""
    followed = dict.fromkeys(supply_paths(experiment.scenario.device), SUPPLY)
    if DORSIFLEXION_SUPPLY in experiment.inputs:
        followed["plant.dorsiflexion_pressure"] = DORSIFLEXION_SUPPLY
    channel = EXTERNAL_TORQUE if path == "motion.external_torque" else followed.get(_SUPPLIES.get(path, ""))
    if channel in experiment.inputs:
        raise IdentificationError(
            f"{parameter.name}: the run of experiment '{experiment.label}' follows the recorded '{channel}', so this "
            f"number has no effect in it; omit one of the two"
        )


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
    if start == 0.0 and ((parameter.high is None and parameter.path != TIME_OFFSET) or not math.isfinite(high - low)):
        raise IdentificationError(
            f"{parameter.name}: a start at 0 needs bounds, because they define what a small step is"
        )
    if parameter.prior is not None and not parameter.prior.standard_deviation > 0.0:
        raise IdentificationError(f"{parameter.name}: the standard deviation of a prior must be above 0")
    if parameter.prior is not None and scale == "log" and parameter.prior.mean <= 0.0:
        raise IdentificationError(f"{parameter.name}: on the log scale the mean of a prior must be above 0")


Loss = Literal["linear", "soft_l1", "huber"]


@dataclass(frozen=True, slots=True)
class Search:
    """How to look for the optimum: loss, number of starts besides the first, seed of their draws, and limits.

    A robust loss counts residuals beyond 1.345 standard deviations less. ``identified`` and ``weak`` are the half
    widths of an interval, relative to the number, up to which it is called so.
    """

    loss: Loss = "linear"
    other_starts: int = 0
    seed: int = 1
    maximum_evaluations: int = 60
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
            check_experiment(experiment)
        twice = double_use(use_of(item) for item in self.experiments)
        if twice:
            raise IdentificationError(twice)
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


def ranges_of(problem: TrajectoryProblem) -> tuple[Range, ...]:
    """Return all parameters of a problem with start, bounds and scale settled; refuses those that contradict."""
    return tuple(range_of(parameter, problem.experiments_with(parameter)) for parameter in problem.parameters)


def use_of(item: Experiment) -> Use:
    """Return what of its recording an experiment is compared with."""
    last = float(item.recording.time[-1])
    trace = item.source or item.recording.label
    return Use(f"experiment '{item.label}'", trace, item.recording, frozenset(item.channels), item.start, last)


def _refuse_twice(what: str, names: list[str]) -> None:
    twice = first_twice(names)
    if twice is not None:
        raise IdentificationError(f"{what} '{twice}' is named twice")
