"""What a bench and a set do not know exactly, as numbers of the fit with priors: the table [bench], and its defaults.

A tolerance is a limit, as data sheets state it. Only the limits are known, so each has a prior of limit / sqrt(3), the
standard deviation of an even distribution between the limits (GUM, JCGM 100:2008, 4.3.7). A number of the set that is
held has the uncertainty that the set states, at 95 %, or else a limit of ``HELD``.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from ppafo.constants import PASCALS_PER_PSI
from ppafo.documents.models import StrictTable, Text
from ppafo.errors import IdentificationError, UnitError, refused_as
from ppafo.identification.bench.law import DEFAULTS
from ppafo.identification.estimate import interval_factor
from ppafo.identification.new_set import fitting_unit
from ppafo.identification.trajectory.problem import (
    FITTED_CHANNELS,
    GAIN_OF,
    ZERO_OF,
    Experiment,
    FreeParameter,
    declared_numbers,
    full_path,
    number_at,
    scenario_of,
)
from ppafo.parameters.parameter_set import CONFIDENCE, ParameterSet
from ppafo.signals.faults import noise_of
from ppafo.simulation.recorded import ANGLE, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY
from ppafo.simulation.scenario import PYTHON_CONTROLLER, FreeMotion, Scenario
from ppafo.units import parse_quantity, to_si

_WIDEST = 12.0
"""Standard deviations of its prior that a tolerance may be off at most in the search."""

Sensed = Literal["zero", "gain"]


class BenchSection(StrictTable):
    """What the bench does not know exactly: limits on either side; 0 is known exactly."""

    load: Annotated[Text | None, Field(description="of the external torque, of each recording; default 2 %")] = None
    supply: Annotated[Text | None, Field(description="of each supply pressure, of each recording; 1 psi_d")] = None
    zero_of_angle: Annotated[Text | None, Field(description="of the zero of the angle sensor; 0.5 deg")] = None
    zero_of_pressure: Annotated[Text | None, Field(description="of each pressure sensor; 0.3 psi_d")] = None
    gain: Annotated[
        Text | None, Field(description="of the gain of each sensor; 0.5 % of pressures, 0 % of the angle")
    ] = None
    start_of_angle: Annotated[
        Text | None, Field(description="of the angle at the start of each recording; 0.05 deg where it is read there")
    ] = None
    start_of_pressure: Annotated[
        Text | None,
        Field(description="of both pressures at the start; the noise of a sample where they are read there"),
    ] = None
    each_recording: Annotated[
        tuple[Sensed, ...],
        Field(strict=False, description="'zero', 'gain': anew in each recording; default: the same in all of them"),
    ] = ()
    gas_temperature: Annotated[Text | None, Field(description="of the temperature of the gas; 15 K")] = None
    gas_law: Annotated[Text | None, Field(description="departure of the gas from the ideal gas law; 1 %")] = None
    zero_of_flow: Annotated[Text | None, Field(description="zero of the flow meter, of its largest reading")] = None
    held: Annotated[Text | None, Field(description="of a number of the set that states no uncertainty of its own")] = (
        None
    )


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Limits on either side of what a bench does not know exactly, in SI units; 0 is known. ``load`` is a fraction.

    None takes the default of the channel or number. Those ``each_recording`` names are others in each recording.
    """

    load: float = 0.02
    supply: float = PASCALS_PER_PSI
    zero_of_angle: float = math.radians(0.5)
    zero_of_pressure: float = DEFAULTS.zero_of_pressure
    gain: float | None = None
    start_of_angle: float | None = None
    start_of_pressure: float | None = None
    gas_temperature: float | None = None
    gas_law: float | None = None
    zero_of_flow: float | None = None
    held: float | None = None
    each_recording: tuple[Sensed, ...] = ()

    def zero_of(self, channel: str) -> float:
        """Return the limit of the zero of a channel [rad], [Pa]."""
        return self.zero_of_angle if channel == ANGLE else self.zero_of_pressure

    def gain_of(self, channel: str) -> float:
        """Return the limit of the gain of a channel [-]."""
        usual = 0.0 if channel == ANGLE else DEFAULTS.gain
        return usual if self.gain is None else self.gain


HELD = {
    "gas.molar_mass": DEFAULTS.gas_law,
    "gas.heat_capacity_ratio": 0.02,
    "actuator.torque_constant": 0.02,
    "actuator.volume_per_angle": 0.02,
    "actuator.dead_volume_1": 0.05,
    "actuator.dead_volume_2": 0.05,
    "actuator.leak.discharge_coefficient": 0.3,
    "actuator.leak.sonic_conductance": 0.3,
    "actuator.restitution": 0.2,
    "friction.static_torque": 0.3,
    "friction.dynamic_torque": 0.5,
    "friction.viscous_damping": 0.3,
    "foot_plate.inertia": 0.05,
    "foot_plate.gravity_torque": 0.1,
    "valve.discharge_coefficient": 0.1,
    "valve.sonic_conductance": 0.1,
}
"""Limits [-] of numbers of a set that is silent about them, over the number."""

_OTHER_SETTING = 0.1
"""Limit [-] of a setting of the valve, an effect or an actuator of another kind."""

_EXACT = ("area", "angle_min", "angle_max", "linear_ratio", "critical_ratio", "atmospheric_pressure")
"""Names of numbers that only go with another one, or that the zero of a sensor moves as well."""

_START_OF_ANGLE = math.radians(0.05)

_UNITS = {
    "load": "1",
    "supply": "Pa_d",
    "zero_of_angle": "rad",
    "zero_of_pressure": "Pa_d",
    "gain": "1",
    "start_of_angle": "rad",
    "start_of_pressure": "Pa_d",
    "gas_temperature": "K",
    "gas_law": "1",
    "zero_of_flow": "1",
    "held": "1",
}
_LARGEST_FRACTION = 0.5


def tolerances_of(section: BenchSection | None, file: str) -> Tolerances:
    """Return the tolerances of a table [SI], defaults without one; IdentificationError for one below 0."""
    limits = {}
    for name, unit in _UNITS.items():
        text = None if section is None else getattr(section, name)
        if text is None:
            continue
        said = f"{file}: bench: {name} = '{text}'"
        with refused_as(IdentificationError, said, UnitError):
            limit = limits[name] = parse_quantity(text, unit)
        if not 0.0 <= limit < math.inf or (unit == "1" and limit > _LARGEST_FRACTION):
            most = f" and at most {_LARGEST_FRACTION:.0%}" if unit == "1" else ""
            raise IdentificationError(f"{said}: must be 0 or above{most}")
    return Tolerances(**limits, each_recording=() if section is None else section.each_recording)


def stated_by(parameter_set: ParameterSet, scenario: Scenario) -> dict[str, float]:
    """Return half widths of the 95 % intervals that a set states [SI], by path."""
    found = {}
    for path, quantity in declared_numbers(scenario).items():
        entry = parameter_set.numbers.get(path)
        if entry is not None and entry.uncertainty:
            unit = fitting_unit(entry.unit, quantity)
            found[path] = to_si(entry.value + entry.uncertainty, entry.unit, unit) - to_si(
                entry.value, entry.unit, unit
            )
    return found


def tolerance_parameters(
    tolerances: Tolerances,
    experiments: Sequence[Experiment],
    fitted: Sequence[FreeParameter],
    stated: Mapping[str, float] | None = None,
) -> tuple[FreeParameter, ...]:
    """Return what is not known exactly and not ``fitted`` anyway, as numbers of the fit with priors.

    ``stated`` are half widths of the 95 % intervals [SI] that the set states, by path.
    """
    found: list[FreeParameter] = []
    for experiment in experiments:
        free = {
            full_path(item.path, experiment.scenario)
            for item in fitted
            if not item.recordings or experiment.label in item.recordings
        }
        for path, (start, deviation) in _of_run(tolerances, experiment).items():
            if path not in free and deviation > 0.0:
                found.append(_parameter(path, start, deviation, (experiment.label,)))
    given = {full_path(item.path, experiments[0].scenario) for item in fitted}
    for kind, prefix, limit_of in (("zero", ZERO_OF, tolerances.zero_of), ("gain", GAIN_OF, tolerances.gain_of)):
        for channel in (*FITTED_CHANNELS, *((SUPPLY, DORSIFLEXION_SUPPLY) if kind == "zero" else ())):
            labels = [
                item.label
                for item in experiments
                if channel in item.channels or (kind == "zero" and channel in item.inputs)
            ]
            path, limit = f"{prefix}{channel}", limit_of(channel)
            if not labels or not limit > 0.0 or path in given:
                continue
            groups = [(label,) for label in labels] if kind in tolerances.each_recording else [tuple(labels)]
            for group in groups:
                whole = len(group) == len(experiments) and kind not in tolerances.each_recording
                found.append(_parameter(path, 0.0, limit / math.sqrt(3.0), () if whole else group))
    return (*found, *_of_set(tolerances, experiments, given, stated or {}))


def _of_run(tolerances: Tolerances, experiment: Experiment) -> dict[str, tuple[float, float]]:
    """Return start and standard deviation of what one run is done with and how it begins, by path [SI]."""
    scenario, inputs, recording = scenario_of(experiment), experiment.inputs, experiment.recording
    free = scenario.motion if isinstance(scenario.motion, FreeMotion) and scenario.motion.leg is None else None
    found = {}
    if free is not None and EXTERNAL_TORQUE not in inputs and free.external_torque != 0.0:
        found["motion.external_torque"] = tolerances.load * abs(free.external_torque) / math.sqrt(3.0)
    if SUPPLY not in inputs:
        # Two regulators are set one by one, to one pressure too.
        found["supply.pressure"] = tolerances.supply / math.sqrt(3.0)
        if DORSIFLEXION_SUPPLY not in inputs:
            found["supply.dorsiflexion_pressure"] = tolerances.supply / math.sqrt(3.0)
    is_read = experiment.initial_state == "recording" or experiment.scenario.control.kind == PYTHON_CONTROLLER
    stops = scenario.device.actuator.angle_min, scenario.device.actuator.angle_max
    # Where the vane lies at a stop, the stop says where it starts.
    if free is not None and ANGLE not in inputs and not any(math.isclose(free.angle, stop) for stop in stops):
        stated = tolerances.start_of_angle
        usual = _START_OF_ANGLE if is_read else 0.0
        found["motion.angle"] = usual if stated is None else stated / math.sqrt(3.0)
    for name in ("pressure_1", "pressure_2"):
        noise = noise_of(recording[name]) if is_read and name in recording else 0.0
        stated = tolerances.start_of_pressure
        found[f"initial.{name}"] = noise if stated is None else stated / math.sqrt(3.0)
    return {path: (number_at(scenario, path), deviation) for path, deviation in found.items()}


def _of_set(
    tolerances: Tolerances, experiments: Sequence[Experiment], given: set[str], stated: Mapping[str, float]
) -> Iterator[FreeParameter]:
    """Return the numbers of the device that are held, each with its own uncertainty, as the fit moves them."""
    scenario = experiments[0].scenario
    for path, quantity in declared_numbers(scenario).items():
        section, _, name = path.rpartition(".")
        if path in given or section in ("motion", "initial", "recording", "motion.shank") or path.startswith("supply."):
            continue
        value, own = number_at(scenario, path), stated.get(path, 0.0) / interval_factor(CONFIDENCE)
        if value == 0.0 or (own == 0.0 and name in _EXACT):
            continue
        usual = HELD.get(path.replace(f"valves.{scenario.device.valve_name}.", "valve."), _OTHER_SETTING)
        limit = abs(value) * (usual if tolerances.held is None else tolerances.held)
        if path == "gas.temperature":
            limit, own = DEFAULTS.temperature, 0.0 if tolerances.gas_temperature is not None else own
            limit = limit if tolerances.gas_temperature is None else tolerances.gas_temperature
        if path == "gas.molar_mass" and tolerances.gas_law is not None:
            limit, own = abs(value) * tolerances.gas_law, 0.0
        deviation = own or limit / math.sqrt(3.0)
        if deviation > 0.0:
            low, high = (
                max(quantity.minimum, value - _WIDEST * deviation),
                min(quantity.maximum, value + _WIDEST * deviation),
            )
            low = max(low, 0.05 * value) if quantity.minimum >= 0.0 else low
            yield FreeParameter(path, value, low, high, deviation, is_tolerance=True)


def _parameter(path: str, start: float, deviation: float, recordings: tuple[str, ...]) -> FreeParameter:
    width = _WIDEST * deviation
    return FreeParameter(path, start, start - width, start + width, deviation, recordings, is_tolerance=True)
