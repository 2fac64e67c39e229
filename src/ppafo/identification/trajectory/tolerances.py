"""Tolerances of the bench and the parameter set as fit parameters with priors."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from ppafo.identification.new_set import fitting_unit, stated_half_width
from ppafo.identification.tolerances import Tolerances
from ppafo.identification.trajectory.experiment import (
    FITTED_CHANNELS,
    GAIN_OF,
    LAG_OF,
    ZERO_OF,
    FittedExperiment,
    FreeParameter,
    declared_numbers,
    full_path,
    number_at,
    scenario_of,
)
from ppafo.model.declaration import Quantity
from ppafo.parameters.effects import switches_of
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.signals.faults import noise_of, resolution_of
from ppafo.signals.recording import Recording
from ppafo.simulation.recorded.channels import ANGLE, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY
from ppafo.simulation.recorded.clock import regular_interval
from ppafo.simulation.recorded.usual_errors import deviation_of_limit
from ppafo.simulation.scenario import FreeMotion, Scenario, vane_motion

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
    fitted: Sequence[FreeParameter],
    stated: Mapping[str, float] | None = None,
) -> tuple[FreeParameter, ...]:
    """Return all tolerances, except parameters already ``fitted``, as fit parameters with priors.

    ``stated`` are the half-widths of the 95 % intervals stated in the set [SI], by path.
    """
    parameters: list[FreeParameter] = []
    for experiment in experiments:
        free = {
            full_path(item.path, experiment.scenario)
            for item in fitted
            if not item.recordings or experiment.label in item.recordings
        }
        for path, (start, deviation) in _of_run(tolerances, experiment).items():
            if path not in free and deviation > 0.0:
                parameters.append(_parameter(path, start, deviation, (experiment.label,)))
    # What is fitted is moved already; a second number for it could not be told from the first.
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


def _stribeck(
    tolerances: Tolerances, experiments: Sequence[FittedExperiment], given: set[str]
) -> Iterator[FreeParameter]:
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
        yield FreeParameter(
            _STRIBECK,
            limit * math.exp(-_ONE_SIDED * _FACTOR),
            _LEAST * limit,
            4.0 * limit,
            _FACTOR,
            is_tolerance=True,
            is_logarithm=True,
        )
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
    is_read = experiment.initial_state == "recording" or experiment.scenario.controller.is_outside
    stops = scenario.device.actuator.angle_min, scenario.device.actuator.angle_max
    # Where the vane lies at a stop, the stop says where it starts.
    if free is not None and ANGLE not in inputs and not any(math.isclose(free.angle, stop) for stop in stops):
        stated = tolerances.start_of_angle
        read = math.hypot(_START_OF_ANGLE, _read_error(recording, ANGLE)) if is_read else 0.0
        # The angle of a scenario was set by a sensor, whose zero is known to this limit.
        usual = read or deviation_of_limit(tolerances.zero_of_angle)
        found["motion.angle"] = usual if stated is None else deviation_of_limit(stated)
    for name in ("pressure_1", "pressure_2"):
        noise = _read_error(recording, name) if is_read else 0.0
        stated = tolerances.start_of_pressure
        found[f"initial.{name}"] = noise if stated is None else deviation_of_limit(stated)
    return {path: (number_at(scenario, path), deviation) for path, deviation in found.items()}


def _read_error(recording: Recording, name: str) -> float:
    """Return the standard deviation [SI] of one sample of a channel, from noise and resolution; 0 if not recorded."""
    if name not in recording:
        return 0.0
    return math.hypot(noise_of(recording[name]), resolution_of(recording[name]) / math.sqrt(12.0))


def _of_set(
    tolerances: Tolerances, experiments: Sequence[FittedExperiment], given: set[str], stated: Mapping[str, float]
) -> Iterator[FreeParameter]:
    """Yield the fixed parameters of the device as fit parameters, each with its uncertainty as prior.

    A parameter linked to another one has no uncertainty of its own.
    """
    scenario = experiments[0].scenario
    following = {path for path, links in scenario.device.links.items() if not all(link.when_set for link in links)}
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


def _held(path: str, value: float, deviation: float, quantity: Quantity) -> FreeParameter:
    """Return a fixed parameter of the device, with its standard deviation [SI] as prior, as a fit parameter."""
    low = max(quantity.minimum, value - _WIDEST * deviation)
    high = min(quantity.maximum, value + _WIDEST * deviation)
    # A volume or a friction of 0 would make no device.
    low = max(low, 0.05 * value) if quantity.minimum >= 0.0 else low
    return FreeParameter(path, value, low, high, deviation, is_tolerance=True)


def _parameter(path: str, start: float, deviation: float, recordings: tuple[str, ...]) -> FreeParameter:
    width = _WIDEST * deviation
    return FreeParameter(path, start, start - width, start + width, deviation, recordings, is_tolerance=True)
