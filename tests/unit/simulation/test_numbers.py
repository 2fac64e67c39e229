"""Numbers of a scenario by dotted path."""

from collections import Counter
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from ppafo.errors import ScenarioError
from ppafo.parameters import load_device
from ppafo.parameters.device import Orifice, SonicOrifice
from ppafo.parameters.overrides import over
from ppafo.simulation.clock import TIMES
from ppafo.simulation.ensemble.planning import check_columns, screen_columns
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.numbers import check_parts, declared_numbers, number_at, other_form, with_numbers
from ppafo.simulation.torque_loop import LoopLink


@cache
def looked_at() -> dict[str, set[str]]:
    """Numbers by scenario: each in the first that has it, and a tenth of the others, in turn."""
    seen: Counter[str] = Counter()
    chosen: dict[str, set[str]] = {}
    for number, name in enumerate(list_scenarios()):
        declared = list(declared_numbers(load_scenario(name)))
        chosen[name] = {path for place, path in enumerate(declared) if seen[path] < 1 or place % 10 == number % 10}
        seen.update(declared)
    return chosen


@pytest.mark.parametrize("name", list_scenarios())
def test_a_replaced_number_is_the_single_run_with_it(name: str) -> None:
    held = "motion.angle" in declared_numbers(load_scenario(name))
    given = ("motion.angle=75 deg",) if held else ()
    scenario = load_scenario(name, given)
    absent = {
        f"{section}.{form}" for section in ("valve", "actuator.leak") for form in other_form(scenario.device, section)
    }
    declared = declared_numbers(scenario)
    paths = [path for path in declared if path not in {*TIMES, *absent}]
    chosen = looked_at()[name] & set(paths)
    assert chosen
    for path in chosen:
        before, quantity = number_at(scenario, path), declared[path]
        # A pressure that is wanted stays above the atmosphere.
        part = 1.001 if path == "reference.start_level" else 0.999
        value = before * part if before else min(0.125, quantity.maximum)
        text = "3" if path == "sensors.seed" else f"{value!r} {quantity.unit}".removesuffix(" 1")
        changed = with_numbers(scenario, {path: 3.0 if path == "sensors.seed" else value})
        alone = load_scenario(name, over(given, [f"{path}={text}"]))
        assert {other: number_at(changed, other) for other in paths} == {
            other: number_at(alone, other) for other in paths
        }
        assert number_at(changed, path) == (3.0 if path == "sensors.seed" else value)


def test_what_follows_a_number_moves_with_it_and_what_is_given_does_not() -> None:
    scenario = load_scenario("torque-task-solenoid", ["initial.pressure_2=dorsiflexion_supply"])
    thin = with_numbers(scenario, {"supply.atmospheric_pressure": 8.0e4})
    gauge = scenario.device.supply.pressure - scenario.device.supply.atmospheric_pressure
    assert thin.device.supply.pressure == pytest.approx(8.0e4 + gauge, rel=1e-12)
    assert (thin.initial.pressure_1, thin.initial.pressure_2) == (8.0e4, thin.device.supply.dorsiflexion_pressure)
    apart = with_numbers(thin, {"supply.dorsiflexion_pressure": 3.0e5})
    assert (apart.initial.pressure_2, apart.device.supply.pressure) == (3.0e5, thin.device.supply.pressure)
    higher = with_numbers(apart, {"supply.pressure": 5.0e5})
    assert (higher.device.supply.pressure, higher.device.supply.dorsiflexion_pressure) == (5.0e5, 3.0e5)


def test_a_number_that_was_changed_since_the_scenario_was_loaded_follows_nothing_any_more() -> None:
    loaded = load_scenario("torque-task-solenoid")
    scenario = replace(loaded, initial=replace(loaded.initial, pressure_1=2.0e5))
    assert with_numbers(scenario, {"supply.atmospheric_pressure": 8.0e4}).initial.pressure_1 == 2.0e5


def test_an_orifice_in_the_other_form_takes_that_form() -> None:
    scenario = load_scenario("step-response")
    assert isinstance(scenario.device.valve.orifice, Orifice)
    changed = with_numbers(scenario, {"valve.sonic_conductance": 1e-8, "valve.critical_ratio": 0.3})
    assert changed.device.valve.orifice == SonicOrifice(1e-8, 0.3)
    assert changed.device.actuator == scenario.device.actuator


def test_a_scenario_made_from_a_device_alone_has_the_links_of_the_device() -> None:
    scenario = replace(load_scenario("step-response"), device=load_device("ppafo2011"), links={})
    supply = with_numbers(scenario, {"supply.pressure": 5.0e5}).device.supply
    assert (supply.pressure, supply.dorsiflexion_pressure) == (5.0e5, 5.0e5)


LINEARISED = ("controller.kind=feedback_linearisation", "reference.kind=constant", "reference.level=2 N m")


@pytest.mark.parametrize(("name", "overrides"), [("swing-foot-angle", ()), ("step-response", LINEARISED)])
def test_gains_follow_a_valve_whose_size_is_given_in_the_other_form(name: str, overrides: tuple[str, ...]) -> None:
    scenario = load_scenario(name, overrides)
    moved = with_numbers(scenario, {"valve.sonic_conductance": 1.5e-8, "valve.critical_ratio": 0.3})
    sonic = ("valve.sonic_conductance=1.5e-8 m^3/(s Pa)", "valve.critical_ratio=0.3")
    assert moved.controller == load_scenario(name, over(overrides, sonic)).controller
    assert moved.controller != scenario.controller
    back = with_numbers(moved, {"valve.area": 2e-5, "valve.discharge_coefficient": 0.4})
    area = ("valve.area=2e-5 m^2", "valve.discharge_coefficient=0.4")
    assert back.controller == load_scenario(name, over(overrides, area)).controller


def test_the_gains_of_a_cascade_share_one_torque_loop_and_keep_their_bits() -> None:
    scenario, computed = load_scenario("swing-foot-angle"), dict[object, object]()
    links = [link for links in scenario.graph.values() for link in links if isinstance(link, LoopLink)]
    assert len(links) > 5
    alone = [link.number(partial(number_at, scenario)) for link in links]
    assert [link.number(partial(number_at, scenario), computed) for link in links] == alone
    # Groups once, for all gains of the same ones.
    assert len(computed) == len({link.groups for link in links}) < len(links)


def test_knots_out_of_order_or_at_one_time_are_refused_wherever_they_come_from() -> None:
    name, last = "swing-foot-angle", "reference.time_03"
    for time in (0.0198, 0.0099):
        said = f"{last} = {time} s: must be later than reference.time_02, 0.0198 s"
        with pytest.raises(ScenarioError, match=said):
            load_scenario(name, [f"{last}={time} s"])
        scenario = load_scenario(name)
        with pytest.raises(ScenarioError, match=said):
            check_parts(with_numbers(scenario, {last: time}))
        assert screen_columns(check_columns(scenario, {last: np.array([0.03, time])})).reasons == {1: said}
    with pytest.raises(ScenarioError, match=r"must be later than the first knot, 0 s"):
        load_scenario(name, ["reference.time_02=0 s"])
