"""Gas behind a regulator against CoolProp: what it lacks, how cold it comes, when it freezes, what its parts give."""

import pytest

from ppafo.model.cold_gas import (
    DRY_ICE,
    Isobar,
    Passage,
    enthalpy_at,
    enthalpy_behind,
    heat_to_warm,
    ice_rate,
    isobar,
    supply_rates,
    temperature_at,
)
from ppafo.model.source import bottle_content
from ppafo.parameters.bottles.bottle import load_bottle
from ppafo.parameters.bottles.fluids import load_fluid
from ppafo.walking import load_walk

TABLE = load_fluid("CO2").table
PRESSURE = 446.06e3
WARM = 298.15


@pytest.fixture(scope="module")
def line() -> Isobar:
    return isobar(TABLE, PRESSURE)


def coolprop(name: str, *given: str | float) -> float:
    properties = pytest.importorskip("CoolProp.CoolProp", reason="needs the extra 'properties'")
    return float(properties.PropsSI(name, *given, "CO2"))


def test_vapour_of_20_degrees_lacks_95_kj_a_kg_which_is_38_w_at_0_4_g_s(line: Isobar) -> None:
    content = bottle_content(TABLE, 0.255, 375e-6, 293.15)
    lacking = heat_to_warm(TABLE, content, WARM, PRESSURE)
    assert lacking == pytest.approx(
        coolprop("H", "T", WARM, "P", PRESSURE) - coolprop("H", "T", 293.15, "Q", 1), rel=1e-3
    )
    assert (lacking, 0.4e-3 * lacking) == (pytest.approx(95e3, rel=0.01), pytest.approx(38.0, rel=0.01))


def test_a_regulator_that_warms_its_gas_to_the_room_gives_38_w() -> None:
    supply = load_walk("solenoid-regulators", ["bottle.temperature=293.15 K"], bottle="paper-co2-9oz").bottle
    assert supply is not None
    model = supply.bottle.supply._replace(body=Passage(1.0, 1.0, 0.0), room_temperature=WARM)
    state = supply.start()._replace(body_temperature=WARM)
    content = bottle_content(TABLE, state.mass, model.volume, 293.15)
    rates = supply_rates(supply.line, model, state, content, 0.4e-3, 1.0)
    assert -rates.body_temperature == pytest.approx(38.0, rel=0.01), "W out of a body of 1 J/K"


@pytest.mark.parametrize("bottle", [245.0, 255.0, 268.0])
def test_a_throttle_alone_keeps_the_enthalpy(line: Isobar, bottle: float) -> None:
    enthalpy = bottle_content(TABLE, 0.255, 375e-6, bottle).outflow_enthalpy
    behind = enthalpy_behind(line, Passage(1.0, 0.0, 0.0), WARM, enthalpy)
    assert behind == enthalpy
    expected = coolprop("T", "H", coolprop("H", "T", bottle, "Q", 1), "P", PRESSURE)
    assert temperature_at(line, behind) == pytest.approx(expected, abs=0.1)


def test_from_a_warm_bottle_it_is_as_cold_as_dry_ice(line: Isobar) -> None:
    enthalpy = bottle_content(TABLE, 0.255, 375e-6, 285.0).outflow_enthalpy
    assert temperature_at(line, enthalpy) == 216.592


def test_temperature_and_enthalpy_are_inverse(line: Isobar) -> None:
    for temperature in (220.0, 251.3, 303.0):
        assert temperature_at(line, enthalpy_at(line, temperature)) == pytest.approx(temperature, abs=1e-9)


def test_ice_forms_only_behind_an_outlet_below_the_triple_point_of_518_kpa(line: Isobar) -> None:
    wet = bottle_content(TABLE, 0.255, 375e-6, 298.0).outflow_enthalpy
    above = isobar(TABLE, 600e3)
    assert ice_rate(line, wet, 1e-3, 0.0, 0.1) == pytest.approx(1e-3 * (line.enthalpies[0] - wet) / DRY_ICE)
    assert ice_rate(above, wet, 1e-3, 0.0, 0.1) == 0.0
    assert above.temperatures[0] == pytest.approx(coolprop("T", "P", 600e3, "Q", 1), abs=1.0)
    assert isobar(load_fluid("air").table, PRESSURE).freezes == 0.0


def test_warm_gas_takes_off_no_more_ice_than_there_is(line: Isobar) -> None:
    warm = enthalpy_at(line, WARM)
    assert ice_rate(line, warm, 1e-3, 0.0, 0.1) == 0.0
    assert ice_rate(line, warm, 1.0, 1e-6, 0.1) == pytest.approx(-1e-5)


def test_a_bottle_file_without_regulator_and_hose_has_those_of_the_papers_bottle() -> None:
    air, paper = load_bottle("air-48ci-3000psi"), load_bottle("paper-co2-9oz")
    assert (air.body, air.hose, air.ice_capacity) == (paper.body, paper.hose, paper.ice_capacity)
    assert load_bottle("air-48ci-3000psi", ["hose.effectiveness=0.2"]).hose.effectiveness == 0.2
