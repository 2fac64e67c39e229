"""Recordings to validate against: runs of the model itself, changed in known ways."""

from collections.abc import Callable

import pytest

from ppafo.parameters.device import Device
from ppafo.running import simulate
from ppafo.signals import Recording
from ppafo.simulation.loading import load_scenario
from ppafo.validation.agreement import compare_recording
from ppafo.validation.measured import check_recording
from ppafo.validation.settings import ReplaySettings


@pytest.fixture(scope="session")
def step() -> tuple[Device, Recording]:
    """The step response of figure 7: device and recording of the model."""
    scenario = load_scenario("step-response", ["motion.kind=free"])
    return scenario.device, simulate(scenario).recording


@pytest.fixture
def agree() -> Callable[..., object]:
    """Compares a recording with a device, with any settings of the replay."""

    def compare(recording: Recording, device: Device, **settings: object) -> object:
        return compare_recording(check_recording(recording, device, "r.csv"), device, ReplaySettings(**settings))

    return compare
