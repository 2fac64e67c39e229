"""Free decay: the closed form, planted damping and friction, and an inertia that may be unknown."""

from types import ModuleType

import numpy as np
import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.bench import FreeDecaySettings, free_decay
from ppafo.identification.bench.free_decay import angle_of_decay, stop_time, velocity_of_decay
from ppafo.identification.source import Source


def test_the_closed_form_satisfies_the_equation_of_motion() -> None:
    time = np.linspace(0.0, 1.5, 30001)
    angle = angle_of_decay(time, 0.2, 3.0, 0.7, 0.5)
    velocity = np.gradient(angle, time)
    acceleration = np.gradient(velocity, time)
    inner = slice(10, -10)
    assert np.allclose(acceleration[inner], -0.7 * velocity[inner] - 0.5, atol=2e-4)


def test_the_decay_ends_at_rest_where_the_velocity_reaches_zero() -> None:
    stop = stop_time(3.0, 0.7, 0.5)
    assert (3.0 + 0.5 / 0.7) * np.exp(-0.7 * stop) == pytest.approx(0.5 / 0.7)
    late = angle_of_decay(np.array([stop, stop + 5.0]), 0.0, 3.0, 0.7, 0.5)
    assert late[0] == late[1]


def test_no_damping_is_the_limit_of_little_damping() -> None:
    time = np.linspace(0.0, 4.0, 50)
    none = angle_of_decay(time, 0.0, 3.0, 0.0, 0.5)
    assert np.allclose(none, angle_of_decay(time, 0.0, 3.0, 1e-7, 0.5), atol=1e-5)
    assert none[10] == pytest.approx(3.0 * time[10] - 0.25 * time[10] ** 2)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_planted_damping_and_friction_lie_inside_their_intervals(planted: ModuleType, sign: float) -> None:
    result = free_decay((planted.decay(sign=sign),), FreeDecaySettings(inertia=8.4e-3))
    damping, friction = result["friction.viscous_damping"], result["friction.dynamic_torque"]
    assert damping.low <= 8.4e-3 * planted.DAMPING_RATE <= damping.high
    assert friction.low <= 8.4e-3 * planted.DECELERATION <= friction.high
    assert damping.relative_half_width < 0.02
    assert result.failed == ()


def test_intervals_cover_in_about_the_stated_share_of_repetitions(planted: ModuleType) -> None:
    found = [free_decay((planted.decay(seed=seed),))["free_decay.damping_over_inertia"] for seed in range(40)]
    assert sum(item.low <= planted.DAMPING_RATE <= item.high for item in found) >= 35


def test_several_impulses_share_one_damping(planted: ModuleType) -> None:
    one = free_decay((planted.decay(seed=1),))["free_decay.damping_over_inertia"]
    three = free_decay(tuple(planted.decay(seed=seed) for seed in (1, 2, 3)))["free_decay.damping_over_inertia"]
    assert three.half_width < 0.8 * one.half_width
    assert len(three.recordings) == 3


def test_an_unknown_inertia_leaves_only_ratios_and_says_so(planted: ModuleType) -> None:
    result = free_decay((planted.decay(),))
    assert [item.path.partition(".")[0] for item in result.estimates] == ["free_decay", "free_decay"]
    assert all("inertia is not known" in item.explanation for item in result.estimates)
    assert "inertia is not known" in result.summary


def test_an_uncertain_inertia_widens_what_depends_on_it(planted: ModuleType) -> None:
    settings = FreeDecaySettings(inertia=8.4e-3, inertia_half_width=0.84e-3)
    result = free_decay((planted.decay(),), settings)
    assert result["friction.viscous_damping"].relative_half_width == pytest.approx(0.1, rel=0.05)
    assert result["free_decay.damping_over_inertia"].relative_half_width < 0.02


def test_pure_coulomb_friction_shows_no_damping(planted: ModuleType) -> None:
    result = free_decay((planted.decay(rate=0.0, deceleration=0.8, seed=2),))
    assert result["free_decay.friction_over_inertia"].value == pytest.approx(0.8, rel=0.02)
    assert result["free_decay.damping_over_inertia"].verdict in ("not identifiable", "at its bound")


def test_gravity_fails_the_residual_check(planted: ModuleType) -> None:
    time = np.arange(0.0, 6.0, 0.005)
    swing = planted.source("swing", time, angle=(0.6 * np.exp(-0.2 * time) * np.sin(1.2 * time), "rad"))
    assert "residuals" in [check.name for check in free_decay((swing,), FreeDecaySettings(start=0.0)).failed]


def test_an_angle_that_never_moves_is_refused(planted: ModuleType) -> None:
    still = planted.source("still", np.arange(100.0), angle=(np.full(100, 0.3), "rad"))
    with pytest.raises(IdentificationError, match=r"still: free-decay: channel 'angle' is 0\.3 rad throughout"):
        free_decay((still,))


def test_too_few_samples_are_refused(planted: ModuleType) -> None:
    with pytest.raises(IdentificationError, match="at least 20 samples between start and end, there are 2"):
        free_decay((planted.decay(),), FreeDecaySettings(start=7.99))


def with_velocity(planted: ModuleType, factor: float = 1.0, seed: int = 1) -> Source:
    source = planted.decay(seed=seed)
    time = source.recording.time
    speed = velocity_of_decay(np.maximum(time - 1.0, 0.0), 2.5, planted.DAMPING_RATE, planted.DECELERATION)
    speed = np.where(time < 1.0, 0.0, speed) + np.random.default_rng(seed + 50).normal(0.0, 0.003, time.size)
    return Source(source.recording.with_channel("angular_velocity", factor * speed, "rad/s"))


def test_the_velocity_is_the_slope_of_the_angle_in_the_closed_form() -> None:
    time = np.linspace(0.0, 6.0, 6001)
    slope = np.gradient(angle_of_decay(time, 0.3, 2.5, 0.7, 0.5), time)
    assert np.allclose(velocity_of_decay(time, 2.5, 0.7, 0.5)[1:-1], slope[1:-1], atol=1e-3)


def test_a_recorded_velocity_makes_the_intervals_narrower_and_covers_the_planted_values(planted: ModuleType) -> None:
    inside, narrower = 0, 0
    for seed in range(20):
        alone = free_decay((planted.decay(seed=seed),))["free_decay.damping_over_inertia"]
        both = free_decay((with_velocity(planted, seed=seed),))["free_decay.damping_over_inertia"]
        inside += both.low <= planted.DAMPING_RATE <= both.high
        narrower += both.half_width < 0.8 * alone.half_width
    assert inside >= 17
    assert narrower >= 18
    assert "angular velocity" in free_decay((with_velocity(planted),)).summary


@pytest.mark.parametrize(("factor", "shown"), [(57.29578, "57.3 times"), (-1.0, "-1 times")])
def test_a_velocity_in_another_unit_or_direction_is_refused(planted: ModuleType, factor: float, shown: str) -> None:
    with pytest.raises(IdentificationError, match=f"'angular_velocity' is {shown} as fast as 'angle' changes"):
        free_decay((with_velocity(planted, factor),))


def test_the_gain_of_the_sensor_touches_friction_and_not_damping(planted: ModuleType) -> None:
    plain = free_decay((planted.decay(),), FreeDecaySettings(inertia=8.4e-3))
    told = free_decay((planted.decay(),), FreeDecaySettings(inertia=8.4e-3, calibration=0.1))
    assert told["friction.viscous_damping"].half_width == plain["friction.viscous_damping"].half_width
    assert told["friction.dynamic_torque"].relative_half_width == pytest.approx(
        np.hypot(0.1, plain["friction.dynamic_torque"].relative_half_width)
    )
