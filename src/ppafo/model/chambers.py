"""The two chambers of the vane actuator: volume, pressure and mass. Equations (3) to (5)."""

from ppafo.model.columns import Number


def chamber_1_volume(angle: Number, angle_min: float, volume_per_angle: float, dead_volume: float) -> Number:
    """Volume of chamber 1 [m^3], growing with the angle [rad]; equation (4) with a dead volume and a lower stop."""
    return dead_volume + volume_per_angle * (angle - angle_min)


def chamber_2_volume(angle: Number, angle_max: float, volume_per_angle: float, dead_volume: float) -> Number:
    """Volume of chamber 2 [m^3], shrinking with the angle [rad]; equation (5) with a dead volume and an upper stop."""
    return dead_volume + volume_per_angle * (angle_max - angle)


def chamber_pressure(mass: Number, volume: Number, gas_product: float) -> Number:
    """Absolute pressure [Pa] of ``mass`` [kg] in ``volume`` [m^3]; ``gas_product`` is R T / M [J/kg]. Equation (3)."""
    return mass * gas_product / volume


def chamber_mass(pressure: float, volume: Number, gas_product: float) -> Number:
    """Mass [kg] that fills ``volume`` [m^3] at an absolute pressure [Pa]; the inverse of equation (3)."""
    return pressure * volume / gas_product
