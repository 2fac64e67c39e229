"""Plant parameters computed from a device: orifices, valve and actuator."""

from typing import Any, NamedTuple

from ppafo.model.actuators.kind import Range, mean_growth
from ppafo.model.catalog import ACTUATORS, VALVES
from ppafo.model.columns import first, over_runs
from ppafo.model.flow_curve import isentropic_curve, iso6358_curve
from ppafo.model.orifice import FlowCurve, area_conductance, sonic_conductance_mass
from ppafo.model.plant import PlantParameters
from ppafo.model.valves.kind import ValveModel
from ppafo.parameters.device import Device, Gas, Orifice, SonicOrifice, Valve


class Restriction(NamedTuple):
    """Orifice for a given gas: conductance [kg/(s Pa)] and flow function of the pressure ratio."""

    conductance: float
    curve: FlowCurve


def area_restriction(orifice: Orifice, gas: Gas, linear_ratio: float) -> Restriction:
    """Return the paper's orifice for a gas, with linear flow above ``linear_ratio`` [-]; equations (6), (7)."""
    conductance = area_conductance(
        orifice.area, orifice.discharge_coefficient, gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature
    )
    return Restriction(conductance, isentropic_curve(gas.heat_capacity_ratio, linear_ratio))


def sonic_restriction(orifice: SonicOrifice, gas: Gas, linear_ratio: float) -> Restriction:
    """Return an ISO 6358 orifice for a gas, with linear flow above the pressure ratio ``linear_ratio`` [-]."""
    conductance = sonic_conductance_mass(orifice.sonic_conductance, gas.specific_gas_constant, gas.temperature)
    return Restriction(conductance, iso6358_curve(orifice.critical_ratio, linear_ratio))


def restriction(orifice: Orifice | SonicOrifice, gas: Gas, linear_ratio: float) -> Restriction:
    """Return an orifice in either form for a gas, with linear flow above the pressure ratio ``linear_ratio`` [-]."""
    if isinstance(orifice, SonicOrifice):
        return sonic_restriction(orifice, gas, linear_ratio)
    return area_restriction(orifice, gas, linear_ratio)


def valve_settings(valve: Valve) -> Any:
    """Return the settings of a valve [SI] as the class of its kind; arrays (runs,) if varied."""
    return VALVES[valve.kind].settings(**valve.settings)


def first_settings(valve: Valve) -> Any:
    """Return the settings [SI] of a valve in the first run of an ensemble, which selects the model."""
    return valve_settings(valve)._make(map(first, valve_settings(valve)))


def venting_valve(valve: Valve) -> ValveModel:
    """Return the model of a valve with a vent command: a proportional valve is combined with a vent valve.

    In an ensemble the first run selects the model.
    """
    if valve.kind == "proportional":
        from ppafo.model.valves import vent_valve  # a vane on a bench needs none

        return vent_valve.choose(first_settings(valve))
    return VALVES[valve.kind].choose(first_settings(valve))


def plant_parameters(device: Device, external_torque: float = 0.0) -> PlantParameters:
    """Plant parameters of a device, with a constant external torque T_ex [N m] on a free vane."""
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
    """Shape of an actuator other than a vane, and mean growth of chamber 1 with angle [m^3/rad]."""
    actuator = device.actuator
    supply = device.supply
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
    """Plant parameters of a device with given orifices and external torque [N m]."""
    actuator = device.actuator
    gas = device.gas
    supply = device.supply
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
