"""A short step response with planted values: the model's own run plus white noise."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from ppafo.identification.trajectory.experiment import FittedExperiment
from ppafo.running import simulate
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario

NOISE = {"angle": math.radians(0.1), "pressure_1": 500.0, "pressure_2": 500.0}


@pytest.fixture(scope="session")
def step() -> Scenario:
    """The first 0.35 s of the paper's step response: breakaway, motion, impact, filling."""
    return load_scenario("step-response", ["motion.kind=free", "run.duration=0.35 s"])


@pytest.fixture(scope="session")
def recorded() -> Callable[..., Recording]:
    """What sensors with white noise would record of a scenario."""

    def record(scenario: Scenario, seed: int = 1) -> Recording:
        random = np.random.default_rng(seed)
        clean = simulate(scenario).recording
        channels = {
            name: Channel(clean[name] + noise * random.standard_normal(len(clean)), clean.unit(name))
            for name, noise in NOISE.items()
        }
        return Recording(f"synthetic {scenario.name}", clean.time, channels, kind="synthetic")

    return record


@pytest.fixture(scope="session")
def experiment(step: Scenario, recorded: Callable[..., Recording]) -> FittedExperiment:
    """The step response with its recording."""
    return FittedExperiment("step", step, recorded(step), noise=NOISE)
