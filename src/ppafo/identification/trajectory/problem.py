"""A trajectory fit as values: recordings with the scenarios that are to explain them, and the numbers that it moves."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ppafo.errors import IdentificationError, first_twice, nearest_name
from ppafo.identification.residuals import Free
from ppafo.identification.source import Use, double_use
from ppafo.model.catalog import find_effects
from ppafo.model.declaration import Quantity
from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.simulation import numbers
from ppafo.simulation.declaration import FREE, INITIAL, LEG, shank_settings
from ppafo.simulation.numbers import other_form
from ppafo.simulation.recorded.channels import (
    ANGLE,
    COMMAND,
    DORSIFLEXION_SUPPLY,
    EXTERNAL_TORQUE,
    SUPPLY,
    check_absolute,
    check_command,
    check_gaps,
)
from ppafo.simulation.recorded.inputs import between_stops, supply_paths, with_highest_supply
from ppafo.simulation.recorded.replay import replay_control
from ppafo.simulation.recorded.rest import value_at_rest
from ppafo.simulation.scenario import FreeMotion, Scenario, Sensors, vane_motion

FITTED_CHANNELS = ("angle", "pressure_1", "pressure_2")
"""What a recording is compared in [rad], [Pa], [Pa]."""

INPUTS = (COMMAND, SUPPLY, EXTERNAL_TORQUE)
"""Channels that a run follows where they were recorded, sample by sample, if it has no scenario."""

ALL_INPUTS = (*INPUTS, DORSIFLEXION_SUPPLY, ANGLE)
"""Channels that a run may follow instead of its scenario; a recorded angle prescribes the vane's."""

InitialState = Literal["scenario", "recording"]


@dataclass(frozen=True, slots=True)
class Experiment:
    """A recording and the scenario that is to explain it; time ``start`` [s] of the recording is time 0 of the run.

    ``noise`` is the least standard deviation by channel [rad], [Pa]; it is estimated from what the fit leaves.
    ``channels`` are those that are compared, to the end of the recording. ``inputs`` names measured channels that the
    run follows sample by sample: ``command``, in place of the scenario's controller, ``supply_pressure`` (of both
    inlets where they have one pressure), ``dorsiflexion_pressure``, ``external_torque``, ``angle``. ``initial_state``
    takes angle and pressures at the start from the scenario or, by the samples up to the start, from the recording:
    their mean, or where a line through them ends if they move. ``source`` names the file and its hash.
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
    said, recording, inputs = f"experiment '{experiment.label}'", experiment.recording, experiment.inputs
    if len(recording) < 2:
        raise IdentificationError(f"{said}: {recording.label} has only one sample")
    for name in experiment.channels:
        if name not in FITTED_CHANNELS:
            raise IdentificationError(f"{said}: channel '{name}' cannot be fitted; {', '.join(FITTED_CHANNELS)} can")
    for name in inputs:
        if name not in ALL_INPUTS:
            hint = nearest_name(name, ALL_INPUTS)
            raise IdentificationError(f"{said}: '{name}' is not a measured input{hint}; use {', '.join(ALL_INPUTS)}")
    for name, use in (*((one, "") for one in experiment.channels), *((one, " to follow") for one in inputs)):
        if name not in recording:
            have = ", ".join(recording.names)
            raise IdentificationError(f"{said}: {recording.label} has no channel '{name}'{use}; it has {have}")
    scenario, has_torque = experiment.scenario, EXTERNAL_TORQUE in inputs
    motion, follows = vane_motion(scenario), {ANGLE} & set(inputs) & set(experiment.channels)
    is_python = scenario.controller.is_outside and COMMAND not in inputs
    refuse_first(
        said,
        (not experiment.channels, "there is no channel to compare"),
        (bool(follows), "the angle of the vane is prescribed by the recording, so it cannot be compared"),
        (
            experiment.channels == (ANGLE,) and motion.profile is not None,
            "the angle of the vane is prescribed, so it carries no information; add a pressure",
        ),
        (is_python, "a Python controller cannot run in a batch; use one of the catalogue"),
        (
            has_torque and motion.profile is not None,
            "a torque has no effect on a vane whose angle is prescribed; remove it from inputs",
        ),
        (
            has_torque and motion.leg is not None,
            "the leg of the motion prescribes T_ex; remove it from inputs, or let the motion be free",
        ),
        *(
            (not 0.0 < deviation < math.inf, f"the noise of '{name}' must be above 0, not {deviation!r}")
            for name, deviation in experiment.noise.items()
        ),
    )
    if COMMAND in inputs:
        check_command(recording, said)
    if inputs:
        check_gaps(recording, said)
        check_absolute(recording, experiment.scenario.device.supply.atmospheric_pressure, said)


def refuse_first(said: str, *checks: tuple[bool, str]) -> None:
    """Refuse the first that is wrong of pairs, whether it is and why; ``said`` begins the line."""
    for is_wrong, why in checks:
        if is_wrong:
            raise IdentificationError(f"{said}: {why}")


_FITS = 1.0e-6


def scenario_of(experiment: Experiment) -> Scenario:
    """Return the scenario of an experiment with all that it takes from the recording, but for the samples of inputs.

    A state that is taken from the recording comes from the samples up to the start.
    """
    scenario, recording = experiment.scenario, experiment.recording
    if {SUPPLY, DORSIFLEXION_SUPPLY} & set(experiment.inputs):
        scenario = replace(scenario, device=with_highest_supply(scenario.device, recording, experiment.inputs))
    if COMMAND in experiment.inputs:
        # Nobody measures for a controller that nobody asks.
        scenario = replace(scenario, controller=replay_control(recording), sensors=Sensors())
    said = f"experiment '{experiment.label}'"
    if ANGLE in experiment.inputs:
        # From here the recorded angle prescribes the vane's.
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
    recorded = {name: rest[name] for name in ("pressure_1", "pressure_2") if name in rest}
    scenario = replace(scenario, initial=replace(scenario.initial, **recorded))
    if ANGLE in rest and ANGLE not in experiment.inputs and isinstance(scenario.motion, FreeMotion):
        start = float(between_stops(np.array([rest[ANGLE]]), scenario.device, said)[0])
        scenario = replace(scenario, motion=replace(scenario.motion, angle=start))
    return scenario


TIME_OFFSET = "recording.time_offset"
"""Path of a number that no scenario has: the time by which the samples of a recording are later than the run."""

ZERO_OF, GAIN_OF = "recording.zero_of_", "recording.gain_of_"
"""Paths, with a channel behind them, of what a sensor adds to its samples and of its gain less 1."""

RECORDING = (
    Quantity("time_offset", "s", "time by which the samples are later than the run, a late trigger", 0.0, -1.0, 1.0),
    *(
        Quantity(f"zero_of_{name}", unit, f"what the sensor of {name} adds to its samples", 0.0, -size, size)
        for name, unit, size in (
            ("angle", "rad", 1.0),
            *((one, "Pa_d", 1.0e6) for one in ("pressure_1", "pressure_2", SUPPLY, DORSIFLEXION_SUPPLY)),
        )
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
    # An orifice has two forms, and the device one of them.
    other = {f"{section}.{name}" for section in ("actuator.leak", "valve") for name in other_form(device, section)}
    found = {
        full_path(path, scenario): item for path, item in numbers.device_numbers(device).items() if path not in other
    }
    leg = vane_motion(scenario).leg
    if vane_motion(scenario).profile is None:
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
    """Return the number at a path in SI units; numbers of a recording are 0 before they are fitted."""
    declaration_of(path, scenario)
    return 0.0 if path in _OF_RECORDING else numbers.number_at(scenario, path)


def with_numbers(scenario: Scenario, changed: Mapping[str, float]) -> Scenario:
    """Return the scenario with numbers [SI] replaced, by paths of ``declared_numbers``, but not of recordings."""
    # Those of a recording change what is compared, not the run.
    return numbers.with_numbers(scenario, {path: one for path, one in changed.items() if path not in _OF_RECORDING})


def broken_rule(device: Device) -> str:
    """Return which rule of a device a set of numbers breaks, as a parameter set would say it; empty for none."""
    if device.friction.dynamic_torque > device.friction.static_torque:
        return "friction.dynamic_torque came out above friction.static_torque"
    if device.actuator.angle_min >= device.actuator.angle_max:
        return "actuator.angle_min came out above actuator.angle_max"
    return ""


LONGEST_TIME_OFFSET = 0.02
"""Bounds [s] of a fitted time offset where none are given: a trigger or a sensor, not another experiment."""

_FURTHEST = 100.0
"""Factor from its start by which a number is moved at most where no bounds are given."""

_SCALE = 100.0
"""Typical size of a number with a prior over its standard deviation; differences are a thousandth of it at most."""

_STATE = frozenset({"motion", "initial"})
"""Sections that say how a run begins, which the recording may say better."""

_SUPPLIES = {"supply.pressure": "plant.supply_pressure", "supply.dorsiflexion_pressure": "plant.dorsiflexion_pressure"}


@dataclass(frozen=True, slots=True)
class FreeParameter:
    """A number that the fit moves, by its path such as ``friction.viscous_damping`` or ``initial.pressure_1``; SI.

    ``start`` None begins at the value of the scenario. ``deviation`` is the standard deviation of its prior about
    ``mean``, which is the start where it is None; infinite for none. Bounds left out are the declared ones, at most a
    factor of 100 from the start. ``recordings`` limits the number to some experiments, by label: an initial pressure
    belongs to one. One that ``is_tolerance`` is known within a tolerance, and no value of the device that is sought.
    One that ``is_logarithm`` is moved as its natural logarithm; ``deviation`` is of that.
    """

    path: str
    start: float | None = None
    low: float | None = None
    high: float | None = None
    deviation: float = math.inf
    recordings: tuple[str, ...] = ()
    is_tolerance: bool = False
    is_logarithm: bool = False

    @property
    def name(self) -> str:
        """The path, with the experiments where it is limited to some."""
        return f"{self.path} of {', '.join(self.recordings)}" if self.recordings else self.path


@dataclass(frozen=True, slots=True)
class Number:
    """A number with everything settled: full path, SI unit, and what the estimator moves."""

    path: str
    unit: str
    free: Free
    recordings: tuple[str, ...]
    is_tolerance: bool
    is_logarithm: bool

    def acts_in(self, label: str) -> bool:
        """Return whether the number acts in the experiment with this label."""
        return not self.recordings or label in self.recordings


def number_of(parameter: FreeParameter, experiments: Sequence[Experiment]) -> Number:
    """Return a parameter with all of it settled; ``experiments`` are those it acts in.

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
        followed = dict.fromkeys(supply_paths(experiment.scenario.device), SUPPLY)
        if DORSIFLEXION_SUPPLY in experiment.inputs:
            followed["plant.dorsiflexion_pressure"] = DORSIFLEXION_SUPPLY
        channel = EXTERNAL_TORQUE if path == "motion.external_torque" else followed.get(_SUPPLIES.get(path, ""))
        if channel in experiment.inputs:
            raise IdentificationError(
                f"{parameter.name}: the run of experiment '{experiment.label}' follows the recorded '{channel}', so "
                "this number has no effect in it; omit one of the two"
            )
    start = parameter.start
    if start is None:
        # Of how a run begins the recording may say more than the scenario.
        first = experiments[0]
        is_state = path.partition(".")[0] in _STATE
        start = number_at(scenario_of(first) if is_state else first.scenario, path)
    if path == TIME_OFFSET:
        low, high = -LONGEST_TIME_OFFSET, LONGEST_TIME_OFFSET
    else:
        # A number above 0 is bounded by factors: with 0 as its lower bound a valve or an effect would be another model.
        low = max(quantity.minimum, start / _FURTHEST) if start > 0.0 <= quantity.minimum else quantity.minimum
        high = min(quantity.maximum, start * _FURTHEST) if start > 0.0 else quantity.maximum
    low, high = (low if parameter.low is None else parameter.low), (high if parameter.high is None else parameter.high)
    bounds, unit = f"{low:.6g} and {high:.6g}", quantity.unit
    has_size = math.isfinite(high - low) or math.isfinite(parameter.deviation)
    is_allowed = quantity.minimum <= low and high <= quantity.maximum
    allowed = f"{quantity.minimum:.6g} to {quantity.maximum:.6g} {unit}".rstrip()
    refuse_first(
        parameter.name,
        (not math.isfinite(start) or math.isnan(low) or math.isnan(high), "start and bounds must be finite numbers"),
        (not low < high, f"low, {low:.6g}, must be below high, {high:.6g}"),
        (not low <= start <= high, f"start {start:.6g} must lie between the bounds {bounds}"),
        (start == 0.0 and not has_size, "a start at 0 needs bounds, because they define what a small step is"),
        (not parameter.deviation > 0.0, "the standard deviation of a prior must be above 0"),
        (not is_allowed, f"the bounds {bounds} exceed what is allowed, {allowed}"),
    )
    if parameter.is_logarithm:
        start, low, high = math.log(start), math.log(low), math.log(high)
    # Differences are a thousandth of the scale at most, which for a prior is a tenth of its deviation.
    scale = abs(start) or 0.5 * (high - low)
    if math.isfinite(parameter.deviation):
        scale = _SCALE * parameter.deviation
    name = full_path(parameter.name, scenarios[0])
    free = Free(name, start, low, high, scale, parameter.deviation)
    shown, recordings = unit.removesuffix("_a").removesuffix("_d") or "-", parameter.recordings
    return Number(path, shown, free, recordings, parameter.is_tolerance, parameter.is_logarithm)


def reach_of(chosen: Sequence[Number]) -> float:
    """Return the largest time offset [s] among the bounds of numbers; 0 where none is fitted."""
    ends = [end for item in chosen if item.path == TIME_OFFSET for end in (item.free.low, item.free.high)]
    return max(map(abs, ends), default=0.0)


@dataclass(frozen=True, slots=True)
class TrajectoryProblem:
    """Numbers to be fitted to recordings. IdentificationError for a problem that makes no sense."""

    parameters: tuple[FreeParameter, ...]
    experiments: tuple[Experiment, ...]
    confidence: float = 0.95

    def __post_init__(self) -> None:
        if not self.parameters or not self.experiments:
            raise IdentificationError("a trajectory fit needs at least one parameter and at least one recording")
        labels = [item.label for item in self.experiments]
        _refuse_twice("experiment", labels)
        for experiment in self.experiments:
            check_experiment(experiment)
        twice = double_use(use_of(item) for item in self.experiments)
        if twice:
            raise IdentificationError(twice)
        for parameter in self.parameters:
            for label in parameter.recordings:
                if label not in labels:
                    hint = nearest_name(label, labels)
                    raise IdentificationError(f"{parameter.path}: there is no experiment '{label}'{hint}")
        _refuse_twice("parameter", [item.free.name for item in numbers_of(self)])


def numbers_of(problem: TrajectoryProblem) -> tuple[Number, ...]:
    """Return all parameters of a problem with start and bounds settled; refuses those that contradict."""
    return tuple(
        number_of(one, [item for item in problem.experiments if not one.recordings or item.label in one.recordings])
        for one in problem.parameters
    )


def use_of(item: Experiment) -> Use:
    """Return what of its recording an experiment is compared with."""
    last = float(item.recording.time[-1])
    trace = item.source or item.recording.label
    return Use(f"experiment '{item.label}'", trace, item.recording, frozenset(item.channels), item.start, last)


def _refuse_twice(what: str, names: list[str]) -> None:
    twice = first_twice(names)
    if twice is not None:
        raise IdentificationError(f"{what} '{twice}' is named twice")
