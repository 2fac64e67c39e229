"""Kinds of motion of a vane: each is found by its name, and one of another package by the place of the object too."""

import math
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import ScenarioError
from ppafo.loading import load_scenario
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.motion_kind import MOTIONS, VANE_MOTIONS, is_walk
from ppafo.simulation.numbers import declared_numbers, number_at, path_of_locked_angle, with_numbers
from ppafo.simulation.simulate import simulate

SWAY = """
from dataclasses import replace

from ppafo.model.declaration import Quantity
from ppafo.simulation.motion import PRESCRIBED_MOTION
from ppafo.simulation.motion_kind import MotionSection
from ppafo.simulation.scenario import PrescribedMotion, ProfileChoice

SIZE = (Quantity("size", "rad", "largest angle from 90 deg", 0.1, 0.0, 0.5),)


def read(reading, folder):
    size = reading.number("motion.size", SIZE[0])
    settings = {"level": 1.5707963267948966, "amplitude": size, "frequency": 2.0, "phase": 0.0}
    return PrescribedMotion(ProfileChoice("sine", settings), "swaying:SWAY")


SWAY = replace(
    PRESCRIBED_MOTION,
    name="sway",
    places={"motion.size": ("motion", "profile", "amplitude")},
    section=MotionSection("the ankle sways", SIZE, read),
)
"""


def test_each_kind_of_motion_of_a_vane_has_the_name_by_which_it_is_found_and_a_section() -> None:
    kinds = [MOTIONS[name] for name in VANE_MOTIONS]
    assert [kind.name for kind in kinds] == list(VANE_MOTIONS)
    assert all(kind.section is not None and not is_walk(kind.name) for kind in kinds)


def test_what_is_no_kind_of_motion_is_refused_with_its_type(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "halves.py").write_text(
        "class Half:\n    name = 'half'\n\n    def plan(self, scenario): ...\n\n\nHALF = Half()\n"
    )
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ScenarioError, match="motion 'halves:HALF' is of type Half, not MotionKind"):
        load_scenario("torque-task-proportional", ["motion.kind=halves:HALF"], plugins=["halves.py"])


def test_a_vane_follows_its_reference_and_a_walk_the_torque_that_its_controller_makes() -> None:
    names = ("torque-task-proportional", "step-response", "proportional")
    assert [load_scenario(name).follows_reference for name in names] == [True, False, False]
    assert [load_scenario(name).motion.stride_time > 0.0 for name in names] == [False, False, True]
    assert [path_of_locked_angle(load_scenario(name)) for name in names] == ["motion.angle", None, None]


def test_a_kind_of_another_package_is_read_run_and_varied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "swaying.py").write_text(SWAY)
    monkeypatch.chdir(tmp_path)
    words = ["motion.kind=swaying:SWAY", "motion.size=5 deg", "run.duration=0.5 s"]
    scenario = load_scenario("torque-task-proportional", words, plugins=["swaying.py"])
    recording = simulate(scenario).recording
    assert np.ptp(recording["angle"]) == pytest.approx(math.radians(10.0), rel=1e-3)
    assert "motion.size" in declared_numbers(scenario)
    assert number_at(with_numbers(scenario, {"motion.size": 0.2}), "motion.size") == 0.2
    alone = simulate(scenario).metrics["rms_error"].value
    many = run_ensemble(scenario, {"motion.size": np.array([math.radians(5.0), 0.2])}, ["rms_error"])
    assert many.metrics["rms_error"][0] == pytest.approx(alone, rel=1e-9)
    with pytest.raises(ScenarioError, match=r"motion\.size = '40 deg'|motion\.size=40 deg"):
        load_scenario(
            "torque-task-proportional", ["motion.kind=swaying:SWAY", "motion.size=40 deg"], plugins=["swaying.py"]
        )
