"""Presets of the rig: deviations from the identified model, as TOML files with a unit and a reason for each value.

Every value of a preset is declared here with section, name, SI unit, range and meaning, and so are the request and the
result of an experiment.

The bandwidth of sensors is integrated with the rig; noise, offset and quantisation are applied here, from a seed. Every
channel has a separate stream of random numbers, so that an additional channel changes no other channel.
"""

import functools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from ppafo.documents.models import SchemaVersion, StrictTable, make_schema, read_model, table
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import ParameterError, UnitError, refused_as
from ppafo.model.catalog import VALVES
from ppafo.model.declaration import Quantity
from ppafo.model.effects import stribeck
from ppafo.model.effects.kind import SECTION
from ppafo.model.effects.seal_friction import SealFriction
from ppafo.model.effects.second_virial import SECOND_VIRIAL
from ppafo.model.gas import heat_capacity_at_constant_volume
from ppafo.model.orifice import ExactOrifice, area_conductance
from ppafo.model.plant import PlantParameters
from ppafo.model.sensors import quantise
from ppafo.parameters.declaration import is_within, range_rule
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.parameters.effects import switches_of
from ppafo.parameters.overrides import override_set, read_overrides
from ppafo.rig.dynamics import RigPhysics
from ppafo.signals.recording import Recording
from ppafo.units import parse_quantity, to_si
from ppafo.wording import nearest_name


def _from_zero(name: str, unit: str, summary: str, maximum: float = math.inf) -> Quantity:
    return Quantity(name, unit, summary, minimum=0.0, maximum=maximum)


def _sensor(unit: str, what: str) -> tuple[Quantity, ...]:
    return (
        _from_zero("noise", unit, f"standard deviation of the noise of the {what}"),
        _from_zero("offset", unit, f"standard deviation of the offset of the {what}, drawn once"),
        _from_zero("resolution", unit, f"step of the {what}, 0 for none"),
    )


def _bandwidth(what: str) -> Quantity:
    return _from_zero("bandwidth", "Hz", f"first-order bandwidth of the {what}, 0 for none", 1e5)


_WALL, _SUPPLIED = "wall and room above the set's temperature", "supplied gas above the set's temperature"

SECTIONS: dict[str, tuple[Quantity, ...]] = {
    "gas": (
        _from_zero("heat_transfer_coefficient", "W/(m^2 K)", "heat transfer between gas and wall", 1e9),
        _from_zero("wall_area_per_volume", "1/m", "inner surface of chamber or line over its volume", 1e5),
        Quantity("wall_temperature_difference", "K", _WALL, minimum=-80.0, maximum=80.0),
        Quantity("supply_temperature_difference", "K", _SUPPLIED, minimum=-80.0, maximum=80.0),
        _from_zero("real_gas_share", "", "fraction of the gas's second virial coefficient, 0: ideal", 1.0),
    ),
    "supply": (
        _from_zero("droop", "Pa s/kg", "fall of a regulated pressure per mass flow", 1e9),
        _from_zero("recovery_time", "s", "time constant with which the regulated pressure falls and recovers", 10.0),
    ),
    "line": (
        _from_zero("volume", "m^3", "volume of each line, a part of the dead volume, 0 for none", 1e-2),
        _from_zero("area", "m^2", "area of an orifice between line and chamber with the same pressure loss", 1e-2),
        _from_zero("discharge_coefficient", "", "discharge coefficient of that orifice", 2.0),
        _from_zero("delay", "s", "time that a wave needs through the line, added to the command", 0.1),
    ),
    "valve": (
        _from_zero("hysteresis", "", "play between command and spool, whole width", 0.5),
        _from_zero("dead_band", "", "proportional: smallest command that opens the valve", 0.9),
        _from_zero("delay", "s", "proportional: dead time between command and spool", 0.2),
        _from_zero("spool_frequency", "Hz", "proportional: undamped frequency of the spool, 0 for none", 2e3),
        Quantity("spool_damping_ratio", "", "proportional: damping ratio of the spool", minimum=0.05, maximum=5.0),
        _from_zero("opening_delay", "s", "solenoid: time from energising to flow from the source", 0.2),
        _from_zero("closing_delay", "s", "solenoid: time from de-energising to venting", 0.2),
    ),
    "friction": (
        _from_zero("static_per_pressure", "m^3", "static limit per pressure difference across the vane", 1e-2),
        _from_zero("dynamic_per_pressure", "m^3", "dynamic friction per pressure difference", 1e-2),
        _from_zero("stribeck_velocity", "rad/s", "speed at which half of the rise at standstill is left", 1e2),
        _from_zero("scatter", "", "standard deviation of the static limit from reading to reading", 0.5),
    ),
    "leak": (
        _from_zero("conductance_factor", "", "leak of the device times this", 1e3),
        _from_zero("laminar_conductance", "kg/(s Pa^2)", "further leak per difference of squared pressures", 1e-8),
    ),
    "sampling": (Quantity("rate", "Hz", "samples recorded per second", minimum=1.0, maximum=1e5),),
    "angle_sensor": (_bandwidth("angle sensor"), *_sensor("rad", "angle sensor")),
    "pressure_sensor": (_bandwidth("pressure sensors"), *_sensor("Pa_d", "pressure sensors")),
    "torque_sensor": _sensor("N m", "scale"),
    "flow_sensor": _sensor("kg/s", "flow meter"),
}
"""Values of a preset, all of them required: physics that is off has the value 0 and a reason."""

PATHS: dict[str, Quantity] = {
    f"{section}.{quantity.name}": quantity for section, members in SECTIONS.items() for quantity in members
}


class PresetValue(StrictTable):
    """Value of a preset of the simulated bench, with unit and reason."""

    value: float = Field(description="the number, in the unit beside it")
    unit: str = Field(description="unit of the number, such as 'mm^2'; empty for a plain number")
    reason: str = Field(min_length=1, description="reason for the number: a source, or why it was chosen")


@functools.cache
def _layout() -> type[BaseModel]:
    """Return the layout of a preset file: name, title and notes, and a table for each section of ``SECTIONS``."""
    fields: dict[str, Any] = {
        "schema_version": (SchemaVersion, ...),
        "name": (str, Field(description="name of the preset")),
        "title": (str, Field(description="which test bench it represents, in one line")),
        "notes": (str, Field(description="what is on, what is off, and where the values come from")),
    }
    for name, members in SECTIONS.items():
        values = {
            quantity.name: (PresetValue, Field(description=f"{quantity.summary} [{quantity.unit or '-'}]"))
            for quantity in members
        }
        fields[name] = (table("".join(part.capitalize() for part in name.split("_")), values), Field())
    return table("RigPreset", fields)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a preset; every value is required."""
    return make_schema(_layout(), "ppafo rig preset")


PREFIX = "rig."
"""Prefix of overrides of the preset; any other override concerns the device or the experiment."""

_FILE = TomlKind("preset of the rig", "rig", resources.files("ppafo.rig") / "presets", ParameterError)


@dataclass(frozen=True, slots=True)
class Preset:
    """Preset of the rig: values in SI and their reasons, both by dotted path."""

    name: str
    title: str
    notes: str
    values: Mapping[str, float]
    reasons: Mapping[str, str]

    def section(self, name: str) -> dict[str, float]:
        """Return the values [SI] of one section, by name."""
        return {quantity.name: self.values[f"{name}.{quantity.name}"] for quantity in SECTIONS[name]}

    def with_value(self, path: str, value: float, reason: str) -> "Preset":
        """Return the preset with one value [SI] replaced.

        Raises ParameterError if the path is unknown or the value is out of range.
        """
        quantity = PATHS.get(path)
        if quantity is None:
            raise ParameterError(f"preset '{self.name}' has no value '{path}'{nearest_name(path, PATHS)}")
        if not (math.isfinite(value) and is_within(value, quantity)):
            raise ParameterError(f"preset '{self.name}': {path} = {value:g}: {range_rule(quantity, quantity.unit)}")
        return replace(self, values={**self.values, path: value}, reasons={**self.reasons, path: reason})


def list_presets() -> tuple[str, ...]:
    """Return the names of the presets in the package."""
    return _FILE.names()


def load_preset(name_or_path: str | Path, overrides: Iterable[str] = ()) -> Preset:
    """Return a preset by its name in the package or by the path of a TOML file.

    ``overrides`` are texts such as ``rig.pressure_sensor.noise=0 Pa_d``. Raises ParameterError for an invalid preset or
    override.
    """
    layout, file = read_model(_FILE, _layout(), name_or_path)
    read: Any = layout
    preset = Preset(read.name, read.title, read.notes.strip(), {}, {})
    for path, quantity in PATHS.items():
        section, _, name = path.partition(".")
        entry: PresetValue = getattr(getattr(read, section), name)
        with refused_as(ParameterError, f"{file}: {path}", UnitError):
            in_si = to_si(entry.value, entry.unit, quantity.unit)
        with refused_as(ParameterError, file, ParameterError):
            preset = preset.with_value(path, in_si, entry.reason)
    for typed, override in override_set(read_overrides(overrides)).items():
        path = typed.removeprefix(PREFIX)
        if path not in PATHS or not typed.startswith(PREFIX):
            hint = nearest_name(typed, [f"{PREFIX}{known}" for known in PATHS])
            raise ParameterError(f"override '{override}': the rig has no value '{typed}'{hint}")
        with refused_as(ParameterError, f"override '{override}'", UnitError):
            value = parse_quantity(override.text, PATHS[path].unit)
        preset = preset.with_value(path, value, "override")
    return preset


@dataclass(frozen=True, slots=True)
class ExperimentRequest:
    """Request for an experiment on the rig.

    ``preset``: deviations of the rig from the identified model
    ``seed``: random seed of sensor noise and friction scatter
    ``parameter_set``: name of the parameter set of the device
    ``valve``: name of the valve; None for the default valve of the set
    ``overrides``: changes of device, scenario and preset, as texts
    """

    preset: Preset
    seed: int
    parameter_set: str
    valve: str | None
    overrides: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ExperimentResult:
    """Result of an experiment: recording, true device, sensor offsets by channel, and further true values by name."""

    recording: Recording
    device: Device
    offsets: Mapping[str, float]
    settings: Mapping[str, Any]


def real_device(device: Device, preset: Preset) -> Device:
    """Return the true device of the rig: the device with valve dynamics and seal leak of the preset.

    Raises ParameterError for a device with an active effect, because the rig has its own physics and would ignore the
    effect, and for a device that works on vacuum, because the supplies of the rig are pressure regulators.
    """
    device.check_pressurised("the simulated bench", "; take the recording of a simulated run")
    for effect in (effect for effect, is_on in switches_of(device).items() if is_on):
        zeros = {quantity.name: f"0 {quantity.unit}".strip() for quantity in effect.quantities}
        off = " and ".join(f"'{SECTION}.{effect.name}.{name}={zeros[name]}'" for name in effect.switch)
        raise ParameterError(
            f"the simulated bench has no effect '{effect.name}': switch it off with {off}, or take the recording of a "
            "simulated run"
        )
    declared = {quantity.name for quantity in VALVES[device.valve.kind].quantities}
    settings, added = dict(device.valve.settings), preset.section("valve")
    for name in (name for name in added if name in declared):
        # What the set states of its valve counts; a damping ratio is stated beside any frequency.
        if settings.get(name, 0.0) == 0.0 or name == "spool_damping_ratio":
            settings[name] = added[name]
    valve = replace(device.valve, settings=settings)
    leak, factor = device.actuator.leak, preset.values["leak.conductance_factor"]
    # The form of the set is kept, and with it the law of the flow.
    if isinstance(leak, SonicOrifice):
        leak = replace(leak, sonic_conductance=leak.sonic_conductance * factor)
    else:
        leak = replace(leak, area=leak.area * factor)
    return replace(device, valve=valve, actuator=replace(device.actuator, leak=leak))


def rig_physics(device: Device, preset: Preset) -> RigPhysics:
    """Return the parameters of the rig beyond the plant, in SI; 0 for physics that is switched off.

    Raises ParameterError for a supply droop without a time constant.
    """
    gas, values = device.gas, preset.values
    constant = gas.specific_gas_constant
    droop, recovery = values["supply.droop"], values["supply.recovery_time"]
    velocity = values["friction.stribeck_velocity"]
    # Without a velocity the rise has no place, and is none.
    share = stribeck.EFFECT.defaults(gas.species)["share"] if velocity > 0.0 else 0.0
    if droop > 0.0 and recovery <= 0.0:
        raise ParameterError(f"preset '{preset.name}': supply.recovery_time must be above 0 s with a droop")
    return RigPhysics(
        gas_constant=constant,
        heat_capacity=heat_capacity_at_constant_volume(constant, gas.heat_capacity_ratio),
        reference_temperature=gas.temperature,
        wall_temperature=gas.temperature + values["gas.wall_temperature_difference"],
        supply_temperature=gas.temperature + values["gas.supply_temperature_difference"],
        heat_transfer_coefficient=values["gas.heat_transfer_coefficient"],
        wall_area_per_volume=values["gas.wall_area_per_volume"],
        virial=values["gas.real_gas_share"] * SECOND_VIRIAL[gas.species] / gas.molar_mass,
        supply_droop=values["supply.droop"],
        # A regulator without droop has no state to recover.
        supply_rate=1.0 / recovery if droop > 0.0 else 0.0,
        line_volume=values["line.volume"],
        laminar_conductance=values["leak.laminar_conductance"],
        seal_friction=SealFriction(values["friction.static_per_pressure"], values["friction.dynamic_per_pressure"]),
        stribeck=stribeck.prepare(stribeck.StribeckSettings(velocity, share), device),
        angle_follow_rate=math.tau * values["angle_sensor.bandwidth"],
        pressure_follow_rate=math.tau * values["pressure_sensor.bandwidth"],
        chambers_open=0.0,
        ports_open=1.0,
    )


def with_line(device: Device, plant: PlantParameters, preset: Preset) -> tuple[PlantParameters, ExactOrifice]:
    """Return the plant with the line volumes subtracted from the dead volumes, and the orifice of the lines.

    Raises ParameterError for a line larger than a dead volume, and for a line without an orifice.
    """
    gas, line = device.gas, preset.section("line")
    volume, smallest = line["volume"], min(plant.dead_volume_1, plant.dead_volume_2)
    if volume >= smallest:
        raise ParameterError(
            f"preset '{preset.name}': line.volume = {volume:g} m^3 is part of each dead volume, so it must be below "
            f"the smaller one, {smallest:g} m^3"
        )
    if volume > 0.0 and line["area"] * line["discharge_coefficient"] <= 0.0:
        raise ParameterError(
            f"preset '{preset.name}': line.area and line.discharge_coefficient must be above 0 with a line"
        )
    conductance = area_conductance(
        line["area"], line["discharge_coefficient"], gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature
    )
    shorter = plant._replace(dead_volume_1=plant.dead_volume_1 - volume, dead_volume_2=plant.dead_volume_2 - volume)
    return shorter, ExactOrifice(
        conductance=conductance,
        is_iso6358=0.0,
        number=gas.heat_capacity_ratio,
        linear_ratio=device.flow.linear_ratio,
    )


Floats = NDArray[np.float64]

CHANNEL_SENSORS = {
    "angle": "angle_sensor",
    "pressure_1": "pressure_sensor",
    "pressure_2": "pressure_sensor",
    "supply_pressure": "pressure_sensor",
    "pressure_difference": "pressure_sensor",
    "upstream_pressure": "pressure_sensor",
    "downstream_pressure": "pressure_sensor",
    "torque": "torque_sensor",
    "mass_flow": "flow_sensor",
    "friction": "",
    "dorsiflexion_pressure": "pressure_sensor",
}
"""Sensor of each channel; ``friction`` has no sensor, but a stream of random numbers.

The order determines the streams: a new channel must come last, so that the other streams do not change.
"""

# By its place, not its name: renaming a channel leaves its noise.
_STREAMS = {name: number for number, name in enumerate(CHANNEL_SENSORS)}


@dataclass(frozen=True, slots=True)
class SimulatedSensor:
    """Sensor of a run: offset, quantisation step, and noise of every sample."""

    offset: float
    resolution: float
    noise: Floats

    def reads(self, true: float, sample: int) -> float:
        """Return the reading at a sample for a true value, both in SI.

        ``sample`` is the number of the sample, which selects its noise.
        """
        return quantise(true + self.offset + float(self.noise[sample]), self.resolution)

    def readings(self, true: Floats) -> Floats:
        """Return the readings of true values [SI] at the first samples."""
        return np.array([self.reads(float(value), sample) for sample, value in enumerate(true)])


def random_stream(seed: int, channel: str) -> np.random.Generator:
    """Return the random generator of a channel for a seed."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, _STREAMS[channel]])))


def sensor(preset: Preset, channel: str, seed: int, samples: int, fraction_of_range: float = 1.0) -> SimulatedSensor:
    """Return the simulated sensor of a channel for a number of samples.

    ``fraction_of_range`` [-] scales offset, noise and quantisation step for a sensor of smaller range.
    """
    numbers = preset.section(CHANNEL_SENSORS[channel])
    offset, noise, resolution = (fraction_of_range * numbers[name] for name in ("offset", "noise", "resolution"))
    stream = random_stream(seed, channel)
    # The offset comes first, so that a longer recording begins with the same noise.
    drawn = offset * float(stream.standard_normal())
    return SimulatedSensor(drawn, resolution, noise * stream.standard_normal(samples))
