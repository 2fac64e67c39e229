"""The foot in the swing and on its heel, against Lagrange's equations of the leg written here once more."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.run import Run, batch_of, state_row_numbers
from ppafo.engine.scheme.walking import DeviceShare, carried_foot, foot_direction, torque_with_carried
from ppafo.gait import Gait, load_gait
from ppafo.gait.gait import GaitCurve
from ppafo.model import contact as ground
from ppafo.model.gait import gait_at
from ppafo.model.leg import foot_inertia_about_ankle, passive_torque
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.walking.gait_series import heel_rocker, landing_phase, truncate
from ppafo.walking.motion import walk_of
from ppafo.walking.wearer import Wearer, paper_subject


class AnswerFilter:
    """The ankle in the swing from the curves of a gait file: theta'' from the foot's angular momentum about the ankle.

    The foot hangs on an ankle that accelerates with the shank, so its angle alpha over the horizontal obeys
    ``I alpha'' = -m c (a_y + g) cos(alpha) + m c a_x sin(alpha) - torque`` with the torque in plantarflexion.
    """

    def __init__(self, gait: Gait, wearer: Wearer, plate: DeviceShare) -> None:
        self.wearer, self.plate, self.stride = wearer, plate, gait.stride_time
        self.shank = truncate(gait.shank_angle)
        self.healthy = truncate(gait.ankle_angle)
        self.knee = [truncate(gait.curve(name)) for name in ("knee_forward", "knee_up")]
        self.moment = wearer.foot_mass * wearer.foot_mass_centre
        self.inertia = wearer.foot_inertia + self.moment * wearer.foot_mass_centre

    def at(self, curve: Any, phase: float) -> tuple[float, float, float]:
        """Value and two derivatives by time, from differences of the curve."""
        small = 1.0e-4
        before, here, after = (curve.value((phase + way * small) % 1.0) for way in (-1.0, 0.0, 1.0))
        by_time = small * self.stride
        return here, (after - before) / (2.0 * by_time), (after - 2.0 * here + before) / by_time**2

    def without_torque(self, phase: float, angle: float) -> float:
        """Torque [N m] in plantarflexion of which I alpha'' = -(torque + this)."""
        phi, rate, acceleration = self.at(self.shank, phase)
        length = self.wearer.shank_length
        knee_forward, knee_up = (curve.value(phase % 1.0) for curve in self.knee)
        forward = length * (acceleration * math.cos(phi) - rate**2 * math.sin(phi)) + knee_forward
        up = length * (acceleration * math.sin(phi) + rate**2 * math.cos(phi)) + knee_up + 9.80665
        alpha = phi - angle + 0.5 * math.pi
        return self.moment * (up * math.cos(alpha) - forward * math.sin(alpha))

    def tissue(self, angle: float, rate: float) -> float:
        """Torque [N m] of tissue."""
        wearer = self.wearer
        return wearer.ankle_stiffness * (wearer.ankle_rest_angle - angle) - wearer.ankle_damping * rate

    def muscles(self, phase: float) -> float:
        """Torque [N m] that a healthy wearer adds to tissue along the measured ankle in the swing."""
        _, _, shank_acceleration = self.at(self.shank, phase)
        angle, rate, acceleration = self.at(self.healthy, phase)
        turning = self.inertia * (shank_acceleration - acceleration)
        return -turning - self.without_torque(phase, angle) - self.tissue(angle, rate)

    def slopes(self, phase: float, angle: float, rate: float) -> list[float]:
        """Rate and acceleration of the ankle; the foot plate turns in space with the foot and has no weight."""
        _, _, shank_acceleration = self.at(self.shank, phase)
        torque = self.tissue(angle, rate)
        torque += self.wearer.residual_share * self.muscles(phase) - self.plate.viscous_damping * rate
        inertia = self.inertia + self.plate.inertia
        return [rate, shank_acceleration + (torque + self.without_torque(phase, angle)) / inertia]


def swing_of(run: Run, begin_phase: float, steps: int) -> Run:
    """The part of a walk from a phase on, without gas, friction and stops: what is left is the leg."""
    walk = run.walk
    assert walk is not None
    plant = run.plant._replace(
        torque_constant=0.0, static_torque=0.0, dynamic_torque=0.0, angle_min=-9.0, angle_max=9.0
    )
    timing = walk.timing._replace(start=begin_phase)
    begin = gait_at(walk.gait, timing, walk.leg, 0.0)
    initial = run.initial._replace(angle=begin.ankle, angular_velocity=begin.ankle_rate)
    first = walk.initial._replace(contact=ground.SWING, now=begin, foot=foot_direction(begin.shank, begin.ankle))
    return replace(
        run, plant=plant, initial=initial, walk=replace(walk, timing=timing, initial=first), step_count=steps
    )


def worn_by(plan: Scenario, wearer: Wearer) -> Scenario:
    return replace(plan, motion=replace(walk_of(plan), wearer=wearer))


def angles_of(run: Run) -> np.ndarray:
    return run_batch(batch_of(run)).record[:, state_row_numbers(run)["state.angle"], 0]


@pytest.mark.parametrize("share", [0.0, 0.4])
def test_the_free_foot_agrees_with_an_independent_solution(walk_plan: Callable[[str], Any], share: float) -> None:
    from scipy.integrate import solve_ivp

    plan = worn_by(walk_plan("off"), replace(paper_subject(), residual_share=share))
    swing = swing_of(plan_run(plan), walk_of(plan).gait.stance_share, 300)
    assert swing.walk is not None
    angle = angles_of(swing)
    judge = AnswerFilter(walk_of(plan).gait, walk_of(plan).wearer, swing.walk.share)
    times = np.arange(angle.size) * swing.step

    def slopes(time: float, y: np.ndarray) -> list[float]:
        return judge.slopes(walk_of(plan).gait.stance_share + time / walk_of(plan).gait.stride_time, y[0], y[1])

    start = [swing.initial.angle, swing.initial.angular_velocity]
    solution = solve_ivp(slopes, (0.0, times[-1]), start, t_eval=times, rtol=1e-9, atol=1e-11)
    assert np.ptp(solution.y[0]) > 0.1
    assert np.abs(solution.y[0] - angle).max() < 2e-4


def test_a_wearer_with_all_muscles_and_no_device_walks_the_measured_gait(walk_plan: Callable[[str], Any]) -> None:
    plan = worn_by(walk_plan("off"), replace(paper_subject(), residual_share=1.0))
    run = plan_run(plan)
    assert run.walk is not None
    light = replace(run.walk, share=DeviceShare(0.0, 0.0, 0.0))
    bare = run.plant._replace(
        inertia=run.plant.inertia - run.walk.share.inertia,
        viscous_damping=run.walk.leg.ankle_damping,
        torque_constant=0.0,
        static_torque=0.0,
        dynamic_torque=0.0,
    )
    walk = replace(run, walk=light, plant=bare)
    rows = state_row_numbers(walk)
    record = run_batch(batch_of(walk)).record[:, :, 0]
    away = np.abs(record[:, rows["state.angle"]] - record[:, rows["walk.now.ankle"]])
    contact = record[:, rows["walk.contact"]]
    assert np.degrees(away[contact == ground.SWING].max()) < 0.05
    assert np.degrees(away[contact == ground.HEEL].max()) < 1.0
    assert record[-1, rows["walk.toe_landings"]] == 0


def test_the_ground_under_the_heel_turns_the_toes_down(walk_plan: Callable[[str], Any]) -> None:
    walk = plan_run(walk_plan("off")).walk
    assert walk is not None
    for phase in (0.03, 0.06, 0.2):
        now = gait_at(walk.gait, walk.timing._replace(start=phase), walk.leg, 0.0)
        foot = foot_direction(now.shank, now.ankle)
        carried = carried_foot(walk.leg, walk.share, now, foot)
        on_heel, in_air = (
            torque_with_carried(walk.leg, contact, now, walk.timing.ground_angle, now.ankle, carried)
            for contact in (ground.HEEL, ground.SWING)
        )
        # No more than the whole force at the heel.
        assert 0.0 < on_heel - in_air < 0.05 * now.force


def test_before_the_foot_is_flat_the_ground_gives_what_was_measured(walk_plan: Callable[[str], Any]) -> None:
    walk = plan_run(walk_plan("off")).walk
    assert walk is not None
    for phase in (0.03, 0.05, 0.07):
        now = gait_at(walk.gait, walk.timing._replace(start=phase), walk.leg, 0.0)
        given = ground.heel_torque(ground.HEEL, now, walk.leg, walk.timing.ground_angle, now.ankle)
        assert given == pytest.approx(now.healthy_torque - now.moment)


def test_a_loaded_heel_pulls_a_raised_foot_down_harder_than_the_device_can_hold(
    walk_plan: Callable[[str], Any],
) -> None:
    walk = plan_run(walk_plan("off")).walk
    assert walk is not None
    level = walk.timing.ground_angle
    for phase in (0.12, 0.15, 0.2):
        now = gait_at(walk.gait, walk.timing._replace(start=phase), walk.leg, 0.0)
        flat = now.shank + 0.5 * math.pi - level
        torques = [ground.heel_torque(ground.HEEL, now, walk.leg, level, flat - tilt) for tilt in (0.0, 0.05, 0.1, 0.2)]
        assert torques[0] > 5.5
        assert torques == sorted(torques)
        assert torques[-1] - torques[0] > 2.0


@pytest.mark.parametrize("measured", ["moment", "centre of pressure", "nothing"])
def test_the_lever_of_the_ground_is_bounded_by_the_heel_whatever_was_measured(measured: str) -> None:
    gait, wearer = load_gait("falisse2019-subject1"), paper_subject()
    if measured != "moment":
        gait = replace(gait, ankle_moment=None)
    if measured == "centre of pressure":
        # It runs from 4 cm behind the ankle to the ankle while the foot comes down.
        gait = replace(gait, centre_of_pressure=GaitCurve(0.0, (-0.04,), (0.0,)))
    rocker = heel_rocker(gait, wearer)
    assert 0.0 <= rocker.flat <= rocker.raised <= wearer.heel_lever
    assert rocker.half > 0.0
    if measured == "centre of pressure":
        assert rocker.flat == pytest.approx(0.04 * math.cos(2.0 * math.pi * landing_phase(gait)))


def test_the_weight_of_the_foot_plate_pulls_the_toes_down(walk_plan: Callable[[str], Any]) -> None:
    walk = plan_run(walk_plan("off")).walk
    assert walk is not None
    # The ankle of a flat foot rests, so the plate weighs as much as it does on a bench.
    now = gait_at(walk.gait, walk.timing._replace(start=0.3), walk.leg, 0.0)
    level = foot_direction(0.0, 0.5 * math.pi)
    heavy, light = (
        torque_with_carried(
            walk.leg,
            ground.SWING,
            now,
            0.0,
            1.5,
            carried_foot(walk.leg, DeviceShare(0.0, 0.0, moment), now, level),
        )
        for moment in (0.2, 0.0)
    )
    assert heavy - light == pytest.approx(0.2 * walk.leg.gravity, rel=0.1)


def test_a_foot_plate_is_carried_along_like_a_foot_of_its_mass_and_inertia(walk_plan: Callable[[str], Any]) -> None:
    walk = plan_run(walk_plan("off")).walk
    assert walk is not None
    leg = walk.leg._replace(residual_share=0.0)
    moment = leg.foot_mass * leg.foot_mass_centre
    for phase in (0.66, 0.8, 0.95):
        now = gait_at(walk.gait, walk.timing._replace(start=phase), leg, 0.0)
        foot = foot_direction(now.shank, now.ankle + 0.2)
        shares = DeviceShare(0.0, 0.0, 0.0), DeviceShare(foot_inertia_about_ankle(leg), 0.0, moment)
        bare, twice = (
            torque_with_carried(leg, ground.SWING, now, 0.0, now.ankle + 0.2, carried_foot(leg, share, now, foot))
            for share in shares
        )
        assert twice - bare == pytest.approx(bare - passive_torque(leg, now.ankle + 0.2))
