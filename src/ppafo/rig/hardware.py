"""From a device and a preset to the rig: the device with a real valve, and the numbers of the richer physics."""

from dataclasses import replace

from ppafo.engine.reference.derivative import ExactOrifice
from ppafo.errors import ParameterError
from ppafo.model.orifice_curves import area_conductance
from ppafo.model.plant import PlantParameters
from ppafo.model.thermal import heat_capacity_at_constant_volume
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.device import Device, Orifice, SonicOrifice
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
    leak = _scale(device.actuator.leak, preset.values["leak.conductance_factor"])
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


def _scale(orifice: Orifice | SonicOrifice, factor: float) -> Orifice | SonicOrifice:
    if isinstance(orifice, SonicOrifice):
        return replace(orifice, sonic_conductance=orifice.sonic_conductance * factor)
    return replace(orifice, area=orifice.area * factor)


def rig_physics(device: Device, preset: Preset) -> RigPhysics:
    """Return the numbers that the rig has beyond the plant, in SI; 0 where something is off.

    ParameterError for a droop without a time.
    """
    gas, values = device.gas, preset.values
    constant = gas.specific_gas_constant
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
        supply_rate=_supply_rate(preset),
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


def _supply_rate(preset: Preset) -> float:
    droop, time = preset.values["supply.droop"], preset.values["supply.recovery_time"]
    if droop > 0.0 and time <= 0.0:
        raise ParameterError(f"preset '{preset.name}': supply.recovery_time must be above 0 s with a droop")
    return 1.0 / time if droop > 0.0 else 0.0


def line_orifice(device: Device, preset: Preset) -> ExactOrifice:
    """Return the orifice between line and chamber. ParameterError for a line without an orifice."""
    gas, line = device.gas, preset.section("line")
    if line["volume"] > 0.0 and line["area"] * line["discharge_coefficient"] <= 0.0:
        raise ParameterError(
            f"preset '{preset.name}': line.area and line.discharge_coefficient must be above 0 with a line"
        )
    conductance = area_conductance(
        line["area"],
        line["discharge_coefficient"],
        gas.heat_capacity_ratio,
        gas.specific_gas_constant,
        gas.temperature,
    )
    return ExactOrifice(
        conductance=conductance, is_iso6358=0.0, number=gas.heat_capacity_ratio, linear_ratio=device.flow.linear_ratio
    )
