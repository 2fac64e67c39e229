"""Chambers whose volumes grow linearly with pressure, V = rest + compliance p, as in most kinds of actuators.

The co-energy of a chamber is Phi = rest p + compliance p^2/2 at the gauge pressure p, where rest and compliance are
functions of the angle. Rigid chambers have no compliance.
"""

import math
from typing import NamedTuple

from ppafo.model.actuators.kind import Chambers, ShapedPlant


class LinearChamber(NamedTuple):
    """Chamber at an angle: volume at zero gauge pressure [m^3], compliance [m^3/Pa], and derivatives per radian."""

    rest: float
    compliance: float
    rest_slope: float
    compliance_slope: float


def rigid(volume: float, slope: float) -> LinearChamber:
    """Rigid chamber with a volume [m^3] and its derivative with respect to the angle [m^3/rad]."""
    return LinearChamber(rest=volume, compliance=0.0, rest_slope=slope, compliance_slope=0.0)


def pressure_in(chamber: LinearChamber, content: float, atmosphere: float) -> float:
    """Absolute pressure [Pa] of a chamber with a gas content p V [J]."""
    # p (rest + compliance (p - p_0)) = content is a quadratic. This form of its root subtracts no near numbers, and is
    # exact for a rigid chamber too.
    above = content - chamber.rest * atmosphere
    half = 0.5 * (chamber.rest + chamber.compliance * atmosphere)
    return atmosphere + above / (half + math.sqrt(max(half * half + chamber.compliance * above, 0.0)))


def linear_chambers(
    plant: ShapedPlant, chamber_1: LinearChamber, chamber_2: LinearChamber, pressure_1: float, pressure_2: float
) -> Chambers:
    """Volumes dPhi/dp and compliances of both chambers at two absolute pressures [Pa]."""
    room = plant.atmospheric_pressure
    return Chambers(
        volume_1=chamber_1.rest + chamber_1.compliance * (pressure_1 - room),
        volume_2=chamber_2.rest + chamber_2.compliance * (pressure_2 - room),
        compliance_1=chamber_1.compliance,
        compliance_2=chamber_2.compliance,
    )


def linear_pressures(
    plant: ShapedPlant, chamber_1: LinearChamber, chamber_2: LinearChamber, mass_1: float, mass_2: float
) -> tuple[float, float]:
    """Absolute pressures [Pa] of both chambers for two masses [kg]. Equation (3)."""
    room = plant.atmospheric_pressure
    return (
        pressure_in(chamber_1, mass_1 * plant.gas_product, room),
        pressure_in(chamber_2, mass_2 * plant.gas_product, room),
    )


def linear_torque(
    plant: ShapedPlant, chamber_1: LinearChamber, chamber_2: LinearChamber, pressure_1: float, pressure_2: float
) -> float:
    """Torque dPhi/dangle [N m] of both chambers at two absolute pressures [Pa]."""
    gauge_1 = pressure_1 - plant.atmospheric_pressure
    gauge_2 = pressure_2 - plant.atmospheric_pressure
    torque_1 = gauge_1 * (chamber_1.rest_slope + 0.5 * chamber_1.compliance_slope * gauge_1)
    return torque_1 + gauge_2 * (chamber_2.rest_slope + 0.5 * chamber_2.compliance_slope * gauge_2)
