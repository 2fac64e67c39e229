"""Mistakes in a walk file or an override: one line that names what, and what is allowed."""

import math
import tomllib
from dataclasses import replace
from importlib import resources
from pathlib import Path

import jsonschema
import pytest

from ppafo.errors import ParameterError, ScenarioError
from ppafo.gait import load_gait
from ppafo.gait.document import gait_toml
from ppafo.simulation.plan import plan_run
from ppafo.walking import list_walks, load_walk, walk
from ppafo.walking.declaration import json_schema
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import gait_sensors_of

MISTAKES = {
    "solenoid": {
        "controller.unload_threshold=80 N": "controller.load_threshold = 60 N",
        "controller.first_stride_time=5 s": "1.0384 s",
        "controller.push_off_end=0.39": "controller.push_off_start = 0.4",
        "controller.swing_angle=135 deg": "20 deg to 130 deg",
        "wearer.shank_mass_centre=0.5 m": "wearer.shank_length = 0.46 m",
        "wearer.toe_lever=0.08 m": "0.09 m",
        "controller.kind=event_proportional": "device.valve",
    },
    "proportional": {
        "actuator.angle_max=70 deg": "76 to 109 deg.* 70 deg$",
        "actuator.angle_min=85 deg": "76 to 109 deg.* 85 deg$",
        "controller.peak_time=0.9; controller.fall_time=0.2": "controller.fall_time",
        "controller.rise_time=0.6": "controller.peak_time = 0.53",
        "controller.peak_time=0.3": "controller.push_off_start = 0.4",
    },
}
"""Overrides of two walks, and the other number that the refusal names."""


@pytest.mark.parametrize(("name", "overrides"), [(name, each) for name in MISTAKES for each in MISTAKES[name]])
def test_a_mistake_is_named_in_one_line(name: str, overrides: str) -> None:
    with pytest.raises((ScenarioError, ParameterError), match=MISTAKES[name][overrides]) as caught:
        load_walk(name, overrides.split("; "))
    assert "\n" not in str(caught.value)


def test_bandwidths_are_what_is_left_after_a_sample() -> None:
    slow = load_walk("solenoid", ["sensors.angle_bandwidth=20 Hz", "controller.rate=500 Hz"])
    assert gait_sensors_of(slow).angle_memory == pytest.approx(math.exp(-2.0 * math.pi * 20.0 / 500.0))
    assert gait_sensors_of(slow).pressure_memory == 0.0
    assert not plan_run(slow).program.ideal_sensors
    assert plan_run(load_walk("solenoid", ["sensors.force_bandwidth=10 Hz"])).program.ideal_sensors


def test_the_published_schema_accepts_the_shipped_walks_and_no_unknown_key() -> None:
    schema = json_schema()
    for name in list_walks():
        text = (resources.files("ppafo.walking") / "configurations" / f"{name}.toml").read_text(encoding="utf-8")
        document = tomllib.loads(text)
        jsonschema.validate(document, schema)
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({**document, "wearers": {}}, schema)


def test_force_sensors_need_a_gait_with_a_ground_reaction(tmp_path: Path) -> None:
    bare = replace(load_gait(), name="bare", vertical_force=None, ankle_moment=None, centre_of_pressure=None)
    path = tmp_path / "bare.toml"
    path.write_text(gait_toml(bare))
    with pytest.raises(ScenarioError, match="vertical_force"):
        load_walk("solenoid", gait=path)
    assert walk_of(load_walk("off", gait=path)).gait.name == "bare"


@pytest.mark.parametrize("minutes", [0.05, 61.0])
def test_a_walk_too_short_or_too_long_is_refused(minutes: float) -> None:
    with pytest.raises(ScenarioError, match=r"0\.087 min.* 60 min"):
        walk("solenoid", minutes=minutes)
