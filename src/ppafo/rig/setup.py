"""Setup of an experiment on the simulated bench: request, true device and physics, result."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ppafo.errors import ParameterError
from ppafo.model.catalog import VALVES
from ppafo.model.effects import stribeck
from ppafo.model.effects.kind import SECTION
from ppafo.model.effects.seal_friction import SealFriction
from ppafo.model.effects.second_virial import SECOND_VIRIAL
from ppafo.model.gas import heat_capacity_at_constant_volume
from ppafo.model.orifice import ExactOrifice, area_conductance
from ppafo.model.plant import PlantParameters
from ppafo.parameters import load_device
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.parameters.effects import switches_of
from ppafo.progress import Report, report_nothing
from ppafo.rig.dynamics import RigPhysics
from ppafo.rig.preset import Preset
from ppafo.signals.recording import Recording


@dataclass(frozen=True, slots=True)
class ExperimentRequest:
    """Request for an experiment on the simulated bench.

    ``preset``: deviations of the rig from the identified model
    ``seed``: random seed of sensor noise and friction scatter
    ``parameter_set``: name of the parameter set of the device
    ``valve``: name of the valve; None for the default valve of the set
    ``overrides``: changes of device, scenario and preset, as texts
    ``report``: called every second with the number of samples recorded
    """

    preset: Preset
    seed: int
    parameter_set: str
    valve: str | None
    overrides: tuple[str, ...]
    report: Report = report_nothing


@dataclass(frozen=True, slots=True)
class ExperimentResult:
    """Result of an experiment: recording, true device, sensor offsets by channel, and other true values by name.

    ``replaced`` is a sentence on values of the scenario that replace those of the requested parameter set, else "".
    ``motion`` is the motion with which ``validate`` replays the recording, "" if it cannot.
    """

    recording: Recording
    device: Device
    offsets: Mapping[str, float]
    settings: Mapping[str, Any]
    replaced: str = ""
    motion: str = ""


def steady_bench(request: ExperimentRequest) -> tuple[Device, RigPhysics]:
    """Return the true device of a request without scenario, and the physics of the bench."""
    device = load_device(request.parameter_set, overrides=request.overrides, valve=request.valve)
    device = real_device(device, request.preset)
    return device, rig_physics(device, request.preset)


def real_device(device: Device, preset: Preset) -> Device:
    """Return the true device of the bench: the device with valve dynamics and seal leak of the preset.

    Raises ParameterError for a device with an active effect, because the rig has its own physics and would ignore the
    effect, and for a device that works on vacuum, because the supplies of the rig are pressure regulators.
    """
    device.check_pressurised("the simulated test bench", "; use the recording of a simulated run")
    for effect in (effect for effect, is_on in switches_of(device).items() if is_on):
        zeros = {quantity.name: f"0 {quantity.unit}".strip() for quantity in effect.quantities}
        off = " and ".join(f"'{SECTION}.{effect.name}.{name}={zeros[name]}'" for name in effect.switch)
        raise ParameterError(
            f"the simulated test bench does not support the effect '{effect.name}': switch the effect off with {off}, "
            "or use the recording of a simulated run"
        )
    declared = {quantity.name for quantity in VALVES[device.valve.kind].quantities}
    settings = dict(device.valve.settings)
    for name, value in preset.section("valve").items():
        # What the set states of its valve counts; a damping ratio is stated beside any frequency.
        if name in declared and (settings.get(name, 0.0) == 0.0 or name == "spool_damping_ratio"):
            settings[name] = value
    valve = replace(device.valve, settings=settings)
    leak, factor = device.actuator.leak, preset.values["leak.conductance_factor"]
    # The form of the set is kept, and with it the law of the flow.
    if isinstance(leak, SonicOrifice):
        leak = replace(leak, sonic_conductance=leak.sonic_conductance * factor)
    else:
        leak = replace(leak, area=leak.area * factor)
    return replace(device, valve=valve, actuator=replace(device.actuator, leak=leak))


def rig_physics(device: Device, preset: Preset) -> RigPhysics:
    """Return the parameters of the bench beyond the plant [SI]; 0 for physics that is off.

    Raises ParameterError for a supply droop without a time constant.
    """
    gas, values = device.gas, preset.values
    constant = gas.specific_gas_constant
    droop, recovery = values["supply.droop"], values["supply.recovery_time"]
    velocity = values["friction.stribeck_velocity"]
    # Without a velocity the rise has no place, and is none.
    share = stribeck.EFFECT.defaults(gas.species)["share"] if velocity > 0.0 else 0.0
    if droop > 0.0 and recovery <= 0.0:
        raise ParameterError(
            f"preset '{preset.name}': supply.recovery_time must be above 0 s if supply.droop is above 0"
        )
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
    """Return the plant with line volumes subtracted from the dead volumes, and the orifice of the lines.

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
            f"preset '{preset.name}': line.area and line.discharge_coefficient must be above 0 if line.volume is above "
            "0"
        )
    conductance = area_conductance(
        line["area"], line["discharge_coefficient"], gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature
    )
    shorter = plant._replace(dead_volume_1=plant.dead_volume_1 - volume, dead_volume_2=plant.dead_volume_2 - volume)
    return shorter, ExactOrifice(
        conductance=conductance, is_iso6358=0.0, number=gas.heat_capacity_ratio, linear_ratio=device.flow.linear_ratio
    )
