"""Scenarios from names, files and plain values, in SI units."""

import copy
import math
from pathlib import Path
from typing import Any

import pytest

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import ScenarioError
from ppafo.model.sensors import Measurement
from ppafo.parameters import load_device
from ppafo.simulation.loading import list_scenarios, load_scenario, scenario_from_dict
from ppafo.simulation.scenario import FreeMotion, ProfileChoice, Scenario, Sensors

PSI = 6894.757293168361
SMALL: dict[str, Any] = {
    "schema_version": 1,
    "name": "small",
    "device": {"set": "ppafo2011"},
    "run": {"duration": "1 s"},
    "motion": {"kind": "locked", "angle": "75 deg"},
    "controller": {"kind": "pid", "rate": "1 kHz"},
    "reference": {"kind": "constant", "level": "0 N m"},
}
SMALL_TEXT = """
schema_version = 1
name = "small"
device.set = "ppafo2011"
run.duration = "1 s"
motion = { kind = "locked", angle = "75 deg" }
controller = { kind = "pid", rate = "1 kHz" }
reference = { kind = "constant", level = "0 N m" }
"""


def small(**sections: Any) -> Scenario:
    return scenario_from_dict({**copy.deepcopy(SMALL), **sections})


@pytest.mark.parametrize("name", list_scenarios())
def test_every_scenario_of_the_package_loads_under_its_own_name(name: str) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description
    assert scenario.assumptions


@pytest.mark.parametrize("name", list_scenarios())
def test_the_content_of_a_scenario_gives_the_same_scenario_again(name: str) -> None:
    scenario = load_scenario(name, ["run.duration=0.25 s"])
    again = scenario_from_dict(scenario.origin.content, scenario.origin.overrides)
    for field in ("device", "run", "motion", "initial", "controller", "reference", "sensors", "assumptions"):
        assert getattr(again, field) == getattr(scenario, field)


def test_a_file_and_the_same_plain_values_give_the_same_scenario(tmp_path: Path) -> None:
    file = tmp_path / "small.toml"
    file.write_text(SMALL_TEXT)
    from_file, from_values = load_scenario(file), scenario_from_dict(SMALL)
    assert from_file.controller == from_values.controller
    assert from_file.motion == from_values.motion
    assert from_file.origin.content == from_values.origin.content
    assert (from_file.origin.file, from_values.origin.file) == (str(file), None)


def test_every_value_arrives_in_si_units() -> None:
    scenario = small(
        run={"duration": "1 min", "step": "0.5 ms", "output_interval": "2 ms"},
        motion={"kind": "free", "angle": "75 deg", "angular_velocity": "90 deg/s", "external_torque": "500 N m"},
        initial={"pressure_1": "10 psi_g", "pressure_2": "200 kPa_a"},
        sensors={"delay": "3 ms", "angle_noise": "0.5 deg", "pressure_noise": "1 psi_d", "seed": 7},
        reference={"kind": "sine", "level": "1 N m", "amplitude": "500 g m^2/s^2", "frequency": "2 Hz"},
    )
    assert (scenario.run.duration, scenario.run.step, scenario.run.output_interval) == (60.0, 0.0005, 0.002)
    assert scenario.motion == FreeMotion(math.radians(75.0), math.pi / 2.0, 500.0)
    assert scenario.initial.pressure_1 == pytest.approx(STANDARD_ATMOSPHERE + 10.0 * PSI, rel=1e-15)
    assert scenario.initial.pressure_2 == 2.0e5
    assert scenario.sensors == Sensors(0.003, math.radians(0.5), PSI, 0.0, 0.0, 7)
    assert scenario.reference.settings == {"level": 1.0, "amplitude": 0.5, "frequency": 2.0, "phase": 0.0}


def test_what_is_left_out_has_its_declared_value() -> None:
    scenario = small()
    assert scenario.device == load_device("ppafo2011")
    assert scenario.controller.derivative_gain == 0.0
    assert scenario.sensors == Sensors()
    assert scenario.reference == ProfileChoice("constant", {"level": 0.0})
    assert (scenario.run.step, scenario.run.output_interval) == (0.001, 0.001)
    assert scenario.initial.pressure_1 == scenario.initial.pressure_2 == STANDARD_ATMOSPHERE


def test_words_stand_for_the_pressures_of_the_device() -> None:
    scenario = small(
        device={"set": "ppafo2011", "overrides": ["supply.pressure=60 psi_g", "supply.dorsiflexion_pressure=20 psi_g"]},
        initial={"pressure_1": "supply", "pressure_2": "dorsiflexion_supply"},
    )
    supply = scenario.device.supply
    assert scenario.initial.pressure_1 == supply.pressure
    assert scenario.initial.pressure_2 == supply.dorsiflexion_pressure
    assert supply.pressure > supply.dorsiflexion_pressure


def test_a_rate_and_its_period_are_the_same_sampling() -> None:
    by_rate = small(controller={"kind": "on_off", "rate": "20 Hz"})
    by_period = small(controller={"kind": "on_off", "period": "50 ms"})
    assert by_rate.controller.period == by_period.controller.period == 0.05


def test_a_set_file_is_found_beside_the_scenario(tmp_path: Path) -> None:
    original = Path(__file__).parents[3] / "src" / "ppafo" / "parameters" / "sets" / "ppafo2011.toml"
    (tmp_path / "bench.toml").write_text(original.read_text().replace('name = "ppafo2011"', 'name = "bench"'))
    file = tmp_path / "small.toml"
    file.write_text(SMALL_TEXT.replace('"ppafo2011"', '"bench.toml"'))
    assert load_scenario(file).device.name == "bench"


class Relay:
    def reset(self) -> None: ...

    def update(self, time: float, reference: float, measurement: Measurement) -> float:
        return 1.0 if reference > measurement.torque and time >= 0.0 else 0.0


def test_a_python_object_takes_the_place_of_the_controller() -> None:
    relay = Relay()
    control = small().controlled_by(relay).controller
    assert (control.kind, control.custom, control.period, control.settings) == ("python", relay, 0.001, {})


def test_an_assumption_carries_the_value_it_is_about() -> None:
    scenario = small(assumed={"motion.angle": "a guess", "controller.derivative_filter": "none", "valve.area": "old"})
    shown = [(item.path, item.value) for item in scenario.assumptions]
    assert shown == [("motion.angle", "75 deg"), ("controller.derivative_filter", "0 s"), ("valve.area", "31.6 mm^2")]


def test_an_assumption_about_nothing_is_refused_with_the_nearest_path() -> None:
    with pytest.raises(ScenarioError, match=r"\[assumed\] names 'motion.angel', .*did you mean 'motion.angle'"):
        small(assumed={"motion.angel": "a guess"})
    with pytest.raises(ScenarioError, match=r"names 'controller.slope', 'reference.knot', which have no value in this"):
        small(assumed={"controller.slope": "of another law", "motion.angle": "a guess", "reference.knot": "of another"})


def test_the_paper_s_gains_and_times_are_in_its_scenarios() -> None:
    proportional, solenoid = load_scenario("torque-task-proportional"), load_scenario("torque-task-solenoid")
    gains = [proportional.controller.settings[f"{name}_gain"] for name in ("proportional", "integral", "derivative")]
    assert gains == [0.095, 0.25, 0.006]
    assert (proportional.controller.period, solenoid.controller.period) == (0.001, 0.05)
    assert proportional.run.duration == solenoid.run.duration
    for field in ("reference", "motion", "initial"):
        assert getattr(proportional, field) == getattr(solenoid, field)
    assert (proportional.device.valve.kind, solenoid.device.valve.kind) == ("proportional", "solenoid")


def test_the_step_response_starts_as_the_paper_says() -> None:
    scenario = load_scenario("step-response")
    supply = scenario.device.supply
    assert supply.pressure == supply.dorsiflexion_pressure == pytest.approx(STANDARD_ATMOSPHERE + 55.0 * PSI)
    assert scenario.initial.pressure_1 == STANDARD_ATMOSPHERE
    assert scenario.initial.pressure_2 == supply.pressure
    assert isinstance(scenario.motion, FreeMotion)
    assert scenario.motion.angle == scenario.device.actuator.angle_min == math.radians(20.0)
    assert scenario.controller.settings == {"command": 1.0}
