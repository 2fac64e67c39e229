"""What a run takes from a recording."""

import dataclasses

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.parameters import load_device
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.plan import plan_run
from ppafo.simulation.recorded.channels import between_stops, regular_interval, sample_period
from ppafo.simulation.recorded.inputs import (
    RecordedInputs,
    step_inputs,
    supply_paths,
    with_highest_supply,
)
from ppafo.simulation.recorded.replay import replay_scenario
from ppafo.simulation.recorded.rest import ReplayStart, samples_at_rest, value_at_rest


def recording(time: np.ndarray, command: np.ndarray, supply: np.ndarray) -> Recording:
    channels = {"command": Channel(command, "-"), "supply_pressure": Channel(supply, "Pa")}
    return Recording("bench", time, channels)


def test_clocks_that_write_rounded_times_are_regular_and_others_are_not() -> None:
    time = np.arange(0.0, 0.1, 1e-3)
    assert regular_interval(np.round(time + 4e-6 * (-1.0) ** np.arange(time.size), 6)) == pytest.approx(1e-3, rel=1e-3)
    bent = np.append(time, [0.2, 0.3])
    assert regular_interval(bent) is None
    # Irregular samples are placed on a grid as fine as the closest two, at most a millisecond.
    assert sample_period(bent) == pytest.approx(1e-3)


def test_inputs_begin_at_the_time_of_the_recording_that_is_zero_of_the_run() -> None:
    time = np.arange(0.0, 0.1, 1e-3)
    given = recording(time, (time >= 0.0495).astype(float), 4.0e5 + 1.0e6 * time)
    device = load_device("ppafo2011")
    run = plan_run(replay_scenario(given, device, ReplayStart(0.5, 0.0, 2e5, 2e5), 0.05, "bench.csv"))
    inputs = step_inputs(RecordedInputs(given, ("command", "supply_pressure"), 0.04), device, run)
    assert inputs.command is not None
    first_open = int(np.argmax(inputs.command))
    assert first_open * run.step == pytest.approx(0.01, abs=run.step)
    assert inputs.parameters["plant.supply_pressure"][0] == pytest.approx(4.405e5)
    # After the last sample, at 0.059 s of the run, all stays as it was.
    assert inputs.parameters["plant.supply_pressure"][-1] <= 4.99e5


def test_both_regulators_follow_the_supply_unless_they_have_two_pressures() -> None:
    one = load_device("ppafo2011")
    two = dataclasses.replace(one, supply=dataclasses.replace(one.supply, dorsiflexion_pressure=3.0e5))
    assert supply_paths(one) == ("plant.supply_pressure", "plant.dorsiflexion_pressure")
    assert supply_paths(two) == ("plant.supply_pressure",)
    given = recording(np.array([0.0, 1.0]), np.ones(2), np.array([5.0e5, 6.0e5]))
    assert supply_paths(with_highest_supply(one, given, given.names)) == supply_paths(one)
    assert with_highest_supply(one, given, given.names).supply.pressure == 6.0e5
    assert with_highest_supply(two, given, given.names).supply.dorsiflexion_pressure == 3.0e5
    other = {**given.channels, "dorsiflexion_pressure": Channel(np.array([6.1e5, 6.1e5]), "Pa")}
    with_both = Recording(given.label, given.time, other)
    followed = with_highest_supply(one, with_both, ["supply_pressure"])
    assert supply_paths(followed) == supply_paths(one)
    assert with_highest_supply(one, with_both, with_both.names).supply.dorsiflexion_pressure == 6.1e5


def test_rest_ends_at_the_first_command_and_lasts_fifty_milliseconds_at_most() -> None:
    time = np.arange(0.0, 0.2, 1e-3)
    assert samples_at_rest(recording(time, np.where(time > 0.0295, 1.0, 0.0), time + 4e5)) == 30
    assert samples_at_rest(recording(time, np.where(time > 0.1, 1.0, 0.0), time + 4e5)) == 50
    assert samples_at_rest(recording(time, np.ones(time.size), time + 4e5)) == 1


def test_an_angle_slightly_beyond_a_stop_is_the_stop_and_one_far_beyond_is_refused() -> None:
    device = load_device("ppafo2011")
    lowest = device.actuator.angle_min
    assert between_stops(np.array([lowest - 0.01]), device, "bench.csv").tolist() == [lowest]
    with pytest.raises(DataError, match=r"bench\.csv: 'angle' is .* beyond the stops of ppafo2011.* another zero"):
        between_stops(np.array([device.actuator.angle_max + 1.0]), device, "bench.csv")


def test_an_input_is_held_or_runs_straight_at_the_steps_of_a_run_as_its_channel_declares() -> None:
    time = np.array([0.0, 0.01, 0.02])
    command, supply = np.array([0.0, 1.0, 1.0]), np.array([4.0e5, 5.0e5, 5.0e5])
    device = load_device("ppafo2011")
    declared = Recording(
        "bench", time, {"command": Channel(command, "-", "linear"), "supply_pressure": Channel(supply, "Pa", "hold")}
    )
    found = []
    for one in (recording(time, command, supply), declared):
        run = plan_run(replay_scenario(one, device, ReplayStart(1.0, 0.0, 1.0e5, 1.0e5), 0.02, "r.csv"))
        given = step_inputs(RecordedInputs(one, ("command", "supply_pressure"), 0.0), device, run)
        assert given.command is not None
        middle = round(0.005 / run.step)
        found.append((given.command[middle], given.parameters["plant.supply_pressure"][middle]))
    usual, other = found
    assert usual == pytest.approx((0.0, 4.5e5), rel=0.02)
    assert other == pytest.approx((0.5, 4.0e5), abs=0.1)


def test_a_chamber_that_leaks_before_the_valve_opens_starts_where_it_was_and_not_at_the_mean() -> None:
    time = np.arange(0.0, 0.05, 1e-3)
    pressure = 1.0e5 + 3.0e5 * (1.0 - np.exp(-time / 0.03))
    noise = 300.0 * np.random.default_rng(1).standard_normal(time.size)
    assert abs(float(np.mean(pressure)) - pressure[0]) > 1.0e5
    assert value_at_rest(time, pressure + noise) == pytest.approx(pressure[0], abs=1500.0)
    assert value_at_rest(time, pressure + noise, at_end=True) == pytest.approx(pressure[-1], abs=1000.0)
    still = 1.0e5 + noise
    assert value_at_rest(time, still) == float(np.mean(still))
