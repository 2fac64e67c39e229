"""What a fit says where recordings leave a combination open, and where a sensor's level moves from sample to sample."""

import dataclasses

import numpy as np
import pytest

from ppafo.identification.fit import FitNumber
from ppafo.identification.tolerances import Tolerances
from ppafo.identification.trajectory.experiment import (
    FittedExperiment,
    TrajectoryProblem,
    tolerance_parameters,
)
from ppafo.identification.trajectory.fitting import TrajectoryFit, fit
from ppafo.parameters.loading import load_parameter_set
from ppafo.rig.experiments import record
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.loading import load_scenario

STEP = ("motion.kind=free", "run.duration=0.35 s")
LEAK = 0.3e-6


def fitted(experiment: FittedExperiment, *sought: FitNumber) -> TrajectoryFit:
    tolerances = tolerance_parameters(Tolerances(), (experiment,), sought, load_parameter_set("ppafo2011"))
    return fit(TrajectoryProblem((*sought, *tolerances), (experiment,)))


@pytest.mark.parametrize("seed", [1, 2])
def test_a_leak_beside_the_delay_of_a_valve_is_not_identifiable_and_its_interval_is_open(seed: int) -> None:
    scenario = load_scenario("step-response", STEP)
    recording = record("step-response", "paper-bench", seed, overrides=STEP).recording
    delay = FitNumber("valve.delay", start=2.0e-3, low=1.0e-4, high=2.0e-2)
    sought = FitNumber("valve.discharge_coefficient"), FitNumber("actuator.leak.area"), delay

    found = fitted(FittedExperiment("step", scenario, recording), *sought)

    leak = found["actuator.leak.area"]
    assert leak.verdict == "not identifiable"
    assert leak.low < 0.1 * LEAK
    assert leak.high > 50.0 * LEAK
    # That they are hardly sensitive would be untrue: the model lacks what the bench has, and the leak stands in for it.
    assert leak.explanation == found.conflict
    assert not any(one.is_identified for one in found.estimates)


def wandering_by(experiment: FittedExperiment, size: float) -> TrajectoryFit:
    """A fit of a recording whose first pressure has noise with a memory of some hundred samples, of a size [Pa]."""
    recording, random = experiment.recording, np.random.default_rng(11)
    level = random.normal(size=len(recording))
    for place in range(1, len(level)):
        level[place] = 0.99 * level[place - 1] + 0.14 * level[place]
    moved = Channel(recording["pressure_1"] + size * level, "Pa")
    other = Recording(recording.label, recording.time, {**recording.channels, "pressure_1": moved}, recording.kind)
    found = dataclasses.replace(experiment, recording=other, noise={})
    return fitted(found, FitNumber("foot_plate.inertia"))


def test_what_wanders_by_more_than_the_zero_of_its_sensor_may_be_off_holds_for_this_model_only(
    experiment: FittedExperiment,
) -> None:
    found = wandering_by(experiment, 6000.0)

    assert "the residual of pressure_1 drifts by" in found.conflict
    assert "the zero of its sensor by at most 0.3 psi" in found.conflict
    assert found.estimates[0].verdict == "holds for this model only"


def test_noise_that_wanders_by_less_than_the_zero_of_its_sensor_may_be_off_is_the_sensors(
    experiment: FittedExperiment,
) -> None:
    found = wandering_by(experiment, 1000.0)

    assert found.conflict == ""
    assert found.estimates[0].is_identified


def test_samples_that_stand_out_are_left_out_and_said(experiment: FittedExperiment) -> None:
    recording = experiment.recording
    values = recording["pressure_2"].copy()
    values[[40, 200]] += np.array([4.0e4, -4.0e4])
    spoilt = dataclasses.replace(experiment, recording=recording.with_channel("pressure_2", values, "Pa"), noise={})

    found = fitted(spoilt, FitNumber("foot_plate.inertia"))

    said = "experiment 'step': 2 outliers of pressure_2 left out, the first at 0.04 s"
    assert (found.remarks, found.faults) == ((said,), ())
    assert found.estimates[0].is_identified
