"""Numbers of the plant and its effects, computed from a device."""

from collections.abc import Iterable, Mapping
from functools import cache
from types import SimpleNamespace
from typing import Any, NamedTuple

from ppafo.model.actuators.kind import Range, mean_growth
from ppafo.model.catalog import ACTUATORS, VALVES, find_effects, ordered_effects
from ppafo.model.columns import first, over_runs
from ppafo.model.effects.kind import SECTION, Effect
from ppafo.model.flow_curve import isentropic_curve, iso6358_curve
from ppafo.model.orifice import FlowCurve, area_conductance, sonic_conductance_mass
from ppafo.model.plant import PlantParameters
from ppafo.model.valves.kind import ValveModel
from ppafo.parameters.declaration import members
from ppafo.parameters.device import Device, Gas, Orifice, SonicOrifice, Valve


class Restriction(NamedTuple):
    """An orifice with a gas: conductance [kg/(s Pa)] and flow function."""

    conductance: float
    curve: FlowCurve


def area_restriction(orifice: Orifice, gas: Gas, linear_ratio: float) -> Restriction:
    """An orifice in the paper's form with a gas; linear above ``linear_ratio`` [-]. Equations (6), (7)."""
    conductance = area_conductance(
        orifice.area,
        orifice.discharge_coefficient,
        gas.heat_capacity_ratio,
        gas.specific_gas_constant,
        gas.temperature,
    )
    return Restriction(conductance, isentropic_curve(gas.heat_capacity_ratio, linear_ratio))


def sonic_restriction(orifice: SonicOrifice, gas: Gas, linear_ratio: float) -> Restriction:
    """An orifice in the form of ISO 6358 with a gas; linear above ``linear_ratio`` [-]."""
    conductance = sonic_conductance_mass(orifice.sonic_conductance, gas.specific_gas_constant, gas.temperature)
    return Restriction(conductance, iso6358_curve(orifice.critical_ratio, linear_ratio))


def restriction(orifice: Orifice | SonicOrifice, gas: Gas, linear_ratio: float) -> Restriction:
    """Return an orifice, by conductance or by area, for a gas."""
    if isinstance(orifice, SonicOrifice):
        return sonic_restriction(orifice, gas, linear_ratio)
    return area_restriction(orifice, gas, linear_ratio)


def orifice_conductance(orifice: Orifice | SonicOrifice, gas: Gas) -> float:
    """Conductance [kg/(s Pa)] of an orifice in either form; choked flow over upstream pressure. Equation (6)."""
    return restriction(orifice, gas, 0.0).conductance


def valve_settings(valve: Valve) -> Any:
    """Return the settings [SI] of a valve as the class of its kind, whose numbers may be arrays (runs,)."""
    return VALVES[valve.kind].settings(**valve.settings)


def first_settings(valve: Valve) -> Any:
    """Return the settings [SI] of a valve in the first run of an ensemble: they choose the model for all of them."""
    return valve_settings(valve)._make(map(first, valve_settings(valve)))


def venting_valve(valve: Valve) -> ValveModel:
    """The model of a valve that a command can vent: a proportional one has a vent valve beside it.

    Of an ensemble the first run decides which model it is.
    """
    if valve.kind == "proportional":
        from ppafo.model.valves import vent_valve  # a vane on a bench needs none

        return vent_valve.choose(first_settings(valve))
    return VALVES[valve.kind].choose(first_settings(valve))


def plant_parameters(device: Device, external_torque: float = 0.0) -> PlantParameters:
    """The plant of a device, with a constant external torque T_ex [N m] on a free vane."""
    ratio = device.flow.linear_ratio
    valve = restriction(device.valve.orifice, device.gas, ratio)
    plant = plant_with(device, valve, restriction(device.actuator.leak, device.gas, ratio), external_torque)
    plant = plant._replace(relieving=float(device.supply.takes_back))
    model: Any = ACTUATORS[device.actuator.kind].model
    if model.shape is None:
        return plant
    # The plant of another kind, from a vane's with the same stops, gas and orifices.
    shape, growth = shape_and_growth(device)
    other: PlantParameters = model.plant(*plant._replace(torque_constant=growth, displacement_per_radian=growth), shape)
    return other


def shape_and_growth(device: Device) -> tuple[Any, Any]:
    """Shape of an actuator that is no vane, and how chamber 1 grows with the angle on average [m^3/rad]."""
    actuator, supply = device.actuator, device.supply
    kind = ACTUATORS[actuator.kind]
    model = kind.model

    def prepared(low: float, high: float, dead_1: float, dead_2: float, pressed: float, *values: float) -> Any:
        stops = Range(angle_min=low, angle_max=high, dead_volume_1=dead_1, dead_volume_2=dead_2)
        settings = kind.settings(*values)
        table = actuator.table
        shape = model.prepare(settings, stops) if table is None else model.prepare(settings, stops, table)
        return shape, mean_growth(shape, stops, pressed, model.chambers)

    ends = actuator.angle_min, actuator.angle_max, actuator.dead_volume_1, actuator.dead_volume_2
    gauge = supply.pressure - supply.atmospheric_pressure
    shape, growth = over_runs(prepared, *ends, gauge, *actuator.settings.values())
    return shape, growth


def plant_with(device: Device, valve: Restriction, leak: Restriction, external_torque: float) -> PlantParameters:
    """The plant of a device whose orifices are known; external torque [N m]."""
    actuator, gas, supply = device.actuator, device.gas, device.supply
    return PlantParameters(
        gas_product=gas.specific_gas_constant * gas.temperature,
        torque_constant=actuator.torque_constant,
        displacement_per_radian=actuator.displacement_per_radian,
        angle_min=actuator.angle_min,
        angle_max=actuator.angle_max,
        dead_volume_1=actuator.dead_volume_1,
        dead_volume_2=actuator.dead_volume_2,
        static_torque=device.friction.static_torque,
        dynamic_torque=device.friction.dynamic_torque,
        viscous_damping=device.friction.viscous_damping,
        inertia=device.foot_plate.inertia,
        gravity_torque=device.foot_plate.gravity_torque,
        external_torque=external_torque,
        supply_pressure=supply.pressure,
        dorsiflexion_pressure=supply.dorsiflexion_pressure,
        atmospheric_pressure=supply.atmospheric_pressure,
        valve_conductance=valve.conductance,
        leak_conductance=leak.conductance,
        valve_curve=valve.curve,
        leak_curve=leak.curve,
        relieving=float(supply.relieving),
    )


SEEN_BY_EFFECTS = ("gas", "actuator", "friction", "foot_plate", "supply")
"""Sections of a device that ``prepare`` of an effect may read; an exported library has them in C."""


Sections = Mapping[str, Any]
"""Objects whose attributes are settings of effects beside the device's, by section of files."""
_NO_SECTIONS: Sections = {}


def settings_of(device: Device, effect: Effect, others: Sections = _NO_SECTIONS) -> dict[str, Any]:
    """Return the settings [SI] of an effect, arrays (runs,) where they vary; its defaults where nothing is said."""
    if effect.section in others or effect.always:
        section = others[effect.section] if effect.section in others else getattr(device, effect.section)
        return {quantity.name: getattr(section, quantity.name) for quantity in effect.quantities}
    return {**effect.defaults(device.gas.species), **device.effects.get(effect.name, {})}


def all_settings(device: Device) -> dict[str, dict[str, Any]]:
    """Return the settings [SI] of all effects of devices that are loaded, by name."""
    return {effect.name: settings_of(device, effect) for effect in _effects(device) if effect.is_of_device}


def number_under(node: Any, attributes: Iterable[str]) -> Any:
    """Return the number to which attributes lead from a device, or from what has one; it may be an array (runs,)."""
    for name in attributes:
        node = part_of(node, name)
    return node


def part_of(node: Any, name: str) -> Any:
    """Return an attribute or entry of a part of a device, or of what has one."""
    # A device has settings of the effects that its set names; those of all others are their defaults.
    if name == SECTION and isinstance(node, Device):
        return all_settings(node)
    return node[name] if isinstance(node, Mapping) else getattr(node, name)


def effects_of(device: Device, others: Sections = _NO_SECTIONS) -> tuple[Effect, ...]:
    """Return the effects that are on, in the order in which they act; of columns the first run's."""
    return tuple(
        effect
        for effect in _effects(device)
        if effect.is_on({name: first(value) for name, value in settings_of(device, effect, others).items()})
    )


def switches_of(device: Device) -> dict[Effect, Any]:
    """Return for each effect of a device whether it is on; an array (runs,) where settings that switch it vary."""
    settings = all_settings(device)
    return {effect: effect.is_on(settings[effect.name]) for effect in ordered_effects() if effect.is_of_device}


def _effects(device: Device) -> tuple[Effect, ...]:
    """Return the effects that may act, in their order: a device from another process may name what is not loaded."""
    find_effects(f"{SECTION}.{name}" for name in device.effects)
    return ordered_effects()


def effect_rows(device: Device, others: Sections = _NO_SECTIONS) -> tuple[Any, ...]:
    """Return the rows of the effects that are on; numbers are arrays (runs,) where settings or the device vary."""
    return tuple(effect_row(effect, device, others) for effect in effects_of(device, others))


def effect_row(effect: Effect, device: Device, others: Sections = _NO_SECTIONS) -> Any:
    """Return the row of an effect for a device, whether it is on or not; numbers are arrays (runs,) where they vary."""
    settings, prepare = settings_of(device, effect, others), effect.prepare
    # Most effects compute with their settings as they are.
    if prepare is None:
        return effect.parameters(*settings.values())
    names = _names(device.actuator.kind)
    seen = [(section, name) for section, names_of_section in names.items() for name in names_of_section]

    def prepared(*numbers: float) -> Any:
        own, of_device = numbers[: len(settings)], numbers[len(settings) :]
        sections: dict[str, dict[str, float]] = {section: {} for section in names}
        for (section, name), number in zip(seen, of_device, strict=True):
            sections[section][name] = number
        view = SimpleNamespace(**{section: SimpleNamespace(**inner) for section, inner in sections.items()})
        return prepare(effect.settings(*own), view)

    return over_runs(prepared, *settings.values(), *(_number(device, section, name) for section, name in seen))


def _number(device: Device, section: str, name: str) -> Any:
    """Return a number of a device; a setting of the actuator's kind comes before a field of the same name."""
    if section == "actuator" and name in device.actuator.settings:
        return device.actuator.settings[name]
    return getattr(getattr(device, section), name)


@cache
def _names(actuator_kind: str) -> dict[str, tuple[str, ...]]:
    """Return the numbers of a device that effects see, by section."""
    names = {
        section: tuple(quantity.name for quantity in members(section, actuator_kind)) for section in SEEN_BY_EFFECTS
    }
    return names | {"gas": (*names["gas"], "specific_gas_constant")}
