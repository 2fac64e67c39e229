"""Flow curves fitted to the exact flow functions, and conductances, for both forms of an orifice.

By plain arithmetic and square roots alone, so that a run begins with the same bits on every machine.
"""

import math
from collections.abc import Sequence
from functools import lru_cache

from ppafo.constants import STANDARD_REFERENCE_DENSITY_AIR, STANDARD_REFERENCE_TEMPERATURE
from ppafo.model.columns import over_runs, root
from ppafo.model.elementary import power
from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio
from ppafo.model.orifice import TERMS, FlowCurve

PLACES = (0.01371, 0.117149, 0.300253, 0.522087, 0.735768, 0.900391, 0.988845)
"""Where a curve meets the exact function: 1 - r over that of the critical ratio.

A curve that is best by relative least squares crosses the exact function of helium here, and of other gases nearby.
"""


def isentropic_curve(heat_capacity_ratio: float, linear_ratio: float) -> FlowCurve:
    """Fitted curve [-] of equations (6), (7) for a gas; within 3e-7 of the exact function below ``linear_ratio``."""
    coefficients = over_runs(_isentropic_coefficients, heat_capacity_ratio)
    return _curve(critical_pressure_ratio(heat_capacity_ratio), linear_ratio, coefficients)


def iso6358_curve(critical_ratio: float, linear_ratio: float) -> FlowCurve:
    """Fitted curve [-] of ISO 6358 for a critical ratio b; within 1e-5 of the exact function below ``linear_ratio``.

    The exact function depends on (1 - r) / (1 - b) alone, so one fit, scaled, serves every b.
    """
    scale = 1.0 / (1.0 - critical_ratio)
    factor = root(scale)
    coefficients = []
    for value in _iso6358_coefficients():
        coefficients.append(value * factor)
        factor = factor * scale
    return _curve(critical_ratio, linear_ratio, coefficients)


@lru_cache(maxsize=4096)
def _isentropic_coefficients(heat_capacity_ratio: float) -> tuple[float, ...]:
    """Coefficients of a gas, through the exact function of equation (7) at places below the critical pressure ratio."""
    k = heat_capacity_ratio
    critical_gap = 1.0 - critical_pressure_ratio(k)
    gaps = [critical_gap * place for place in PLACES]
    choked = math.sqrt(0.5 * (k - 1.0) * power(2.0 / (k + 1.0), (k + 1.0) / (k - 1.0)))
    values = [power(1.0 - gap, 1.0 / k) * math.sqrt((1.0 - power(1.0 - gap, (k - 1.0) / k)) / gap) for gap in gaps]
    return _polynomial_through(gaps, [value / choked for value in values])


@lru_cache(maxsize=1)
def _iso6358_coefficients() -> tuple[float, ...]:
    """Coefficients for a critical ratio of 0, where the function is the root of (1 - r)(1 + r)."""
    return _polynomial_through(PLACES, [math.sqrt(2.0 - place) for place in PLACES])


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


def _polynomial_through(places: Sequence[float], values: Sequence[float]) -> tuple[float, ...]:
    """Coefficients, from the constant one upwards, of the polynomial that has some values at some places (Newton)."""
    differences = list(values)
    for order in range(1, TERMS):
        for index in range(TERMS - 1, order - 1, -1):
            rise = differences[index] - differences[index - 1]
            differences[index] = rise / (places[index] - places[index - order])
    coefficients = [0.0] * TERMS
    for place, difference in zip(reversed(places), reversed(differences), strict=True):
        raised = [0.0, *coefficients[:-1]]
        coefficients = [higher - place * lower for higher, lower in zip(raised, coefficients, strict=True)]
        coefficients[0] += difference
    return tuple(coefficients)


def _curve(critical_ratio: float, linear_ratio: float, coefficients: Sequence[float]) -> FlowCurve:
    return FlowCurve(
        critical_ratio=critical_ratio,
        linear_ratio=linear_ratio,
        linear_slope=1.0 / (1.0 - linear_ratio),
        coefficients=tuple(coefficients),
    )
