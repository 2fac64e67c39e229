"""The leg on the ground and in the swing, with and without the device."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ppafo.model import contact as ground
from ppafo.simulation.plan import plan_run
from ppafo.walking.motion import walk_of

CONTROLLERS = ("off", "event_on_off", "event_proportional")


@pytest.mark.parametrize("name", CONTROLLERS)
def test_contacts_follow_each_other_in_every_stride(walked: Callable[[str], Any], name: str) -> None:
    contact = walked(name)["walk.contact"]
    assert set(np.unique(contact)) == {ground.SWING, ground.HEEL, ground.FLAT, ground.TOE}
    changes = [int(value) for value in contact[np.flatnonzero(np.diff(contact)) + 1]]
    turn = [int(ground.FLAT), int(ground.TOE), int(ground.SWING), int(ground.HEEL)]
    assert changes == [turn[index % 4] for index in range(len(changes))]
    assert len(changes) > 4 * 6


@pytest.mark.parametrize("name", CONTROLLERS)
def test_the_ankle_does_not_jump_at_a_hand_over(walked: Callable[[str], Any], name: str) -> None:
    walk = walked(name)
    speed = np.abs(walk["state.angular_velocity"])
    jump = np.abs(np.diff(walk["state.angle"]))
    assert jump.max() < 1.5e-3 * max(speed.max(), 1.0)


def test_a_flat_foot_stands_still_on_the_ground(walked: Callable[[str], Any]) -> None:
    walk = walked("event_on_off")
    settled = (walk["walk.contact"] == ground.FLAT) & (np.abs(walk["walk.offset"]) < 1e-6)
    foot = walk["walk.now.shank"] - walk["state.angle"] + 0.5 * math.pi
    assert settled.sum() > 500
    np.testing.assert_allclose(foot[settled], walk.run.walk.timing.ground_angle, atol=1e-5)


def test_on_the_toes_the_ankle_follows_the_measured_gait(walked: Callable[[str], Any]) -> None:
    walk = walked("off")
    settled = (walk["walk.contact"] == ground.TOE) & (np.abs(walk["walk.offset"]) < 1e-5)
    assert settled.sum() > 300
    np.testing.assert_allclose(walk["state.angle"][settled], walk["walk.now.ankle"][settled], atol=2e-5)


def test_a_drop_foot_hangs_without_the_device_and_is_lifted_with_it(walked: Callable[[str], Any]) -> None:
    late_swing = {}
    for name in CONTROLLERS:
        walk = walked(name)
        phase = walk["walk.now.phase"]
        chosen = (phase > 0.85) & (phase < 0.97) & (walk.time > 2.0)
        late_swing[name] = math.degrees(float(np.mean(walk["state.angle"][chosen])))
    assert late_swing["off"] > 105.0
    assert late_swing["event_on_off"] < 100.0
    assert late_swing["event_proportional"] < 100.0
    lowest = {name: walked(name)["walk.clearances"][-1] / walked(name)["walk.strides"][-1] for name in CONTROLLERS}
    assert lowest["off"] < -0.1
    assert min(lowest["event_on_off"], lowest["event_proportional"]) > -0.05


def test_the_device_gives_work_in_push_off_and_uses_gas(walked: Callable[[str], Any]) -> None:
    off = walked("off")
    assert off["walk.net_push_off_work"][-1] < 0.0 <= off["walk.positive_push_off_work"][-1]
    gain, net = np.diff(off["walk.positive_push_off_work"]), np.diff(off["walk.net_push_off_work"])
    np.testing.assert_allclose(gain[net >= 0.0], net[net >= 0.0], atol=1e-12)
    assert (gain >= 0.0).all()
    assert gain.sum() > net.sum() + 1.0, "the friction of a vented device brakes"
    assert walked("off")["state.supplied_mass"][-1] == 0.0
    for name in ("event_on_off", "event_proportional"):
        assert walked(name)["walk.net_push_off_work"][-1] > 0.5
        assert walked(name)["state.supplied_mass"][-1] > 1e-3


def test_metrics_at_one_kilohertz_are_within_two_per_cent(walk_plan: Callable[[str], Any]) -> None:
    from ppafo.engine.lanes import run_batch
    from ppafo.engine.run import batch_of, state_row_numbers

    for name in ("event_on_off", "event_proportional"):
        found = []
        for step in (1.0e-3, 5.0e-5):
            plan = walk_plan(name)
            run = plan_run(replace(plan, run=replace(plan.run, step=step)))
            rows = state_row_numbers(run)
            states = run_batch(batch_of(run)).states[:, 0]
            names = ("walk.positive_push_off_work", "walk.net_push_off_work", "state.supplied_mass")
            found.append([states[rows[item]] for item in names])
        np.testing.assert_allclose(found[0], found[1], rtol=0.02)


def test_a_dead_time_of_the_valve_delays_the_pressure(walk_plan: Callable[[str], Any]) -> None:
    from ppafo.engine.lanes import run_batch
    from ppafo.engine.run import batch_of, state_row_numbers

    plan = walk_plan("event_proportional")
    seen = {}
    for delay in (0.0, 0.0304):
        valve = replace(plan.device.valve, settings={**plan.device.valve.settings, "delay": delay})
        device = replace(plan.device, valve=valve)
        run = plan_run(replace(plan, device=device, run=replace(plan.run, duration=3.0)))
        rows = state_row_numbers(run)
        record = run_batch(batch_of(run)).record[:, :, 0]
        loaded = record[:, rows["state.supplied_mass"]] > 1e-6
        seen[delay] = float(np.flatnonzero(loaded)[0]) * run.step * run.record_every
    assert 0.028 < seen[0.0304] - seen[0.0] < 0.036


def test_a_foot_that_comes_first_with_its_toes_loads_them(
    walked: Callable[[str], Any], walk_plan: Callable[[str], Any]
) -> None:
    plan = walk_plan("off")
    # An equinus foot: stiff tissue that rests in plantarflexion.
    wearer = replace(walk_of(plan).wearer, ankle_stiffness=20.0, ankle_rest_angle=2.2)
    lifted = walked("event_on_off")
    stiff = type(lifted)(plan_run(replace(plan, motion=replace(walk_of(plan), wearer=wearer))))
    assert stiff["walk.toe_landings"][-1] >= 6
    assert lifted["walk.toe_landings"][-1] == 0
    early = {walk: (walk["walk.now.phase"] < 0.05) & (walk.time > 2.0) for walk in (stiff, lifted)}
    assert np.max((stiff["walk.heel_force"] - 0.5 * stiff["walk.toe_force"])[early[stiff]]) < 10.0
    assert np.max(lifted["walk.toe_force"][early[lifted]]) < 10.0
