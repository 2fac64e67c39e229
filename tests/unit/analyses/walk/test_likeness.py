"""Likeness of the stride of a neuromuscular gait model to a measured gait: known delays, and the ankle moment."""

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from ppafo.gait.document import load_gait
from ppafo.model.contact import FLAT
from ppafo.walking import load_walk, walk
from ppafo.walking.motion import with_duration
from ppafo.walking.result import WalkResult
from ppafo.walking.strides import PHASES, Curves
from ppafo.wearer.answer import likeness


class Planted:
    """A walk whose mean stride is the measured gait, 3 % late, with an ankle that is 0.1 rad off."""

    def __init__(self) -> None:
        gait, late = load_gait(), np.asarray(PHASES) - 0.03
        assert gait.vertical_force is not None
        force = 80.0 * 9.81 * gait.vertical_force.values_at(late)
        angle = gait.ankle_angle.values_at(PHASES) + 0.1
        self.scenario = load_walk("reacting")
        self.averages = {
            "ground_force": Curves(force, 0.0 * force, "N"),
            "angle": Curves(angle, 0.0 * angle, "rad"),
        }


def test_a_planted_delay_and_a_planted_difference_are_found() -> None:
    found = likeness(cast(WalkResult, cast(Any, Planted())))
    assert set(found) == {"vertical_force", "ankle_angle"}
    force, angle = found["vertical_force"], found["ankle_angle"]
    assert (force.delay, force.delayed_r) == (0.03, pytest.approx(1.0, abs=1e-9))
    assert force.r < 0.999
    assert (angle.delay, angle.r, angle.rms) == (0.0, pytest.approx(1.0), pytest.approx(0.1))


@pytest.mark.long
def test_the_moment_on_the_ankle_is_that_of_the_ground_under_a_flat_foot() -> None:
    """The foot is light: what muscles and device give together, the ground takes at heel and ball."""
    scenario = with_duration(load_walk("reacting", ["wearer.name=healthy-128"]), 6.0)
    record = walk(replace(scenario, run=replace(scenario.run, output_interval=1e-3))).recording
    foot = 0.16 * record["toe_force"] - 0.04 * record["heel_force"]
    given = record["wearer_ankle_moment"] + record["external_torque"]
    flat = (record["contact"] == FLAT) & (record.time > 1.0)
    assert flat.sum() > 500
    assert np.corrcoef(foot[flat], given[flat])[0, 1] > 0.95
    assert float(np.median(given[flat] - foot[flat])) == pytest.approx(0.0, abs=5.0)
