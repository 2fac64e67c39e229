"""Covariance of fits with stray samples, with and without a robust loss in the search."""

import dataclasses

import numpy as np
import pytest

from ppafo.identification.estimate import Estimate
from ppafo.identification.trajectory import (
    Experiment,
    FreeParameter,
    Prior,
    Search,
    TrajectoryFit,
    TrajectoryProblem,
    fit,
)
from ppafo.identification.trajectory.follow_up import profile
from ppafo.identification.trajectory.information import ROBUST_SCALE, loss_weights
from ppafo.identification.trajectory.problem import Loss, Range
from ppafo.identification.trajectory.uncertainty import Evidence, estimate_of

PARAMETERS = (FreeParameter("valve.discharge_coefficient"), FreeParameter("foot_plate.inertia"))


def stray(experiment: Experiment, share: float, seed: int) -> Experiment:
    """The recording with a share of its angles thrown about by thirty standard deviations."""
    random = np.random.default_rng(seed)
    angle = experiment.recording["angle"].copy()
    hit = random.random(angle.size) < share
    angle[hit] += 30.0 * experiment.noise["angle"] * random.standard_normal(int(hit.sum()))
    return dataclasses.replace(experiment, recording=experiment.recording.with_channel("angle", angle, "rad"))


def fitted(experiment: Experiment, loss: Loss) -> TrajectoryFit:
    return fit(TrajectoryProblem(PARAMETERS, (experiment,), Search(loss=loss)))


@pytest.mark.parametrize("loss", ["huber", "soft_l1"])
def test_weights_of_a_robust_loss_fall_beyond_its_scale(loss: str) -> None:
    inside, outside = loss_weights(np.array([0.1 * ROBUST_SCALE, 10.0 * ROBUST_SCALE]), loss)
    assert inside == pytest.approx(1.0, abs=0.01)
    assert outside == pytest.approx(0.1, abs=0.001)


def test_the_loss_of_the_search_does_not_change_the_interval(experiment: Experiment) -> None:
    plain, robust = (np.sqrt(np.diag(fitted(experiment, loss).covariance)) for loss in ("linear", "huber"))
    assert robust == pytest.approx(plain, rel=0.02)


def test_stray_samples_are_heavy_tails_and_widen_an_interval_little(experiment: Experiment) -> None:
    clean = fitted(experiment, "linear")
    thrown = fitted(stray(experiment, 0.03, 4), "linear")
    (angle,) = [sensor for sensor in thrown.uncertainty.sensors if sensor.channel == "angle"]
    assert angle.noise.is_heavy
    ratios = np.sqrt(np.diag(thrown.covariance) / np.diag(clean.covariance))
    # Least squares would be wider by the size of the noise, sqrt(1 + 0.03 * 900), 5.3 times where the angle says all.
    assert np.all(ratios > 0.9)
    assert np.all(ratios < 2.0)


def test_the_profile_of_a_fit_with_stray_samples_has_its_interval(experiment: Experiment) -> None:
    found = fitted(stray(experiment, 0.03, 4), "soft_l1")
    curve, estimate = profile(found, "foot_plate.inertia"), found.estimate("foot_plate.inertia")
    assert curve.low is not None
    assert curve.high is not None
    assert curve.low == pytest.approx(estimate.low, abs=0.2 * estimate.half_width)
    assert curve.high == pytest.approx(estimate.high, abs=0.2 * estimate.half_width)


DEVIATION = 0.05
"""Standard deviation of the prior [-], in the logarithm of the number."""


def estimate(fraction: float, inflation: float) -> Estimate:
    """The estimate of a number whose posterior is this fraction as wide as the prior."""
    prior = Prior(0.01, DEVIATION * 0.01)
    item = Range("foot_plate.inertia", "foot_plate.inertia", "kg m^2", "log", 0.01, 0.001, 0.1, 1.0, prior, ())
    error, point = fraction * DEVIATION, np.log([0.01])
    return estimate_of(
        Evidence(
            ranges=(item,),
            point=point,
            interval=(point - 2.0 * error, point + 2.0 * error),
            information=np.array([[1.0 / DEVIATION**2]]),
            covariance=np.array([[error**2]]),
            correlation=np.ones((1, 1)),
            low=np.log([0.001]),
            high=np.log([0.1]),
            prior_deviation=np.array([DEVIATION]),
            inflation=inflation,
            residual_check="noise: white",
            misfit="",
            alone=("",),
            sources=(("step.csv",),),
            search=Search(),
        ),
        0,
    )


@pytest.mark.parametrize("inflation", [0.7, 1.0, 2.0, 10.0])
def test_what_the_noise_widens_elsewhere_does_not_change_what_the_prior_decides(inflation: float) -> None:
    silent, told = estimate(1.0, inflation), estimate(0.75, inflation)
    assert silent.verdict == "not identifiable"
    assert silent.explanation.startswith("The recordings add little to the prior, which decides the value")
    assert told.verdict == "identified"
