"""From a device to the numbers that the plant computes with."""

from ppafo.model.orifice import FlowCurve
from ppafo.model.orifice_curves import area_conductance, isentropic_curve, iso6358_curve, sonic_conductance_mass
from ppafo.model.plant import PlantParameters
from ppafo.parameters.device import Device, Gas, Orifice, SonicOrifice


def orifice_conductance(orifice: Orifice | SonicOrifice, gas: Gas) -> float:
    """Conductance [kg/(s Pa)] of an orifice in either form; choked flow over upstream pressure. Equation (6)."""
    constant = gas.specific_gas_constant
    if isinstance(orifice, SonicOrifice):
        return sonic_conductance_mass(orifice.sonic_conductance, constant, gas.temperature)
    return area_conductance(
        orifice.area, orifice.discharge_coefficient, gas.heat_capacity_ratio, constant, gas.temperature
    )


def orifice_curve(orifice: Orifice | SonicOrifice, gas: Gas, linear_ratio: float) -> FlowCurve:
    """Flow function [-] of an orifice in either form, linear above ``linear_ratio`` [-]. Equations (6), (7)."""
    if isinstance(orifice, SonicOrifice):
        return iso6358_curve(orifice.critical_ratio, linear_ratio)
    return isentropic_curve(gas.heat_capacity_ratio, linear_ratio)


def plant_parameters(device: Device, external_torque: float = 0.0) -> PlantParameters:
    """The plant of a device, with a constant external torque T_ex [N m] on a free vane."""
    actuator, gas, supply = device.actuator, device.gas, device.supply
    return PlantParameters(
        gas_product=gas.specific_gas_constant * gas.temperature,
        torque_constant=actuator.torque_constant,
        volume_per_angle=actuator.volume_per_angle,
        angle_min=actuator.angle_min,
        angle_max=actuator.angle_max,
        dead_volume_1=actuator.dead_volume_1,
        dead_volume_2=actuator.dead_volume_2,
        restitution=actuator.restitution,
        static_torque=device.friction.static_torque,
        dynamic_torque=device.friction.dynamic_torque,
        viscous_damping=device.friction.viscous_damping,
        inertia=device.foot_plate.inertia,
        gravity_torque=device.foot_plate.gravity_torque,
        external_torque=external_torque,
        supply_pressure=supply.pressure,
        dorsiflexion_pressure=supply.dorsiflexion_pressure,
        atmospheric_pressure=supply.atmospheric_pressure,
        valve_conductance=orifice_conductance(device.valve.orifice, gas),
        leak_conductance=orifice_conductance(actuator.leak, gas),
        valve_curve=orifice_curve(device.valve.orifice, gas, device.flow.linear_ratio),
        leak_curve=orifice_curve(actuator.leak, gas, device.flow.linear_ratio),
        relieving=float(supply.relieving),
    )
