"""The bottle and its regulator: phases, balances, droop and flow limit."""

import math

import pytest

from ppafo.model.gas import choked_flow_constant
from ppafo.model.source import (
    BottleState,
    BottleWall,
    Regulator,
    bottle_content,
    bottle_rates,
    content_energy,
    content_temperature,
    densest_gas,
    fluid_pressure,
    liquid_density,
    liquid_mass,
    pressure_reserve,
    regulated_pressure,
    regulator_flow_limit,
)
from ppafo.parameters.bottles.bottle import load_fluid

CO2 = load_fluid("CO2").table
VOLUME = 3.75e-4
REGULATOR = Regulator(set_pressure=4.5e5, droop=3e6, pressure_margin=1e5, seat_area=2.5e-6)


@pytest.mark.parametrize("name", ["CO2", "air", "N2"])
@pytest.mark.parametrize("mass", [0.002, 0.03, 0.12])
@pytest.mark.parametrize("temperature", [218.3, 255.01, 302.9])
def test_temperature_is_found_from_the_energy(name: str, mass: float, temperature: float) -> None:
    table = load_fluid(name).table
    energy = content_energy(table, mass, VOLUME, temperature)
    assert content_temperature(table, mass, VOLUME, energy) == pytest.approx(temperature, abs=1e-6)


def test_an_energy_beyond_the_table_gives_its_end() -> None:
    assert content_temperature(CO2, 0.1, VOLUME, -1e9) == CO2.temperatures[0]
    assert content_temperature(CO2, 0.1, VOLUME, 1e9) == CO2.temperatures[-1]


@pytest.mark.parametrize("temperature", [220.0, 273.15, 298.0])
def test_liquid_and_vapour_fill_the_bottle_and_make_up_the_mass(temperature: float) -> None:
    liquid = liquid_mass(CO2, 0.2, VOLUME, temperature)
    vapour = 0.2 - liquid
    filled = liquid / liquid_density(CO2, temperature) + vapour / densest_gas(CO2, temperature)
    assert liquid > 0.1
    assert filled == pytest.approx(VOLUME, rel=1e-12)


def test_there_is_no_liquid_in_little_gas_and_none_in_air() -> None:
    assert liquid_mass(CO2, 0.9 * VOLUME * densest_gas(CO2, 290.0), VOLUME, 290.0) == 0.0
    assert liquid_mass(load_fluid("air").table, 0.15, VOLUME, 290.0) == 0.0


def test_the_content_of_a_wet_bottle_has_the_vapour_pressure_whatever_its_mass() -> None:
    pressures = {bottle_content(CO2, mass, VOLUME, 280.0).pressure for mass in (0.08, 0.15, 0.25)}
    assert pressures == {fluid_pressure(CO2, 280.0, math.inf)}


def test_what_leaves_a_wet_bottle_carries_more_than_the_liquid_has() -> None:
    content = bottle_content(CO2, 0.2, VOLUME, 273.15)
    assert content.outflow_enthalpy == pytest.approx(430.89e3, rel=1e-4)  # IIR reference: liquid 200 kJ/kg


def test_rates_balance_mass_and_energy_of_content_and_wall() -> None:
    wall = BottleWall(wall_heat_capacity=400.0, content_heat_transfer=5.0, room_heat_transfer=0.5)
    content = bottle_content(CO2, 0.2, VOLUME, 270.0)
    rates = bottle_rates(content, BottleState(0.2, 0.0, 280.0), 2e-4, wall, 298.0)
    stored = rates.content_energy_rate + rates.wall_temperature_rate * wall.wall_heat_capacity
    assert rates.mass_rate == -2e-4
    assert rates.room_heat == pytest.approx(9.0)
    assert rates.outflow_power == pytest.approx(2e-4 * content.outflow_enthalpy)
    assert stored == pytest.approx(rates.room_heat - rates.outflow_power, rel=1e-12)


def test_a_regulator_droops_with_the_flow_and_follows_the_bottle_when_that_is_too_low() -> None:
    assert regulated_pressure(REGULATOR, 0.0) == 4.5e5
    assert regulated_pressure(REGULATOR, 5e-3) == pytest.approx(4.35e5)
    assert pressure_reserve(REGULATOR, 6e6, 5e-3) > 0.0 > pressure_reserve(REGULATOR, 5e5, 5e-3)
    assert pressure_reserve(REGULATOR, 5.35e5, 5e-3) == pytest.approx(0.0, abs=1e-6)


def test_the_flow_limit_is_choked_flow_of_the_seat_and_vanishes_without_a_pressure_difference() -> None:
    def limit(pressure: float) -> float:
        return regulator_flow_limit(REGULATOR, pressure, 280.0, 1.3, 188.924)

    assert limit(6e6) == pytest.approx(2.5e-6 * choked_flow_constant(1.3, 188.924, 280.0) * 6e6, rel=1e-12)
    assert limit(6e6) == pytest.approx(6.0 * limit(1e6), rel=1e-12)
    assert limit(5e5) < limit(1e6) * 0.5
    assert limit(4.5e5) == limit(3e5) == 0.0
