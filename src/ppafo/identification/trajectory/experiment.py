"""Trajectory fit problem: recordings with the scenarios that model them, parameters to fit, tolerances with priors."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import get_args

import numpy as np

from ppafo.errors import Faults, IdentificationError, ScenarioError, UnitError, refused_as
from ppafo.identification.bench.law import BenchContext
from ppafo.identification.estimate import Estimate, interval_factor
from ppafo.identification.fit import FitNumber, tolerance
from ppafo.identification.new_set import stated_half_width
from ppafo.identification.problem import Compared, ExperimentSection, ParameterSection, PriorSection
from ppafo.identification.source import RecordingReader, UsedRecording, double_use
from ppafo.identification.tolerances import Tolerances
from ppafo.model.catalog import VALVES, find_effects
from ppafo.model.declaration import Quantity
from ppafo.parameters import apply_overrides, build_device
from ppafo.parameters.device import Device
from ppafo.parameters.effects import switches_of
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.parameters.overrides import over
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.signals.faults import MINIMUM_SAMPLES
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
from ppafo.simulation.recorded.inputs import with_highest_supply
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
from ppafo.wording import check_known, first_twice

FITTED_CHANNELS: tuple[str, ...] = get_args(Compared)
"""Channels that a fit can compare with a recording [rad], [Pa], [Pa]."""
INPUTS = (COMMAND, SUPPLY, EXTERNAL_TORQUE)
"""Recorded channels that drive a run without a scenario, sample by sample."""
_FITS = 1.0e-6
"""Rounding tolerance [s] of sample times at the start of an experiment."""
TIME_OFFSET = "recording.time_offset"
"""Path of the delay of the samples of a recording with respect to the run; no scenario has this parameter."""
# Prefixes of the parameter paths of zero, gain and first-order lag of a sensor; the channel name follows.
ZERO_OF = "recording.zero_of_"
GAIN_OF = "recording.gain_of_"
LAG_OF = "recording.lag_of_"
_SUPPLY_CHANNELS = SUPPLY, DORSIFLEXION_SUPPLY
_OF_RECORDING = {
    TIME_OFFSET: Quantity("time_offset", "s", "delay of the samples behind the run", 0.0, -1.0, 1.0),
    **{
        f"{prefix}{name}": Quantity(f"{prefix}{name}", unit, f"{error} of the sensor of {name}", 0.0, -size, size)
        for prefix, error, unit, size, names in (
            (ZERO_OF, "zero", "rad", 1.0, (ANGLE,)),
            (ZERO_OF, "zero", "Pa_d", 1.0e6, (*FITTED_CHANNELS[1:], *_SUPPLY_CHANNELS)),
            (GAIN_OF, "gain less 1", "1", 0.5, FITTED_CHANNELS),
            (LAG_OF, "time constant", "s", 1.0, FITTED_CHANNELS),
        )
        for name in names
    },
}
"""Declarations of the parameters of a recording by path; they are 0 before the fit."""
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
_LONGEST_LAG = 0.1
"""Longest time constant of a sensor that is tried [s]."""
_EXACT = ("area", "angle_min", "angle_max", "linear_ratio", "critical_ratio", "atmospheric_pressure")
"""Parameters without a default tolerance, because another parameter or a zero error has the same effect."""
_STRIBECK = "effects.stribeck.velocity"
_SHARE = "effects.stribeck.share"
# Prior of the Stribeck velocity: standard deviation of its logarithm, distance of the limit from its mean [-], and
# least value [limits], at which the fall of the friction is practically abrupt; at 0 the effect would be off.
_FACTOR = 1.5
_ONE_SIDED = 1.645
_LEAST = 0.01
_START_OF_ANGLE = math.radians(0.05)
"""Standard deviation of an initial angle read from a recording [rad]."""


@dataclass(frozen=True)
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
    def where(self) -> str:
        """Beginning of a message."""
        return f"experiment '{self.label}'"

    @property
    def trace(self) -> str:
        """Reference of the recording among the sources of an estimate."""
        return self.source or self.recording.label

    @property
    def use(self) -> UsedRecording:
        """Part of the recording with which the experiment is compared."""
        span = self.start, float(self.recording.time[-1])
        return UsedRecording(self.where, self.trace, self.recording, frozenset(self.channels), *span)

    @property
    def is_read(self) -> bool:
        """True if the run starts from the recorded state."""
        return self.is_recorded_start or self.scenario.controller.is_outside

    @property
    def motion_at_start(self) -> tuple[float, float, float] | None:
        """Angle [rad], velocity and its standard error [rad/s] of a recorded start; None if at rest, or better told."""
        is_told = ANGLE in self.inputs or "angular_velocity" in self.recording
        return None if is_told or not self.is_read else motion_at(self.recording, self.start)

    @cached_property
    def begun(self) -> Scenario:
        """Scenario completed from the recording: supply, recorded control, initial angle and pressures.

        Samples of inputs are added later. A recorded initial state is taken from the samples up to the start.
        """
        scenario = self.scenario
        recording = self.recording
        if {*_SUPPLY_CHANNELS} & {*self.inputs}:
            scenario = replace(scenario, device=with_highest_supply(scenario.device, recording, self.inputs))
        if COMMAND in self.inputs:
            # A recorded command needs no sensors.
            scenario = replace(
                with_control(scenario, Control(PYTHON_CONTROLLER, {}, sample_period(recording.time))), sensors=Sensors()
            )
        if ANGLE in self.inputs:
            # From here the recorded angle prescribes the vane's.
            angle = np.interp([self.start], recording.time, recording[ANGLE])
            scenario = replace(scenario, motion=FreeMotion(float(between_stops(angle, scenario.device, self.where)[0])))
        if not self.is_recorded_start:
            return scenario
        before = recording.time <= self.start + _FITS
        if not before.any():
            raise IdentificationError(f"{self.where}: {recording.label} has no sample up to {self.start:g} s")
        time = recording.time[before]
        rest = {name: value_at_rest(time, recording[name][before], at_end=True) for name in recording.names}
        recorded = {name: rest[name] for name in ("pressure_1", "pressure_2") if name in rest}
        scenario = replace(scenario, initial=replace(scenario.initial, **recorded))
        if ANGLE in rest and ANGLE not in self.inputs and isinstance(scenario.motion, FreeMotion):
            first, velocity, _ = self.motion_at_start or (rest[ANGLE], scenario.motion.angular_velocity, 0.0)
            start = float(between_stops(np.array([first]), scenario.device, self.where)[0])
            scenario = replace(scenario, motion=replace(scenario.motion, angle=start, angular_velocity=velocity))
        return scenario

    def check(self) -> None:
        """Raise IdentificationError for an experiment that cannot be fitted; the message begins with the label."""
        recording = self.recording
        inputs = self.inputs
        scenario = self.scenario
        if (count := int((recording.time >= self.start - _FITS).sum())) < MINIMUM_SAMPLES:
            why = f"has {count} samples from the start at {self.start:g} s on, but needs at least {MINIMUM_SAMPLES}"
            raise IdentificationError(f"{self.where}: {recording.label} {why}")
        for name in (*self.channels, *inputs):
            said = f"{self.where}: {recording.label} has no channel '{name}'"
            check_known(name, recording.names, IdentificationError, said)
        motion = vane_motion(scenario)
        has_torque = EXTERNAL_TORQUE in inputs
        is_prescribed = motion.profile is not None
        is_followed = ANGLE in inputs and ANGLE in self.channels
        is_python = scenario.controller.is_outside and COMMAND not in inputs
        refuse_first(
            self.where,
            (not self.channels, "has no channel to compare; give channels"),
            (is_followed, "the recording prescribes the angle, which cannot be compared; remove it from channels"),
            (self.channels == (ANGLE,) and is_prescribed, "the angle is prescribed; add a pressure to channels"),
            (is_python, "a Python controller cannot be fitted; use a controller kind of the catalogue"),
            (
                has_torque and is_prescribed,
                "a torque does nothing where the angle is prescribed; remove it from inputs",
            ),
            (
                has_torque and motion.leg is not None,
                "the leg prescribes T_ex; remove it from inputs, or free the motion",
            ),
        )
        if COMMAND in inputs:
            check_command(recording, self.where)
        scenario.device.check_pressurised(f"{self.where}: a fit of motion")
        if inputs:
            check_gaps(recording, self.where)
            check_absolute(recording, scenario.device.supply.atmospheric_pressure, self.where)


def refuse_first(where: str, *checks: tuple[bool, str]) -> None:
    """Raise IdentificationError for the first failed pair (is wrong, reason); ``where`` is the message prefix."""
    for is_wrong, why in checks:
        if is_wrong:
            raise IdentificationError(f"{where}: {why}")


def full_path(path: str, scenario: Scenario) -> str:
    """Return the path as in a parameter set: ``valve.area`` becomes ``valves.NAME.area`` with the chosen valve."""
    section, _, name = path.partition(".")
    return f"valves.{scenario.device.valve_name}.{name}" if section == "valve" else path


def declared_numbers(scenario: Scenario) -> dict[str, Quantity]:
    """Return the declarations of all parameters that can be fitted in this scenario, by path."""
    device = scenario.device
    moves = vane_motion(scenario).profile is None
    # An orifice has two forms, and the device one of them.
    other = {f"{section}.{name}" for section in ("actuator.leak", "valve") for name in other_form(device, section)}
    declared = {
        full_path(path, scenario): quantity
        for path, quantity in numbers.declared_numbers(scenario).items()
        if path not in other
        and path.partition(".")[0] in (_FITTED_SECTIONS if moves else _FITTED_SECTIONS - {"motion"})
    }
    return declared | _OF_RECORDING


def declaration_of(path: str, scenario: Scenario) -> Quantity:
    """Return the declaration of a parameter. Raises IdentificationError, with the nearest name, for an unknown path."""
    find_effects([path])
    known = declared_numbers(scenario)
    full = full_path(path, scenario)
    check_known(full, known, IdentificationError, f"{scenario.name}: '{path}' cannot be fitted")
    return known[full]


def number_at(scenario: Scenario, path: str) -> float:
    """Return the value of a parameter [SI]; parameters of a recording are 0 before the fit."""
    declaration_of(path, scenario)
    return 0.0 if path in _OF_RECORDING else numbers.number_at(scenario, path)


def with_numbers(scenario: Scenario, changed: Mapping[str, float]) -> Scenario:
    """Return the scenario with changed parameters [SI], by path; parameters of recordings are ignored."""
    # Those of a recording change what is compared, not the run.
    return numbers.with_numbers(scenario, {path: value for path, value in changed.items() if path not in _OF_RECORDING})


def broken_rule(device: Device) -> str:
    """Return a sentence on a rule that the parameters of a device violate; empty for a valid device."""
    dynamic = device.friction.dynamic_torque
    static = device.friction.static_torque
    if dynamic > static:
        above = f"above friction.static_torque of {static:.3g} N m (fitted, or moved within its tolerance)"
        return f"friction.dynamic_torque was fitted to {dynamic:.3g} N m, {above}"
    is_crossed = device.actuator.angle_min >= device.actuator.angle_max
    return "actuator.angle_min was fitted above actuator.angle_max" if is_crossed else ""


def number_of(parameter: FitNumber, experiments: Sequence[FittedExperiment]) -> FitNumber:
    """Return a parameter with start, bounds and scale resolved, given the experiments in which it acts.

    Raises IdentificationError for contradictory settings.
    """
    path, *others = sorted({full_path(parameter.path, each.scenario) for each in experiments})
    if others:
        paths = " and ".join((path, *others))
        raise IdentificationError(f"{parameter.path} is {paths} in these experiments; give one, with its recordings")
    quantity = [declaration_of(path, each.begun) for each in experiments][-1]
    for experiment in experiments:
        is_common = experiment.scenario.device.supply.has_one_pressure and DORSIFLEXION_SUPPLY not in experiment.inputs
        channel = {
            "motion.external_torque": EXTERNAL_TORQUE,
            "supply.pressure": SUPPLY,
            "supply.dorsiflexion_pressure": SUPPLY if is_common else DORSIFLEXION_SUPPLY,
        }.get(path)
        if channel in experiment.inputs:
            user = f"{experiment.where} uses the recorded '{channel}'"
            raise IdentificationError(f"{parameter.name}: has no effect, since {user}")
    start = parameter.start
    low = quantity.minimum
    high = quantity.maximum
    first = experiments[0].begun
    # Of how a run begins the recording may say more than the scenario.
    start = number_at(first, path) if math.isnan(start) else start
    if path == TIME_OFFSET:
        low = -LONGEST_TIME_OFFSET
        high = LONGEST_TIME_OFFSET
    elif start > 0.0:
        # A number above 0 is bounded by factors: with 0 as its lower bound a valve or an effect would be another model.
        low = max(low, start / _FURTHEST) if low >= 0.0 else low
        high = min(high, start * _FURTHEST)
    low = low if math.isnan(parameter.low) else parameter.low
    high = high if math.isnan(parameter.high) else parameter.high
    bounds = f"{low:.6g} and {high:.6g}"
    allowed = f"{quantity.minimum:.6g} to {quantity.maximum:.6g} {quantity.unit}".rstrip()
    is_known = math.isfinite(parameter.deviation)
    has_size = math.isfinite(high - low) or is_known
    key = "the mean of its prior" if is_known else "start"
    is_from_zero = 0.0 in (low, start) and not parameter.is_tolerance
    refuse_first(
        parameter.name,
        (not low < high, f"low = {low:.6g} must be below high = {high:.6g}"),
        (not low <= start <= high, f"{key} = {start:.6g} must lie between the bounds {bounds}"),
        (start == 0.0 and not has_size, "start = 0 needs bounds, which define the step size of the search"),
        (not parameter.deviation > 0.0, "the standard deviation of its prior must be above 0"),
        (
            is_from_zero and _model_at(first, path, 0.0) != _model_at(first, path, high),
            "0 leaves it out of the model, so it cannot be fitted from there; start and low must be above 0",
        ),
        (
            not (quantity.minimum <= low and high <= quantity.maximum),
            f"the bounds {bounds} exceed the allowed range, {allowed}",
        ),
    )
    if parameter.is_logarithm:
        start = math.log(start)
        low = math.log(low)
        high = math.log(high)
    # Differences are a thousandth of the scale at most, which for a prior is a tenth of its deviation.
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
            experiment.check()
        if message := double_use((*self.used, *(experiment.use for experiment in self.experiments))):
            raise IdentificationError(message)
        numbers = []
        wrong = Faults()
        for parameter in self.parameters:
            for label in parameter.recordings:
                check_known(label, labels, IdentificationError, f"{parameter.path}: there is no experiment '{label}'")
            with wrong:
                numbers.append(
                    number_of(parameter, [item for item in self.experiments if parameter.acts_in(item.label)])
                )
        wrong.raise_all()
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
        inputs = experiment.inputs
        recording = experiment.recording
        is_read = experiment.is_read
        motion = experiment.begun.motion
        actuator = experiment.begun.device.actuator
        # Of a vane that moves freely, or on a leg.
        own = motion if isinstance(motion, FreeMotion) else None
        found = {}
        if own is not None and own.leg is None and EXTERNAL_TORQUE not in inputs:
            found["motion.external_torque"] = deviation_of_limit(tolerances.load * abs(own.external_torque))
        if SUPPLY not in inputs:
            # Two regulators are set one by one, to one pressure too.
            found["supply.pressure"] = deviation_of_limit(tolerances.supply)
            if DORSIFLEXION_SUPPLY not in inputs:
                found["supply.dorsiflexion_pressure"] = deviation_of_limit(tolerances.supply)
        read = math.hypot(_START_OF_ANGLE, read_error(recording, ANGLE))
        # Where the vane lies at a stop, the stop says where it starts.
        stops = actuator.angle_min, actuator.angle_max
        is_at_stop = own is not None and any(math.isclose(own.angle, stop) for stop in stops)
        if own is not None and own.leg is None and ANGLE not in inputs and not is_at_stop:
            # The angle of a scenario was set by a sensor, whose zero is known to this limit.
            usual = read if is_read else deviation_of_limit(tolerances.zero_of_angle)
            stated = tolerances.start_of_angle
            found["motion.angle"] = usual if stated is None else deviation_of_limit(stated)
        if own is not None and (start := experiment.motion_at_start) is not None:
            found["motion.angular_velocity"] = start[2]
            found.setdefault("motion.angle", read)
        for name in ("pressure_1", "pressure_2"):
            noise = read_error(recording, name) if is_read else 0.0
            stated = tolerances.start_of_pressure
            found[f"initial.{name}"] = noise if stated is None else deviation_of_limit(stated)
        for path in (path for path, deviation in found.items() if path not in free and deviation > 0.0):
            start_of_path = number_at(experiment.begun, path)
            parameters += tolerance(path, found[path], start_of_path, 1.0, recordings=(experiment.label,))
    # A fitted number takes up the error of its path: a tolerance beside it could not be told apart.
    scenario = experiments[0].scenario
    given = {full_path(item.path, scenario) for item in fitted}
    for kind, prefix, channels, limit_of in (
        ("zero", ZERO_OF, (*FITTED_CHANNELS, *_SUPPLY_CHANNELS), tolerances.zero_of),
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
            path = f"{prefix}{channel}"
            limit = limit_of(channel)
            if not labels or path in given:
                continue
            common = () if len(labels) == len(experiments) else labels
            for group in [(label,) for label in labels] if is_own else [common]:
                for number in tolerance(path, deviation_of_limit(limit), 0.0, 1.0, recordings=group):
                    lag = replace(number, low=-_LONGEST_LAG, high=_LONGEST_LAG)
                    parameters.append(lag if kind == "lag" else number)
    return (*parameters, *_of_device(tolerances, experiments, given, parameter_set))


def _of_device(
    tolerances: Tolerances, experiments: Sequence[FittedExperiment], given: set[str], parameter_set: ParameterSet | None
) -> Iterator[FitNumber]:
    """Yield the tolerances of a device whose numbers ``given`` are fitted.

    Stribeck velocity and share of the fall to dynamic friction are among them, unless the set defines them: with an
    abrupt fall, static friction trades off against damping. The static friction seen in a step response varies with the
    logarithm of that velocity, so the logarithm is varied; 95 % of its prior lies below the limit. A fixed share would
    shift its whole error to the static friction.
    """
    scenario = experiments[0].scenario
    # A parameter linked to another one has no uncertainty of its own, and of an effect that is off no number acts. A
    # gauge pressure, which counts from the atmosphere, has one.
    following = {
        path
        for path, links in scenario.device.links.items()
        if not all(link.when or link.direct == (ATMOSPHERE_PATH,) for link in links)
    }
    off = {effect.section for effect, is_on in switches_of(scenario.device).items() if not is_on}
    skipped = {"motion", "initial", "recording", "motion.shank", "supply", *off}
    for path, quantity in declared_numbers(scenario).items():
        section, _, name = path.rpartition(".")
        entry = None if parameter_set is None else parameter_set.numbers.get(path)
        stated = 0.0 if entry is None else stated_half_width(entry, quantity)
        value = number_at(scenario, path)
        if path in given | following or section in skipped or value == 0.0 or (stated == 0.0 and name in _EXACT):
            continue
        kind = path.replace(f"valves.{scenario.device.valve_name}.", "valve.")
        yield from _held(path, value, tolerances.deviation_of(kind, value, stated), quantity)
    limit = tolerances.stribeck_velocity
    moves = any(vane_motion(item.scenario).profile is None and ANGLE not in item.inputs for item in experiments)
    friction = scenario.device.friction
    has_own = number_at(scenario, _STRIBECK) > 0.0
    if has_own or not moves or friction.static_torque <= friction.dynamic_torque:
        return
    is_sought = _STRIBECK in given
    if not is_sought and limit > 0.0:
        start = limit * math.exp(-_ONE_SIDED * _FACTOR)
        low = _LEAST * limit
        high = 4.0 * limit
        yield FitNumber(_STRIBECK, start, low, high, deviation=_FACTOR, is_tolerance=True, is_logarithm=True)
    share = number_at(scenario, _SHARE)
    if (is_sought or limit > 0.0) and _SHARE not in given:
        yield from _held(_SHARE, share, tolerances.deviation_of(_SHARE, share, 0.0), declaration_of(_SHARE, scenario))


def _held(path: str, start: float, deviation: float, quantity: Quantity) -> tuple[FitNumber, ...]:
    """Return a number of the device with a prior [SI], within what it may be; nothing if it is exact."""
    # A volume or a friction of 0 would make no device.
    least = max(quantity.minimum, 0.05 * start) if quantity.minimum >= 0.0 else quantity.minimum
    return tuple(
        replace(number, low=max(number.low, least), high=min(number.high, quantity.maximum))
        for number in tolerance(path, deviation, start, 1.0)
    )


def experiment_of(entry: ExperimentSection, context: BenchContext, reader: RecordingReader) -> FittedExperiment:
    """Convert a table of a section to an experiment: recording, and scenario that models it.

    Without a scenario the recorded inputs drive the run, from the first sample unless a start is given.
    """
    where = f"experiment '{entry.label}'"
    source, *others = reader.read(entry.recording, entry.columns)
    if others:
        trial = f"columns.{entry.columns}.trial"
        raise IdentificationError(f"{where}: {entry.recording} has {1 + len(others)} trials; name one as {trial}")
    recording = source.recording
    start = entry.start or 0.0
    inputs: tuple[str, ...] = entry.inputs or ()
    is_locked = entry.locked is not None
    is_fixed = entry.volume is not None
    if entry.scenario is not None:
        reason = "cannot be combined with a scenario, which prescribes the motion of the vane"
        refuse_first(where, (is_locked, f"locked {reason}"), (is_fixed, f"volume {reason}"))
        scenario = scenario_named(entry.scenario, entry.overrides, context, reader.folder)
    else:
        inputs = tuple(name for name in INPUTS if name in recording) if entry.inputs is None else entry.inputs
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
        device = build_device(changed, context.valve)
        known = {} if entry.locked is None else {ANGLE: entry.locked}
        if entry.volume is not None:
            device, known = with_fixed_volume(device, entry.volume)
        state = start_of(replayed, device, known, where)
        motion = locked_vane(state.angle) if known else None
        scenario = replay_scenario(recording, device, state, replayed.duration, where, motion)
    # All that is neither locked nor followed; of a fixed volume its pressure.
    is_single = is_fixed or scenario.device.actuator.has_one_chamber
    unseen = {ANGLE: is_locked or is_fixed or ANGLE in inputs, "pressure_2": is_single}
    compared = (
        tuple(name for name in FITTED_CHANNELS if not unseen.get(name)) if entry.channels is None else entry.channels
    )
    if entry.step is not None:
        scenario = replace(scenario, run=replace(scenario.run, step=entry.step))
    # The scenario of a replay has the state of the samples already.
    is_read = entry.scenario is not None and entry.initial_state in ("recording", "fitted")
    noise = entry.noise.by_channel()
    trace = source.trace
    return FittedExperiment(entry.label, scenario, recording, start, compared, noise, inputs, is_read, trace)


def scenario_named(name: str, overrides: tuple[str, ...], context: BenchContext, folder: Path) -> Scenario:
    """Load a scenario, bundled or from a file in the ``folder`` of the problem, with the device of the problem."""
    name_or_file = name if name in list_scenarios() else str(folder / name)
    # The valve of the problem goes before what the experiment changes of it.
    chosen = () if context.valve is None else (f"device.valve={context.valve}",)
    return load_scenario(name_or_file, over(chosen, overrides, ScenarioError), context.parameter_set)


def parameter_of(
    entry: ParameterSection, experiments: Sequence[FittedExperiment], bench: Mapping[str, Estimate]
) -> FitNumber:
    """Convert a table of a section to a parameter to fit [SI]; ``bench`` are estimates of procedures by path."""
    scenario = next((each.scenario for each in experiments if each.label in entry.recordings), experiments[0].scenario)
    quantity = declaration_of(entry.path, scenario)
    atmosphere = scenario.device.supply.atmospheric_pressure
    where = f"parameter '{entry.path}'"
    prior = entry.prior
    deviation = math.inf

    def number(key: str, text: str | None) -> float:
        value = math.nan
        if text is not None:
            with refused_as(IdentificationError, f"{where}: {key} = '{text}'", UnitError):
                value = parse_quantity(text, quantity.unit, atmosphere)
        return value

    start, low, high = (number(key, getattr(entry, key)) for key in ("start", "low", "high"))
    refuse_first(
        where, (prior is not None and entry.start is not None, "start: a fit starts from the mean of its prior")
    )
    if isinstance(prior, PriorSection):
        start = number("prior.mean", prior.mean)
        deviation = abs(start) * prior.relative
    elif prior is not None:
        estimate = bench.get(full_path(entry.path, scenario))
        if estimate is None or not estimate.is_usable:
            identified = ", ".join(path for path, known in bench.items() if known.is_usable) or "none"
            raise IdentificationError(f"{where}: prior = 'bench': no procedure identifies it; identified: {identified}")
        start = estimate.value
        deviation = estimate.wider_half_width / interval_factor(estimate.confidence)
    return FitNumber(entry.path, start, low, high, 1.0, deviation, entry.recordings)
