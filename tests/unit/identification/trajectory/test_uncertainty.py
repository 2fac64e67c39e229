"""Covariance of robust fits: the sandwich, and what it must reduce to."""

import dataclasses

import numpy as np
import pytest

from ppafo.identification.trajectory import Experiment, FreeParameter, Search, TrajectoryFit, TrajectoryProblem, fit
from ppafo.identification.trajectory.information import (
    ROBUST_SCALE,
    cost_of,
    curvature_and_spread,
    loss_curvature,
    loss_weights,
    precision,
    sandwich,
)
from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.problem import Loss
from ppafo.identification.trajectory.profiles import profile
from ppafo.identification.trajectory.residuals import Neighbourhood

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


def near(found: TrajectoryFit) -> Neighbourhood:
    return found.optimum.residuals.around(found.optimum.point, 1e-4 * np.eye(len(PARAMETERS)))


@pytest.mark.parametrize("loss", ["huber", "soft_l1"])
def test_weight_and_curvature_are_derivatives_of_the_cost(loss: str) -> None:
    step = 1e-4
    for residual in (0.3, 0.9 * ROBUST_SCALE, 2.0 * ROBUST_SCALE, -7.0):
        below, at, above = (cost_of(np.array([residual + shift]), loss) for shift in (-step, 0.0, step))
        here: Floats = np.array([residual])
        assert (above - below) / (2.0 * step) == pytest.approx(float((loss_weights(here, loss) * here)[0]), rel=1e-6)
        assert (above - 2.0 * at + below) / step**2 == pytest.approx(float(loss_curvature(here, loss)[0]), abs=1e-6)


def test_without_a_robust_loss_curvature_and_spread_are_the_information(experiment: Experiment) -> None:
    found = fitted(experiment, "linear")
    curvature, spread = curvature_and_spread(near(found), "linear")
    information = precision(near(found), "linear")
    assert curvature == pytest.approx(information)
    # The mean of 351 squares of normal errors has a standard deviation of 7.5 % in each channel.
    assert np.diag(spread) == pytest.approx(np.diag(information), rel=0.25)
    assert np.sqrt(np.diag(sandwich(curvature, spread))) == pytest.approx(
        np.sqrt(np.diag(np.linalg.inv(information))), rel=0.12
    )


def test_a_robust_fit_of_clean_samples_has_intervals_like_a_plain_one(experiment: Experiment) -> None:
    plain, robust = (np.sqrt(np.diag(fitted(experiment, loss).covariance)) for loss in ("linear", "huber"))
    # At 1.345 standard deviations Huber's loss has 95 % of the efficiency: 2.6 % wider; the rest is chance.
    assert robust == pytest.approx(1.026 * plain, rel=0.12)


def test_stray_samples_widen_a_robust_interval_less_than_a_plain_one(experiment: Experiment) -> None:
    thrown = stray(experiment, 0.03, 4)
    clean = np.sqrt(np.diag(fitted(experiment, "soft_l1").covariance))
    plain, robust = (np.sqrt(np.diag(fitted(thrown, loss).covariance)) for loss in ("linear", "soft_l1"))
    assert np.all(robust < plain)
    assert np.all(robust > 0.9 * clean)
    assert np.all(robust < 2.0 * clean)


def test_the_profile_of_a_robust_fit_has_the_interval_of_the_sandwich(experiment: Experiment) -> None:
    found = fitted(stray(experiment, 0.03, 4), "soft_l1")
    curve, estimate = profile(found, "foot_plate.inertia"), found.estimate("foot_plate.inertia")
    assert curve.low is not None
    assert curve.high is not None
    assert curve.low == pytest.approx(estimate.low, abs=0.2 * estimate.half_width)
    assert curve.high == pytest.approx(estimate.high, abs=0.2 * estimate.half_width)
