"""The course of a bottle against CoolProp and closed forms: adiabatic, isothermal, ideal gas, and its balances."""

from typing import Any

import pytest

from ppafo.analyses.endurance.discharge import Endurance, discharge
from ppafo.errors import ParameterError
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, Bottle, load_bottle
from ppafo.walking.bottle.coupling import Schedule

INSULATED = ("bottle.content_heat_transfer=0 W/K",)
HELD_WARM = ("bottle.content_heat_transfer=30 W/K", "bottle.room_heat_transfer=30 W/K")
NOTHING_WARMS_THE_GAS = ("regulator.room_heat_transfer=0 W/K", "hose.room_heat_transfer=0 W/K")
DAY = 86400.0


@pytest.fixture(scope="module")
def properties() -> Any:
    """CoolProp's function, with the reference that the table of CO2 states."""
    module = pytest.importorskip("CoolProp.CoolProp")
    module.set_reference_state("CO2", "IIR")
    return module.PropsSI


def emptied(bottle: Bottle, flow: float, longest: float = DAY, walk: float = 600.0, rest: float = 0.0) -> Endurance:
    """The course under a flow [kg/s]."""
    return discharge(bottle, flow, 1.0, flow, Schedule(walk, rest, longest))


def boiled_adiabatically(properties: Any, bottle: Bottle, drawn: float, steps: int = 400) -> tuple[float, float]:
    """Temperature and pressure from CoolProp alone after vapour was drawn: dU/dm = h of the vapour, midpoint rule."""
    mass, volume = bottle.mass, bottle.volume
    energy = mass * properties("U", "T", bottle.room_temperature, "D", mass / volume, "CO2")
    piece = drawn / steps

    def vapour_enthalpy(mass: float, energy: float) -> float:
        temperature = properties("T", "D", mass / volume, "U", energy / mass, "CO2")
        return float(properties("H", "T", temperature, "Q", 1, "CO2"))

    for _ in range(steps):
        half = energy - 0.5 * piece * vapour_enthalpy(mass, energy)
        energy -= piece * vapour_enthalpy(mass - 0.5 * piece, half)
        mass -= piece
    temperature, pressure = (properties(key, "D", mass / volume, "U", energy / mass, "CO2") for key in "TP")
    return float(temperature), float(pressure)


@pytest.mark.parametrize("seconds", [30.0, 90.0])
def test_an_insulated_wet_bottle_cools_as_coolprop_says(properties: Any, seconds: float) -> None:
    bottle = load_bottle(PAPER_BOTTLE, INSULATED)
    course = emptied(bottle, 1e-3, seconds).recording
    temperature, pressure = boiled_adiabatically(properties, bottle, 1e-3 * seconds)
    assert temperature < 295.0
    assert course["bottle_temperature"][-1] == pytest.approx(temperature, abs=0.01)
    assert course["bottle_pressure"][-1] == pytest.approx(pressure, rel=5e-4)


@pytest.mark.parametrize(("name", "coolprop_name"), [("air-48ci-3000psi", "Air"), ("n2-48ci-3000psi", "Nitrogen")])
def test_gas_left_in_an_insulated_bottle_keeps_its_entropy(properties: Any, name: str, coolprop_name: str) -> None:
    bottle = load_bottle(name, INSULATED)
    course = emptied(bottle, 1e-3, 100.0).recording
    start = properties("S", "T", bottle.room_temperature, "D", bottle.mass / bottle.volume, coolprop_name)
    density = course["bottle_mass"][-1] / bottle.volume
    temperature = properties("T", "S", start, "D", density, coolprop_name)
    assert temperature < 240.0
    assert course["bottle_temperature"][-1] == pytest.approx(temperature, abs=0.05)
    assert course["bottle_pressure"][-1] == pytest.approx(
        properties("P", "T", temperature, "D", density, coolprop_name), rel=1e-3
    )


def test_thin_nitrogen_in_an_insulated_bottle_follows_the_adiabat_of_an_ideal_gas() -> None:
    overrides = (*INSULATED, "bottle.fill_pressure=3 bar_a", "regulator.set_pressure=1.1 bar_a")
    bottle = load_bottle("n2-48ci-3000psi", (*overrides, "regulator.pressure_margin=0 bar_d"))
    course = emptied(bottle, 1e-5, 0.4 * bottle.mass / 1e-5).recording
    left = course["bottle_mass"][-1] / bottle.mass
    assert left == pytest.approx(0.6, rel=1e-6)
    assert course["bottle_temperature"][-1] / bottle.room_temperature == pytest.approx(left**0.4, rel=2e-3)


def test_a_wet_bottle_held_warm_keeps_its_pressure_and_takes_the_heat_of_evaporation(properties: Any) -> None:
    # The room heats the bottle alone, so that its heat is that of CoolProp's evaporation.
    bottle = load_bottle(PAPER_BOTTLE, (*HELD_WARM, *NOTHING_WARMS_THE_GAS))
    course = emptied(bottle, 1e-5, 1000.0)
    recording, room, masses = course.recording, bottle.room_temperature, (bottle.mass, bottle.mass - 0.01)
    last = recording["bottle_temperature"][-1]
    assert room - 0.2 < last < room
    energies = [
        mass * properties("U", "T", warmth, "D", mass / bottle.volume, "CO2")
        for mass, warmth in zip(masses, (room, last), strict=True)
    ]
    heat = energies[1] - energies[0] + 0.01 * properties("H", "T", last, "Q", 1, "CO2")
    of_wall = bottle.wall.wall_heat_capacity * (room - recording["wall_temperature"][-1])
    assert recording["bottle_pressure"][-1] == pytest.approx(properties("P", "T", last, "Q", 1, "CO2"), rel=2e-4)
    assert course.balance["room"] + of_wall == pytest.approx(heat, rel=2e-3)


def test_liquid_in_a_warm_bottle_is_used_up_when_vapour_alone_fills_it(properties: Any) -> None:
    bottle = load_bottle(PAPER_BOTTLE, HELD_WARM)
    course = emptied(bottle, 1e-4).recording
    (first, *_) = (course["liquid_mass"] <= 0.0).nonzero()[0]
    dry = course["bottle_mass"][first]
    sample = 1e-4 * (course.time[1] - course.time[0])
    vapour = bottle.volume * properties("D", "T", course["bottle_temperature"][first], "Q", 1, "CO2")
    assert vapour - sample <= dry <= vapour + 1e-7


@pytest.mark.parametrize(
    ("name", "coolprop_name"), [(PAPER_BOTTLE, "CO2"), ("air-48ci-3000psi", "Air"), ("n2-48ci-3000psi", "Nitrogen")]
)
def test_a_warm_bottle_ends_with_the_gas_that_the_regulators_pressure_leaves(
    properties: Any, name: str, coolprop_name: str
) -> None:
    bottle = load_bottle(name, (*HELD_WARM, "regulator.area=1000 mm^2"))
    course = emptied(bottle, 1e-4)
    regulator = bottle.regulator
    needed = regulator.set_pressure + regulator.pressure_margin - regulator.droop * 1e-4
    warmth = course.recording["bottle_temperature"][-1]
    left = bottle.volume * properties("D", "T|gas", warmth, "P", needed, coolprop_name)
    assert course.ending == "empty"
    assert course.mass_left == pytest.approx(left, rel=1e-3)
    assert course.total_time == pytest.approx((bottle.mass - left) / 1e-4, rel=1e-4)


@pytest.mark.parametrize("name", [PAPER_BOTTLE, "air-48ci-3000psi", "n2-48ci-3000psi"])
@pytest.mark.parametrize("rest", [0.0, 240.0])
def test_mass_and_energy_are_conserved(name: str, rest: float) -> None:
    bottle = load_bottle(name)
    course = emptied(bottle, 4e-4, walk=60.0, rest=rest)
    balance = course.balance
    assert balance["left_bottle"] == pytest.approx(balance["regulated"] + balance["iced"], rel=1e-9)
    assert balance["regulated"] == pytest.approx(4e-4 * course.walking_time, rel=1e-9)
    assert balance["given_up"] + balance["ice"] + balance["room"] == pytest.approx(balance["delivered"], rel=1e-9)
    assert balance["delivered"] > 1e4
    assert course.recording["bottle_mass"][-1] == pytest.approx(bottle.mass - balance["left_bottle"], rel=1e-9)


def test_a_bottle_that_follows_its_wall_at_once_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"the content has a time constant of .* ms: must be at least 50 ms"):
        emptied(load_bottle(PAPER_BOTTLE, ("bottle.content_heat_transfer=100000 W/K",)), 1e-4)


def test_pulses_of_a_second_cool_the_bottle_as_their_mean_does() -> None:
    bottle = load_bottle(PAPER_BOTTLE)
    mean = emptied(bottle, 3e-4, 200.0).recording
    pulsed = emptied(bottle, 6e-4, 200.0, walk=1.0, rest=1.0).recording
    assert pulsed["bottle_mass"][-1] == pytest.approx(mean["bottle_mass"][-1], rel=1e-9)
    one_pulse = 0.17  # K: 0.6 g of vapour at 190 kJ/kg from content of about 0.65 kJ/K
    assert pulsed["bottle_temperature"][-1] == pytest.approx(mean["bottle_temperature"][-1], abs=0.25 * one_pulse)
