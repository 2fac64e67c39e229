"""From a device and a preset to the rig: the device with a real valve, numbers of the richer physics, and sensors.

The bandwidth of sensors is integrated with the rig; noise, offset and quantisation come here, from a seed. Every
channel has a stream of random numbers of its own, so that one more channel changes none of the others.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import ParameterError
from ppafo.model.catalog import VALVES
from ppafo.model.gas import heat_capacity_at_constant_volume
from ppafo.model.orifice import ExactOrifice, area_conductance
from ppafo.model.plant import PlantParameters
from ppafo.model.sensors import quantise
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.rig.preset import Preset
from ppafo.rig.rows import RigPhysics

TWO_PI = 6.283185307179586

SECOND_VIRIAL = {"CO2": -123.0e-6, "air": -7.4e-6, "N2": -4.5e-6, "He": 11.8e-6}
"""Second virial coefficient [m^3/mol] of every gas that a set can name, at 298 K, rounded; from handbooks."""


def real_device(device: Device, preset: Preset) -> Device:
    """Return the device as it stands on the rig: the valve with its dynamics, the leak of its seals."""
    declared = {item.name for item in VALVES[device.valve.kind].quantities}
    added = {name: value for name, value in preset.section("valve").items() if name in declared}
    given = {name for name in added if device.valve.settings.get(name, 0.0) != 0.0 and name != "spool_damping_ratio"}
    kept = {name: value for name, value in added.items() if name not in given}
    valve = replace(device.valve, settings={**device.valve.settings, **kept})
    leak, factor = device.actuator.leak, preset.values["leak.conductance_factor"]
    if isinstance(leak, SonicOrifice):
        leak = replace(leak, sonic_conductance=leak.sonic_conductance * factor)
    else:
        leak = replace(leak, area=leak.area * factor)
    return replace(device, valve=valve, actuator=replace(device.actuator, leak=leak))


def rig_plant(plant: PlantParameters, preset: Preset) -> PlantParameters:
    """Return the plant with the lines taken out of the dead volumes, of which they are a part.

    ParameterError where a line is larger than a dead volume.
    """
    line = preset.values["line.volume"]
    smallest = min(plant.dead_volume_1, plant.dead_volume_2)
    if line >= smallest:
        raise ParameterError(
            f"preset '{preset.name}': line.volume = {line:g} m^3 must be below the dead volumes of the device, "
            f"of which it is a part; the smaller one is {smallest:g} m^3"
        )
    return plant._replace(dead_volume_1=plant.dead_volume_1 - line, dead_volume_2=plant.dead_volume_2 - line)


def rig_physics(device: Device, preset: Preset) -> RigPhysics:
    """Return the numbers that the rig has beyond the plant, in SI; 0 where something is off.

    ParameterError for a droop without a time.
    """
    gas, values = device.gas, preset.values
    constant = gas.specific_gas_constant
    droop, recovery = values["supply.droop"], values["supply.recovery_time"]
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
        supply_rate=1.0 / recovery if droop > 0.0 else 0.0,
        line_volume=values["line.volume"],
        laminar_conductance=values["leak.laminar_conductance"],
        static_per_pressure=values["friction.static_per_pressure"],
        dynamic_per_pressure=values["friction.dynamic_per_pressure"],
        stribeck_velocity=values["friction.stribeck_velocity"],
        angle_follow_rate=TWO_PI * values["angle_sensor.bandwidth"],
        pressure_follow_rate=TWO_PI * values["pressure_sensor.bandwidth"],
        chambers_open=0.0,
        ports_open=1.0,
    )


def line_orifice(device: Device, preset: Preset) -> ExactOrifice:
    """Return the orifice between line and chamber. ParameterError for a line without an orifice."""
    gas, line = device.gas, preset.section("line")
    if line["volume"] > 0.0 and line["area"] * line["discharge_coefficient"] <= 0.0:
        raise ParameterError(
            f"preset '{preset.name}': line.area and line.discharge_coefficient must be above 0 with a line"
        )
    conductance = area_conductance(
        line["area"], line["discharge_coefficient"], gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature
    )
    return ExactOrifice(
        conductance=conductance, is_iso6358=0.0, number=gas.heat_capacity_ratio, linear_ratio=device.flow.linear_ratio
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
"""Sensor of each channel; ``friction`` is no sensor but has a stream of random numbers too.

The order decides the streams: a new channel comes last, so that the numbers of the others stay.
"""

_STREAMS = {name: number for number, name in enumerate(CHANNEL_SENSORS)}


@dataclass(frozen=True, slots=True)
class Sensor:
    """One sensor at work: offset that was drawn, step of quantisation, and the noise of every sample to come."""

    offset: float
    quantum: float
    noise: Floats

    def reads(self, true: float, sample: int) -> float:
        """Return the reading at a sample, in the unit of ``true`` [SI]."""
        return quantise(true + self.offset + float(self.noise[sample]), self.quantum)

    def readings(self, true: Floats) -> Floats:
        """Return the readings [SI] at the first samples."""
        return np.array([self.reads(float(value), sample) for sample, value in enumerate(true)])


def random_stream(seed: int, channel: str) -> np.random.Generator:
    """Return the random numbers of a channel for a seed."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, _STREAMS[channel]])))


def sensor(preset: Preset, channel: str, seed: int, samples: int, fraction_of_range: float = 1.0) -> Sensor:
    """Return the sensor of a channel for a number of samples; one of a smaller range is finer in everything.

    ``fraction_of_range`` [-] scales offset, noise and step.
    """
    given = preset.section(CHANNEL_SENSORS[channel])
    offset, noise, quantum = (fraction_of_range * given[name] for name in ("offset", "noise", "quantum"))
    stream = random_stream(seed, channel)
    drawn = offset * float(stream.standard_normal())
    return Sensor(drawn, quantum, noise * stream.standard_normal(samples))
