"""Recordings of regulators that begin in operation: at rest under a command, and cut anywhere."""

import numpy as np
import pytest

from ppafo.parameters import load_device
from ppafo.signals import Channel, Recording
from ppafo.validation.agreement import replay_of
from ppafo.validation.measured import MeasuredRecording
from ppafo.validation.replay import Replayed, replay_together
from ppafo.validation.settings import ReplaySettings

SLOW = ["valve.delay=15 ms", "valve.response_time=60 ms", "supply.pressure=5 bar_a"]
TIMES = np.arange(0.0, 2.4, 1e-3)
LEVELS = np.repeat([0.0, 0.6, 0.3, 0.8, 0.2, 0.5], 400)
NOISE = 100.0


def replayed(words: list[str], command: np.ndarray, pressures: np.ndarray, start: float = 0.0) -> np.ndarray:
    """Both pressures [Pa] (2, samples) from a time [s] on, replayed from the first ones of a recording."""
    device = load_device("cylinder-lever", overrides=words, valve="pressure_regulator")
    inside = start <= TIMES
    channels = {"command": Channel(command[inside], "-")}
    channels |= {f"pressure_{side}": Channel(row[inside], "Pa") for side, row in enumerate(pressures, 1)}
    recording = Recording("bench", TIMES[inside], channels)
    settings = ReplaySettings("locked", {"angle": device.actuator.angle_min + 0.2})
    (run,) = replay_together([replay_of(MeasuredRecording("bench", "", recording, ()), device, settings)])
    assert isinstance(run, Replayed)
    return np.array([np.interp(recording.time, run.recording.time, run.recording[name]) for name in list(channels)[1:]])


@pytest.mark.parametrize("words", [[], ["valve.hysteresis=0.03", "valve.resolution=0.01"]])
def test_a_regulator_is_replayed_from_where_its_recording_begins(words: list[str]) -> None:
    words = [*SLOW, *words]
    room = load_device("cylinder-lever").supply.atmospheric_pressure
    whole = replayed(words, LEVELS, np.full((2, TIMES.size), room))
    read = whole + NOISE * np.random.default_rng(7).standard_normal(whole.shape)
    for start in (0.52, 0.9, 1.33):
        cut = replayed(words, LEVELS, read, start)
        assert np.sqrt(np.mean(np.square(cut - whole[:, start <= TIMES]))) < 5.0 * NOISE
    held = np.repeat(whole[:, -1:], TIMES.size, axis=1)
    assert np.ptp(replayed(words, np.full(TIMES.size, 0.5), held), axis=1).max() < NOISE
