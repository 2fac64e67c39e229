"""Energy of the gas against closed forms."""

import math

import pytest

from ppafo.model import gas as thermal

R, K, T = 188.95, 1.3, 298.0
CV = thermal.heat_capacity_at_constant_volume(R, K)


def compressed(steps: int, ratio: float, coefficient: float) -> tuple[float, float]:
    """Temperature and pressure of a closed chamber of 1 L that is compressed in 1 s, by the midpoint rule."""
    volume, mass, end = 1e-3, 1e-3, 1e-3 * ratio
    energy, rate, step = thermal.gas_energy(mass, T, CV), (end - volume), 1.0 / steps

    def slope(energy: float, volume: float) -> float:
        temperature = thermal.gas_temperature(energy, mass, CV)
        pressure = mass * R * temperature / volume
        heat = thermal.heat_from_wall(temperature, T, coefficient, 0.06)
        return thermal.energy_rate(0.0, pressure, rate, heat)

    for _ in range(steps):
        middle = energy + 0.5 * step * slope(energy, volume)
        energy += step * slope(middle, volume + 0.5 * step * rate)
        volume += step * rate
    temperature = thermal.gas_temperature(energy, mass, CV)
    return temperature, mass * R * temperature / volume


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


def test_colder_gas_flows_more() -> None:
    assert thermal.temperature_flow_factor(298.0, 298.0) == 1.0
    assert thermal.temperature_flow_factor(298.0, 298.0 / 4.0) == pytest.approx(2.0)
    assert math.isclose(thermal.heat_from_wall(290.0, 300.0, 50.0, 0.01), 5.0)
