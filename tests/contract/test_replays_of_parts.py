"""Recordings that begin in operation, for every valve of the catalogue and every effect that acts on the gas."""

from dataclasses import replace

import numpy as np
import pytest

from ppafo.model.catalog import EFFECTS, VALVES
from ppafo.model.ports import at_valve, leakage_path, supply_path
from ppafo.parameters import load_device
from ppafo.parameters.device import Device
from ppafo.signals import Channel, Recording
from ppafo.validation.agreement import replay_of
from ppafo.validation.causes import of_effects
from ppafo.validation.measured import MeasuredRecording
from ppafo.validation.replay import Replayed, replay_together
from ppafo.validation.settings import ReplaySettings

SET_OF = {"proportional": "ppafo2011", "solenoid": "ppafo2011", "pressure_regulator": "cylinder-lever"}
SLOW = {"s": "15 ms", "Hz": "20 Hz", "1/s": "10 1/s"}
PRESSURES = ("pressure_1", "pressure_2")
TIMES = np.arange(0.0, 2.4, 1e-3)
LEVELS = np.repeat([0.0, 0.6, 0.3, -0.5, -0.2, 0.5], 400)
NOISE = 100.0


def slow(valve: str) -> Device:
    """A device with a valve that has every delay, lag and limit of its kind."""
    numbers = [f"valve.{item.name}={SLOW[item.unit]}" for item in VALVES[valve].quantities if item.unit in SLOW]
    return load_device(SET_OF[valve], overrides=[*numbers, "supply.pressure=5 bar_a"], valve=valve)


DEVICES = {valve: slow(valve) for valve in VALVES} | {
    cause.name: replace(slow("proportional"), effects=dict(cause.at(cause.grid[-1]).effects))
    for cause in of_effects(slow("proportional"))
    if {at_valve, supply_path, leakage_path} & EFFECTS[cause.name.partition(".")[0]].laws.keys()
}


def replayed(device: Device, command: np.ndarray, pressures: np.ndarray, start: float = 0.0) -> np.ndarray:
    """Both pressures [Pa] (2, samples) from a time [s] on, replayed from the first ones of a recording."""
    inside = start <= TIMES
    channels = {"command": Channel(command[inside], "-")}
    channels |= {name: Channel(row[inside], "Pa") for name, row in zip(PRESSURES, pressures, strict=True)}
    recording = Recording("bench", TIMES[inside], channels)
    settings = ReplaySettings("locked", {"angle": device.actuator.angle_min + 0.2})
    request = replay_of(MeasuredRecording("bench", "", recording, ()), device, settings)
    (run,) = replay_together([request])
    assert isinstance(run, Replayed)
    return np.array([np.interp(recording.time, run.recording.time, run.recording[name]) for name in PRESSURES])


@pytest.mark.parametrize("name", DEVICES)
def test_a_recording_cut_anywhere_in_operation_is_replayed_as_the_whole(name: str) -> None:
    device = DEVICES[name]
    whole = replayed(device, LEVELS, np.full((2, TIMES.size), device.supply.atmospheric_pressure))
    read = whole + NOISE * np.random.default_rng(7).standard_normal(whole.shape)
    for start in (0.52, 0.9, 1.33):
        cut = replayed(device, LEVELS, read, start)
        assert np.sqrt(np.mean(np.square(cut - whole[:, start <= TIMES]))) < 5.0 * NOISE


@pytest.mark.parametrize("name", DEVICES)
def test_what_is_at_rest_under_a_command_stays_there(name: str) -> None:
    device = DEVICES[name]
    command = np.full(TIMES.size, 0.5)
    settled = command, np.full((2, TIMES.size), device.supply.atmospheric_pressure)
    for _ in range(3):
        settled = command, np.repeat(replayed(device, *settled)[:, -1:], TIMES.size, axis=1)
    assert np.ptp(replayed(device, *settled), axis=1).max() < NOISE
