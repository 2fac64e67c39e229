"""The gait in a task sequence: continuous at knots, upright and flat in standing, that of the file at its own speed."""

import itertools
import math

import numpy as np
import pytest

from ppafo.gait import load_gait
from ppafo.model.contact import foot_angle
from ppafo.model.gait import (
    SCUFF_FORCE,
    STANDS_AT,
    GaitNow,
    TimedSequence,
    gait_at,
    gait_in_task_sequence,
    pace_in,
    part_at,
)
from ppafo.walking.gait_series import gait_series, gait_timing
from ppafo.walking.planning import planned_task_sequence
from ppafo.walking.task_sequence import FILE, TaskSegment, TaskSequence, load_task_sequence
from ppafo.walking.task_sequence_plan import PlannedSequence, pace_in_time, turns_walked
from ppafo.walking.wearer import paper_subject

GAIT = load_gait("falisse2019-subject1")
SERIES, TIMING, LEG = gait_series(GAIT), gait_timing(GAIT), paper_subject().leg()
ANGLES = ("shank", "ankle")
MOVING = [f"{name}{of}" for name in ANGLES for of in ("", "_rate", "_acceleration")]


def sequence_of(*segments: tuple[str, dict[str, float]]) -> PlannedSequence:
    listed = tuple(TaskSegment(kind, values) for kind, values in segments)
    return planned_task_sequence(TaskSequence("tried", "", listed, "tried.toml"), GAIT)


def at(sequence: TimedSequence, time: float) -> GaitNow:
    return gait_in_task_sequence(SERIES, sequence, TIMING, LEG, time)[0]


@pytest.mark.parametrize("name", FILE.names())
def test_angles_rates_and_accelerations_are_continuous_at_every_knot(name: str) -> None:
    sequence = planned_task_sequence(load_task_sequence(name), GAIT).timed
    knots = [part.start for part in sequence.parts if 0.0 < part.start < 1.0e5]
    assert len(knots) > 5
    for knot in knots:
        before, after = at(sequence, knot - 1.0e-9), at(sequence, knot)
        for value in (*MOVING, "force", "healthy_torque"):
            assert getattr(after, value) == pytest.approx(getattr(before, value), abs=2.0e-5), (knot, value)


@pytest.mark.parametrize("name", FILE.names())
def test_phase_and_strides_per_second_are_continuous_at_every_knot(name: str) -> None:
    sequence = planned_task_sequence(load_task_sequence(name), GAIT).timed
    parts = [part for part in sequence.parts if part.start < 1.0e5]
    for part, after in itertools.pairwise(parts):
        ends, begins = pace_in(part, after.start), pace_in(after, after.start)
        assert begins[:6] == pytest.approx(ends[:6], abs=1.0e-9)


@pytest.mark.parametrize("name", FILE.names())
def test_rates_and_accelerations_are_the_derivatives_of_the_angles(name: str) -> None:
    sequence = planned_task_sequence(load_task_sequence(name), GAIT).timed
    moments, step = np.random.default_rng(1).uniform(0.01, 45.0, 1500), 1.0e-3
    for moment in moments:
        before, now, after = (at(sequence, moment + by) for by in (-step, 0.0, step))
        for angle in ANGLES:
            rate, acceleration = (
                (getattr(after, f"{angle}{of}") - getattr(before, f"{angle}{of}")) / (2.0 * step)
                for of in ("", "_rate")
            )
            assert rate == pytest.approx(getattr(now, f"{angle}_rate"), abs=2.0e-3), moment
            assert acceleration == pytest.approx(getattr(now, f"{angle}_acceleration"), abs=0.2), moment


def test_a_person_stands_upright_with_a_flat_foot_and_half_of_the_weight_on_it() -> None:
    sequence = sequence_of(("stand", {"duration": 2.0})).timed
    for time in (0.0, 1.0, 1.999):
        now = at(sequence, time)
        assert now.shank == 0.0
        assert foot_angle(now.shank, now.ankle) == pytest.approx(TIMING.ground_angle, abs=1.0e-12)
        assert (now.shank_rate, now.ankle_rate, now.shank_acceleration, now.ankle_acceleration) == (0.0, 0.0, 0.0, 0.0)
        assert now.force == pytest.approx(0.5 * LEG.body_mass * LEG.gravity)
        assert now.phase == pytest.approx(STANDS_AT * TIMING.heel_off)


def test_at_the_speed_of_the_gait_it_is_the_gait() -> None:
    planned = sequence_of(("walk", {"strides": 5.0}))
    sequence = planned.timed
    for time in np.linspace(float(planned.steady[0][0]), float(planned.steady[0][1]), 50):
        now = at(sequence, time)
        plain = gait_at(SERIES, TIMING, LEG, now.phase / TIMING.frequency)
        assert now[1:] == pytest.approx(plain[1:], rel=1.0e-6, abs=1.0e-6)


def test_a_slower_walk_has_fewer_and_shorter_strides_by_the_same_factor() -> None:
    planned = sequence_of(("walk", {"speed": 0.8, "strides": 4.0}))
    ratio = math.sqrt(0.8 / 1.33)
    start, end = planned.steady[0]
    pace = pace_in(part_at(planned.timed, 0.5 * (start + end)), 0.5 * (start + end))
    assert pace.frequency == pytest.approx(ratio * TIMING.frequency)
    assert pace.stride == pytest.approx(ratio)
    time = np.linspace(start, end, 500)
    swing = np.ptp([at(planned.timed, moment).shank for moment in time])
    usual = np.ptp([gait_at(SERIES, TIMING, LEG, moment).shank for moment in np.linspace(0.0, 1.1, 500)])
    assert swing == pytest.approx(ratio * usual, rel=1.0e-3)


def test_on_stairs_the_healthy_toes_are_down_at_the_strike_and_on_level_ground_they_are_up() -> None:
    planned = sequence_of(("walk", {"strides": 3.0}), ("stairs", {"strides": 4.0}))
    time = np.arange(0.0, float(planned.duration), 1.0e-3)
    turns, _, _ = pace_in_time(planned.timed, time)
    strikes = time[np.flatnonzero(np.diff(np.floor(turns))) + 1]
    tilts = [foot_angle(now.shank, now.ankle) - TIMING.ground_angle for now in (at(planned.timed, t) for t in strikes)]
    assert len(tilts) == 7
    assert min(tilts[1:3]) > math.radians(10.0)
    assert max(tilts[4:]) < math.radians(-9.0)


def test_on_a_slope_the_shank_keeps_its_angle_to_the_vertical_and_the_ankle_takes_the_slope_up() -> None:
    slope = math.radians(6.0)
    uphill = sequence_of(
        ("walk", {"strides": 3.0}), ("walk", {"strides": 4.0, "slope": slope}), ("stop", {"strides": 1.0})
    )
    level = sequence_of(("walk", {"strides": 7.0}), ("stop", {"strides": 1.0}))
    assert len(uphill.steady) == 1, "strides on a slope are not those of level walking"
    settled, end = [part.start for part in uphill.timed.parts if part.slope == slope]
    for time in np.linspace(settled, end - 1.0e-6, 40):
        now, plain = at(uphill.timed, time), at(level.timed, time)
        assert now.phase == pytest.approx(plain.phase, abs=1.0e-9)
        assert now.ankle == pytest.approx(plain.ankle - slope)
        assert foot_angle(now.shank, now.ankle) == pytest.approx(foot_angle(plain.shank, plain.ankle))
        assert now.ankle_rate == pytest.approx(plain.ankle_rate)
    assert at(uphill.timed, float(uphill.duration) + 1.0).ankle == pytest.approx(math.pi / 2.0 - TIMING.ground_angle)
    for knot in (part.start for part in uphill.timed.parts if 0.0 < part.start < 1.0e5):
        before, after = at(uphill.timed, knot - 1.0e-9), at(uphill.timed, knot)
        for value in MOVING:
            assert getattr(after, value) == pytest.approx(getattr(before, value), abs=2.0e-5), (knot, value)
    for moment in np.linspace(0.1, float(uphill.duration), 400):
        before, now, after = (at(uphill.timed, moment + by) for by in (-1.0e-3, 0.0, 1.0e-3))
        for name in ANGLES:
            rate = (getattr(after, name) - getattr(before, name)) / 2.0e-3
            assert rate == pytest.approx(getattr(now, f"{name}_rate"), abs=2.0e-3)


@pytest.mark.parametrize(("radius", "shorter"), [(0.5, 0.9), (-0.5, 1.1), (2.0, 0.975)])
def test_in_a_turn_the_inner_leg_takes_shorter_steps(radius: float, shorter: float) -> None:
    planned = sequence_of(("walk", {"strides": 3.0}), ("turn", {"strides": 4.0, "radius": radius}))
    assert len(planned.steady) == 1
    last = planned.timed.parts[3]
    assert (last.stride, last.stride_gain) == pytest.approx((shorter, 0.0))
    assert last.frequency == pytest.approx(TIMING.frequency)


def test_a_scuff_loads_the_toes_for_its_time_in_one_swing() -> None:
    planned = sequence_of(("walk", {"strides": 2.0}), ("scuff", {"contact": 0.04}), ("walk", {"strides": 2.0}))
    time = np.arange(0.0, float(planned.duration), 1.0e-4)
    force = np.array(
        [gait_in_task_sequence(SERIES, planned.timed, TIMING, LEG, moment)[1].scuff_force for moment in time]
    )
    assert np.count_nonzero(force) * 1.0e-4 == pytest.approx(0.04, abs=2.0e-4)
    assert np.ptp(np.flatnonzero(force)) * 1.0e-4 < 0.041
    assert force.max() == SCUFF_FORCE * LEG.body_mass * LEG.gravity
    scuffed = at(planned.timed, float(time[np.argmax(force)]))
    assert TIMING.clearance_from < scuffed.phase < TIMING.clearance_to


def test_a_stumble_takes_one_stride_of_its_time() -> None:
    planned = sequence_of(
        ("walk", {"strides": 2.0}), ("stumble", {"time": 0.75, "length": 0.6}), ("walk", {"strides": 2.0})
    )
    stumble = planned.spans[1]
    assert stumble.end - stumble.start == pytest.approx(0.75 * GAIT.stride_time)
    times = np.array([stumble.start, 0.5 * (stumble.start + stumble.end), stumble.end])
    _, _, stride = pace_in_time(planned.timed, times)
    assert stride == pytest.approx([1.0, 0.6, 1.0])


@pytest.mark.parametrize("name", FILE.names())
def test_arrays_of_times_and_single_times_agree(name: str) -> None:
    sequence = planned_task_sequence(load_task_sequence(name), GAIT).timed
    time = np.linspace(0.0, 60.0, 301)
    turns, _, stride = pace_in_time(sequence, time)
    single = [pace_in(part_at(sequence, moment), moment) for moment in time]
    assert turns == pytest.approx([item.turns for item in single], abs=1.0e-9)
    assert stride == pytest.approx([item.stride for item in single], abs=1.0e-12)
    walked = [turns_walked(sequence, float(moment)) for moment in time]
    assert turns - sequence.parts[0].turns == pytest.approx(walked, abs=1.0e-9)
