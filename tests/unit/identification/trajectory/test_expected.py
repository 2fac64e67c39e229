"""Which experiment would say most."""

import dataclasses

import numpy as np
import pytest

from ppafo.identification.fit import FitNumber
from ppafo.identification.trajectory.experiment import FittedExperiment, TrajectoryProblem
from ppafo.identification.trajectory.fitting import TrajectoryFit, expected_information, fit
from ppafo.simulation.loading import load_scenario
from tests.unit.identification.trajectory.conftest import NOISE


@pytest.fixture(scope="module")
def found(experiment: FittedExperiment) -> TrajectoryFit:
    """Flow, damping and leak from a step response, in which the leak hardly shows."""
    paths = ("valve.discharge_coefficient", "friction.viscous_damping", "actuator.leak.area")
    return fit(TrajectoryProblem(tuple(FitNumber(path) for path in paths), (experiment,)))


def test_the_experiment_that_lets_the_leak_be_seen_is_recommended_before_the_same_again(found: TrajectoryFit) -> None:
    slow = load_scenario("step-response", ["controller.command=0.05", "run.duration=2 s", "name=slow"])
    shut = load_scenario("step-response", ["controller.command=0", "run.duration=2 s", "name=shut"])
    again = found.scenarios[0]
    ranked = expected_information(found, [(one.name, one, NOISE, 1e-3) for one in (again, slow, shut)])
    gains = [one.gain for one in ranked]
    assert gains == sorted(gains, reverse=True)
    assert ranked[-1].label == again.name
    assert {one.label: one.most_helped for one in ranked}["shut"] == "actuator.leak.area"


def test_the_same_experiment_again_narrows_everything_by_the_square_root_of_two(
    found: TrajectoryFit, experiment: FittedExperiment
) -> None:
    (again,) = expected_information(found, [("again", experiment.scenario, {}, 1e-3)])
    for share in again.shrinkage.values():
        assert share == pytest.approx(1.0 / np.sqrt(2.0), rel=0.12)
    assert again.gain == pytest.approx(1.5 * np.log(2.0), rel=0.2)


def test_more_noise_and_a_shorter_run_bring_less(found: TrajectoryFit, experiment: FittedExperiment) -> None:
    loud = {name: 3.0 * noise for name, noise in NOISE.items()}
    short = dataclasses.replace(experiment.scenario, run=dataclasses.replace(experiment.scenario.run, duration=0.1))
    candidates = [
        ("noisy", experiment.scenario, loud, 1e-3),
        ("short", short, NOISE, 1e-3),
        ("whole", experiment.scenario, NOISE, 1e-3),
    ]
    assert expected_information(found, candidates)[0].label == "whole"
