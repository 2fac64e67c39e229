"""Mass flow through a restriction: equations (6) and (7) of the paper, and ISO 6358.

Both forms are one curve, ``mass_flow = conductance * upstream_pressure * flow_function(pressure_ratio)``,
with a flow function that is 1 when the flow is choked. ``conductance`` [kg/(s Pa)] is ``Cd A C1`` in the paper's
form and ``C rho_0 sqrt(T_0 / T)`` in the standard's. This module has the exact flow functions, and the fitted one
for the time stepping: a square root times a polynomial, without powers (``flow_curve.py`` fits the polynomial).
"""

import math
from typing import Annotated, NamedTuple

from ppafo.constants import STANDARD_REFERENCE_DENSITY_AIR, STANDARD_REFERENCE_TEMPERATURE
from ppafo.model.columns import Numeric, larger, root, smaller
from ppafo.model.elementary import raised
from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio

TERMS = 7
"""Number of coefficients of the polynomial of a flow curve."""


class FlowCurve(NamedTuple):
    """Fitted flow function: ``sqrt(1 - r)`` times a polynomial in ``1 - r``, constant below the critical ratio.

    All dimensionless; coefficients with the constant term first. Above ``linear_ratio`` the curve is the straight line
    to zero at ``r = 1``.
    """

    critical_ratio: float
    linear_ratio: float
    linear_slope: float
    coefficients: Annotated[tuple[float, ...], TERMS]


def isentropic_flow_function(pressure_ratio: Numeric, heat_capacity_ratio: float) -> Numeric:
    """Flow divided by choked flow [-] of an isentropic nozzle, for downstream over upstream pressure. Eqs (6), (7)."""
    critical = critical_pressure_ratio(heat_capacity_ratio)
    within: Numeric = smaller(larger(pressure_ratio, critical), 1.0)
    return _subsonic(within, heat_capacity_ratio) / _subsonic(critical, heat_capacity_ratio)


def _subsonic(pressure_ratio: Numeric, heat_capacity_ratio: float) -> Numeric:
    """Factor [-] of equation (7) behind ``C2 P_up``."""
    k = heat_capacity_ratio
    return raised(pressure_ratio, 1.0 / k) * root(1.0 - raised(pressure_ratio, (k - 1.0) / k))


def subsonic_flow_constant(heat_capacity_ratio: float, gas_constant: float, temperature: float) -> float:
    """Constant C2 [s/m] of equation (7), with which it meets (6); ``gas_constant`` is R/M [J/(kg K)]."""
    k = heat_capacity_ratio
    return choked_flow_constant(k, gas_constant, temperature) / _subsonic(critical_pressure_ratio(k), k)


def iso6358_flow_function(pressure_ratio: Numeric, critical_ratio: float) -> Numeric:
    """Flow divided by choked flow [-] of ISO 6358-1:2013 (index 0.5), for downstream over upstream pressure."""
    within: Numeric = smaller(larger(pressure_ratio, critical_ratio), 1.0)
    position = (within - critical_ratio) / (1.0 - critical_ratio)
    return root(1.0 - position * position)


def fitted_flow_function(pressure_ratio: float, curve: FlowCurve) -> tuple[float, float]:
    """Flow function [-] and slope with respect to the pressure ratio [-], at most 0, of a fitted curve.

    The slope is the derivative; within twice the linear region it is the slope of the secant to equal pressures.
    """
    gap = 1.0 - pressure_ratio
    linear_gap = 1.0 - curve.linear_ratio
    choked_gap = 1.0 - curve.critical_ratio
    inside = max(min(gap, choked_gap), linear_gap)
    # Even and odd powers apart: half as many operations wait for one another.
    square = inside * inside
    even = curve.coefficients[6] * square + curve.coefficients[4]
    even_slope = curve.coefficients[6] * square + even
    even = even * square + curve.coefficients[2]
    even_slope = even_slope * square + even
    even = even * square + curve.coefficients[0]
    odd = curve.coefficients[5] * square + curve.coefficients[3]
    odd_slope = curve.coefficients[5] * square + odd
    odd = odd * square + curve.coefficients[1]
    polynomial = even + inside * odd
    derivative = (inside + inside) * (even_slope + inside * odd_slope) + odd
    root = math.sqrt(inside)
    inverse = 1.0 / root
    value = root * polynomial
    # Near equal pressures the chord from there: with the slope of the curve a settled chamber would ring at the kink.
    is_near = gap < 2.0 * linear_gap
    slope = (polynomial if is_near else 0.5 * polynomial + inside * derivative) * inverse
    slope = 0.0 if gap > choked_gap else slope
    return value * min(gap * curve.linear_slope, 1.0), -slope


def orifice_flow(
    pressure_a: float, pressure_b: float, conductance: float, is_relieving: float, curve: FlowCurve
) -> tuple[float, float, float]:
    """Mass flow from a to b [kg/s] and its derivatives with respect to both pressures [kg/(s Pa)]. Eqs (6) to (8).

    Positive from a to b, antisymmetric under exchange; no backflow if ``is_relieving`` is 0, as behind a check valve.
    """
    forward = pressure_a >= pressure_b
    upstream = max(pressure_a, pressure_b)
    ratio = min(pressure_a, pressure_b) / upstream
    value, slope = fitted_flow_function(ratio, curve)
    flow = conductance * upstream * value
    # d(C p_up psi(p_dn / p_up)) by p_up: the ratio falls as the upstream pressure grows.
    by_upstream = conductance * (value - ratio * slope)
    by_downstream = conductance * slope
    signed = flow if forward else -is_relieving * flow
    by_a = by_upstream if forward else -is_relieving * by_downstream
    by_b = by_downstream if forward else -is_relieving * by_upstream
    return signed, by_a, by_b


def area_conductance(
    area: float, discharge_coefficient: float, heat_capacity_ratio: float, gas_constant: float, temperature: float
) -> float:
    """Conductance Cd A C1 [kg/(s Pa)] of an area [m^2]; ``gas_constant`` is the specific one. Equation (6)."""
    return discharge_coefficient * area * choked_flow_constant(heat_capacity_ratio, gas_constant, temperature)


def sonic_conductance_mass(sonic_conductance: float, gas_constant: float, temperature: float) -> float:
    """Mass-flow conductance [kg/(s Pa)] for the sonic conductance C [m^3/(s Pa)] of ISO 6358, gas and temperature.

    ISO 6358 gives C rho_0 sqrt(T_0 / T) for air; another gas passes sqrt(R_air / R) times as much.
    """
    # Specific gas constant of air from its density in the reference atmosphere of 1 bar (ISO 8778).
    air_constant = 1.0e5 / (STANDARD_REFERENCE_DENSITY_AIR * STANDARD_REFERENCE_TEMPERATURE)
    warmth = root(STANDARD_REFERENCE_TEMPERATURE / temperature)
    same_gas = sonic_conductance * STANDARD_REFERENCE_DENSITY_AIR * warmth
    return same_gas * root(air_constant / gas_constant)


def conductance_in_series(conductance: float, resistance: float) -> float:
    """Conductance [kg/(s Pa)] of two orifices in series; ``resistance`` is the second conductance to the power -2.

    ``1/C^2 = 1/C_1^2 + 1/C_2^2``: pressure drops of a subsonic flow add up, each proportional to the square of the
    flow. The form ``C_1 / sqrt(1 + (C_1/C_2)^2)`` is also valid for a closed orifice. Exact for a flow far from choked;
    for a choked flow up to 12 % low if the second orifice is as narrow as the first, 5 % if it is three times as wide
    (ISO 6358-3).
    """
    return conductance / math.sqrt(1.0 + conductance * conductance * resistance)
