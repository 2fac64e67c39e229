"""What a model-based controller believes of the device: torque rate by valve opening, and its inverse.

Equations (2) to (9) for a proportional valve, with the ellipse of ISO 6358 for the flow function. Every number is the
controller's own, so that it can be wrong about the device as a real controller is.
"""

import math
from typing import NamedTuple

from ppafo.model.chambers import chamber_1_volume, chamber_2_volume
from ppafo.model.declaration import Quantity

SMALLEST_GAIN = 1.0e-3
"""N m/s: where full opening changes the torque no faster, the valve opens fully and the result is clipped."""


class NominalChambers(NamedTuple):
    """The believed device, SI units; conductances are Cd A C1 [kg/(s Pa)], ``gas_product`` is R T / M [J/kg]."""

    torque_constant: float
    volume_per_angle: float
    angle_min: float
    angle_max: float
    dead_volume_1: float
    dead_volume_2: float
    gas_product: float
    valve_conductance: float
    leak_conductance: float
    critical_ratio: float
    supply_pressure: float
    dorsiflexion_pressure: float
    atmospheric_pressure: float


class TorqueRates(NamedTuple):
    """Torque rate of the closed valve [N m/s], and what full opening either way adds to or takes from it [N m/s]."""

    closed: float
    rising: float
    falling: float


NOMINAL_QUANTITIES = (
    Quantity("torque_constant", "m^3", "believed K_actuator", 1.451e-5, 1.0e-9, 1.0),
    Quantity("volume_per_angle", "m^3/rad", "believed B_vane", 5.1e-5, 1.0e-9, 1.0),
    Quantity("angle_min", "rad", "believed lower stop", math.radians(20.0), -10.0, 10.0),
    Quantity("angle_max", "rad", "believed upper stop", math.radians(130.0), -10.0, 10.0),
    Quantity("dead_volume_1", "m^3", "believed dead volume of chamber 1", 2.0e-6, 1.0e-9, 1.0),
    Quantity("dead_volume_2", "m^3", "believed dead volume of chamber 2", 2.0e-6, 1.0e-9, 1.0),
    Quantity("gas_product", "J/kg", "believed R T / M, that of CO2 at 298 K", 5.6308454545e4, 1.0e3, 1.0e7),
    Quantity("valve_conductance", "kg/(s Pa)", "believed Cd A C1 of the valve", 1.0040962467e-8, 1.0e-15, 1.0),
    Quantity("leak_conductance", "kg/(s Pa)", "believed Cd A C1 of the leak", 9.532559304e-11, 0.0, 1.0),
    Quantity("critical_ratio", "", "believed critical pressure ratio, ISO 6358", 0.545727733814, 0.01, 0.95),
    Quantity("supply_pressure", "Pa_a", "believed pressure to chamber 1", 446062.864658, 1.0e3, 1.0e8),
    Quantity("dorsiflexion_pressure", "Pa_a", "believed pressure to chamber 2", 446062.864658, 1.0e3, 1.0e8),
    Quantity("atmospheric_pressure", "Pa_a", "believed atmosphere", 101325.0, 1.0e3, 1.0e8),
)
"""Fields of ``NominalChambers`` in order; the defaults are those of the set ppafo2011 with its proportional valve."""


def ellipse_flow(pressure_a: float, pressure_b: float, conductance: float, critical_ratio: float) -> float:
    """Mass flow from a to b [kg/s] by the ellipse of ISO 6358, antisymmetric; conductance [kg/(s Pa)]."""
    upstream = max(pressure_a, pressure_b)
    ratio = min(pressure_a, pressure_b) / upstream
    position = max(0.0, min(1.0, (ratio - critical_ratio) / (1.0 - critical_ratio)))
    flow = conductance * upstream * math.sqrt(1.0 - position * position)
    return flow if pressure_a >= pressure_b else -flow


def torque_rates(
    nominal: NominalChambers, angle: float, angular_velocity: float, pressure_1: float, pressure_2: float
) -> TorqueRates:
    """Believed rates of K (P_1 - P_2) [N m/s] at an angle [rad], its rate [rad/s] and absolute pressures [Pa].

    Equations (2) to (9). Opening the valve raises or lowers the torque as it should where both pressures are above the
    atmosphere: the believed supplies let gas in only.
    """
    least = min(nominal.dead_volume_1, nominal.dead_volume_2)
    volume_1 = chamber_1_volume(angle, nominal.angle_min, nominal.volume_per_angle, nominal.dead_volume_1)
    volume_2 = chamber_2_volume(angle, nominal.angle_max, nominal.volume_per_angle, nominal.dead_volume_2)
    volume_1, volume_2 = max(volume_1, least), max(volume_2, least)
    ratio, valve = nominal.critical_ratio, nominal.valve_conductance
    leak = ellipse_flow(pressure_1, pressure_2, nominal.leak_conductance, ratio)
    feed_1 = max(ellipse_flow(nominal.supply_pressure, pressure_1, valve, ratio), 0.0)
    vent_2 = ellipse_flow(pressure_2, nominal.atmospheric_pressure, valve, ratio)
    feed_2 = max(ellipse_flow(nominal.dorsiflexion_pressure, pressure_2, valve, ratio), 0.0)
    vent_1 = ellipse_flow(pressure_1, nominal.atmospheric_pressure, valve, ratio)
    per_flow = nominal.torque_constant * nominal.gas_product
    swept = nominal.torque_constant * nominal.volume_per_angle * angular_velocity
    closed = -per_flow * leak * (1.0 / volume_1 + 1.0 / volume_2)
    closed = closed - swept * (pressure_1 / volume_1 + pressure_2 / volume_2)
    rising = per_flow * (feed_1 / volume_1 + vent_2 / volume_2)
    falling = per_flow * (vent_1 / volume_1 + feed_2 / volume_2)
    return TorqueRates(closed, rising, falling)


def opening_for_rate(rates: TorqueRates, requested: float) -> float:
    """Opening from -1 to 1 that gives a torque rate [N m/s], the inverse of ``torque_rates``; clipped to full."""
    needed = requested - rates.closed
    gain = rates.rising if needed >= 0.0 else rates.falling
    return max(-1.0, min(1.0, needed / max(gain, SMALLEST_GAIN)))
