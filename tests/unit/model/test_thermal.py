"""Energy of the gas against closed forms."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.model import gas as thermal

R, K, T = 188.95, 1.3, 298.0
CV = thermal.heat_capacity_at_constant_volume(R, K)


def compressed(steps: int, ratio: float, coefficient: float) -> tuple[float, float]:
    """Temperature and pressure of a closed chamber of 1 L that is compressed in 1 s, by the midpoint rule."""
    volume, mass, end = 1e-3, 1e-3, 1e-3 * ratio
    energy, rate, step = thermal.gas_energy(mass, T, CV), (end - volume), 1.0 / steps

    def slope(energy: float, volume: float) -> float:
        temperature = thermal.gas_temperature(energy, mass, CV)
        pressure = thermal.real_pressure(mass, volume, temperature, R, 0.0)
        heat = thermal.heat_from_wall(temperature, T, coefficient, 0.06)
        return thermal.energy_rate(0.0, pressure, rate, heat)

    for _ in range(steps):
        middle = energy + 0.5 * step * slope(energy, volume)
        energy += step * slope(middle, volume + 0.5 * step * rate)
        volume += step * rate
    temperature = thermal.gas_temperature(energy, mass, CV)
    return temperature, thermal.real_pressure(mass, volume, temperature, R, 0.0)


def test_without_heat_a_compressed_chamber_follows_the_adiabate() -> None:
    temperature, pressure = compressed(2000, 0.5, 0.0)
    assert temperature == pytest.approx(T * 2.0 ** (K - 1.0), rel=1e-6)
    assert pressure == pytest.approx(1e-3 * R * T / 1e-3 * 2.0**K, rel=1e-6)


def test_with_much_heat_a_compressed_chamber_stays_at_the_walls_temperature() -> None:
    temperature, pressure = compressed(20_000, 0.5, 5e4)
    assert temperature == pytest.approx(T, rel=1e-4)
    assert pressure == pytest.approx(2.0 * R * T, rel=1e-4)


def test_the_departure_from_isothermal_falls_in_proportion_to_the_heat_transfer() -> None:
    warm, cool = compressed(20_000, 0.5, 2e3)[0] - T, compressed(20_000, 0.5, 2e4)[0] - T
    assert warm / cool == pytest.approx(10.0, rel=0.02)


def test_enthalpy_of_an_ideal_gas_is_specific_heat_at_constant_pressure_times_temperature() -> None:
    assert thermal.gas_enthalpy(T, 5.0, R, CV, 0.0) == pytest.approx(K * CV * T)


@given(st.floats(1e4, 1e6), st.floats(220.0, 400.0), st.floats(-3e-3, 3e-3))
def test_density_and_pressure_are_inverse(pressure: float, temperature: float, virial: float) -> None:
    density = thermal.real_density(pressure, temperature, R, virial)
    assert thermal.real_pressure(2.0 * density, 2.0, temperature, R, virial) == pytest.approx(pressure)


def test_carbon_dioxide_holds_two_percent_more_than_an_ideal_gas_at_50_psi() -> None:
    pressure, virial = 446e3, -123e-6 / 0.044
    more = thermal.real_density(pressure, T, R, virial) / thermal.real_density(pressure, T, R, 0.0) - 1.0
    assert more == pytest.approx(0.023, abs=0.001)


@given(st.floats(1e4, 1e6), st.floats(250.0, 350.0))
def test_energy_and_state_of_the_real_gas_agree(pressure: float, temperature: float) -> None:
    """The second law asks for du/drho at constant T = (P - T dP/dT)/rho^2, which is 0 for a constant b."""
    virial, step = -2.8e-3, 1e-3
    density = thermal.real_density(pressure, temperature, R, virial)
    slope = thermal.real_pressure(density, 1.0, temperature + step, R, virial)
    slope = (slope - thermal.real_pressure(density, 1.0, temperature - step, R, virial)) / (2.0 * step)
    assert temperature * slope == pytest.approx(pressure, rel=1e-7)


def test_colder_gas_flows_more() -> None:
    assert thermal.temperature_flow_factor(298.0, 298.0) == 1.0
    assert thermal.temperature_flow_factor(298.0, 298.0 / 4.0) == pytest.approx(2.0)
    assert math.isclose(thermal.heat_from_wall(290.0, 300.0, 50.0, 0.01), 5.0)
