"""Gas that is not isothermal: energy of a chamber, heat through its wall, and a real-gas factor.

The energy of a chamber changes with the enthalpy of the gas that flows in or out, the work of the moving wall and the
heat through it: ``dE/dt = sum of m' h_up - P dV/dt + h A (T_wall - T)``. The equation of state is the virial one cut
after its second term, ``P = rho R T (1 + b rho)`` with a constant ``b``; for a constant ``b`` the internal energy is
that of the ideal gas, so energy and state agree with each other. With ``b = 0`` all of it is the ideal gas.
"""

import math


def gas_temperature(energy: float, mass: float, heat_capacity: float) -> float:
    """Temperature [K] of ``mass`` [kg] with an internal energy [J]; ``heat_capacity`` is c_v [J/(kg K)]."""
    return energy / (mass * heat_capacity)


def gas_energy(mass: float, temperature: float, heat_capacity: float) -> float:
    """Internal energy [J] of ``mass`` [kg] at a temperature [K], 0 at 0 K; the inverse of ``gas_temperature``."""
    return mass * heat_capacity * temperature


def heat_capacity_at_constant_volume(gas_constant: float, heat_capacity_ratio: float) -> float:
    """Specific heat c_v = R/(k - 1) [J/(kg K)] of an ideal gas; ``gas_constant`` is the specific one."""
    return gas_constant / (heat_capacity_ratio - 1.0)


def real_gas_factor(density: float, virial: float) -> float:
    """Compressibility Z = 1 + b rho [-] at a density [kg/m^3]; ``virial`` is b [m^3/kg], below 0 for CO2."""
    return 1.0 + virial * density


def real_pressure(mass: float, volume: float, temperature: float, gas_constant: float, virial: float) -> float:
    """Absolute pressure [Pa] of ``mass`` [kg] in ``volume`` [m^3]; equation (3) times the real-gas factor."""
    density = mass / volume
    return density * gas_constant * temperature * real_gas_factor(density, virial)


def real_density(pressure: float, temperature: float, gas_constant: float, virial: float) -> float:
    """Density [kg/m^3] at an absolute pressure [Pa]; the inverse of ``real_pressure``, by its smaller root."""
    product = gas_constant * temperature
    return 2.0 * pressure / (product * (1.0 + math.sqrt(1.0 + 4.0 * virial * pressure / product)))


def gas_enthalpy(temperature: float, density: float, gas_constant: float, heat_capacity: float, virial: float) -> float:
    """Specific enthalpy [J/kg], internal energy and P/rho; c_p T for an ideal gas. ``heat_capacity`` is c_v."""
    return temperature * (heat_capacity + gas_constant * real_gas_factor(density, virial))


def heat_from_wall(temperature: float, wall_temperature: float, heat_transfer_coefficient: float, area: float) -> float:
    """Heat [W] into the gas through a wall of ``area`` [m^2]; positive where the wall is warmer."""
    return heat_transfer_coefficient * area * (wall_temperature - temperature)


def energy_rate(enthalpy_flow: float, pressure: float, volume_rate: float, heat: float) -> float:
    """Time derivative [W] of a chamber's energy: enthalpy that flows in, less work P dV/dt, plus heat [W]."""
    return enthalpy_flow - pressure * volume_rate + heat


def wall_exchange(
    heat_transfer_coefficient: float, area_per_volume: float, heat_capacity_ratio: float, gas_constant: float
) -> float:
    """Heat of the walls over the heat that one kelvin takes up, h a/c_v [kg/(s m^3)]; ``gas_constant`` is specific."""
    return heat_transfer_coefficient * area_per_volume * (heat_capacity_ratio - 1.0) / gas_constant


def mass_flow_ratio(root: float) -> float:
    """Mass flow [-] over that of gas at the reference temperature; ``root`` is sqrt(T_up/T_ref) [-], equation (6)."""
    return 1.0 / root


def enthalpy_flow_ratio(root: float, heat_capacity_ratio: float) -> float:
    """Enthalpy that a flow carries over c_v T_ref and over its flow at the reference temperature [-].

    ``root`` is sqrt(T_up/T_ref) [-]: gas at four times the temperature flows half as much and is four times as rich.
    """
    return heat_capacity_ratio * root


def energy_per_content(gas_product: float, heat_capacity_ratio: float) -> float:
    """Internal energy over content [J/kg], ``R T_ref / (M (k - 1))``, from ``R T_ref / M`` [J/kg].

    The content of a chamber is the mass that would give its pressure at the reference temperature.
    """
    return gas_product / (heat_capacity_ratio - 1.0)


def temperature_flow_factor(reference_temperature: float, upstream_temperature: float) -> float:
    """Factor [-] on a conductance that holds at a reference temperature [K]: sqrt(T_ref/T_up), from equation (6)."""
    return math.sqrt(reference_temperature / upstream_temperature)
