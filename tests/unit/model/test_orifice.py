"""Orifice flow: the exact functions, the fitted curve, and both forms of data."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.model.flow_curve import isentropic_curve, iso6358_curve
from ppafo.model.gas import SPECIES, choked_flow_constant, critical_pressure_ratio
from ppafo.model.orifice import (
    area_conductance,
    fitted_flow_function,
    isentropic_flow_function,
    iso6358_flow_function,
    orifice_flow,
    sonic_conductance_mass,
    subsonic_flow_constant,
)

CO2 = SPECIES["CO2"]
CO2_CONSTANT = UNIVERSAL_GAS_CONSTANT / CO2.molar_mass
CURVE = isentropic_curve(1.3, 0.999)
pressures = st.floats(2.0e4, 2.0e6)


def flow(first: float, second: float, conductance: float) -> float:
    """Flow from the first pressure to the second."""
    return orifice_flow(first, second, conductance, 1.0, CURVE)[0]


def test_flow_constants_of_co2_are_the_printed_ones() -> None:
    assert choked_flow_constant(1.3, CO2_CONSTANT, 298.0) == pytest.approx(0.00281, abs=5e-6)
    assert subsonic_flow_constant(1.3, CO2_CONSTANT, 298.0) == pytest.approx(0.0124, abs=5e-5)
    assert 1.0 / critical_pressure_ratio(1.3) == pytest.approx(1.832, abs=5e-4)


def test_exact_flow_function_agrees_with_both_printed_equations_at_the_critical_ratio() -> None:
    critical = critical_pressure_ratio(1.3)
    choked = choked_flow_constant(1.3, CO2_CONSTANT, 298.0)
    subsonic = subsonic_flow_constant(1.3, CO2_CONSTANT, 298.0)
    equation_7 = subsonic * critical ** (1 / 1.3) * math.sqrt(1 - critical ** (0.3 / 1.3))
    assert equation_7 == pytest.approx(choked, rel=1e-12)
    assert isentropic_flow_function(critical * (1 + 1e-9), 1.3) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("name", sorted(SPECIES))
def test_fitted_curve_follows_the_isentropic_function_of_every_gas(name: str) -> None:
    k = SPECIES[name].heat_capacity_ratio
    curve = isentropic_curve(k, 0.999)
    for step in range(1000):
        ratio = 0.999 * step / 999
        exact = isentropic_flow_function(ratio, k)
        assert fitted_flow_function(ratio, curve)[0] == pytest.approx(exact, rel=3e-7)


@given(st.floats(0.05, 0.6), st.floats(0.0, 0.995))
def test_fitted_curve_follows_the_iso_function(critical_ratio: float, ratio: float) -> None:
    curve = iso6358_curve(critical_ratio, 0.995)
    exact = iso6358_flow_function(ratio, critical_ratio)
    assert fitted_flow_function(ratio, curve)[0] == pytest.approx(exact, rel=1e-5)


@given(pressures, pressures)
def test_flow_is_antisymmetric_under_exchange_of_the_sides(first: float, second: float) -> None:
    assert flow(first, second, 1e-8) == -flow(second, first, 1e-8)


@given(pressures)
def test_flow_vanishes_at_equal_pressures_and_is_continuous_there(pressure: float) -> None:
    assert flow(pressure, pressure, 1e-8) == 0.0
    across = flow(pressure * (1 + 1e-9), pressure, 1e-8)
    assert 0.0 < across < 1e-6 * 1e-8 * pressure


@given(st.floats(0.0, 1.0))
def test_flow_function_falls_with_the_pressure_ratio_and_stays_within_0_and_1(ratio: float) -> None:
    value, slope = fitted_flow_function(ratio, CURVE)
    assert -1e-12 <= value <= 1.0 + 1e-7
    assert slope <= 0.0


TWICE_LINEAR = 1.0 - 2.0 * (1.0 - CURVE.linear_ratio)


@given(st.floats(0.001, TWICE_LINEAR - 1e-5).filter(lambda ratio: abs(ratio - CURVE.critical_ratio) > 1e-4))
def test_slope_is_the_derivative_of_the_flow_function(ratio: float) -> None:
    width = 1e-6
    rise = fitted_flow_function(ratio + width, CURVE)[0] - fitted_flow_function(ratio - width, CURVE)[0]
    numerical = rise / (2 * width)
    assert fitted_flow_function(ratio, CURVE)[1] == pytest.approx(numerical, rel=2e-4, abs=2e-6)


@given(st.floats(TWICE_LINEAR + 1e-6, 1.0 - 1e-6))
def test_slope_near_equal_pressures_is_that_of_the_chord_to_them(ratio: float) -> None:
    chord = -fitted_flow_function(ratio, CURVE)[0] / (1.0 - ratio)
    assert fitted_flow_function(ratio, CURVE)[1] == pytest.approx(chord, rel=1e-9)


@given(pressures, pressures)
def test_flow_slopes_are_derivatives_by_both_pressures(first: float, second: float) -> None:
    ratio = min(first, second) / max(first, second)
    is_chord = TWICE_LINEAR - 1e-4 < ratio < CURVE.linear_ratio + 1e-4
    if is_chord or min(abs(ratio - kink) for kink in (CURVE.critical_ratio, 1.0)) < 1e-4:
        return
    _, by_first, by_second = orifice_flow(first, second, 1.0, 1.0, CURVE)
    for derivative, move in ((by_first, (1.0, 0.0)), (by_second, (0.0, 1.0))):
        high = flow(first + move[0], second + move[1], 1.0)
        low = flow(first - move[0], second - move[1], 1.0)
        assert derivative == pytest.approx((high - low) / 2.0, rel=1e-3, abs=1e-6)


def test_sonic_conductance_of_air_passes_the_mass_that_the_standard_defines() -> None:
    air_constant = 1.0e5 / (1.185 * 293.15)
    conductance = sonic_conductance_mass(1.0e-8, air_constant, 293.15)
    assert conductance == pytest.approx(1.0e-8 * 1.185, rel=1e-12)


def test_both_forms_of_an_orifice_describe_the_same_choked_flow() -> None:
    air = SPECIES["air"]
    constant = UNIVERSAL_GAS_CONSTANT / air.molar_mass
    by_area = area_conductance(10e-6, 0.6, air.heat_capacity_ratio, constant, 293.15)
    sonic = by_area / 1.185
    assert sonic_conductance_mass(sonic, constant, 293.15) == pytest.approx(by_area, rel=2e-3)
