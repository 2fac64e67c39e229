"""Trajectory fit problem: recordings with the scenarios that model them, parameters to fit, tolerances with priors."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ppafo.errors import IdentificationError, PpafoError, ScenarioError, UnitError, noted_in, raise_noted, refused_as
from ppafo.identification.bench.law import BenchContext
from ppafo.identification.estimate import Estimate, interval_factor
from ppafo.identification.fit import FitNumber
from ppafo.identification.new_set import fitting_unit, stated_half_width
from ppafo.identification.problem import ALL_INPUTS, ExperimentSection, ParameterSection, TrajectorySection
from ppafo.identification.source import RecordingReader, UsedRecording, double_use
from ppafo.identification.tolerances import Tolerances
from ppafo.model.catalog import VALVES, find_effects
from ppafo.model.declaration import Quantity
from ppafo.parameters import apply_overrides, build_device
from ppafo.parameters.device import Device
from ppafo.parameters.effects import switches_of
from ppafo.parameters.overrides import over
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.signals.recording import Recording
from ppafo.simulation import numbers
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.numbers import other_form
from ppafo.simulation.recorded.channels import (
    ANGLE,
    COMMAND,
    DORSIFLEXION_SUPPLY,
    EXTERNAL_TORQUE,
    SUPPLY,
    between_stops,
    check_absolute,
    check_command,
    check_gaps,
    regular_interval,
    sample_period,
)
from ppafo.simulation.recorded.inputs import supply_paths, with_highest_supply
from ppafo.simulation.recorded.replay import replay_scenario, with_fixed_volume
from ppafo.simulation.recorded.rest import motion_at, read_error, start_of, value_at_rest
from ppafo.simulation.recorded.usual_errors import deviation_of_limit
from ppafo.simulation.scenario import (
    PYTHON_CONTROLLER,
    Control,
    FreeMotion,
    Scenario,
    Sensors,
    locked_vane,
    vane_motion,
    with_control,
)
from ppafo.units import parse_quantity
from ppafo.wording import first_twice, known_names

FITTED_CHANNELS = ("angle", "pressure_1", "pressure_2")
"""Channels that a fit can compare with a recording [rad], [Pa], [Pa]."""
INPUTS = (COMMAND, SUPPLY, EXTERNAL_TORQUE)
"""Recorded channels that drive a run without a scenario, sample by sample."""
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
_FITTED_SECTIONS = frozenset(
    ("gas", "actuator", "friction", "foot_plate", "supply", "flow", "valve", "effects", "motion", "initial")
)
"""Sections of a scenario and its device whose numbers a fit may change; motion, where the vane is free."""
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
    they share a pressure), ``dorsiflexion_pressure``, ``external_torque``, ``angle``. With ``is_recorded_start`` the
    initial angle and pressures are not those of the scenario, but of the samples up to the start (their mean or, if
    they move, the end of a line through them). ``source`` names the file and its hash.
    """

    label: str
    scenario: Scenario
    recording: Recording
    start: float = 0.0
    channels: tuple[str, ...] = FITTED_CHANNELS
    noise: Mapping[str, float] = field(default_factory=dict)
    inputs: tuple[str, ...] = ()
    is_recorded_start: bool = False
    source: str = ""

    @property
    def is_read(self) -> bool:
        """True if the run starts from the recorded state."""
        return self.is_recorded_start or self.scenario.controller.is_outside

    @property
    def use(self) -> UsedRecording:
        """Part of the recording with which the experiment is compared."""
        span = self.start, float(self.recording.time[-1])
        trace, channels = self.source or self.recording.label, frozenset(self.channels)
        return UsedRecording(f"experiment '{self.label}'", trace, self.recording, channels, *span)


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
    if not experiment.is_recorded_start:
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


def full_path(path: str, scenario: Scenario) -> str:
    """Return the path as in a parameter set: ``valve.area`` becomes ``valves.NAME.area`` with the chosen valve."""
    section, _, name = path.partition(".")
    return f"valves.{scenario.device.valve_name}.{name}" if section == "valve" else path


def declared_numbers(scenario: Scenario) -> dict[str, Quantity]:
    """Return the declarations of all parameters that can be fitted in this scenario, by path."""
    device, moves = scenario.device, vane_motion(scenario).profile is None
    # An orifice has two forms, and the device one of them.
    other = {f"{section}.{name}" for section in ("actuator.leak", "valve") for name in other_form(device, section)}
    declared = {
        full_path(path, scenario): quantity
        for path, quantity in numbers.declared_numbers(scenario).items()
        if path not in other
        and path.partition(".")[0] in (_FITTED_SECTIONS if moves else _FITTED_SECTIONS - {"motion"})
    }
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
    path, *others = sorted({full_path(parameter.path, scenario) for scenario in scenarios})
    if others:
        raise IdentificationError(
            f"{parameter.path} refers to {' and '.join((path, *others))} in these experiments and cannot be fitted as "
            "one parameter; give one of these paths, and in recordings the experiments that have it"
        )
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
    start, low, high = parameter.start, quantity.minimum, quantity.maximum
    if math.isnan(start):
        # Of how a run begins the recording may say more than the scenario.
        is_state = path.partition(".")[0] in _STATE
        start = number_at(scenario_of(experiments[0]) if is_state else scenarios[0], path)
    if path == TIME_OFFSET:
        low, high = -LONGEST_TIME_OFFSET, LONGEST_TIME_OFFSET
    elif start > 0.0:
        # A number above 0 is bounded by factors: with 0 as its lower bound a valve or an effect would be another model.
        low, high = max(low, start / _FURTHEST) if low >= 0.0 else low, min(high, start * _FURTHEST)
    low = low if math.isnan(parameter.low) else parameter.low
    high = high if math.isnan(parameter.high) else parameter.high
    bounds = f"{low:.6g} and {high:.6g}"
    allowed = f"{quantity.minimum:.6g} to {quantity.maximum:.6g} {quantity.unit}".rstrip()
    has_size = math.isfinite(high - low) or math.isfinite(parameter.deviation)
    is_from_zero = 0.0 in (low, start) and not parameter.is_tolerance
    refuse_first(
        parameter.name,
        (not low < high, f"low = {low:.6g} must be below high = {high:.6g}"),
        (not low <= start <= high, f"start = {start:.6g} must lie between the bounds {bounds}"),
        (start == 0.0 and not has_size, "start = 0 needs bounds, which define the step size of the search"),
        (not parameter.deviation > 0.0, "the standard deviation of a prior must be above 0"),
        (
            is_from_zero and _model_at(scenarios[0], path, 0.0) != _model_at(scenarios[0], path, high),
            "0 leaves it out of the model, so it cannot be fitted from there; start and low must be above 0",
        ),
        (
            not (quantity.minimum <= low and high <= quantity.maximum),
            f"the bounds {bounds} exceed the allowed range, {allowed}",
        ),
    )
    if parameter.is_logarithm:
        start, low, high = math.log(start), math.log(low), math.log(high)
    # Differences are a thousandth of the scale at most, which for a prior is a tenth of its deviation.
    is_known = math.isfinite(parameter.deviation)
    scale = _SCALE * parameter.deviation if is_known else abs(start) or 0.5 * (high - low)
    unit = quantity.unit.removesuffix("_a").removesuffix("_d") or "-"
    # Of a quantity of either sign, such as the zero of a sensor, the value may be zero.
    size = scale if low < 0.0 < high else None
    return replace(parameter, path=path, start=start, low=low, high=high, scale=scale, unit=unit, size=size)


def _model_at(scenario: Scenario, path: str, value: float) -> tuple[object, ...]:
    """Return the model that a parameter selects at a value [SI]: at 0 a delay or an effect is left out."""
    device = with_numbers(scenario, {path: value}).device
    kind = VALVES[device.valve.kind]
    settings = kind.settings(**device.valve.settings)
    valve = kind.choose(settings)
    return valve, valve.command_delay(settings) > 0.0, switches_of(device)


def reach_of(chosen: Sequence[FitNumber]) -> float:
    """Return the largest time offset [s] that the bounds of the parameters allow; 0 if none is fitted."""
    bounds = [bound for number in chosen if number.path == TIME_OFFSET for bound in (number.low, number.high)]
    return max(map(abs, bounds), default=0.0)


@dataclass(frozen=True, slots=True)
class TrajectoryProblem:
    """Trajectory fit problem: parameters and experiments. Raises IdentificationError if inconsistent.

    Samples that bench procedures ``used`` are in their intervals, which are priors here. ``numbers`` are the parameters
    with start and bounds resolved.
    """

    parameters: tuple[FitNumber, ...]
    experiments: tuple[FittedExperiment, ...]
    confidence: float = 0.95
    used: tuple[UsedRecording, ...] = ()
    numbers: tuple[FitNumber, ...] = field(init=False)

    def __post_init__(self) -> None:
        labels = [experiment.label for experiment in self.experiments]
        for experiment in self.experiments:
            check_experiment(experiment)
        if message := double_use((*self.used, *(experiment.use for experiment in self.experiments))):
            raise IdentificationError(message)
        numbers, wrong = list[FitNumber](), list[PpafoError]()
        for parameter in self.parameters:
            for label in (label for label in parameter.recordings if label not in labels):
                near = known_names(label, labels)
                raise IdentificationError(f"{parameter.path}: there is no experiment '{label}'{near}")
            with noted_in(wrong):
                numbers.append(
                    number_of(parameter, [item for item in self.experiments if parameter.acts_in(item.label)])
                )
        raise_noted(wrong)
        for kind, names in (("experiment", labels), ("parameter", [number.name for number in numbers])):
            if (twice := first_twice(names)) is not None:
                raise IdentificationError(f"{kind} '{twice}' is given twice")
        object.__setattr__(self, "numbers", tuple(numbers))


def tolerance_parameters(
    tolerances: Tolerances,
    experiments: Sequence[FittedExperiment],
    fitted: Sequence[FitNumber],
    parameter_set: ParameterSet | None = None,
) -> tuple[FitNumber, ...]:
    """Return all tolerances, except parameters already ``fitted``, as fit parameters with priors.

    Fixed parameters of the device have the uncertainty that ``parameter_set`` states, or the default of the bench.
    """
    parameters: list[FitNumber] = []
    for experiment in experiments:
        free = {full_path(item.path, experiment.scenario) for item in fitted if item.acts_in(experiment.label)}
        begun = scenario_of(experiment)
        for path, deviation in _of_run(tolerances, experiment, begun).items():
            if path not in free and deviation > 0.0:
                parameters.append(_tolerance(path, number_at(begun, path), deviation, (experiment.label,)))
    # A fitted number takes up the error of its path: a tolerance beside it could not be told apart.
    scenario = experiments[0].scenario
    given = {full_path(item.path, scenario) for item in fitted}
    supplies = SUPPLY, DORSIFLEXION_SUPPLY
    for kind, prefix, channels, limit_of in (
        ("zero", ZERO_OF, (*FITTED_CHANNELS, *supplies), tolerances.zero_of),
        ("gain", GAIN_OF, FITTED_CHANNELS, tolerances.gain_of),
        ("lag", LAG_OF, FITTED_CHANNELS, tolerances.lag_of),
    ):
        is_own = kind in tolerances.each_recording
        for channel in channels:
            labels = tuple(
                item.label
                for item in experiments
                if (channel in item.channels and (kind != "lag" or regular_interval(item.recording.time)))
                or (kind == "zero" and channel in item.inputs)
            )
            path, limit = f"{prefix}{channel}", limit_of(channel)
            # A number with a prior of no width cannot be moved.
            if not labels or not limit > 0.0 or path in given:
                continue
            common = () if len(labels) == len(experiments) else labels
            for group in [(label,) for label in labels] if is_own else [common]:
                number = _tolerance(path, 0.0, deviation_of_limit(limit), group)
                lag = replace(number, low=-_LONGEST_LAG, high=_LONGEST_LAG)
                parameters.append(lag if kind == "lag" else number)
    # A parameter linked to another one has no uncertainty of its own, and of an effect that is off no number acts.
    following = {path for path, links in scenario.device.links.items() if not all(link.when for link in links)}
    off = {effect.section for effect, is_on in switches_of(scenario.device).items() if not is_on}
    skipped = {"motion", "initial", "recording", "motion.shank", "supply", *off}
    for path, quantity in declared_numbers(scenario).items():
        section, _, name = path.rpartition(".")
        entry = None if parameter_set is None else parameter_set.numbers.get(path)
        stated = 0.0 if entry is None else stated_half_width(entry, fitting_unit(entry.unit, quantity))
        value = number_at(scenario, path)
        if path in given | following or section in skipped or value == 0.0 or (stated == 0.0 and name in _EXACT):
            continue
        kind = path.replace(f"valves.{scenario.device.valve_name}.", "valve.")
        deviation = tolerances.deviation_of(kind, value, stated)
        if deviation > 0.0:
            parameters.append(_tolerance(path, value, deviation, quantity=quantity))
    return (*parameters, *_stribeck(tolerances, experiments, given))


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
        yield _tolerance(_SHARE, share, deviation, quantity=declared_numbers(scenario)[_SHARE])


def _of_run(tolerances: Tolerances, experiment: FittedExperiment, scenario: Scenario) -> dict[str, float]:
    """Return standard deviations [SI] of initial state and operating conditions of an experiment, by path.

    ``scenario`` is completed from the recording.
    """
    inputs, recording, is_read = experiment.inputs, experiment.recording, experiment.is_read
    free = scenario.motion if isinstance(scenario.motion, FreeMotion) else None
    found = {}
    if free is not None and free.leg is None and EXTERNAL_TORQUE not in inputs and free.external_torque != 0.0:
        found["motion.external_torque"] = deviation_of_limit(tolerances.load * abs(free.external_torque))
    if SUPPLY not in inputs:
        # Two regulators are set one by one, to one pressure too.
        found["supply.pressure"] = deviation_of_limit(tolerances.supply)
        if DORSIFLEXION_SUPPLY not in inputs:
            found["supply.dorsiflexion_pressure"] = deviation_of_limit(tolerances.supply)
    read = math.hypot(_START_OF_ANGLE, read_error(recording, ANGLE))
    stops = scenario.device.actuator.angle_min, scenario.device.actuator.angle_max
    # Where the vane lies at a stop, the stop says where it starts.
    is_at_stop = free is not None and any(math.isclose(free.angle, stop) for stop in stops)
    if free is not None and free.leg is None and ANGLE not in inputs and not is_at_stop:
        # The angle of a scenario was set by a sensor, whose zero is known to this limit.
        usual = read if is_read else deviation_of_limit(tolerances.zero_of_angle)
        stated = tolerances.start_of_angle
        found["motion.angle"] = usual if stated is None else deviation_of_limit(stated)
    if free is not None and (start := motion_at_start(experiment)) is not None:
        found["motion.angular_velocity"] = start[2]
        found.setdefault("motion.angle", read)
    for name in ("pressure_1", "pressure_2"):
        noise, stated = read_error(recording, name) if is_read else 0.0, tolerances.start_of_pressure
        found[f"initial.{name}"] = noise if stated is None else deviation_of_limit(stated)
    return found


def _tolerance(
    path: str, start: float, deviation: float, recordings: tuple[str, ...] = (), quantity: Quantity | None = None
) -> FitNumber:
    """Return a quantity with a prior [SI] as a fit parameter, within what a ``quantity`` of the device may be."""
    low, high = start - _WIDEST * deviation, start + _WIDEST * deviation
    if quantity is not None:
        # A volume or a friction of 0 would make no device.
        least = max(quantity.minimum, 0.05 * start) if quantity.minimum >= 0.0 else quantity.minimum
        low, high = max(low, least), min(high, quantity.maximum)
    return FitNumber(path, start, low, high, 1.0, deviation, recordings, is_tolerance=True)


def problem_of(
    section: TrajectorySection,
    context: BenchContext,
    reader: RecordingReader,
    bench: Mapping[str, Estimate],
    used: tuple[UsedRecording, ...],
) -> TrajectoryProblem:
    """Convert section [trajectory] of a problem file to a fit problem; its set and valve are those of all scenarios.

    ``bench`` are estimates of bench procedures by path, ``used`` the recordings from which these were obtained. Raises
    IdentificationError for what cannot be fitted.
    """
    experiments = tuple(_experiment(entry, context, reader) for entry in section.experiments)
    scenarios = {experiment.label: experiment.scenario for experiment in experiments}
    parameters = [_parameter(entry, scenarios, context.label, bench) for entry in section.parameters]
    for entry in section.experiments:
        if (limit := entry.time_offset) is not None:
            # The delay of the samples of one recording is known within a limit, as a tolerance is.
            known = deviation_of_limit(limit), (entry.label,)
            parameters.append(FitNumber(TIME_OFFSET, 0.0, -limit, limit, 1.0, *known, is_tolerance=True))
    tolerances = tolerance_parameters(context.tolerances, experiments, parameters, context.parameter_set)
    return TrajectoryProblem((*parameters, *tolerances), experiments, section.confidence, used)


def _experiment(entry: ExperimentSection, context: BenchContext, reader: RecordingReader) -> FittedExperiment:
    """Convert a table of a section to an experiment: recording, and scenario that models it.

    Without a scenario the recorded inputs drive the run, from the first sample unless a start is given.
    """
    where = f"{context.label}: experiment '{entry.label}'"
    source, *others = reader.read(entry.recording, entry.columns)
    if others:
        raise IdentificationError(
            f"{entry.recording}: columns.{entry.columns}.trial selects {1 + len(others)} trials, but an experiment has "
            "one recording; name one trial"
        )
    recording, start, inputs = source.recording, entry.start or 0.0, entry.inputs or ()
    if entry.scenario is not None:
        reason = "cannot be combined with a scenario, which prescribes the motion of the vane"
        refuse_first(where, *((getattr(entry, name) is not None, f"{name} {reason}") for name in ("locked", "volume")))
        scenario = scenario_named(entry.scenario, entry.overrides, context, reader.folder)
    else:
        inputs = tuple(name for name in INPUTS if name in recording) if entry.inputs is None else entry.inputs
        is_locked, is_fixed = entry.locked is not None, entry.volume is not None
        channels = ", ".join(recording.names)
        refuse_first(
            where,
            (entry.initial_state == "scenario", "initial_state = 'scenario' needs a scenario"),
            ((is_locked or is_fixed) and ANGLE in inputs, f"'{ANGLE}' cannot be an input with locked or volume"),
            (is_locked and is_fixed, "locked and volume exclude each other: a fixed volume has no vane"),
            (
                COMMAND not in recording,
                f"has no scenario, so its recording needs a channel '{COMMAND}'; available: {channels}",
            ),
            (COMMAND not in inputs, f"has no scenario, so inputs must have '{COMMAND}'"),
        )
        start = float(recording.time[0]) if entry.start is None else entry.start
        replayed = recording.between(start, float(recording.time[-1]))
        changed = apply_overrides(context.parameter_set, entry.overrides, valve=context.valve)
        device, known = build_device(changed, context.valve), {} if entry.locked is None else {ANGLE: entry.locked}
        if entry.volume is not None:
            device, known = with_fixed_volume(device, entry.volume)
        state = start_of(replayed, device, known, where)
        motion = locked_vane(state.angle) if known else None
        scenario = replay_scenario(recording, device, state, replayed.duration, where, motion)
    compared = entry.channels
    if compared is None:
        # All that is neither locked nor followed; of a fixed volume its pressure.
        is_prescribed = entry.locked is not None or ANGLE in (entry.inputs or ())
        compared = FITTED_CHANNELS[1:] if is_prescribed else FITTED_CHANNELS
        compared = compared if entry.volume is None else ("pressure_1",)
        if scenario.device.actuator.has_one_chamber:
            compared = tuple(name for name in compared if name != "pressure_2")
    if entry.step is not None:
        scenario = replace(scenario, run=replace(scenario.run, step=entry.step))
    # The scenario of a replay has the state of the samples already.
    is_read = entry.scenario is not None and entry.initial_state in ("recording", "fitted")
    noise, trace = entry.noise.by_channel(), source.trace
    return FittedExperiment(entry.label, scenario, recording, start, compared, noise, inputs, is_read, trace)


def scenario_named(name: str, overrides: tuple[str, ...], context: BenchContext, folder: Path) -> Scenario:
    """Load a scenario, bundled or from a file in the ``folder`` of the problem, with the device of the problem."""
    name_or_file = name if name in list_scenarios() else str(folder / name)
    # The valve of the problem goes before what the experiment changes of it.
    chosen = () if context.valve is None else (f"device.valve={context.valve}",)
    return load_scenario(name_or_file, over(chosen, overrides, ScenarioError), context.parameter_set)


def _parameter(
    entry: ParameterSection, scenarios: Mapping[str, Scenario], label: str, bench: Mapping[str, Estimate]
) -> FitNumber:
    """Convert a table of a section to a parameter to fit [SI]; ``scenarios`` are by label of the experiment."""
    scenario = next((scenarios[name] for name in entry.recordings if name in scenarios), None)
    acting = scenario or next(iter(scenarios.values()))
    quantity = declaration_of(entry.path, acting)
    atmosphere = acting.device.supply.atmospheric_pressure
    where = f"{label}: parameter '{entry.path}'"
    prior, texts = entry.prior, {"start": entry.start, "low": entry.low, "high": entry.high}
    if prior is not None and prior != "bench":
        texts["prior.mean"] = prior.mean
    values, deviation = dict.fromkeys(("start", "low", "high"), math.nan), math.inf
    for key, text in texts.items():
        if text is not None:
            with refused_as(IdentificationError, f"{where}: {key} = '{text}'", UnitError):
                values[key] = parse_quantity(text, quantity.unit, atmosphere)
    if prior == "bench":
        estimate = bench.get(full_path(entry.path, acting))
        if estimate is None or not estimate.is_usable:
            identified = ", ".join(path for path, known in bench.items() if known.is_usable) or "none"
            raise IdentificationError(
                f"{where}: prior = 'bench' needs a value that a procedure of this problem identifies; identified: "
                f"{identified}"
            )
        values["start"], deviation = estimate.value, estimate.wider_half_width / interval_factor(estimate.confidence)
    elif prior is not None:
        values["start"] = values.pop("prior.mean")
        deviation = abs(values["start"]) * prior.relative
    start, low, high = values.values()
    return FitNumber(entry.path, start, low, high, 1.0, deviation, entry.recordings)
