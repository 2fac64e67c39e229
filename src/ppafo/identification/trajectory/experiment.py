"""Trajectory fit problem: recordings with the scenarios that model them, parameters to fit, tolerances with priors."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ppafo.errors import IdentificationError, PpafoError, noted_in, raise_noted
from ppafo.identification.least_squares import FitNumber
from ppafo.identification.new_set import fitting_unit, stated_half_width
from ppafo.identification.source import UsedRecording, double_use
from ppafo.identification.tolerances import Tolerances
from ppafo.model.catalog import VALVES, find_effects
from ppafo.model.declaration import Quantity
from ppafo.parameters.device import Device
from ppafo.parameters.effects import switches_of
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.signals.recording import Recording
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
    regular_interval,
    sample_period,
)
from ppafo.simulation.recorded.inputs import between_stops, supply_paths, with_highest_supply
from ppafo.simulation.recorded.motion import motion_at, read_error
from ppafo.simulation.recorded.rest import value_at_rest
from ppafo.simulation.recorded.usual_errors import deviation_of_limit
from ppafo.simulation.scenario import (
    PYTHON_CONTROLLER,
    Control,
    FreeMotion,
    Scenario,
    Sensors,
    vane_motion,
    with_control,
)
from ppafo.wording import first_twice, known_names

FITTED_CHANNELS = ("angle", "pressure_1", "pressure_2")
"""Channels that a fit can compare with a recording [rad], [Pa], [Pa]."""
INPUTS = (COMMAND, SUPPLY, EXTERNAL_TORQUE)
"""Recorded channels that drive a run without a scenario, sample by sample."""
ALL_INPUTS = (*INPUTS, DORSIFLEXION_SUPPLY, ANGLE)
"""Recorded channels that may replace inputs of the scenario; a recorded angle is a prescribed motion."""
InitialState = Literal["scenario", "recording"]
"""Source of the initial angle and pressures of a run."""
_FITS = 1.0e-6
"""Rounding tolerance [s] of sample times at the start of an experiment."""
TIME_OFFSET = "recording.time_offset"
"""Path of the delay of the samples of a recording with respect to the run; no scenario has this parameter."""
ZERO_OF, GAIN_OF, LAG_OF = "recording.zero_of_", "recording.gain_of_", "recording.lag_of_"
"""Prefixes of the parameter paths of zero, gain and first-order lag of a sensor; the channel name follows."""
RECORDING = (
    Quantity("time_offset", "s", "delay of the samples behind the run, such as a late trigger", 0.0, -1.0, 1.0),
    *(
        Quantity(f"zero_of_{name}", unit, f"zero of the sensor of {name}", 0.0, -size, size)
        for name, unit, size in (
            ("angle", "rad", 1.0),
            *((name, "Pa_d", 1.0e6) for name in ("pressure_1", "pressure_2", SUPPLY, DORSIFLEXION_SUPPLY)),
        )
    ),
    *(
        Quantity(f"gain_of_{name}", "1", f"gain of the sensor of {name} less 1", 0.0, -0.5, 0.5)
        for name in FITTED_CHANNELS
    ),
    *(
        Quantity(f"lag_of_{name}", "s", f"time constant of the sensor of {name} or its filter", 0.0, -1.0, 1.0)
        for name in FITTED_CHANNELS
    ),
)
_OF_RECORDING = frozenset(f"recording.{quantity.name}" for quantity in RECORDING)
LONGEST_TIME_OFFSET = 0.02
"""Default bound of a fitted time offset [s]: covers the delay of a trigger or a sensor."""
_FURTHEST = 100.0
"""Default bounds of a positive parameter, as the largest ratio to its start value, up and down [-]."""
_SCALE = 100.0
"""Scale of a parameter with a prior, in standard deviations [-]; a finite difference is at most 0.001 scales."""
_STATE = frozenset({"motion", "initial"})
"""Sections with the initial state of a run, which a recording may give more accurately."""
_SUPPLIES = {"supply.pressure": "plant.supply_pressure", "supply.dorsiflexion_pressure": "plant.dorsiflexion_pressure"}
_WIDEST = 12.0
"""Largest deviation of a tolerance in the search, in standard deviations of its prior [-]."""
_LONGEST_LAG = 0.1
"""Longest time constant of a sensor that is tried [s]."""
_EXACT = ("area", "angle_min", "angle_max", "linear_ratio", "critical_ratio", "atmospheric_pressure")
"""Parameters without a default tolerance, because another parameter or a zero error has the same effect."""
_STRIBECK, _SHARE = "effects.stribeck.velocity", "effects.stribeck.share"
_FACTOR, _ONE_SIDED, _LEAST = 1.5, 1.645, 0.01
"""Prior of the Stribeck velocity: standard deviation of its logarithm, distance of the limit from the mean in standard
deviations, and least value as a fraction of the limit [-].

At the least value the fall of the friction is practically abrupt; at 0 the effect would be off.
"""
_START_OF_ANGLE = math.radians(0.05)
"""Standard deviation of an initial angle read from a recording [rad]."""


@dataclass(frozen=True, slots=True)
class FittedExperiment:
    """Recording paired with the scenario that models it; time ``start`` [s] of the recording is time 0 of the run.

    ``channels`` are compared from the start to the end of the recording. ``noise`` is a lower bound of the standard
    deviation by channel [rad], [Pa]; the noise itself is estimated from the residuals. ``inputs`` are recorded channels
    that drive the run, sample by sample: ``command`` (replaces the controller), ``supply_pressure`` (of both inlets if
    they share a pressure), ``dorsiflexion_pressure``, ``external_torque``, ``angle``. ``initial_state`` selects the
    source of the initial angle and pressures: the scenario, or the samples of the recording up to the start (their mean
    or, if they move, the end of a line through them). ``source`` names the file and its hash.
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

    @property
    def is_read(self) -> bool:
        """True if the run starts from the recorded state."""
        return self.initial_state == "recording" or self.scenario.controller.is_outside


def check_experiment(experiment: FittedExperiment) -> None:
    """Raise IdentificationError for an experiment that cannot be fitted; the message begins with the label."""
    where, recording, inputs = f"experiment '{experiment.label}'", experiment.recording, experiment.inputs
    if len(recording) < 2:
        raise IdentificationError(f"{where}: {recording.label} has only one sample; a fit needs two or more")
    for names, allowed, fault in (
        (experiment.channels, FITTED_CHANNELS, "cannot be fitted"),
        (inputs, ALL_INPUTS, "is not a measured input"),
    ):
        for name in names:
            if name not in allowed:
                raise IdentificationError(f"{where}: channel '{name}' {fault}{known_names(name, allowed)}")
            if name not in recording:
                known = known_names(name, recording.names)
                raise IdentificationError(f"{where}: {recording.label} has no channel '{name}'{known}")
    scenario, has_torque = experiment.scenario, EXTERNAL_TORQUE in inputs
    motion, follows = vane_motion(scenario), {ANGLE} & set(inputs) & set(experiment.channels)
    is_prescribed = motion.profile is not None
    is_python = scenario.controller.is_outside and COMMAND not in inputs
    refuse_first(
        where,
        (not experiment.channels, "has no channel to compare; give channels"),
        (bool(follows), "the recording prescribes the angle, which cannot be compared; remove it from channels"),
        (experiment.channels == (ANGLE,) and is_prescribed, "the angle is prescribed; add a pressure to channels"),
        (is_python, "a Python controller cannot be fitted; use a controller kind of the catalogue"),
        (has_torque and is_prescribed, "the angle is prescribed, so that a torque does nothing; remove it from inputs"),
        (has_torque and motion.leg is not None, "the leg prescribes T_ex; remove it from inputs, or free the motion"),
    )
    if COMMAND in inputs:
        check_command(recording, where)
    experiment.scenario.device.check_pressurised(f"{where}: a fit of motion")
    if inputs:
        check_gaps(recording, where)
        check_absolute(recording, experiment.scenario.device.supply.atmospheric_pressure, where)


def refuse_first(where: str, *checks: tuple[bool, str]) -> None:
    """Raise IdentificationError for the first failed pair (is wrong, reason); ``where`` is the message prefix."""
    for is_wrong, why in checks:
        if is_wrong:
            raise IdentificationError(f"{where}: {why}")


def scenario_of(experiment: FittedExperiment) -> Scenario:
    """Return the scenario completed from the recording: supply, recorded control, initial angle and pressures.

    Samples of inputs are added later. A recorded initial state is taken from the samples up to the start.
    """
    scenario, recording = experiment.scenario, experiment.recording
    if {SUPPLY, DORSIFLEXION_SUPPLY} & set(experiment.inputs):
        scenario = replace(scenario, device=with_highest_supply(scenario.device, recording, experiment.inputs))
    if COMMAND in experiment.inputs:
        # A recorded command needs no sensors.
        scenario = replace(
            with_control(scenario, Control(PYTHON_CONTROLLER, {}, sample_period(recording.time))), sensors=Sensors()
        )
    where = f"experiment '{experiment.label}'"
    if ANGLE in experiment.inputs:
        # From here the recorded angle prescribes the vane's.
        angle = np.interp([experiment.start], recording.time, recording[ANGLE])
        scenario = replace(scenario, motion=FreeMotion(float(between_stops(angle, scenario.device, where)[0])))
    if experiment.initial_state == "scenario":
        return scenario
    before = recording.time <= experiment.start + _FITS
    if not before.any():
        raise IdentificationError(
            f"{where}: {recording.label} has no sample at or before {experiment.start:g} s, from which the initial "
            "state is read"
        )
    time = recording.time[before]
    rest = {name: value_at_rest(time, recording[name][before], at_end=True) for name in recording.names}
    recorded = {name: rest[name] for name in ("pressure_1", "pressure_2") if name in rest}
    scenario = replace(scenario, initial=replace(scenario.initial, **recorded))
    if ANGLE in rest and ANGLE not in experiment.inputs and isinstance(scenario.motion, FreeMotion):
        first, velocity, _ = motion_at_start(experiment) or (rest[ANGLE], scenario.motion.angular_velocity, 0.0)
        start = float(between_stops(np.array([first]), scenario.device, where)[0])
        scenario = replace(scenario, motion=replace(scenario.motion, angle=start, angular_velocity=velocity))
    return scenario


def motion_at_start(experiment: FittedExperiment) -> tuple[float, float, float] | None:
    """Return angle [rad], angular velocity and its standard error [rad/s] of a recorded start; None if it is at rest.

    A recorded velocity says more.
    """
    is_recorded = "angular_velocity" in experiment.recording
    if not experiment.is_read or ANGLE in experiment.inputs or is_recorded:
        return None
    return motion_at(experiment.recording, experiment.start)


def use_of(experiment: FittedExperiment) -> UsedRecording:
    """Return the part of the recording with which an experiment is compared."""
    used, recording = frozenset(experiment.channels), experiment.recording
    label, trace = f"experiment '{experiment.label}'", experiment.source or recording.label
    return UsedRecording(label, trace, recording, used, experiment.start, float(recording.time[-1]))


def full_path(path: str, scenario: Scenario) -> str:
    """Return the path as in a parameter set: ``valve.area`` becomes ``valves.NAME.area`` with the chosen valve."""
    section, _, name = path.partition(".")
    return f"valves.{scenario.device.valve_name}.{name}" if section == "valve" else path


def declared_numbers(scenario: Scenario) -> dict[str, Quantity]:
    """Return the declarations of all parameters that can be fitted in this scenario, by path."""
    device = scenario.device
    # An orifice has two forms, and the device one of them.
    other = {f"{section}.{name}" for section in ("actuator.leak", "valve") for name in other_form(device, section)}
    declared = {
        full_path(path, scenario): quantity
        for path, quantity in numbers.device_numbers(device).items()
        if path not in other
    }
    leg = vane_motion(scenario).leg
    if vane_motion(scenario).profile is None:
        declared |= {f"motion.{quantity.name}": quantity for quantity in (FREE if leg is None else LEG)}
        shank = () if leg is None else shank_settings(leg.shank.kind)
        declared |= {f"motion.shank.{quantity.name}": quantity for quantity in shank}
    declared |= numbers.of_its_chambers({f"initial.{quantity.name}": quantity for quantity in INITIAL}, device)
    return declared | {f"recording.{quantity.name}": quantity for quantity in RECORDING}


def declaration_of(path: str, scenario: Scenario) -> Quantity:
    """Return the declaration of a parameter. Raises IdentificationError, with the nearest name, for an unknown path."""
    find_effects([path])
    known = declared_numbers(scenario)
    full = full_path(path, scenario)
    if full not in known:
        raise IdentificationError(f"{scenario.name}: '{path}' cannot be fitted{known_names(full, known)}")
    return known[full]


def number_at(scenario: Scenario, path: str) -> float:
    """Return the value of a parameter [SI]; parameters of a recording are 0 before the fit."""
    declaration_of(path, scenario)
    return 0.0 if path in _OF_RECORDING else numbers.number_at(scenario, path)


def with_numbers(scenario: Scenario, changed: Mapping[str, float]) -> Scenario:
    """Return the scenario with changed parameters [SI], by path; parameters of recordings are ignored."""
    # Those of a recording change what is compared, not the run.
    return numbers.with_numbers(
        scenario, {path: number for path, number in changed.items() if path not in _OF_RECORDING}
    )


def broken_rule(device: Device) -> str:
    """Return a sentence on a rule that the parameters of a device violate; empty for a valid device."""
    dynamic, static = device.friction.dynamic_torque, device.friction.static_torque
    if dynamic > static:
        return (
            f"friction.dynamic_torque was fitted to {dynamic:.3g} N m, above friction.static_torque of "
            f"{static:.3g} N m (fitted, or moved within its tolerance)"
        )
    if device.actuator.angle_min >= device.actuator.angle_max:
        return "actuator.angle_min was fitted above actuator.angle_max"
    return ""


def number_of(parameter: FitNumber, experiments: Sequence[FittedExperiment]) -> FitNumber:
    """Return a parameter with start, bounds and scale resolved, given the experiments in which it acts.

    Raises IdentificationError for contradictory settings.
    """
    scenarios = [experiment.scenario for experiment in experiments]
    paths = {full_path(parameter.path, scenario) for scenario in scenarios}
    if len(paths) > 1:
        raise IdentificationError(
            f"{parameter.path} refers to {' and '.join(sorted(paths))} in these experiments and cannot be fitted as "
            "one parameter; give one of these paths, and in recordings the experiments that have it"
        )
    path = paths.pop()
    quantity = [declaration_of(path, scenario) for scenario in scenarios][-1]
    for experiment in experiments:
        # No number moves an input that the run follows as it was recorded.
        followed = dict.fromkeys(supply_paths(experiment.scenario.device), SUPPLY)
        if DORSIFLEXION_SUPPLY in experiment.inputs:
            followed["plant.dorsiflexion_pressure"] = DORSIFLEXION_SUPPLY
        channel = EXTERNAL_TORQUE if path == "motion.external_torque" else followed.get(_SUPPLIES.get(path, ""))
        if channel in experiment.inputs:
            raise IdentificationError(
                f"{parameter.name}: the run of experiment '{experiment.label}' uses the recorded '{channel}', so this "
                "parameter has no effect"
            )
    start = parameter.start
    if math.isnan(start):
        # Of how a run begins the recording may say more than the scenario.
        is_state = path.partition(".")[0] in _STATE
        start = number_at(scenario_of(experiments[0]) if is_state else scenarios[0], path)
    low, high = quantity.minimum, quantity.maximum
    if path == TIME_OFFSET:
        low, high = -LONGEST_TIME_OFFSET, LONGEST_TIME_OFFSET
    elif start > 0.0:
        # A number above 0 is bounded by factors: with 0 as its lower bound a valve or an effect would be another model.
        low, high = max(low, start / _FURTHEST) if low >= 0.0 else low, min(high, start * _FURTHEST)
    low, high = (
        low if math.isnan(parameter.low) else parameter.low,
        high if math.isnan(parameter.high) else parameter.high,
    )
    bounds = f"{low:.6g} and {high:.6g}"
    has_size = math.isfinite(high - low) or math.isfinite(parameter.deviation)
    is_allowed = quantity.minimum <= low and high <= quantity.maximum
    allowed = f"{quantity.minimum:.6g} to {quantity.maximum:.6g} {quantity.unit}".rstrip()
    refuse_first(
        parameter.name,
        (not low < high, f"low = {low:.6g} must be below high = {high:.6g}"),
        (not low <= start <= high, f"start = {start:.6g} must lie between the bounds {bounds}"),
        (start == 0.0 and not has_size, "start = 0 needs bounds, which define the step size of the search"),
        (not parameter.deviation > 0.0, "the standard deviation of a prior must be above 0"),
        (
            0.0 in (low, start) and not parameter.is_tolerance and _is_off_at_zero(scenarios[0], path, high),
            "0 leaves it out of the model, so it cannot be fitted from there; start and low must be above 0",
        ),
        (not is_allowed, f"the bounds {bounds} exceed the allowed range, {allowed}"),
    )
    if parameter.is_logarithm:
        start, low, high = math.log(start), math.log(low), math.log(high)
    # Differences are a thousandth of the scale at most, which for a prior is a tenth of its deviation.
    scale = abs(start) or 0.5 * (high - low)
    if math.isfinite(parameter.deviation):
        scale = _SCALE * parameter.deviation
    unit = quantity.unit.removesuffix("_a").removesuffix("_d") or "-"
    # Of a quantity of either sign, such as the zero of a sensor, the value may be zero.
    size = scale if low < 0.0 < high else None
    return replace(parameter, path=path, start=start, low=low, high=high, scale=scale, unit=unit, size=size)


def _is_off_at_zero(scenario: Scenario, path: str, value: float) -> bool:
    """Return whether a parameter selects another model at 0 than at ``value`` [SI], such as a delay or an effect."""
    models = []
    for number in (0.0, value):
        device = with_numbers(scenario, {path: number}).device
        kind = VALVES[device.valve.kind]
        settings = kind.settings(**device.valve.settings)
        valve = kind.choose(settings)
        models.append((valve, valve.command_delay(settings) > 0.0, switches_of(device)))
    return models[0] != models[1]


def reach_of(chosen: Sequence[FitNumber]) -> float:
    """Return the largest time offset [s] that the bounds of the parameters allow; 0 if none is fitted."""
    bounds = [bound for number in chosen if number.path == TIME_OFFSET for bound in (number.low, number.high)]
    return max(map(abs, bounds), default=0.0)


@dataclass(frozen=True, slots=True)
class TrajectoryProblem:
    """Trajectory fit problem: parameters and experiments. Raises IdentificationError if inconsistent."""

    parameters: tuple[FitNumber, ...]
    experiments: tuple[FittedExperiment, ...]
    confidence: float = 0.95

    def __post_init__(self) -> None:
        labels = [experiment.label for experiment in self.experiments]
        _refuse_twice("experiment", labels)
        for experiment in self.experiments:
            check_experiment(experiment)
        if message := double_use(use_of(experiment) for experiment in self.experiments):
            raise IdentificationError(message)
        for parameter in self.parameters:
            for label in parameter.recordings:
                if label not in labels:
                    known = known_names(label, labels)
                    raise IdentificationError(f"{parameter.path}: there is no experiment '{label}'{known}")
        _refuse_twice("parameter", [number.name for number in numbers_of(self)])


def numbers_of(problem: TrajectoryProblem) -> tuple[FitNumber, ...]:
    """Return all parameters of a problem with start and bounds resolved. Raises IdentificationError if inconsistent."""
    numbers, wrong = list[FitNumber](), list[PpafoError]()
    for parameter in problem.parameters:
        labels = parameter.recordings
        acting = [experiment for experiment in problem.experiments if not labels or experiment.label in labels]
        with noted_in(wrong):
            numbers.append(number_of(parameter, acting))
    raise_noted(wrong)
    return tuple(numbers)


def _refuse_twice(kind: str, names: list[str]) -> None:
    """Raise IdentificationError for a duplicated name; ``kind`` is the noun for the message."""
    if (twice := first_twice(names)) is not None:
        raise IdentificationError(f"{kind} '{twice}' is given twice")


def stated_by(parameter_set: ParameterSet, scenario: Scenario) -> dict[str, float]:
    """Return the half-widths of 95 % intervals stated in a parameter set [SI], by path."""
    found = {}
    for path, quantity in declared_numbers(scenario).items():
        entry = parameter_set.numbers.get(path)
        if entry is not None and entry.uncertainty:
            found[path] = stated_half_width(entry, fitting_unit(entry.unit, quantity))
    return found


def tolerance_parameters(
    tolerances: Tolerances,
    experiments: Sequence[FittedExperiment],
    fitted: Sequence[FitNumber],
    stated: Mapping[str, float] | None = None,
) -> tuple[FitNumber, ...]:
    """Return all tolerances, except parameters already ``fitted``, as fit parameters with priors.

    ``stated`` are the half-widths of the 95 % intervals stated in the set [SI], by path.
    """
    parameters: list[FitNumber] = []
    for experiment in experiments:
        free = {
            full_path(item.path, experiment.scenario)
            for item in fitted
            if not item.recordings or experiment.label in item.recordings
        }
        for path, (start, deviation) in _of_run(tolerances, experiment).items():
            if path not in free and deviation > 0.0:
                parameters.append(_parameter(path, start, deviation, (experiment.label,)))
    # A fitted number takes up the error of its path: a tolerance beside it could not be told apart.
    given = {full_path(item.path, experiments[0].scenario) for item in fitted}
    for kind, prefix, limit_of in (
        ("zero", ZERO_OF, tolerances.zero_of),
        ("gain", GAIN_OF, tolerances.gain_of),
        ("lag", LAG_OF, tolerances.lag_of),
    ):
        for channel in (*FITTED_CHANNELS, *((SUPPLY, DORSIFLEXION_SUPPLY) if kind == "zero" else ())):
            labels = [
                item.label
                for item in experiments
                if (channel in item.channels and (kind != "lag" or regular_interval(item.recording.time)))
                or (kind == "zero" and channel in item.inputs)
            ]
            path, limit = f"{prefix}{channel}", limit_of(channel)
            # A number with a prior of no width cannot be moved.
            if not labels or not limit > 0.0 or path in given:
                continue
            groups = [(label,) for label in labels] if kind in tolerances.each_recording else [tuple(labels)]
            for group in groups:
                is_common = len(group) == len(experiments) and kind not in tolerances.each_recording
                parameter = _parameter(path, 0.0, deviation_of_limit(limit), () if is_common else group)
                parameters.append(
                    replace(parameter, low=-_LONGEST_LAG, high=_LONGEST_LAG) if kind == "lag" else parameter
                )
    return (
        *parameters,
        *_of_set(tolerances, experiments, given, stated or {}),
        *_stribeck(tolerances, experiments, given),
    )


def _stribeck(tolerances: Tolerances, experiments: Sequence[FittedExperiment], given: set[str]) -> Iterator[FitNumber]:
    """Yield Stribeck velocity and share of the fall to dynamic friction as parameters, unless the set defines them.

    With an abrupt fall, static friction trades off against damping. The static friction seen in a step response varies
    with the logarithm of the Stribeck velocity, so the logarithm is varied; 95 % of its prior lies below the limit. A
    fixed share would shift its whole error to the static friction.
    """
    limit, scenario = tolerances.stribeck_velocity, experiments[0].scenario
    moves = any(vane_motion(item.scenario).profile is None and ANGLE not in item.inputs for item in experiments)
    friction, has_own = scenario.device.friction, number_at(scenario, _STRIBECK) > 0.0
    if has_own or not moves or friction.static_torque <= friction.dynamic_torque:
        return
    is_sought = _STRIBECK in given
    if not is_sought and limit > 0.0:
        start = limit * math.exp(-_ONE_SIDED * _FACTOR)
        low, high = _LEAST * limit, 4.0 * limit
        yield FitNumber(_STRIBECK, start, low, high, deviation=_FACTOR, is_tolerance=True, is_logarithm=True)
    share = number_at(scenario, _SHARE)
    deviation = tolerances.deviation_of(_SHARE, share, 0.0)
    if (is_sought or limit > 0.0) and _SHARE not in given and deviation > 0.0:
        yield _held(_SHARE, share, deviation, declared_numbers(scenario)[_SHARE])


def _of_run(tolerances: Tolerances, experiment: FittedExperiment) -> dict[str, tuple[float, float]]:
    """Return initial state and operating conditions of a run as (start, standard deviation), by path [SI]."""
    scenario, inputs, recording = scenario_of(experiment), experiment.inputs, experiment.recording
    free = scenario.motion if isinstance(scenario.motion, FreeMotion) and scenario.motion.leg is None else None
    found = {}
    if free is not None and EXTERNAL_TORQUE not in inputs and free.external_torque != 0.0:
        found["motion.external_torque"] = deviation_of_limit(tolerances.load * abs(free.external_torque))
    if SUPPLY not in inputs:
        # Two regulators are set one by one, to one pressure too.
        found["supply.pressure"] = deviation_of_limit(tolerances.supply)
        if DORSIFLEXION_SUPPLY not in inputs:
            found["supply.dorsiflexion_pressure"] = deviation_of_limit(tolerances.supply)
    is_read = experiment.is_read
    stops = scenario.device.actuator.angle_min, scenario.device.actuator.angle_max
    # Where the vane lies at a stop, the stop says where it starts.
    if free is not None and ANGLE not in inputs and not any(math.isclose(free.angle, stop) for stop in stops):
        stated = tolerances.start_of_angle
        read = math.hypot(_START_OF_ANGLE, read_error(recording, ANGLE)) if is_read else 0.0
        # The angle of a scenario was set by a sensor, whose zero is known to this limit.
        usual = read or deviation_of_limit(tolerances.zero_of_angle)
        found["motion.angle"] = usual if stated is None else deviation_of_limit(stated)
    if isinstance(scenario.motion, FreeMotion) and (start := motion_at_start(experiment)) is not None:
        found["motion.angular_velocity"] = start[2]
        found.setdefault("motion.angle", math.hypot(_START_OF_ANGLE, read_error(recording, ANGLE)))
    for name in ("pressure_1", "pressure_2"):
        noise = read_error(recording, name) if is_read else 0.0
        stated = tolerances.start_of_pressure
        found[f"initial.{name}"] = noise if stated is None else deviation_of_limit(stated)
    return {path: (number_at(scenario, path), deviation) for path, deviation in found.items()}


def _of_set(
    tolerances: Tolerances, experiments: Sequence[FittedExperiment], given: set[str], stated: Mapping[str, float]
) -> Iterator[FitNumber]:
    """Yield the fixed parameters of the device as fit parameters, each with its uncertainty as prior.

    A parameter linked to another one has no uncertainty of its own.
    """
    scenario = experiments[0].scenario
    following = {path for path, links in scenario.device.links.items() if not all(link.when for link in links)}
    off = {effect.section for effect, is_on in switches_of(scenario.device).items() if not is_on}
    for path, quantity in declared_numbers(scenario).items():
        section, _, name = path.rpartition(".")
        if path in given or section in ("motion", "initial", "recording", "motion.shank") or path.startswith("supply."):
            continue
        if path in following:
            continue
        value, half_width = number_at(scenario, path), stated.get(path, 0.0)
        # An effect that is off has no numbers that act.
        if section in off or value == 0.0 or (half_width == 0.0 and name in _EXACT):
            continue
        kind = path.replace(f"valves.{scenario.device.valve_name}.", "valve.")
        deviation = tolerances.deviation_of(kind, value, half_width)
        if deviation > 0.0:
            yield _held(path, value, deviation, quantity)


def _held(path: str, value: float, deviation: float, quantity: Quantity) -> FitNumber:
    """Return a fixed parameter of the device, with its standard deviation [SI] as prior, as a fit parameter."""
    low = max(quantity.minimum, value - _WIDEST * deviation)
    high = min(quantity.maximum, value + _WIDEST * deviation)
    # A volume or a friction of 0 would make no device.
    low = max(low, 0.05 * value) if quantity.minimum >= 0.0 else low
    return FitNumber(path, value, low, high, deviation=deviation, is_tolerance=True)


def _parameter(path: str, start: float, deviation: float, recordings: tuple[str, ...]) -> FitNumber:
    width = _WIDEST * deviation
    return FitNumber(path, start, start - width, start + width, 1.0, deviation, recordings, is_tolerance=True)
