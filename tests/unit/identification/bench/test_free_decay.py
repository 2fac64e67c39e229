"""Free decay: the course of equation (1), planted damping and friction, and an inertia that may be unknown."""

import math

import numpy as np
import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.bench.free_decay import Slowing, course
from ppafo.identification.source import RecordingSource
from ppafo.identification.tolerances import Tolerances
from tests.unit.identification import planted
from tests.unit.identification.planted import free_decay


def test_the_course_is_that_of_the_closed_form_and_ends_at_rest() -> None:
    time = np.linspace(0.0, 8.0, 801)
    swept, speed = course(time, 3.0, Slowing(0.7, 0.5))
    assert np.allclose(swept, planted.angle_of_decay(time, 0.0, 3.0, 0.7, 0.5), atol=1e-6)
    assert np.allclose(speed, np.gradient(swept, time), atol=0.02)
    assert speed[-1] == pytest.approx(0.0, abs=1e-9)


def test_friction_that_rises_near_standstill_satisfies_the_equation_of_motion() -> None:
    time = np.linspace(0.0, 2.0, 20001)
    swept, _ = course(time, 3.0, Slowing(0.7, 0.5, 4.0, 0.3))
    speed = np.gradient(swept, time)
    slope = np.gradient(speed, time)
    moving = (speed > 0.05) & (time > 0.001)
    law = -0.7 * speed - 0.5 * (1.0 + 4.0 / (1.0 + (speed / 0.3) ** 2))
    assert np.allclose(slope[moving], law[moving], atol=0.01)


def test_a_decay_without_damping_or_without_friction_stays_finite() -> None:
    time = np.linspace(0.0, 4.0, 50)
    assert course(time, 3.0, Slowing(0.0, 0.5))[0][10] == pytest.approx(3.0 * time[10] - 0.25 * time[10] ** 2, rel=1e-6)
    assert course(time, 3.0, Slowing(1.0, 0.0))[0][10] == pytest.approx(3.0 * (1.0 - np.exp(-time[10])), rel=1e-5)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_planted_damping_and_friction_lie_inside_their_intervals(sign: float) -> None:
    result = free_decay(
        (planted.decay(sign=sign),),
        inertia="8.4 g m^2",
        rise=0.0,
        tolerances=Tolerances(gain=0.0, held=0.0),
    )
    for path, ratio in (
        ("friction.viscous_damping", planted.DAMPING_RATE),
        ("friction.dynamic_torque", planted.DECELERATION),
    ):
        assert result[path].low <= 8.4e-3 * ratio <= result[path].high
        assert result[path].wider_half_width < 0.03 * result[path].value
    assert result.conflict == ""


def test_intervals_hold_in_about_the_stated_share_of_recordings() -> None:
    found = [free_decay((planted.decay(seed=seed),), rise=0.0)["free_decay.damping_over_inertia"] for seed in range(20)]
    assert sum(item.low <= planted.DAMPING_RATE <= item.high for item in found) >= 17


def test_several_impulses_share_one_damping() -> None:
    path = "free_decay.damping_over_inertia"
    one = free_decay((planted.decay(seed=1),), rise=0.0)[path]
    three = free_decay(tuple(planted.decay(seed=seed) for seed in (1, 2, 3)), rise=0.0)[path]
    assert three.wider_half_width < 0.8 * one.wider_half_width
    assert len(three.recordings) == 3


def test_an_unknown_inertia_leaves_only_ratios_and_says_so() -> None:
    result = free_decay((planted.decay(),), rise=0.0)
    assert [item.path.partition(".")[0] for item in result.estimates] == ["free_decay", "free_decay"]
    assert "inertia is unknown" in result.summary


def test_an_uncertain_inertia_widens_what_depends_on_it() -> None:
    known = Tolerances(held=0.1)
    damping = free_decay((planted.decay(),), "8.4 g m^2", 0.0, known)["friction.viscous_damping"]
    assert damping.wider_half_width / damping.value == pytest.approx(0.1 / np.sqrt(3.0) * 1.96, rel=0.05)
    assert "inertia" in damping.explanation


def test_a_seal_that_grips_near_standstill_does_not_move_damping_out_of_its_interval() -> None:
    time = np.arange(0.0, 4.0, 0.005)
    swept, _ = course(time, 6.0, Slowing(3.8, 1.3, 35.0, 0.05))
    angle = 0.4 + swept + np.random.default_rng(4).normal(0.0, 2e-3, time.size)
    source = planted.source("grips", time, angle=(angle, "rad"))
    narrow, wide = (free_decay((source,), start="0 s", rise=rise) for rise in (0.0, 40.0))
    found = wide["free_decay.friction_over_inertia"]
    assert found.low <= 1.3 <= found.high
    missed = narrow["free_decay.friction_over_inertia"]
    assert narrow.conflict or not missed.low <= 1.3 <= missed.high
    # Within 0.05 rad/s of 6 rad/s the rise would be an upright line on the axis of the figure.
    assert "fit near rest" not in [mark.label for mark in wide.panels[1].marks]


def test_gravity_holds_for_this_model_only() -> None:
    time = np.arange(0.0, 1.2, 0.005)
    noise = np.random.default_rng(1).normal(0.0, 1e-3, time.size)
    swing = planted.source("swing", time, angle=(0.6 * np.exp(-0.2 * time) * np.sin(1.2 * time) + noise, "rad"))
    assert free_decay((swing,), start="0 s", rise=0.0).conflict


def swing_on_a_spring(
    stiffness: float, duration: float, dynamic: float = 0.03, static: float = 0.03, noise: float = 0.05
) -> RecordingSource:
    """A vane of 8.4 g m^2 released at 30 deg on a spring, with 20 g m^2/s and two frictions [N m], read with noise.

    Friction falls to its dynamic value at some 0.05 rad/s; where a swing ends within static friction the vane rests.
    """
    time, step = np.arange(0.0, duration, 1e-3), 5e-5
    at, rate, swing = math.pi / 6.0, 0.0, np.empty(time.size)
    for number in range(20 * time.size):
        if number % 20 == 0:
            swing[number // 20] = at
        friction = dynamic + (static - dynamic) / (1.0 + (rate / 0.05) ** 2)
        against = math.copysign(friction, rate or -at)
        after = rate - step * (stiffness * at + 20e-3 * rate + against) / 8.4e-3
        if after * rate < 0.0 or rate == 0.0:
            after = 0.0 if abs(stiffness * at) <= static else after
        at, rate = at + 0.5 * step * (rate + after), after
    random = np.random.default_rng(7).normal(0.0, math.radians(noise), time.size)
    return planted.source("spring.csv", time, angle=(0.5 * math.pi + swing + random, "rad"))


@pytest.mark.parametrize(("stiffness", "duration"), [(2.0, 3.0), (0.5, 3.0), (2.0, 12.0)])
def test_a_swing_on_a_spring_is_no_decay(stiffness: float, duration: float) -> None:
    with pytest.raises(IdentificationError, match=r"turns back at 0\.\d+ s without coming to rest"):
        free_decay((swing_on_a_spring(stiffness, duration),), inertia="8.4 g m^2")


def test_a_vane_that_a_hand_turns_back_after_a_rest_is_a_decay() -> None:
    source = planted.decay(deceleration=0.8)
    time = source.recording.time
    turned = source.recording["angle"] - 2.0 * np.clip(time - 6.0, 0.0, 1.0)
    path = "free_decay.friction_over_inertia"
    found = free_decay((planted.source("turned", time, angle=(turned, "rad")),), start="1 s", rise=0.0)[path]
    assert found.low <= 0.8 <= found.high


def with_velocity(factor: float = 1.0) -> RecordingSource:
    """A decay whose angular velocity was recorded too, times a factor."""
    source = planted.decay()
    time = source.recording.time
    slowing = Slowing(planted.DAMPING_RATE, planted.DECELERATION)
    _, speed = course(np.maximum(time - 1.0, 0.0), 2.5, slowing)
    speed = np.where(time < 1.0, 0.0, speed) + np.random.default_rng(51).normal(0.0, 0.003, time.size)
    return RecordingSource(source.recording.with_channel("angular_velocity", factor * speed, "rad/s"))


def test_a_recorded_velocity_makes_the_interval_narrower_and_it_holds() -> None:
    path = "free_decay.damping_over_inertia"
    alone, both = (free_decay((one,), rise=0.0)[path] for one in (planted.decay(), with_velocity()))
    assert both.wider_half_width < 0.8 * alone.wider_half_width
    assert both.low <= planted.DAMPING_RATE <= both.high


@pytest.mark.parametrize(("factor", "shown"), [(57.29578, "57.3 times"), (-1.0, "-1 times")])
def test_a_velocity_in_another_unit_or_direction_is_refused(factor: float, shown: str) -> None:
    with pytest.raises(IdentificationError, match=f"'angular_velocity' is {shown} the derivative of 'angle'"):
        free_decay((with_velocity(factor),))


def test_too_few_samples_between_start_and_end_are_refused() -> None:
    with pytest.raises(IdentificationError, match="at least 20 samples from start to end, not 2"):
        free_decay((planted.decay(),), start="7.99 s")
