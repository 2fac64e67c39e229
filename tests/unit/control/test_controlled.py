"""What a law controls: one table, which laws, meters, metrics and readings of files ask."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from ppafo.control.angle_loop import (
    Joint,
    angle_damping,
    angle_stiffness,
    bandwidth,
    inner_gain,
    load_time,
    rate_filter,
    rest_distance,
    slow_loop,
    tolerance,
    torque_lag,
)
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.controllers.cascade import CASCADE, CascadeParameters
from ppafo.control.torque_loop import TorqueLoop, beyond_dead_band, proportional_gain
from ppafo.control.walking.catalog import walking_controllers
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.model.sensors import Measurement
from ppafo.model.valves.proportional import opening_of_command
from ppafo.signals.recording import CHANNELS

SEEN = Measurement(angle=1.4, pressure_1=3.0e5, pressure_2=1.2e5, torque=2.6)


@pytest.mark.parametrize(
    ("name", "value"),
    [("torque", 2.6), ("angle", 1.4), ("pressure_1", 3.0e5), ("pressure_2", 1.2e5), ("pressure_difference", 1.8e5)],
)
def test_each_is_read_of_what_the_sensors_show(name: str, value: float) -> None:
    assert CONTROLLED[name].value(*SEEN) == pytest.approx(value)


def test_each_has_channels_of_its_own_in_recordings() -> None:
    names = [kind.reference for kind in CONTROLLED.values()]
    assert len(set(names)) == len(names)
    for kind in CONTROLLED.values():
        assert CHANNELS[kind.reference].unit == CHANNELS[kind.name].unit == kind.unit


def test_a_gain_is_per_unit_of_what_is_controlled_and_a_default_of_another_unit_is_none() -> None:
    settings = {item.name: item for item in CONTROLLERS["pid"].quantities}
    gain, slope = (CONTROLLED["angle"].setting(settings[name]) for name in ("proportional_gain", "derivative_gain"))
    assert (gain.unit, slope.unit, slope.default) == ("1/rad", "s/rad", 0.0)
    assert CONTROLLED["pressure_1"].setting(settings["integral_gain"]).unit == "1/(Pa s)"
    zone = next(item for item in CONTROLLERS["on_off_dead_zone"].quantities if item.name == "dead_zone")
    of_pressure = CONTROLLED["pressure_2"].setting(zone)
    assert (of_pressure.unit, of_pressure.default, of_pressure.maximum) == ("Pa_d", None, 1.0e5 * zone.maximum)
    assert CONTROLLED[TORQUE].setting(zone) is zone


@pytest.mark.parametrize("name", [name for name in CONTROLLERS if name.endswith("_fixed_point")])
def test_a_fixed_point_law_follows_a_torque_alone_whatever_its_float_form_follows(name: str) -> None:
    assert CONTROLLERS[name].controls == (TORQUE,)
    assert len(CONTROLLERS[name.removesuffix("_fixed_point")].controls) == len(CONTROLLED)


def test_a_walk_is_offered_laws_of_a_torque_alone() -> None:
    offered = walking_controllers()
    assert "cascade" not in offered
    assert all(kind.controls == (TORQUE,) for kind in offered.values())


LOOP = TorqueLoop(80.0, 2.0e-3, 80.0)
JOINT = Joint(
    inertia=8.4e-3,
    stiffness=2.0,
    shut_in=2.0,
    damping=4.0e-3,
    friction=0.02,
    static_friction=0.0,
    span=1.9,
    travel=0.1,
    gravity=0.3,
    resolution=0.0,
    noise=0.0,
)


def test_as_quick_as_dead_time_or_torque_rate_allow_and_stiff_against_the_gas() -> None:
    frequency = bandwidth(LOOP, JOINT)
    assert frequency == pytest.approx(min(1.0 / 0.009, (80.0 / (8.4e-3 * 0.1)) ** (1.0 / 3.0)))
    assert angle_stiffness(LOOP, JOINT) == pytest.approx(8.4e-3 * frequency**2 + 1.0)
    assert angle_damping(LOOP, JOINT) == pytest.approx(8.4e-3 * frequency)
    assert load_time(LOOP, JOINT) == pytest.approx(1.0 / frequency)
    slow_valve = LOOP._replace(dead_time=0.05)
    assert bandwidth(slow_valve, JOINT) == pytest.approx(1.0 / 0.225)
    # A set pressure that runs ahead of the flow delays, too.
    assert bandwidth(slow_valve._replace(ahead=0.05), JOINT) == pytest.approx(1.0 / 0.45)


def test_static_friction_raises_the_stiffness_up_to_a_cap() -> None:
    heavy = JOINT._replace(inertia=1.0)
    plain = angle_stiffness(LOOP, heavy)
    breaking = angle_stiffness(LOOP, heavy._replace(static_friction=1.5 * plain * JOINT.travel))
    stuck = angle_stiffness(LOOP, heavy._replace(static_friction=1000.0 * plain * JOINT.travel))
    assert breaking == pytest.approx(1.5 * plain)
    assert stuck == pytest.approx((1.0 / (4.5 * LOOP.dead_time)) ** 2 + 1.0)


def test_a_coarse_sensor_widens_what_counts_as_there_and_as_motion() -> None:
    coarse = JOINT._replace(resolution=math.radians(0.5))
    assert tolerance(JOINT) == pytest.approx(0.5 * 0.0025 * JOINT.span)
    assert tolerance(JOINT._replace(span=10.0)) == pytest.approx(math.radians(0.5))
    assert tolerance(coarse) == pytest.approx(math.radians(1.0))
    assert rest_distance(LOOP, coarse) > coarse.resolution > rest_distance(LOOP, JOINT)
    assert rate_filter(LOOP, coarse) > rate_filter(LOOP, JOINT)


def test_noise_of_the_angle_is_no_motion_and_is_filtered_more_than_a_step_of_that_size() -> None:
    noisy = JOINT._replace(noise=math.radians(0.05))
    # Two samples differ by the root of 2 of its standard deviation; by 4.9 of these once in a million samples.
    assert rest_distance(LOOP, noisy) >= 4.9 * math.sqrt(2.0) * noisy.noise
    coarse = JOINT._replace(resolution=noisy.noise)
    assert rate_filter(LOOP, noisy) > rate_filter(LOOP, coarse)
    assert rate_filter(LOOP, JOINT._replace(noise=0.0)) == rate_filter(LOOP, JOINT)


def test_a_law_on_the_angle_alone_keeps_half_the_gain_at_which_the_mass_swings_on_its_gas() -> None:
    smooth = JOINT._replace(friction=0.0)
    loop = slow_loop(LOOP, smooth)
    # s (I s^2 + d s + S) + k R by Routh: it swings from k R/S = d/I on.
    assert proportional_gain(loop) * LOOP.rate / smooth.stiffness == pytest.approx(
        0.5 * smooth.damping / smooth.inertia
    )
    assert slow_loop(LOOP, JOINT).dead_time < loop.dead_time, "dry friction damps"


def cascade(**given: float) -> CascadeParameters:
    """A cascade with these settings and 0 for all others, and a torque loop with a lag of 10 ms."""
    settings = dict.fromkeys((item.name for item in CASCADE.quantities), 0.0) | {"torque_lag": 0.01} | given
    return CascadeParameters(**settings)


def last_command(row: CascadeParameters, angle: float, samples: int) -> float:
    """Command after some samples of 1 ms of a joint that rests at an angle [rad] with a torque of 2 N m, 1.5 wanted."""
    state, command = CASCADE.initial, 0.0
    for _ in range(samples):
        command, state = CASCADE.update(row, state, 1.5, Measurement(angle, 1.0e5, 1.0e5, 2.0), 1.0e-3)
    return float(command)


def test_a_cascade_begins_with_the_torque_that_the_joint_has() -> None:
    assert last_command(cascade(torque_gain=0.1, tolerance=0.01, load_time=0.2), 1.5, 1) == 0.0


def test_the_torque_that_breaks_friction_grows_while_the_joint_rests_away_from_its_reference() -> None:
    stuck = cascade(torque_gain=0.1, tolerance=0.01, rest_distance=1.0e-4, static_torque=0.5, load_time=0.2)
    assert last_command(stuck, 1.505, 200) == 0.0, "nothing is learnt within the tolerance"
    early, later = (last_command(stuck, 1.48, samples) for samples in (20, 40))
    assert 0.0 < early < later <= 1.0


def test_a_load_observer_can_be_left_out() -> None:
    without = cascade(torque_gain=0.1, error_limit=0.1, angle_stiffness=5.0, rest_distance=1.0e-4)
    assert last_command(without, 1.45, 400) == pytest.approx(0.1 * (5.0 * 0.05 - 2.0))


@pytest.mark.parametrize("command", [-1.0, -0.3, -0.02, 0.02, 0.6, 1.0])
def test_a_valve_opens_as_far_as_a_law_asks_beyond_its_dead_band(command: float) -> None:
    for band in (0.0, 0.15):
        assert opening_of_command(beyond_dead_band(command, band), band) == pytest.approx(command)
    assert abs(beyond_dead_band(1.0e-4, 0.15)) < 0.15, "no jump at 0, where the valve would chatter"


def asked_torque(angle: float, reference: float) -> float:
    """The command of a cascade whose inner gain is 1, where nothing moves and the actuator has no torque."""
    row = cascade(error_limit=0.1, angle_stiffness=5.0, torque_gain=1.0)
    seen = Measurement(angle=angle, pressure_1=1.0e5, pressure_2=1.0e5, torque=0.0)
    command, _ = CASCADE.update(row, CASCADE.initial, reference, seen, 1.0e-3)
    return float(command)


def test_a_cascade_acts_on_no_more_than_its_error_limit() -> None:
    assert asked_torque(1.5, 1.55) == pytest.approx(0.25)
    assert asked_torque(1.5, 2.5) == pytest.approx(0.5)
    assert asked_torque(2.5, 1.5) == pytest.approx(-0.5)


def test_the_second_chamber_has_the_other_sign() -> None:
    signs: dict[str, Callable[[float], bool]] = {"pressure_2": lambda sign: sign < 0.0}
    for name, kind in CONTROLLED.items():
        assert signs.get(name, lambda sign: sign > 0.0)(kind.sign), name
        assert math.isfinite(kind.size)


@pytest.mark.parametrize(
    ("rate", "inertia", "largest"), [(1.0, 1.0, 3.7), (0.7, 1.0, 6), (1.3, 1.0, 6), (1.0, 1.5, 3), (1.0, 0.7, 40)]
)
def test_the_linear_loop_of_default_gains_without_friction_has_margins(
    rate: float, inertia: float, largest: float
) -> None:
    # Dead time and believed inertia are units; a slow reference leaves the bandwidth to the dead time.
    loop, joint = TorqueLoop(1.0, 1.0, 1.0), JOINT._replace(inertia=1.0, shut_in=0.01, travel=1.0e-3)
    s = 1.0e-3 + 1j * np.concatenate([[0.0], np.logspace(-4.0, 1.6, 1600)])
    slow = 1.0 + load_time(loop, joint) * s
    filtered = s / (1.0 + rate_filter(loop, joint) * s)
    asked = angle_stiffness(loop, joint) + angle_damping(loop, joint) * filtered + s * filtered / slow
    asked = asked / (1.0 - 1.0 / (slow * (1.0 + torque_lag(loop) * s)))
    mass = s * s + joint.shut_in / inertia
    opened = np.exp(-s) * inner_gain(loop) * rate * (asked / (inertia * s * mass) + s / mass)
    # Nyquist: no turn about -1, as the open loop has no pole to the right of these points.
    turns = np.ptp(np.unwrap(np.angle(1.0 + opened))[[0, -1]]) / (2.0 * math.pi)
    assert turns < 0.25
    assert np.abs(1.0 / (1.0 + opened[s.imag > 0.01])).max() < largest
