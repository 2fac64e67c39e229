"""Motions of a walk: found by name, and those of another package by the place of the object."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import ScenarioError
from ppafo.loading import load_scenario
from ppafo.walking import load_walk, walk

OF_ANOTHER_PACKAGE = """
from dataclasses import replace

from ppafo.walking.kind import WALK_KIND

SLOW = replace(WALK_KIND, name="slow")
"""


def test_a_kind_of_another_package_plans(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "slow_motion.py").write_text(OF_ANOTHER_PACKAGE)
    monkeypatch.chdir(tmp_path)
    given = ["run.duration=6 s"]
    other = load_scenario("proportional", [*given, "motion.kind=slow_motion:SLOW"], plugins=["slow_motion.py"])
    assert other.motion.motion_kind.name == "slow"
    angles = [walk(scenario).recording["angle"] for scenario in (other, load_walk("proportional", given))]
    assert np.array_equal(*angles)


def test_a_shipped_scenario_without_a_walk_is_told_from_a_name_that_is_unknown() -> None:
    with pytest.raises(ScenarioError, match=r"'locked': .*give 'ppafo export opensim' the result folder"):
        load_walk("torque-task-solenoid")
    with pytest.raises(ScenarioError, match="there is no walk 'torque-task-other'"):
        load_walk("torque-task-other")
