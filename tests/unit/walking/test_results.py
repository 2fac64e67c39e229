"""What a walk gives: strides, mean stride, metrics, comparison with a leg without device, files for OpenSim."""

import re
from dataclasses import replace
from functools import lru_cache
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.gait.recorded.forms.opensim import read_opensim
from ppafo.metrics.strides import PER_STRIDE, SETTLING
from ppafo.signals import CHANNELS, Channel, Recording
from ppafo.walking import WalkComparison, WalkResult, compare_walks, load_walk, walk
from ppafo.walking.motion import walk_of
from ppafo.walking.strides import (
    PHASES,
    mean_curves,
    per_stride,
    stride_starts,
)
from ppafo.walking.walk import ANKLE_RANGE

MINUTES = 0.15


@lru_cache(maxsize=4)
def compared(name: str) -> WalkComparison:
    return compare_walks(load_walk(name), minutes=MINUTES)


@pytest.mark.parametrize("name", ["solenoid", "proportional"])
def test_numbers_of_strides_add_up_to_the_recording(name: str) -> None:
    result = compared(name).with_device
    strides = result.strides
    assert {values.size for values in strides.values()} == {int(result.metrics["strides"].value)}
    supplied = result.recording["supplied_mass"]
    first, last = result.starts[0], result.starts[-1]
    assert strides["gas"].sum() == pytest.approx(supplied[last] - supplied[first], rel=1e-12)
    assert result.metrics["gas"].value == pytest.approx(strides["gas"][SETTLING:].mean())
    times = np.diff(result.recording.time[result.starts])
    np.testing.assert_allclose(times, walk_of(result.scenario).gait.stride_time, atol=1.5e-3)


def test_the_mean_stride_is_the_mean_of_strides() -> None:
    time = np.linspace(0.0, 4.0, 4001)
    growing = np.floor(time) + np.sin(2.0 * np.pi * time)
    recording = Recording("strides", time, {"angle": Channel(growing, "rad"), "command": Channel(0.0 * time, "-")})
    starts = stride_starts(np.floor(time + 1.0e-9))
    curves = mean_curves(recording, starts)
    assert set(curves) == {"angle"}, "a held channel has no mean"
    middle = np.abs(PHASES - 0.5) < 0.4
    np.testing.assert_allclose(curves["angle"].mean[middle], 2.0 + np.sin(2.0 * np.pi * PHASES[middle]), atol=1e-5)
    np.testing.assert_allclose(curves["angle"].deviation[middle], np.sqrt(2.0 / 3.0), atol=1e-9)


def test_two_strikes_are_needed_for_a_stride() -> None:
    recording = Recording("one", np.arange(3.0), {"angle": Channel(np.zeros(3), "rad")})
    assert mean_curves(recording, np.array([1])) == {}


def test_channels_of_a_walk_are_known_with_their_units() -> None:
    recording = compared("solenoid").with_device.recording
    assert {name: recording.unit(name) for name in recording.names} == {
        name: CHANNELS[name].unit for name in recording.names
    }
    joint = ppafo.simulate("torque-task-proportional").recording
    assert set(joint.names) <= set(recording.names) | {"reference"}, "a walk records what a joint does"
    np.testing.assert_allclose(
        recording["device_power"], recording["external_torque"] * recording["angular_velocity"], rtol=1e-12
    )
    assert set(np.unique(recording["controller_phase"])) == {0.0, 1.0, 2.0, 3.0}


def test_the_comparison_is_the_same_wearer_without_a_device() -> None:
    pair = compared("solenoid")
    worn, bare = pair.with_device, pair.without_device
    assert walk_of(bare.scenario).wearer == walk_of(worn.scenario).wearer
    assert bare.scenario.controller.kind == "off"
    assert (bare.recording["command"] == 2.0).all()
    assert bare.metrics["gas"].value == 0.0
    assert worn.metrics["toe_clearance"].value > bare.metrics["toe_clearance"].value + 0.05
    assert worn.metrics["angle_difference"].value < 0.5 * bare.metrics["angle_difference"].value
    assert bare.metrics["positive_push_off_work"].value == bare.metrics["net_push_off_work"].value == 0.0
    assert worn.metrics["positive_push_off_work"].value >= worn.metrics["net_push_off_work"].value > 1.0
    assert pair.healthy["positive_push_off_work"].value == pytest.approx(worn.metrics["healthy_positive_work"].value)


def test_the_leg_without_a_device_is_the_same_for_every_valve_and_leaves_the_range_of_the_device() -> None:
    bare = [compared(name).without_device.recording for name in ("solenoid", "proportional")]
    for channel in ("angle", "angular_velocity", "external_torque", "toe_height"):
        np.testing.assert_array_equal(bare[0][channel], bare[1][channel])
    stop = compared("solenoid").with_device.scenario.device.actuator.angle_max
    assert stop < bare[0]["angle"].max() < ANKLE_RANGE[1] - 0.05
    assert (bare[0]["torque"] == 0.0).all()


def test_the_lowest_toes_are_those_of_the_mean_stride_in_mid_swing() -> None:
    pair = compared("solenoid")
    gait = walk_of(pair.with_device.scenario).gait
    swing = (np.linspace(0.0, 1.0, 101) - gait.stance_share) / (1.0 - gait.stance_share)
    middle = (swing > 0.2) & (swing < 0.9)
    for result in (pair.with_device, pair.without_device):
        height = result.averages["toe_height"].mean[middle].min()
        assert result.metrics["lowest_toes"].value == pytest.approx(float(height))
    assert pair.without_device.metrics["lowest_toes"].value < 0.0 < pair.healthy["lowest_toes"].value < 0.02


def diverging() -> WalkResult:
    configuration = load_walk("solenoid")
    supply = replace(configuration.device.supply, pressure=1.0e18)
    with pytest.MonkeyPatch.context() as patch:
        # No file can say it: the check of a scenario's parts would refuse it.
        patch.setattr(import_module("ppafo.walking.walk"), "check_parts", lambda _scenario: None)
        return walk(replace(configuration, device=replace(configuration.device, supply=supply)), minutes=MINUTES)


def test_a_walk_that_diverges_says_when_and_what_to_do() -> None:
    result = diverging()
    assert result.status.kind == "diverged"
    assert re.fullmatch(
        r"diverged at t = [\d.e-]+ s \(before that: .*\); the time step may be too long.*", result.status.message
    )
    assert result.status.time is not None
    assert result.recording.time[-1] < MINUTES * 60.0
    assert "diverged" in repr(result)
    assert result.averages == {}


def test_a_walk_is_written_for_opensim(tmp_path: Path) -> None:
    result = compared("solenoid").with_device
    table = read_opensim(result.save_opensim(tmp_path / "walk.sto"))
    np.testing.assert_array_equal(table.columns["ankle_angle_r"], 0.5 * np.pi - result.recording["angle"])
    np.testing.assert_array_equal(table.columns["ankle_angle_r_device_moment"], -result.recording["external_torque"])
    load = result.recording["heel_force"] + result.recording["toe_force"]
    np.testing.assert_array_equal(table.columns["ground_force_r_vy"], load)
    assert table.units["ankle_angle_r"] == "rad"


def test_a_landing_on_the_toes_is_that_of_the_stride_that_it_begins() -> None:
    strikes = {5: 0.0, 15: 1.0, 25: 0.0, 35: 1.0}
    strides, landings = (np.zeros(40) for _ in range(2))
    for sample, on_toes in strikes.items():
        strides[sample:] += 1.0
        landings[sample:] += on_toes
    totals = {item.total: landings if name == "toe_landing" else strides for name, item in PER_STRIDE.items()}
    found = per_stride(totals, stride_starts(strides))
    assert found["toe_landing"].tolist() == [0.0, 1.0, 0.0]
    assert found["gas"].tolist() == [1.0, 1.0, 1.0]
