"""Gas that is not ideal: density, pressure and energy agree, and so do the laws that the lanes call."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.model.effects.kind import effect_problem
from ppafo.model.effects.second_virial import (
    EFFECT,
    SECOND_VIRIAL,
    SecondVirial,
    gas_enthalpy,
    ideal_gas_density,
    real_density,
    real_gas_density,
    real_pressure,
)
from ppafo.model.gas import SPECIES, heat_capacity_at_constant_volume

R, K, T = 188.95, 1.3, 298.0
CV = heat_capacity_at_constant_volume(R, K)


def test_enthalpy_of_an_ideal_gas_is_specific_heat_at_constant_pressure_times_temperature() -> None:
    assert gas_enthalpy(T, 5.0, R, CV, 0.0) == pytest.approx(K * CV * T)


@given(st.floats(1e4, 1e6), st.floats(220.0, 400.0), st.floats(-3e-3, 3e-3))
def test_density_and_pressure_are_inverse(pressure: float, temperature: float, virial: float) -> None:
    density = real_density(pressure, temperature, R, virial)
    assert real_pressure(2.0 * density, 2.0, temperature, R, virial) == pytest.approx(pressure)


@given(st.floats(0.1, 30.0), st.floats(-3e-3, 3e-3))
def test_the_laws_of_the_lanes_are_those_of_the_rig(ideal: float, virial: float) -> None:
    row = SecondVirial(virial)
    density = real_gas_density(ideal, row)
    assert density == pytest.approx(real_density(ideal * R * T, T, R, virial), rel=1e-12)
    back, growth = ideal_gas_density(density, row)
    assert back == pytest.approx(ideal, rel=1e-12)
    step = 1e-6 * density
    slope = (ideal_gas_density(density + step, row)[0] - ideal_gas_density(density - step, row)[0]) / (2.0 * step)
    assert growth == pytest.approx(slope, rel=1e-7)


def test_carbon_dioxide_holds_two_percent_more_than_an_ideal_gas_at_50_psi() -> None:
    pressure, virial = 446e3, -123e-6 / 0.044
    more = real_density(pressure, T, R, virial) / real_density(pressure, T, R, 0.0) - 1.0
    assert more == pytest.approx(0.023, abs=0.001)


@given(st.floats(1e4, 1e6), st.floats(250.0, 350.0))
def test_energy_and_state_of_the_real_gas_agree(pressure: float, temperature: float) -> None:
    """The second law asks for du/drho at constant T = (P - T dP/dT)/rho^2, which is 0 for a constant b."""
    virial, step = -2.8e-3, 1e-3
    density = real_density(pressure, temperature, R, virial)
    slope = real_pressure(density, 1.0, temperature + step, R, virial)
    slope = (slope - real_pressure(density, 1.0, temperature - step, R, virial)) / (2.0 * step)
    assert temperature * slope == pytest.approx(pressure, rel=1e-7)


def test_every_gas_has_a_second_virial_coefficient_of_a_likely_size() -> None:
    assert set(SECOND_VIRIAL) == set(SPECIES)
    assert SECOND_VIRIAL["CO2"] < SECOND_VIRIAL["air"] < SECOND_VIRIAL["N2"] < 0.0 < SECOND_VIRIAL["He"]


def test_default_of_a_gas_must_be_there_for_every_gas() -> None:
    assert effect_problem(EFFECT) == ""
    of_two = {"coefficient": {"CO2": -123.0e-6, "air": -7.4e-6}}
    assert (
        effect_problem(replace(EFFECT, of_gas=of_two)) == "of_gas names 'coefficient', which has no default for N2, He"
    )
    of_none = {"viscosity": SECOND_VIRIAL}
    assert (
        effect_problem(replace(EFFECT, of_gas=of_none))
        == "of_gas names 'viscosity', which is not a quantity of the effect"
    )
