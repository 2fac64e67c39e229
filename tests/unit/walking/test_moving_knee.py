"""The moving knee: what it changes in the engine, and whether the measured ankle moment agrees with it."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.rows import leaves
from ppafo.engine.run import batch_of, state_row_numbers
from ppafo.engine.scheme.walking import foot_direction, torque_of_body_on_foot
from ppafo.gait import Gait, load_gait
from ppafo.gait.gait import GaitCurve
from ppafo.model.contact import SWING
from ppafo.model.gait import gait_at
from ppafo.model.leg import LegParameters, foot_inertia_about_ankle, foot_load
from ppafo.signals.recording import Floats
from ppafo.simulation.plan import plan_run
from ppafo.walking.gait_series import gait_series, gait_timing
from ppafo.walking.motion import walk_of
from ppafo.walking.wearer import paper_subject

NOTHING = (0.0,)


def constant(level: float) -> GaitCurve:
    return GaitCurve(level, NOTHING, NOTHING)


def swung(plan: Any, forward: float, up: float) -> tuple[Any, Callable[[str], Floats]]:
    """A free foot without gas, friction, damping and stops after toe-off; the knee accelerates [m/s^2]."""
    gait = replace(walk_of(plan).gait, knee_forward=constant(forward), knee_up=constant(up))
    run = plan_run(replace(plan, motion=replace(walk_of(plan), gait=gait)))
    walk = run.walk
    assert walk is not None
    plant = run.plant._replace(
        torque_constant=0.0,
        static_torque=0.0,
        dynamic_torque=0.0,
        viscous_damping=0.0,
        angle_min=-9.0,
        angle_max=9.0,
    )
    timing = walk.timing._replace(start=walk.timing.toe_off)
    begin = gait_at(walk.gait, timing, walk.leg, 0.0)
    first = walk.initial._replace(contact=SWING, now=begin, foot=foot_direction(begin.shank, begin.ankle))
    initial = run.initial._replace(angle=begin.ankle, angular_velocity=begin.ankle_rate)
    moved = replace(walk, timing=timing, initial=first)
    swing = replace(run, plant=plant, initial=initial, walk=moved, step_count=10)
    rows, record = state_row_numbers(swing), run_batch(batch_of(swing)).record
    return swing, lambda name: record[:, rows[name], 0]


@pytest.mark.parametrize(("forward", "up"), [(8.0, 0.0), (0.0, 6.0), (-5.0, -4.0)])
def test_a_knee_that_accelerates_turns_the_free_foot_as_equation_11_says(
    walk_plan: Callable[[str], Any], forward: float, up: float
) -> None:
    run, with_knee = swung(walk_plan("off"), forward, up)
    _, without = swung(walk_plan("off"), 0.0, 0.0)
    # The ankle carries the foot along: a force on its mass centre, against the acceleration.
    lever = run.walk.leg.foot_mass * run.walk.leg.foot_mass_centre
    torque = lever * (up * with_knee("walk.foot.cosine") - forward * with_knee("walk.foot.sine"))
    gained = np.trapezoid(torque, dx=run.step * run.record_every) / run.plant.inertia
    assert abs(gained) > 0.05
    speeds = [found("state.angular_velocity")[-1] for found in (with_knee, without)]
    assert speeds[0] - speeds[1] == pytest.approx(gained, rel=0.02)


def test_a_gait_without_a_knee_leaves_it_at_rest() -> None:
    gait = replace(load_gait(), knee_forward=None, knee_up=None)
    assert set(leaves(gait_series(gait).knee_forward)) == set(leaves(gait_series(gait).knee_up)) == {0.0}
    moving = gait_series(load_gait())
    assert moving.knee_up.harmonics[2].cosine == load_gait().curve("knee_up").cosines[2]
    assert moving.knee_forward.harmonics[6].sine == 0.0


SUBJECT = (
    paper_subject().leg()._replace(shank_length=0.4157, foot_mass=1.1763, foot_mass_centre=0.0582, foot_inertia=0.00511)
)
"""Shank and foot of the gait's own subject: talus, calcaneus and toes of the authors' scaled model together, with the
mass centre forward of the ankle (github.com/antoinefalisse/3dpredictsim, ExternalFunctions/PredSim.cpp)."""


def needed_moment(gait: Gait, leg: LegParameters, phases: Floats) -> Floats:
    """Moment [N m] that moves the foot in the swing as measured: the ankle's row of equation (11)."""
    series, timing = gait_series(gait), gait_timing(gait)
    found = []
    for phase in phases.tolist():
        now = gait_at(series, timing, leg, phase * gait.stride_time)
        foot = foot_direction(now.shank, now.ankle)
        carried = torque_of_body_on_foot(foot_load(leg), now, foot)
        found.append(carried + foot_inertia_about_ankle(leg) * now.ankle_acceleration)
    return np.array(found)


def test_the_knee_brings_the_free_foot_to_the_moment_that_was_measured() -> None:
    gait = load_gait()
    phases = np.linspace(0.68, 0.95, 109)
    measured = gait.body_mass * gait.curve("ankle_moment").values_at(phases)
    knee = {"knee_forward": gait.knee_forward, "knee_up": gait.knee_up}
    tried = {
        "at rest": dict.fromkeys(knee),
        "moving": knee,
        "backwards": knee | {"knee_forward": gait.curve("knee_forward").scale(-1.0)},
        "down": knee | {"knee_up": gait.curve("knee_up").scale(-1.0)},
    }
    error = {
        how: float(np.sqrt(np.mean((needed_moment(replace(gait, **curves), SUBJECT, phases) - measured) ** 2)))
        for how, curves in tried.items()
    }
    assert error["moving"] < 0.25
    assert error["moving"] < 0.5 * error["at rest"]
    assert min(error["backwards"], error["down"]) > 2.0 * error["moving"]
