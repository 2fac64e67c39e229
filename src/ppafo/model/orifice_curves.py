"""Flow curves fitted to the exact flow functions, and conductances, for both forms of an orifice."""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ppafo.constants import STANDARD_REFERENCE_DENSITY_AIR, STANDARD_REFERENCE_TEMPERATURE
from ppafo.model.columns import over_runs, root
from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio
from ppafo.model.orifice import TERMS, FlowCurve, isentropic_flow_function, iso6358_flow_function

FIT_POINTS = 400


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
    gaps = _gaps(critical_pressure_ratio(heat_capacity_ratio))
    return _fit_curve(gaps, np.array([isentropic_flow_function(1.0 - gap, heat_capacity_ratio) for gap in gaps]))


@lru_cache(maxsize=1)
def _iso6358_coefficients() -> tuple[float, ...]:
    """Coefficients for a critical ratio of 0."""
    gaps = _gaps(0.0)
    return _fit_curve(gaps, np.array([iso6358_flow_function(1.0 - gap, 0.0) for gap in gaps]))


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


def _gaps(critical_ratio: float) -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
    """Chebyshev-like points of 1 - r between 0 and the critical gap."""
    angles = np.linspace(0.0, math.pi, FIT_POINTS + 1)[1:]
    return np.asarray(0.5 * (1.0 - critical_ratio) * (1.0 - np.cos(angles)))


def _fit_curve(
    gaps: "np.ndarray[tuple[int], np.dtype[np.float64]]", exact: "np.ndarray[tuple[int], np.dtype[np.float64]]"
) -> tuple[float, ...]:
    """Coefficients of a polynomial times a root, by relative least squares."""
    target = exact / np.sqrt(gaps)
    powers = np.vander(gaps, TERMS, increasing=True)
    coefficients = np.linalg.lstsq(powers / target[:, None], np.ones_like(target), rcond=None)[0]
    return tuple(coefficients.tolist())


def _curve(critical_ratio: float, linear_ratio: float, coefficients: Sequence[float]) -> FlowCurve:
    return FlowCurve(
        critical_ratio=critical_ratio,
        linear_ratio=linear_ratio,
        linear_slope=1.0 / (1.0 - linear_ratio),
        coefficients=tuple(coefficients),
    )
