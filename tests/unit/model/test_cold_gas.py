"""Gas behind a regulator against CoolProp: what it lacks, how cold it comes, when it freezes, what its parts give."""

import pytest

from ppafo.errors import SimulationError
from ppafo.model.cold_gas import (
    DRY_ICE,
    Isobar,
    Passage,
    advance_supply,
    enthalpy_at,
    enthalpy_behind,
    heat_to_warm,
    ice_rate,
    isobar,
    supply_now,
    supply_rates,
    temperature_at,
)
from ppafo.model.source import bottle_content
from ppafo.parameters.bottles.bottle import load_bottle, load_fluid
from ppafo.walking import load_walk
from ppafo.walking.motion import walk_of

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
    supply = walk_of(load_walk("solenoid-regulators", ["bottle.temperature=293.15 K"], bottle="paper-co2-9oz")).bottle
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
    growth = ice_rate(line, wet, 1e-3, 0.0, 0.1)
    split = 1e-3 * line.enthalpies[0] + growth * (line.enthalpies[0] - DRY_ICE)
    assert growth > 0.0
    assert (1e-3 + growth) * wet == pytest.approx(split, rel=1e-12), "what comes is gas that goes on, and ice"
    assert ice_rate(above, wet, 1e-3, 0.0, 0.1) == 0.0
    assert above.temperatures[0] == pytest.approx(coolprop("T", "P", 600e3, "Q", 1), abs=1.0)
    assert isobar(load_fluid("air").table, PRESSURE).freezes == 0.0


def test_warm_gas_takes_off_no_more_ice_than_there_is(line: Isobar) -> None:
    warm = enthalpy_at(line, WARM)
    assert ice_rate(line, warm, 1e-3, 0.0, 0.1) == 0.0
    assert ice_rate(line, warm, 1.0, 1e-6, 0.1) == pytest.approx(-1e-5)


@pytest.mark.parametrize("ice", [0.0, 1.0e-7, 25.0e-6, 1.0e-3])
@pytest.mark.parametrize("body", [220.0, 280.0])
def test_the_gas_that_is_offered_is_as_cold_as_the_balance_says(ice: float, body: float) -> None:
    """The hose passes its gas on as it is, so what is delivered is what comes out of the regulator."""
    supply = walk_of(load_walk("solenoid-regulators", ["bottle.temperature=280 K"], bottle="paper-co2-9oz")).bottle
    assert supply is not None
    line, model = isobar(TABLE, 400e3), supply.bottle.supply._replace(hose=Passage(1.0, 0.0, 0.0))
    state, mass, step = supply.start()._replace(body_temperature=body, ice=ice), 0.4e-3, 0.5
    now = supply_now(TABLE, line, model, state, 280.0, mass)
    rates = supply_rates(line, model, state, now.content, mass / step, step)
    assert now.outlet_temperature == pytest.approx(temperature_at(line, rates.delivered * step / mass), abs=1e-6)
    warmest = supply_now(TABLE, line, model, state._replace(ice=0.0), 280.0, mass).outlet_temperature
    assert now.outlet_temperature <= warmest
    assert now.outlet_temperature < warmest - 5.0 or ice < 1e-6 or body < 280.0, "ice makes the gas of a warm body cold"


def test_ice_takes_from_the_gas_what_it_loses() -> None:
    supply = walk_of(load_walk("solenoid-regulators", ["bottle.temperature=280 K"], bottle="paper-co2-9oz")).bottle
    assert supply is not None
    state = supply.start()._replace(ice=25.0e-6)
    content = bottle_content(TABLE, state.mass, supply.bottle.volume, 280.0)
    model = supply.bottle.supply._replace(hose=Passage(1.0, 0.0, 0.0))
    icy, bare = (
        supply_rates(supply.line, model, state._replace(ice=ice), content, 1.0e-3, 0.5) for ice in (25e-6, 0.0)
    )
    assert icy.ice < 0.0 == bare.ice
    arriving = bare.delivered / 1.0e-3
    taken = (supply.line.enthalpies[0] - DRY_ICE) * -icy.ice
    assert icy.delivered == pytest.approx((1.0e-3 + icy.ice) * arriving + taken, rel=1e-12)
    assert -icy.mass == pytest.approx(1.0e-3 + icy.ice, rel=1e-12), "the ice that goes is part of the flow"


QUICK = {
    "hose": ["bottle.hose.heat_capacity=0.03 J/K"],
    "wall": ["bottle.wall_heat_capacity=0.01 J/K"],
    "content": ["bottle.gas_mass=1 g", "bottle.volume=1.5 cm^3"],
}


@pytest.mark.parametrize("part", QUICK)
def test_a_part_that_follows_fast_ends_between_its_neighbours(part: str) -> None:
    """Heat that flows from warm to cold makes nothing warmer than the warmest; a step that is too long would."""
    supply = walk_of(load_walk("solenoid-regulators", QUICK[part], bottle="paper-co2-9oz")).bottle
    assert supply is not None
    table, model = supply.bottle.fluid.table, supply.bottle.supply
    state, near = supply.start(), supply.temperature
    for _ in range(15):
        state = advance_supply(table, supply.line, model, state, supply.offers(state, near, 0.0).content, 6.0e-5, 0.1)
        now = supply.offers(state, near, 6.0e-5)
        near = now.content.temperature
        assert 216.0 < near < 298.0 + 1e-9
        assert near - 1e-9 < state.wall_temperature < 298.0 + 1e-9
        assert now.outlet_temperature - 1e-9 < state.hose_temperature < 298.0 + 1e-9


@pytest.mark.parametrize("share", [1.0, 1.3])
def test_no_more_gas_is_drawn_than_the_bottle_has(share: float) -> None:
    supply = walk_of(load_walk("solenoid-regulators", ["bottle.fill=0.02"], bottle="paper-co2-9oz")).bottle
    assert supply is not None
    state, content = supply.start(), supply.offers_first().content
    with pytest.raises(SimulationError, match=r"5.1 g: reduce bottle\.coupling"):
        advance_supply(TABLE, supply.line, supply.bottle.supply, state, content, share * state.mass, 0.1)
    after = advance_supply(TABLE, supply.line, supply.bottle.supply, state, content, 0.5 * state.mass, 0.1)
    assert after.mass == pytest.approx(0.5 * state.mass)


def test_a_bottle_file_without_regulator_and_hose_has_those_of_the_papers_bottle() -> None:
    air, paper = load_bottle("air-48ci-3000psi"), load_bottle("paper-co2-9oz")
    assert (air.body, air.hose, air.ice_capacity) == (paper.body, paper.hose, paper.ice_capacity)
    assert load_bottle("air-48ci-3000psi", ["hose.effectiveness=0.2"]).hose.effectiveness == 0.2
