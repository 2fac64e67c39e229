"""Flow curves fitted to the exact flow functions, and conductances, for both forms of an orifice.

By plain arithmetic and square roots alone, so that a run begins with the same bits on every machine.
"""

import math
from functools import lru_cache

from ppafo.constants import STANDARD_REFERENCE_DENSITY_AIR, STANDARD_REFERENCE_TEMPERATURE
from ppafo.model.columns import over_runs, root
from ppafo.model.elementary import power
from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio
from ppafo.model.orifice import TERMS, FlowCurve

Terms = tuple[float, float, float, float, float, float, float]
"""One number for each coefficient; there are ``TERMS``."""
PLACES: Terms = (0.01371, 0.117149, 0.300253, 0.522087, 0.735768, 0.900391, 0.988845)
"""Where a curve meets the exact function: 1 - r over that of the critical ratio.

A curve that is best by relative least squares crosses the exact function of helium here, and of other gases nearby.
"""


def isentropic_curve(heat_capacity_ratio: float, linear_ratio: float) -> FlowCurve:
    """Fitted curve [-] of equations (6), (7) for a gas; within 3e-7 of the exact function below ``linear_ratio``."""
    coefficients = over_runs(_remembered_coefficients, heat_capacity_ratio)
    return _curve(critical_pressure_ratio(heat_capacity_ratio), linear_ratio, coefficients)


def iso6358_curve(critical_ratio: float, linear_ratio: float) -> FlowCurve:
    """Fitted curve [-] of ISO 6358 for a critical ratio b; within 1e-5 of the exact function below ``linear_ratio``.

    The exact function depends on (1 - r) / (1 - b) alone, so one fit, scaled, serves every b.
    """
    scale = 1.0 / (1.0 - critical_ratio)
    factor = root(scale)
    unscaled = _remembered_iso6358_coefficients()
    coefficients = unscaled
    for place in range(TERMS):
        coefficients = _with_item(coefficients, place, unscaled[place] * factor)
        factor = factor * scale
    return _curve(critical_ratio, linear_ratio, coefficients)


def _isentropic_coefficients(heat_capacity_ratio: float) -> Terms:
    """Coefficients of a gas, through the exact function of equation (7) at places below the critical pressure ratio."""
    k = heat_capacity_ratio
    critical_gap = 1.0 - critical_pressure_ratio(k)
    choked = math.sqrt(0.5 * (k - 1.0) * power(2.0 / (k + 1.0), (k + 1.0) / (k - 1.0)))
    gaps, values = PLACES, PLACES
    for place in range(TERMS):
        gap = critical_gap * PLACES[place]
        value = power(1.0 - gap, 1.0 / k) * math.sqrt((1.0 - power(1.0 - gap, (k - 1.0) / k)) / gap)
        gaps, values = _with_item(gaps, place, gap), _with_item(values, place, value / choked)
    return _polynomial_through(gaps, values)


_remembered_coefficients = lru_cache(maxsize=4096)(_isentropic_coefficients)


def _iso6358_coefficients() -> Terms:
    """Coefficients for a critical ratio of 0, where the function is the root of (1 - r)(1 + r)."""
    values = PLACES
    for place in range(TERMS):
        values = _with_item(values, place, math.sqrt(2.0 - PLACES[place]))
    return _polynomial_through(PLACES, values)


_remembered_iso6358_coefficients = lru_cache(maxsize=1)(_iso6358_coefficients)


def area_conductance(
    area: float, discharge_coefficient: float, heat_capacity_ratio: float, gas_constant: float, temperature: float
) -> float:
    """Conductance Cd A C1 [kg/(s Pa)] of an area [m^2]; ``gas_constant`` is the specific one. Equation (6)."""
    return discharge_coefficient * area * choked_flow_constant(heat_capacity_ratio, gas_constant, temperature)


def sonic_conductance_mass(sonic_conductance: float, gas_constant: float, temperature: float) -> float:
    """Conductance [kg/(s Pa)] of a sonic conductance [m^3/(s Pa)] measured with air, for another gas and temperature.

    ISO 6358 gives C rho_0 sqrt(T_0 / T) for air; another gas passes sqrt(R_air / R) times as much.
    """
    air_constant = 1.0e5 / (STANDARD_REFERENCE_DENSITY_AIR * STANDARD_REFERENCE_TEMPERATURE)
    warmth = root(STANDARD_REFERENCE_TEMPERATURE / temperature)
    same_gas = sonic_conductance * STANDARD_REFERENCE_DENSITY_AIR * warmth
    return same_gas * root(air_constant / gas_constant)


def _polynomial_through(places: Terms, values: Terms) -> Terms:
    """Coefficients, from the constant one upwards, of the polynomial that has some values at some places (Newton)."""
    differences = values
    for order in range(1, TERMS):
        for number in range(order, TERMS):
            index = TERMS - 1 + order - number
            rise = differences[index] - differences[index - 1]
            differences = _with_item(differences, index, rise / (places[index] - places[index - order]))
    coefficients = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for number in range(TERMS):
        place = places[TERMS - 1 - number]
        # The polynomial so far times (x - place), and the next difference.
        lower = coefficients
        for index in range(TERMS):
            raised = lower[index - 1] if index > 0 else 0.0
            coefficients = _with_item(coefficients, index, raised - place * lower[index])
        coefficients = _with_item(coefficients, 0, coefficients[0] + differences[TERMS - 1 - number])
    return coefficients


def _with_item(items: Terms, place: int, value: float) -> Terms:
    """Some numbers with another one at a place."""
    return (
        value if place == 0 else items[0],
        value if place == 1 else items[1],
        value if place == 2 else items[2],
        value if place == 3 else items[3],
        value if place == 4 else items[4],
        value if place == 5 else items[5],
        value if place == 6 else items[6],
    )


def _curve(critical_ratio: float, linear_ratio: float, coefficients: Terms) -> FlowCurve:
    return FlowCurve(
        critical_ratio=critical_ratio,
        linear_ratio=linear_ratio,
        linear_slope=1.0 / (1.0 - linear_ratio),
        coefficients=coefficients,
    )
