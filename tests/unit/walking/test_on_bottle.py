"""A walk on its bottle: what closes, an independent simulator, the coupling, what ends it, and what is refused."""

from dataclasses import replace
from inspect import unwrap

import numpy as np
import pytest

from ppafo.errors import ParameterError, ScenarioError, SimulationError
from ppafo.parameters.overrides import over
from ppafo.walking import load_walk, walk
from ppafo.walking.figures.bottle import bottle_figure
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import compare_walks, without_device
from tests.reference import bottle as independent

WALK, BOTTLE = "solenoid-regulators", "paper-co2-9oz"
SMALL = ["bottle.fill=0.15", "bottle.temperature=262 K"]


@pytest.fixture(scope="module")
def small() -> WalkResult:
    return walk(WALK, minutes=0.15, overrides=SMALL, bottle=BOTTLE)


def test_mass_and_energy_close(small: WalkResult) -> None:
    assert small.supply is not None
    balance = small.supply.balance
    assert balance["left_bottle"] == pytest.approx(balance["regulated"], rel=1e-12)
    assert balance["regulated"] > 4.0e-3
    assert balance["given_up"] + balance["ice"] + balance["room"] == pytest.approx(balance["delivered"], rel=1e-12)


def test_the_band_of_the_line_is_seen_beside_the_pressure_of_the_regulator(small: WalkResult) -> None:
    behind = bottle_figure(small).axes[0]
    (band,) = behind.collections
    heights = band.get_paths()[0].vertices[:, 1]
    lowest, highest = behind.get_ylim()
    # Within a stride the line loses less than 1 of its 50 psi, of which an axis from 0 would show a hair.
    assert np.ptp(heights) > 0.1 * (highest - lowest)


def test_a_bottle_of_a_gram_ends_empty_and_its_gas_stays_what_a_gas_can_be() -> None:
    found = walk(WALK, minutes=0.1, overrides=["bottle.gas_mass=1 g", "bottle.volume=1.5 cm^3"], bottle=BOTTLE)
    assert found.supply is not None
    values = found.supply.values
    assert found.supply.ending.kind == "empty"
    assert np.all(np.diff(values["bottle_mass"]) <= 0.0)
    assert values["bottle_temperature"].max() <= 298.0 + 1e-9, "nothing is warmer than the room"
    assert values["bottle_pressure"].max() == values["bottle_pressure"][0]
    assert np.diff(values["bottle_mass"]).min() > -0.06e-3, "no more than a share leaves between two meetings"


def test_what_leaves_the_bottle_is_in_the_lines_or_went_into_the_device(small: WalkResult) -> None:
    recording, configuration = small.recording, small.scenario
    lines = configuration.supply_lines
    assert lines is not None
    product = configuration.device.gas.specific_gas_constant * recording["gas_temperature"]
    stored = (recording["line_pressure_1"] * lines.volume_1 + recording["line_pressure_2"] * lines.volume_2) / product
    gone = recording["bottle_mass"][0] - recording["bottle_mass"]
    # The gas temperature is drawn straight between two meetings, in which it stood still.
    assert gone - recording["supplied_mass"] == pytest.approx(stored - stored[0], abs=2e-6)


def test_an_independent_simulator_coupled_at_every_stage_says_the_same(
    small: WalkResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("CoolProp.CoolProp", reason="needs the extra 'properties'")
    monkeypatch.setattr(independent, "STEP", 2.5e-4)
    gaps = independent.differences(small, independent.independent_run(small, 1.2))
    assert gaps["regulated_mass"] < 1e-3 * 1.5e-3
    assert max(gaps[f"{name}_temperature"] for name in ("bottle", "regulator", "hose", "gas")) < 0.12
    assert max(gaps[f"{name}_rms"] for name in ("line_pressure_1", "pressure_1", "pressure_2")) < 200.0


def test_a_bottle_whose_gas_comes_warm_feeds_as_a_supply_without_end() -> None:
    warm = [f"bottle.hose.{name}" for name in ("effectiveness=1", "heat_capacity=1e6 J/K")]
    found = walk(WALK, minutes=0.1, overrides=[*warm, "bottle.regulator.area=50 mm^2"], bottle=BOTTLE)
    plain = walk(WALK, minutes=0.1)
    assert found.recording["gas_temperature"] == pytest.approx(298.0, abs=1e-3)
    for name in ("gas", "net_push_off_work", "lowest_toes"):
        assert found.metrics[name].value == pytest.approx(plain.metrics[name].value, rel=1e-4, abs=1e-5)


def test_cold_gas_costs_torque_and_takes_more_gas() -> None:
    cold, plain = (
        walk(WALK, minutes=0.15, overrides=["bottle.temperature=270 K"], bottle=BOTTLE),
        walk(WALK, minutes=0.15),
    )
    assert cold.metrics["gas"].value > 1.04 * plain.metrics["gas"].value
    assert cold.averages["torque"].mean.max() < plain.averages["torque"].mean.max()


ENDINGS = {
    "iced": ["bottle.regulator.effectiveness=0.2"],
    "empty": ["bottle.fill=0.02"],
    "too cold": ["bottle.fill=0.3", "bottle.temperature=250 K", "bottle.regulator.pressure_margin=1300 kPa_d"],
    "frozen": ["bottle.fill=0.1", "bottle.temperature=218 K", "bottle.regulator.pressure_margin=0 kPa_d"],
    "too little flow": ["bottle.regulator.area=0.002 mm^2"],
    "walk's end": [],
}


@pytest.mark.parametrize("kind", ENDINGS)
def test_the_walk_ends_with_its_supply_and_says_why_and_when(kind: str) -> None:
    found = walk(WALK, minutes=0.2, overrides=ENDINGS[kind], bottle=BOTTLE)
    assert found.supply is not None
    ending, end = found.supply.ending, float(found.recording.time[-1])
    assert ending.kind == kind
    assert ending.time == pytest.approx(end, abs=2e-3)
    assert (end < 11.9) == (kind != "walk's end")
    assert f"{1e3 * found.recording['bottle_mass'][-1]:.3g} g " in ending.message
    assert found.status.kind == ("completed" if kind == "walk's end" else "ended early")
    assert str(found).startswith(f"{WALK}: {found.status.message}\n")
    reached = found.recording["line_pressure_1"][found.recording.time > end - 1.0].max() - 101325.0
    if kind not in ("walk's end", "frozen"):
        assert reached < 0.9 * 344.74e3 * 1.001, "less than 90 % of the torque in the last stride"


def test_ice_narrows_the_seat_until_the_gas_lacks_no_more_than_it_is_given() -> None:
    found = walk(WALK, minutes=0.2, overrides=[*ENDINGS["iced"], "bottle.least_torque=0.01"], bottle=BOTTLE)
    assert found.supply is not None
    opened = found.supply.values["seat_open"]
    assert opened[0] == 1.0
    assert opened.min() < 0.05
    balance = found.supply.balance
    assert balance["iced"] > 4.0e-5
    assert balance["left_bottle"] == pytest.approx(balance["regulated"] + balance["iced"], rel=1e-12)
    assert balance["given_up"] + balance["ice"] + balance["room"] == pytest.approx(balance["delivered"], rel=1e-12)
    assert np.diff(found.recording["regulated_mass"])[-500:].sum() < 0.1 * found.recording["regulated_mass"][-1]


MISTAKES = {
    "bottle.name=paper-co2-9": "did you mean 'paper-co2-9oz'",
    "bottle.name=air-48ci-3000psi": "the device uses CO2: set gas.species=air, or choose a bottle of CO2",
    "bottle.fill=0": "must be more than 0",
    "bottle.temperature=200 K": "must be above 216.592 K",
    "bottle.temperature=303 K": "only 224.9 g fit into the bottle at 303 K",
    "bottle.regulator.area=0 mm^2": "must be more than 0",
    "bottle.regulator.are=3 mm^2": "bottle.regulator.area",
    "supply.relieving=true": "must be false with a bottle",
    "supply_line.plantarflexion.droop=3 Pa s/kg": "must be omitted for a walk with a bottle",
    "bottle.regulator.pressure_margin=8 MPa_d": "the regulator needs",
    "bottle.regulator.set_pressure=30 psi_g": "in a walk, set supply.pressure instead",
    "bottle.hose.heat_capacity=0.001 J/K": r"hose has a time constant of 0\.0\d+ ms: must be at least 1 ms",
    "bottle.wall_heat_capacity=0.001 J/K": r"wall has a time constant",
}


@pytest.mark.parametrize("override", MISTAKES)
def test_a_mistake_is_named_in_one_line(override: str) -> None:
    with pytest.raises((ScenarioError, ParameterError), match=MISTAKES[override]) as caught:
        load_walk(WALK, over(["bottle.name=paper-co2-9oz"], [override]))
    assert "\n" not in str(caught.value)


def test_many_wearers_and_an_energy_balance_have_no_bottle() -> None:
    configuration = load_walk(WALK, bottle=BOTTLE)
    changes = ["gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=50 W/(m^2 K)"]
    with pytest.raises(ScenarioError, match=r"gas_model\.kind.*omit gas_model\.kind, or the bottle"):
        load_walk(WALK, [*changes, "gas_model.wall_area_per_volume=100 1/m"], bottle=BOTTLE)
    assert walk_of(without_device(configuration)).bottle is None


def test_a_bottle_that_ends_a_walk_within_the_first_strides_is_named_with_its_time(
    small: WalkResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert small.supply is not None
    ending = small.supply.ending._replace(kind="empty", time=3.1, message="the bottle is empty")
    ended = replace(small, supply=replace(small.supply, ended=ending))
    monkeypatch.setitem(unwrap(compare_walks).__globals__, "walk", lambda *_, **__: ended)
    with pytest.raises(SimulationError, match=r"ends after 3\.1 s, within the first 5 strides"):
        compare_walks(small.scenario)
