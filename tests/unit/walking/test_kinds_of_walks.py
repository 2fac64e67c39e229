"""Kinds of motion of a walk: found by name, and those of another package, by the place of the object too."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import ScenarioError
from ppafo.loading import load_scenario
from ppafo.simulation.motion_kind import MOTIONS
from ppafo.walking import load_walk, walk

OF_ANOTHER_PACKAGE = """
from dataclasses import replace

from ppafo.walking.led import WALK_KIND

SLOW = replace(
    WALK_KIND, name="slow", walk=replace(WALK_KIND.walk, name="slow", label=lambda motion: "a walk of another package")
)
"""


def test_each_kind_of_walk_has_the_name_by_which_it_is_found() -> None:
    assert [(MOTIONS[name].name, MOTIONS[name].walk.name) for name in ("walk", "react")] == [
        ("walk", "walk"),
        ("react", "react"),
    ]


def test_a_kind_of_another_package_plans_and_says_what_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "slow_motion.py").write_text(OF_ANOTHER_PACKAGE)
    monkeypatch.chdir(tmp_path)
    given = ["run.duration=6 s"]
    other = load_scenario("proportional", [*given, "motion.kind=slow_motion:SLOW"])
    assert other.motion.label == "a walk of another package"
    angles = [walk(scenario).recording["angle"] for scenario in (other, load_walk("proportional", given))]
    assert np.array_equal(*angles)


def test_a_kind_that_is_not_there_is_refused_with_those_that_are() -> None:
    with pytest.raises(ScenarioError, match=r"motion\.kind=reakt' is not known, did you mean 'react'"):
        load_walk("proportional", ["motion.kind=reakt"])


def test_the_old_key_says_what_to_write() -> None:
    with pytest.raises(ScenarioError, match=r'is now motion\.kind = "react" and wearer\.name = "geyer-herr"'):
        load_walk("proportional", ["wearer.reacts=geyer-herr"])


def test_the_motion_of_a_vane_is_none_of_a_walk() -> None:
    with pytest.raises(ScenarioError, match="this is the file of a walk"):
        load_walk("proportional", ["motion.kind=free"])


def test_another_motion_in_a_layer_above_drops_the_numbers_of_the_wearer_before() -> None:
    weak = ["wearer.tibialis_strength=0.1"]
    with pytest.raises(ScenarioError, match=r"wearer\.tibialis_strength=0\.1' and 'motion\.kind=walk'"):
        load_walk("reacting", [*weak, "motion.kind=walk"])
