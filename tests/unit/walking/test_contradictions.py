"""Mistakes in a walk file or an override: one line that names what, and what is allowed."""

import math
import tomllib
from dataclasses import replace
from importlib import resources
from pathlib import Path

import jsonschema
import pytest

from ppafo.errors import ArgumentError, DataError, ParameterError, ScenarioError
from ppafo.gait import load_gait
from ppafo.gait.document import gait_toml
from ppafo.walking import list_walks, load_walk, walk, walk_population
from ppafo.walking.contradictions import COMPRESSION
from ppafo.walking.declaration import json_schema
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import gait_sensors_of, has_ideal_sensors

MISTAKES = {
    "controller.unload_threshold=80 N": "must be below controller.load_threshold = 60 N",
    "controller.largest_force=100 N; controller.load_threshold=200 N": "must be above controller.load_threshold",
    "controller.first_stride_time=5 s": "between half and twice the stride time of the gait, 1.0384 s",
    "controller.frozen_time=10 ms; controller.rate=100 Hz": "than two sample periods of the controller, each 10 ms",
    "controller.lowest_angle=100 deg; controller.highest_angle=90 deg": "must be below controller.highest_angle",
    "controller.push_off_end=0.39": "must be above controller.push_off_start = 0.4",
    "controller.highest_angle=90 deg": r"its default, 96.2569 deg: .* 90 deg; give a value .*'controller.swing_angle=",
    "actuator.angle_max=90 deg": "the gait needs 76 to 109 deg, but the upper stop is at 90 deg",
    "controller.swing_angle=135 deg": "must be in the range of sensor and device, 20 deg to 130 deg",
    "wearer.shank_mass_centre=0.5 m": "lies beyond the ankle: wearer.shank_length = 0.46 m",
    "wearer.toe_lever=0.08 m": "is not given and has its default, 0.09 m: lies beyond the toes",
    "controller.unload_treshold=20 N": "has no value 'controller.unload_treshold', did you mean 'controller.unload_th",
    "controller.load_threshold=60": "a number without a unit does not fit: a unit like 'N' is needed",
    "controller.load_threshold=60 kg": "unit 'kg' does not fit: a unit like 'N' is needed",
    "wearer.body_mass=5 kg": "must be at least 10 kg and at most 300 kg",
    "controller.kind=event_of": "'event_of' is not known",
    "controller.kind=hysteresis; controller.band=0.5 N m": "controller.kind = 'hysteresis' is not known",
    "faults.heel.kind=stuk; faults.heel.foo=3 N": "'stuk' is not known, did you mean 'stuck'",
    "faults.heel.time=3 s": "'faults.heel.kind' is missing",
    "faults.pressure_1.kind=stuck; faults.pressure_1.time=3 s; faults.pressure_1.reading=3 N": "a pressure level is",
    "controller.kind=event_proportional": "not a solenoid valve: set device.valve to 'proportional', or cont",
    "controller.flat_from=0.3": "must be below controller.flat_to = 0.24",
    "supply.atmospheric_pressure=80 kPa_a; controller.lowest_pressure=90 kPa_a": "must be below atmospheric pressure, ",
    "controller.filled_pressure=60 psi_g": "must be between atmospheric and supply pressure, 0 psi_g and 50 psi_g",
    "controller.filled_pressure=9 bar_g": r"atmospheric and supply pressure, 0 bar_g and 3\.44738 bar_g$",
    "supply.pressure=100 bar_g": r"its default, 18\.9868 bar_g: must be above \S+ bar_g: a moving foot",
    "controller.highest_pressure=60 psi_g": "must be above 88.8",
    "sensors.angle_bandwidth=-1 Hz": "must be at least 0 Hz and at most 1e",
    "sensors.pressure_lost_share=2": "must be at least 0 and at most 1",
}
ON_A_PROPORTIONAL_VALVE = {
    "valve.delay=60 ms": "fill_time is not given and has its default, 0.05 s: must be longer than the dead",
}
PROFILE = {
    "controller.peak_time=0.9; controller.fall_time=0.2": "the torque would end after the stride",
    "controller.peak_time=0.95": "must be at least 0.1 and at most 0.9 .phase of the peak",
    "controller.rise_time=0.6": "the torque would rise before the heel strike: controller.peak_time = 0.53",
    "controller.peak_time=0.3": "the peak would be over before the push-off: controller.push_off_start = 0.4",
}


@pytest.mark.parametrize("overrides", MISTAKES)
def test_a_mistake_is_named_in_one_line(overrides: str) -> None:
    with pytest.raises((ScenarioError, ParameterError), match=MISTAKES[overrides]) as caught:
        load_walk("solenoid", overrides.split("; "))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["solenoid", "solenoid-regulators"])
def test_supplies_that_let_no_gas_back_ask_for_room_above_their_pressure(name: str) -> None:
    with pytest.raises(ScenarioError, match=r"must be above 713\.7\d* kPa_a: a moving foot compresses the gas"):
        load_walk(name, ["controller.highest_pressure=600 kPa_a"])


REPORTED_VANE = (
    "actuator.displacement_per_radian=51 cm^3/rad",
    "actuator.dead_volume_1=2 cm^3",
    "actuator.dead_volume_2=2 cm^3",
)


@pytest.mark.parametrize("name", [name for name in list_walks() if name != "off"])
def test_no_shipped_walk_compresses_a_chamber_by_more_than_is_asked_for(name: str) -> None:
    def compressed(*overrides: str) -> float:
        result = walk(load_walk(name, overrides), minutes=0.15)
        highest = max(result.recording[chamber].max() for chamber in ("pressure_1", "pressure_2"))
        return float(highest / result.scenario.device.supply.pressure)

    # The room is for short lines and the reported vane too, which compress most.
    assert compressed() < 0.98 * COMPRESSION
    assert 1.0 < compressed(*REPORTED_VANE) < 0.98 * COMPRESSION


@pytest.mark.parametrize("overrides", ON_A_PROPORTIONAL_VALVE)
def test_a_mistake_with_a_proportional_valve_is_named(overrides: str) -> None:
    with pytest.raises(ScenarioError, match=ON_A_PROPORTIONAL_VALVE[overrides]):
        load_walk("proportional", overrides.split("; "))


def test_an_on_off_controller_works_a_proportional_valve() -> None:
    assert load_walk("proportional", ["controller.kind=event_on_off"]).controller.kind == "event_on_off"


def test_bandwidths_are_what_is_left_after_a_sample() -> None:
    slow = load_walk("solenoid", ["sensors.angle_bandwidth=20 Hz", "controller.rate=500 Hz"])
    assert gait_sensors_of(slow).angle_memory == pytest.approx(math.exp(-2.0 * math.pi * 20.0 / 500.0))
    assert gait_sensors_of(slow).pressure_memory == 0.0
    assert not has_ideal_sensors(slow)
    assert has_ideal_sensors(load_walk("solenoid", ["sensors.force_bandwidth=10 Hz"]))


def test_bandwidth_of_0_is_a_sensor_that_follows_at_once_as_in_a_scenario() -> None:
    given = load_walk("solenoid", ["sensors.angle_bandwidth=0 Hz", "sensors.pressure_bandwidth=0 Hz"])
    assert (given.sensors, given.controller) == (load_walk("solenoid").sensors, load_walk("solenoid").controller)
    assert has_ideal_sensors(given)


@pytest.mark.parametrize("overrides", PROFILE)
def test_a_torque_profile_that_contradicts_itself_is_refused(overrides: str) -> None:
    with pytest.raises(ScenarioError, match=PROFILE[overrides]):
        load_walk("proportional", overrides.split("; "))


def test_shipped_walks_load_and_contradict_nothing() -> None:
    proportional = ("proportional", "proportional-learning", "proportional-regulators")
    solenoid = ("solenoid", "solenoid-regulators")
    assert list_walks() == ("off", *proportional, *solenoid)
    assert [load_walk(name).name for name in list_walks()] == list(list_walks())


def test_the_published_schema_accepts_the_shipped_walks_and_no_unknown_key() -> None:
    schema = json_schema()
    for name in list_walks():
        text = (resources.files("ppafo.walking") / "configurations" / f"{name}.toml").read_text(encoding="utf-8")
        document = tomllib.loads(text)
        jsonschema.validate(document, schema)
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({**document, "wearers": {}}, schema)


def test_a_period_given_takes_the_place_of_the_rate_of_the_file() -> None:
    assert load_walk("solenoid", ["controller.period=2 ms"]).controller.period == pytest.approx(2.0e-3)


def test_unknown_names_have_a_hint() -> None:
    with pytest.raises(ScenarioError, match="did you mean 'solenoid'"):
        load_walk("solenoit")
    with pytest.raises(DataError, match="no gait 'falisse'"):
        load_walk("solenoid", gait="falisse")


def test_force_sensors_need_a_gait_with_a_ground_reaction(tmp_path: Path) -> None:
    bare = replace(load_gait(), name="bare", vertical_force=None, ankle_moment=None, centre_of_pressure=None)
    path = tmp_path / "bare.toml"
    path.write_text(gait_toml(bare))
    with pytest.raises(ScenarioError, match="gait 'bare' has no vertical_force; import the gait with ground"):
        load_walk("solenoid", gait=path)
    assert walk_of(load_walk("off", gait=path)).gait.name == "bare"


@pytest.mark.parametrize("minutes", [0.05, 61.0])
def test_a_walk_too_short_or_too_long_is_refused(minutes: float) -> None:
    with pytest.raises(ScenarioError, match=r"must be at least 0\.087 min \(5 strides\) and at most 60 min"):
        walk("solenoid", minutes=minutes)


@pytest.mark.parametrize("minutes", [-1.0, float("nan"), float("inf")])
def test_what_is_no_number_of_minutes_is_refused(minutes: float) -> None:
    with pytest.raises(ArgumentError, match=rf"^minutes={minutes}: must be a number of minutes above 0"):
        walk("solenoid", minutes=minutes)


def test_overrides_beside_a_configuration_are_refused() -> None:
    configuration = load_walk("off")
    with pytest.raises(ScenarioError, match="a loaded Scenario accepts no overrides"):
        walk(configuration, minutes=0.1, overrides=["wearer.body_mass=80 kg"])


def test_a_number_of_wearers_that_cannot_walk_is_refused() -> None:
    with pytest.raises(ScenarioError, match="must be from 1 to 1000000"):
        walk_population(load_walk("off"), minutes=0.1, wearers=1_000_001)
    for count in (0, -3):
        with pytest.raises(ArgumentError, match=rf"^wearers={count}: must be a whole number, 1 or more"):
            walk_population(load_walk("off"), minutes=0.1, wearers=count)


def test_a_joint_whose_stops_the_gait_passes_is_refused_with_both_ranges() -> None:
    with pytest.raises(ScenarioError, match=r"the gait needs 76 to 109 deg, but the upper stop is at 70 deg$"):
        load_walk("proportional", ["actuator.angle_max=70 deg"])
    with pytest.raises(ScenarioError, match=r"the gait needs 76 to 109 deg, but the lower stop is at 85 deg$"):
        load_walk("proportional", ["actuator.angle_min=85 deg"])
