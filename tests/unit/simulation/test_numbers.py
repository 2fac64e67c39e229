"""Numbers of a scenario by dotted path."""

import pytest

from ppafo.parameters.device import Orifice, SonicOrifice
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.numbers import TIMES, declared_numbers, number_at, other_form, with_numbers


@pytest.mark.parametrize("name", list_scenarios())
def test_every_declared_number_can_be_read_and_replaced_alone(name: str) -> None:
    scenario = load_scenario(name)
    absent = {
        f"{section}.{form}" for section in ("valve", "actuator.leak") for form in other_form(scenario.device, section)
    }
    paths = [path for path in declared_numbers(scenario) if path not in {*TIMES, *absent}]
    assert len(paths) > 35
    same_place = {"motion.angle", "motion.profile.level"}
    both = {"supply.pressure", "supply.dorsiflexion_pressure"}
    for path in paths:
        changed = with_numbers(scenario, {path: number_at(scenario, path) + 0.125})
        assert number_at(changed, path) == number_at(scenario, path) + 0.125
        others = {other for other in paths if number_at(changed, other) != number_at(scenario, other)}
        together = {"supply.pressure": both, **dict.fromkeys(same_place, same_place & set(paths))}
        assert others == together.get(path, {path})


def test_an_orifice_in_the_other_form_takes_that_form() -> None:
    scenario = load_scenario("step-response")
    assert isinstance(scenario.device.valve.orifice, Orifice)
    changed = with_numbers(scenario, {"valve.sonic_conductance": 1e-8, "valve.critical_ratio": 0.3})
    assert changed.device.valve.orifice == SonicOrifice(1e-8, 0.3)
    assert changed.device.actuator == scenario.device.actuator


def test_a_constant_command_has_no_reference_to_vary() -> None:
    paths = declared_numbers(load_scenario("step-response"))
    assert not [path for path in paths if path.startswith("reference.")]
    assert "controller.command" in paths
