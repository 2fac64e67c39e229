"""A trajectory fit as values: recordings with the scenarios that are to explain them, free numbers, how to search."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ppafo.errors import IdentificationError, first_twice, nearest_name
from ppafo.identification.source import Use, double_use
from ppafo.model.catalog import VALVES, device_effects, find_effects
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import AREA_FORM, SECTIONS, SONIC_FORM
from ppafo.parameters.device import Device, Orifice
from ppafo.signals import Recording
from ppafo.simulation import numbers
from ppafo.simulation.declaration import FREE, INITIAL, LEG, shank_settings
from ppafo.simulation.recorded import (
    ANGLE,
    COMMAND,
    DORSIFLEXION_SUPPLY,
    EXTERNAL_TORQUE,
    SUPPLY,
    between_stops,
    check_absolute,
    check_command,
    check_gaps,
    replay_control,
    supply_paths,
    value_at_rest,
    with_highest_supply,
)
from ppafo.simulation.scenario import PYTHON_CONTROLLER, FreeMotion, Scenario, Sensors

FITTED_CHANNELS = ("angle", "pressure_1", "pressure_2")
"""What a recording is compared in [rad], [Pa], [Pa]."""

INPUTS = (COMMAND, SUPPLY, EXTERNAL_TORQUE)
"""Channels that a run follows where they were recorded, sample by sample, if it has no scenario."""

ALL_INPUTS = (*INPUTS, DORSIFLEXION_SUPPLY, ANGLE)
"""Channels that a run may follow instead of its scenario; a recorded angle prescribes that of the vane."""

InitialState = Literal["scenario", "recording"]


@dataclass(frozen=True, slots=True)
class Experiment:
    """A recording and the scenario that is to explain it; time ``start`` [s] of the recording is time 0 of the run.

    ``noise`` is the standard deviation by channel [rad], [Pa]; channels without one have it estimated from the
    recording. ``channels`` are those that are compared, to the end of the recording. ``inputs`` names measured channels
    that the run follows sample by sample: ``command``, in place of the scenario's controller, ``supply_pressure`` (of
    both inlets where they have one pressure), ``dorsiflexion_pressure``, ``external_torque``, ``angle``.
    ``initial_state`` takes angle and pressures at the start from the scenario or, by the samples up to the start, from
    the recording: their mean, or where a line through them ends if they move. ``source`` names the file and its hash.
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


def check_experiment(experiment: Experiment) -> None:
    """Refuse an experiment that cannot be fitted; the message begins with its label. It is an IdentificationError."""
    said = f"experiment '{experiment.label}'"
    if len(experiment.recording) < 2:
        raise IdentificationError(f"{said}: {experiment.recording.label} has only one sample")
    for name in experiment.channels:
        if name not in FITTED_CHANNELS:
            raise IdentificationError(f"{said}: channel '{name}' cannot be fitted; {', '.join(FITTED_CHANNELS)} can")
        if name not in experiment.recording:
            have = ", ".join(experiment.recording.names)
            raise IdentificationError(f"{said}: {experiment.recording.label} has no channel '{name}'; it has {have}")
    if not experiment.channels:
        raise IdentificationError(f"{said}: there is no channel to compare")
    if ANGLE in experiment.inputs and ANGLE in experiment.channels:
        raise IdentificationError(
            f"{said}: the angle of the vane is prescribed by the recording, so it cannot be compared"
        )
    if experiment.channels == ("angle",) and not isinstance(experiment.scenario.motion, FreeMotion):
        raise IdentificationError(
            f"{said}: the angle of the vane is prescribed, so it carries no information; add a pressure"
        )
    if experiment.scenario.control.kind == PYTHON_CONTROLLER and COMMAND not in experiment.inputs:
        raise IdentificationError(f"{said}: a Python controller cannot run in lanes; use one of the catalogue")
    _check_inputs(experiment, said)


def _check_inputs(experiment: Experiment, said: str) -> None:
    """Refuse measured inputs that a run cannot follow, and a noise that is none."""
    for name in experiment.inputs:
        if name not in ALL_INPUTS:
            hint = nearest_name(name, ALL_INPUTS)
            raise IdentificationError(f"{said}: '{name}' is not a measured input{hint}; use {', '.join(ALL_INPUTS)}")
        if name not in experiment.recording:
            have = ", ".join(experiment.recording.names)
            raise IdentificationError(
                f"{said}: {experiment.recording.label} has no channel '{name}' to follow; it has {have}"
            )
    if EXTERNAL_TORQUE in experiment.inputs and not isinstance(experiment.scenario.motion, FreeMotion):
        raise IdentificationError(
            f"{said}: the angle of the vane is prescribed, so a torque on it has no effect; remove it from inputs"
        )
    motion = experiment.scenario.motion
    if EXTERNAL_TORQUE in experiment.inputs and isinstance(motion, FreeMotion) and motion.leg is not None:
        raise IdentificationError(
            f"{said}: the vane carries the foot of a leg, which T_ex follows from; remove it from inputs, or take a "
            "scenario whose motion is free"
        )
    if COMMAND in experiment.inputs:
        check_command(experiment.recording, said)
    if experiment.inputs:
        check_gaps(experiment.recording, said)
        check_absolute(experiment.recording, experiment.scenario.device.supply.atmospheric_pressure, said)
    for name, deviation in experiment.noise.items():
        if not (math.isfinite(deviation) and deviation > 0.0):
            raise IdentificationError(f"{said}: the noise of '{name}' must be above 0, not {deviation!r}")


_FITS = 1.0e-6


def scenario_of(experiment: Experiment) -> Scenario:
    """Return the scenario of an experiment with all that it takes from the recording, but for the samples of inputs.

    A state that is taken from the recording is that of the samples up to the start.
    """
    scenario, recording = experiment.scenario, experiment.recording
    if {SUPPLY, DORSIFLEXION_SUPPLY} & set(experiment.inputs):
        scenario = replace(scenario, device=with_highest_supply(scenario.device, recording, experiment.inputs))
    if COMMAND in experiment.inputs:
        # Nobody measures for a controller that nobody asks.
        scenario = replace(scenario, control=replay_control(recording), sensors=Sensors())
    said = f"experiment '{experiment.label}'"
    if ANGLE in experiment.inputs:
        # From here the recorded angle prescribes that of the vane.
        angle = np.interp([experiment.start], recording.time, recording[ANGLE])
        scenario = replace(scenario, motion=FreeMotion(float(between_stops(angle, scenario.device, said)[0])))
    if experiment.initial_state == "scenario":
        return scenario
    before = recording.time <= experiment.start + _FITS
    if not before.any():
        raise IdentificationError(
            f"{said}: {recording.label} has no sample up to {experiment.start:g} s, from which the initial state could "
            f"be taken"
        )
    time = recording.time[before]
    rest = {name: value_at_rest(time, recording[name][before], at_end=True) for name in recording.names}
    scenario = replace(
        scenario,
        initial_pressure_1=rest.get("pressure_1", scenario.initial_pressure_1),
        initial_pressure_2=rest.get("pressure_2", scenario.initial_pressure_2),
    )
    if ANGLE in rest and ANGLE not in experiment.inputs and isinstance(scenario.motion, FreeMotion):
        start = float(between_stops(np.array([rest[ANGLE]]), scenario.device, said)[0])
        scenario = replace(scenario, motion=replace(scenario.motion, angle=start))
    return scenario


_DEVICE_SECTIONS = ("gas", "actuator", "friction", "foot_plate", "supply", "flow")
TIME_OFFSET = "recording.time_offset"
"""Path of a number that no scenario has: the time by which the samples of a recording are later than the run."""

ZERO_OF, GAIN_OF = "recording.zero_of_", "recording.gain_of_"
"""Paths, with a channel behind them, of what a sensor adds to its samples and of its gain less 1."""

RECORDING = (
    Quantity("time_offset", "s", "time by which the samples are later than the run, a late trigger", 0.0, -1.0, 1.0),
    *(
        Quantity(f"zero_of_{name}", unit, f"what the sensor of {name} adds to its samples", 0.0, -size, size)
        for name, unit, size in (("angle", "rad", 1.0), ("pressure_1", "Pa_d", 1.0e6), ("pressure_2", "Pa_d", 1.0e6))
    ),
    *(
        Quantity(f"gain_of_{name}", "1", f"gain of the sensor of {name} less 1", 0.0, -0.5, 0.5)
        for name in FITTED_CHANNELS
    ),
)
_OF_RECORDING = frozenset(f"recording.{item.name}" for item in RECORDING)


def full_path(path: str, scenario: Scenario) -> str:
    """Return the path as a parameter set has it: ``valve.area`` becomes ``valves.NAME.area`` of the chosen valve."""
    section, _, name = path.partition(".")
    return f"valves.{scenario.device.valve_name}.{name}" if section == "valve" else path


def declared_numbers(scenario: Scenario) -> dict[str, Quantity]:
    """Return every number that can be fitted in this scenario, with its declaration, by path."""
    device = scenario.device
    found = {f"{section}.{item.name}": item for section in _DEVICE_SECTIONS for item in SECTIONS[section]}
    found |= {f"{effect.section}.{item.name}": item for effect in device_effects() for item in effect.quantities}
    orifices = device.actuator.leak, device.valve.orifice
    leak, opening = (AREA_FORM if isinstance(orifice, Orifice) else SONIC_FORM for orifice in orifices)
    found |= {f"actuator.leak.{item.name}": item for item in leak}
    valve = (*opening, *VALVES[device.valve.kind].quantities)
    found |= {f"valves.{device.valve_name}.{item.name}": item for item in valve}
    if isinstance(scenario.motion, FreeMotion):
        leg = scenario.motion.leg
        found |= {f"motion.{item.name}": item for item in (FREE if leg is None else LEG)}
        found |= {} if leg is None else {f"motion.shank.{item.name}": item for item in shank_settings(leg.shank.kind)}
    found |= {f"initial.{item.name}": item for item in INITIAL}
    return found | {f"recording.{item.name}": item for item in RECORDING}


def declaration_of(path: str, scenario: Scenario) -> Quantity:
    """Return the declaration of the number at a path; IdentificationError with the nearest name for an unknown one."""
    find_effects([path])
    known = declared_numbers(scenario)
    full = full_path(path, scenario)
    if full not in known:
        hint = nearest_name(full, known)
        raise IdentificationError(f"{scenario.name}: no number '{path}' can be fitted{hint}; known: {', '.join(known)}")
    return known[full]


def number_at(scenario: Scenario, path: str) -> float:
    """Return the number at a path in SI units; those of a recording are 0 before they are fitted."""
    declaration_of(path, scenario)
    return 0.0 if path in _OF_RECORDING else numbers.number_at(scenario, path)


def with_numbers(scenario: Scenario, changed: Mapping[str, float]) -> Scenario:
    """Return the scenario with numbers [SI] replaced, by paths of ``declared_numbers``, but those of recordings."""
    return numbers.with_numbers(scenario, {path: one for path, one in changed.items() if path not in _OF_RECORDING})


def broken_rule(device: Device) -> str:
    """Return which rule of a device a set of numbers breaks, as a parameter set would say it; empty for none."""
    if device.friction.dynamic_torque > device.friction.static_torque:
        return "friction.dynamic_torque came out above friction.static_torque"
    if device.actuator.angle_min >= device.actuator.angle_max:
        return "actuator.angle_min came out above actuator.angle_max"
    return ""


_STARTS = tuple(f"initial.{item.name}" for item in INITIAL)
_BELOW_ATMOSPHERE = 0.02
"""Fraction of the atmosphere by which a fitted start may lie below it: its sensor's zero, and no vacuum."""


def impossible_start(ranges: "Sequence[Range]", highest: Sequence[float], atmosphere: float) -> str:
    """Return why a fitted start cannot be, empty where it can; ``highest`` are the upper ends of intervals [SI].

    A chamber that its valve vents into a room of ``atmosphere`` [Pa] never starts below it: only a vane that is drawn
    makes a vacuum.
    """
    for item, most in zip(ranges, highest, strict=True):
        if item.path in _STARTS and most < (1.0 - _BELOW_ATMOSPHERE) * atmosphere:
            return (
                f"{item.name} would be at most {most:.4g} Pa absolute, below the atmosphere of {atmosphere:.6g} Pa "
                "into which the chamber is vented, which cannot be; check the zero and the unit of its sensor, whether "
                "a gauge pressure is read as an absolute one, the atmosphere, and whether the run starts too late"
            )
    return ""


Scale = Literal["log", "linear"]

LONGEST_TIME_OFFSET = 0.02
"""Bounds [s] of a fitted time offset where none are given: a trigger or a sensor, not another experiment."""

_FURTHEST = 100.0
_ADDED = frozenset({"friction", "motion", "initial", "supply"})
"""Sections whose numbers add up in the equations: their likelihood is normal in themselves, not in their logarithms."""

_STATE = frozenset({"motion", "initial"})
"""Sections that say how a run begins, which the recording may say better."""

_SUPPLIES = {"supply.pressure": "plant.supply_pressure", "supply.dorsiflexion_pressure": "plant.dorsiflexion_pressure"}


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
    ``recording.time_offset`` [s], by which its samples are later than the run. One that ``is_tolerance`` is a tolerance
    of the bench: fitted because nobody knows it better, and never a value of the device.
    """

    path: str
    start: float | None = None
    low: float | None = None
    high: float | None = None
    scale: Scale | None = None
    prior: Prior | None = None
    recordings: tuple[str, ...] = ()
    is_tolerance: bool = False

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
    is_tolerance: bool = False

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
    section = path.partition(".")[0]
    for experiment in experiments:
        _refuse_followed(parameter, path, experiment)
    start = parameter.start
    if start is None:
        # Of how a run begins the recording may say more than the scenario.
        first = experiments[0]
        start = number_at(scenario_of(first) if section in _STATE else first.scenario, path)
    is_ratio = start > 0.0 and quantity.minimum >= 0.0 and section not in _ADDED
    scale = parameter.scale or ("log" if is_ratio else "linear")
    if path == TIME_OFFSET:
        low, high = -LONGEST_TIME_OFFSET, LONGEST_TIME_OFFSET
    else:
        low = max(quantity.minimum, start / _FURTHEST) if scale == "log" and start > 0.0 else quantity.minimum
        high = min(quantity.maximum, start * _FURTHEST) if start > 0.0 else quantity.maximum
    low, high = (low if parameter.low is None else parameter.low), (high if parameter.high is None else parameter.high)
    _refuse_nonsense(parameter, scale, start, low, high)
    if low < quantity.minimum or high > quantity.maximum:
        raise IdentificationError(
            f"{parameter.name}: bounds {low:.6g} to {high:.6g} exceed what is allowed, "
            f"{quantity.minimum:.6g} to {quantity.maximum:.6g} {quantity.unit}".rstrip()
        )
    unit = quantity.unit.removesuffix("_a") or "-"
    size = 0.5 * (high - low) if start == 0.0 or path == TIME_OFFSET else abs(start)
    name = full_path(parameter.name, scenarios[0])
    return Range(
        path, name, unit, scale, start, low, high, size, parameter.prior, parameter.recordings, parameter.is_tolerance
    )


def is_nuisance(item: Range) -> bool:
    """Return whether a number is fitted only because nobody knows it: one recording's beginning, or the bench's."""
    is_beginning = bool(item.recordings) and (item.path == TIME_OFFSET or item.path.startswith("initial."))
    return item.is_tolerance or is_beginning


def is_of_sensor(item: Range) -> bool:
    """Return whether a number changes what a sensor says, in a straight line, and nothing that runs."""
    return item.path.startswith((ZERO_OF, GAIN_OF))


def reach_of(ranges: Sequence[Range]) -> float:
    """Return the largest time offset [s] among the bounds of parameters; 0 where none is fitted."""
    reaches = [max(abs(item.low), abs(item.high)) for item in ranges if item.path == TIME_OFFSET]
    return max(reaches, default=0.0)


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


def _refuse_nonsense(parameter: FreeParameter, scale: Scale, start: float, low: float, high: float) -> None:
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

    With ``directions`` what is left is searched for what a bench may have and the model not. A robust loss counts
    residuals beyond 1.345 standard deviations less. ``identified`` and ``weak`` are the half
    widths of an interval, relative to the number, up to which it is called so.
    """

    loss: Loss = "linear"
    other_starts: int = 0
    seed: int = 1
    maximum_evaluations: int = 60
    confidence: float = 0.95
    identified: float = 0.2
    weak: float = 1.0
    directions: bool = False


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
