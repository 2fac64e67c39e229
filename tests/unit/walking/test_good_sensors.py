"""Wearers with more or less of their own muscles, slow walks and poor sensors: nothing of it is a fault."""

import math
from dataclasses import replace

import pytest

from ppafo.gait import load_gait
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.population import walk_population
from ppafo.walking.walk import compare_walks, walk

MINUTES = 0.25
SLOW = 0.99
"""Walking speed [m/s]; the built-in gait was recorded at 1.33."""

SENSORS = {
    "ideal": (),
    "coarse": (
        "sensors.force_resolution=20 N",
        "sensors.angle_resolution=0.5 deg",
        "sensors.pressure_resolution=1 psi_d",
    ),
    "noisy": ("sensors.force_noise=10 N", "sensors.angle_noise=0.2 deg", "sensors.pressure_noise=0.3 psi_d"),
}


@pytest.mark.parametrize("valve", ["solenoid", "proportional"])
@pytest.mark.parametrize("sensors", SENSORS)
def test_a_wearer_with_any_part_of_the_healthy_moment_is_helped_without_alarm(valve: str, sensors: str) -> None:
    for fraction in (0.0, 0.4, 0.8, 0.9, 1.0):
        result = walk(load_walk(valve, [f"wearer.residual_share={fraction}", *SENSORS[sensors]]), minutes=MINUTES)
        assert result.status.is_completed
        assert "safe_state_time" not in result.metrics
        assert result.metrics["net_push_off_work"].value > 1.0


@pytest.mark.parametrize("valve", ["solenoid", "proportional"])
@pytest.mark.parametrize("sensors", SENSORS)
def test_a_slow_walk_is_helped_without_alarm(valve: str, sensors: str) -> None:
    gait = load_gait("falisse2019-subject1")
    assert gait.walking_speed is not None
    slow = replace(gait, stride_time=gait.stride_time * math.sqrt(gait.walking_speed / SLOW), walking_speed=SLOW)
    for fraction in (0.0, 0.8, 1.0):
        overrides = [f"wearer.residual_share={fraction}", *SENSORS[sensors]]
        configuration = load_walk(valve, overrides)
        configuration = replace(configuration, motion=replace(walk_of(configuration), gait=slow))
        result = walk(configuration, minutes=MINUTES)
        assert "safe_state_time" not in result.metrics
        assert result.metrics["net_push_off_work"].value > 1.0


def test_a_nondisabled_wearer_keeps_the_gait_and_the_device_takes_over_part_of_lifting_the_foot() -> None:
    comparison = compare_walks(load_walk("proportional", ["wearer.keeps_gait=1"]), minutes=MINUTES)
    worn, bare = comparison.with_device, comparison.without_device
    for result in (worn, bare):
        assert "safe_state_time" not in result.metrics
        assert result.metrics["angle_difference"].value < math.radians(1.0)
    moments = [metrics["dorsiflexor_moment"].value for metrics in (worn.metrics, bare.metrics, comparison.healthy)]
    # The plate's weight has to be lifted too where the device is off.
    assert 0.0 < moments[0] < moments[2] < moments[1]


@pytest.mark.parametrize("valve", ["solenoid", "proportional"])
def test_a_nondisabled_wearer_stops_without_a_pause(valve: str) -> None:
    """The last foot comes down slowly: its toes carried nothing until it was flat to the last degree, and it paused."""
    result = walk(load_walk(valve, ["wearer.keeps_gait=1"], task_sequence="corridor"), minutes=0.35)
    assert result.recording.time[-1] > 19.0
    assert not result.events


def test_nondisabled_wearers_whose_feet_roll_slowly_are_helped_without_a_pause() -> None:
    people = walk_population(load_walk("solenoid", ["wearer.keeps_gait=1"]), minutes=0.12, wearers=24)
    assert (people.vented, people.paused) == (0, 0)


def test_coarse_sensors_take_no_help_away_in_a_task_sequence_with_stops() -> None:
    """Their steps hold a reading for long: half to seven tenths of the wearers paused by a sensor that seemed still."""
    people = walk_population(
        load_walk("solenoid", SENSORS["coarse"], task_sequence="corridor"), minutes=None, wearers=24
    )
    assert people.vented == 0
    assert not [name for name in people.fault_flags if name.startswith(("still_", "frozen_"))]


def test_an_impaired_wearer_has_no_moment_of_dorsiflexors_to_speak_of() -> None:
    result = walk(load_walk("proportional"), minutes=MINUTES)
    assert "dorsiflexor_moment" not in result.recording
    assert "dorsiflexor_moment" not in result.metrics


QUICK = (
    *("actuator.torque_constant=18 cm^3", "actuator.displacement_per_radian=18 cm^3/rad", "gas.species=air"),
    *("actuator.dead_volume_1=10 cm^3", "actuator.dead_volume_2=3 cm^3", "supply.pressure=3.7 bar_g"),
    *("valve.sonic_conductance=2.1 L/(s bar)", "valve.critical_ratio=0.3", "controller.largest_torque=5 N m"),
)
"""Chambers that a wide valve empties in less than the dead time of a slow one."""


@pytest.mark.parametrize("delay", ["0 ms", "3 ms", "10 ms", "13 ms"])
def test_a_vent_valve_that_follows_late_on_quick_chambers_is_no_fault(delay: str) -> None:
    result = walk(load_walk("proportional", [*QUICK, f"valve.delay={delay}"]), minutes=MINUTES)
    assert result.status.is_completed
    assert "safe_state_time" not in result.metrics
