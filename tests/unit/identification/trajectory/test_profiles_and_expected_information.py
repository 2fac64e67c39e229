import dataclasses

import numpy as np
import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.trajectory import (
    Candidate,
    Experiment,
    FreeParameter,
    Search,
    TrajectoryFit,
    TrajectoryProblem,
    expected_information,
    fit,
    profile,
)
from ppafo.identification.trajectory.problem import with_numbers
from ppafo.simulation.loading import load_scenario

NOISE = {"angle": 0.0017, "pressure_1": 500.0, "pressure_2": 500.0}


@pytest.fixture(scope="module")
def found(experiment: Experiment) -> TrajectoryFit:
    """Flow, leak and damping, the leak weakly."""
    paths = ("valve.discharge_coefficient", "actuator.leak.area", "friction.viscous_damping")
    return fit(TrajectoryProblem(tuple(FreeParameter(path) for path in paths), (experiment,)))


@pytest.mark.parametrize("path", ["valve.discharge_coefficient", "friction.viscous_damping"])
def test_a_profile_agrees_with_the_interval_where_the_likelihood_is_normal(found: TrajectoryFit, path: str) -> None:
    curve, estimate = profile(found, path), found.estimate(path)
    assert curve.threshold == pytest.approx(3.84, abs=0.01)
    assert curve.low is not None
    assert curve.high is not None
    assert curve.low == pytest.approx(estimate.low, abs=0.15 * estimate.half_width)
    assert curve.high == pytest.approx(estimate.high, abs=0.15 * estimate.half_width)


def test_a_profile_is_lowest_at_the_estimate_and_rises_on_both_sides(found: TrajectoryFit) -> None:
    curve = profile(found, "valve.discharge_coefficient")
    middle = int(np.argmin(curve.rises))
    estimate = found.estimate("valve.discharge_coefficient")
    # The profile is lowest at the optimum, the estimate is the mean over all noises that agree with the residuals.
    assert curve.numbers[middle] == pytest.approx(estimate.value, abs=0.1 * estimate.half_width)
    assert np.all(np.diff(curve.rises[middle:]) > 0.0)
    assert np.all(np.diff(curve.rises[: middle + 1]) < 0.0)


def test_holding_one_costs_more_where_the_others_cannot_follow(found: TrajectoryFit, experiment: Experiment) -> None:
    alone = fit(TrajectoryProblem((FreeParameter("friction.viscous_damping"),), (experiment,)))
    narrow, wide = profile(alone, "friction.viscous_damping"), profile(found, "friction.viscous_damping")
    assert narrow.high is not None
    assert narrow.low is not None
    assert wide.high is not None
    assert wide.low is not None
    assert narrow.high - narrow.low < wide.high - wide.low


def test_a_profile_of_a_number_that_nothing_bounds_is_open(experiment: Experiment) -> None:
    silent = FreeParameter("supply.dorsiflexion_pressure")
    # Chamber 2 would start at the pressure of its regulator; with a start of its own, it never meets that regulator.
    start = {"initial.pressure_2": experiment.scenario.initial_pressure_2}
    apart = dataclasses.replace(experiment, scenario=with_numbers(experiment.scenario, start))
    both = fit(TrajectoryProblem((FreeParameter("friction.viscous_damping"), silent), (apart,)))
    curve = profile(both, "supply.dorsiflexion_pressure")
    assert curve.low is None
    assert curve.high is None
    assert np.max(curve.rises) < 0.01


def test_a_profile_of_what_was_not_fitted_is_refused(found: TrajectoryFit) -> None:
    with pytest.raises(IdentificationError, match=r"did you mean 'friction\.viscous_damping'"):
        profile(found, "friction.viscous_dampin")


def test_the_experiment_that_lets_the_leak_be_seen_is_recommended_first(found: TrajectoryFit) -> None:
    slow = load_scenario("step-response", ["controller.command=0.05", "run.duration=2 s", "name=slow"])
    shut = load_scenario("step-response", ["controller.command=0", "run.duration=2 s", "name=shut"])
    again = found.scenarios[0]
    candidates = [Candidate(one.name, one, NOISE) for one in (again, slow, shut)]
    ranked = expected_information(found, candidates)
    gains = [one.gain for one in ranked]
    assert gains == sorted(gains, reverse=True)
    assert ranked[-1].label == again.name
    assert {one.label: one.most_helped for one in ranked}["shut"] == "actuator.leak.area"


def test_the_same_experiment_again_narrows_everything_by_the_square_root_of_two(
    found: TrajectoryFit, experiment: Experiment
) -> None:
    (again,) = expected_information(found, [Candidate("again", experiment.scenario, experiment.noise)])
    for share in again.shrinkage.values():
        assert share == pytest.approx(1.0 / np.sqrt(2.0 / found.uncertainty.inflation), rel=0.12)
    assert again.gain == pytest.approx(1.5 * np.log(2.0), rel=0.2)


def test_more_noise_brings_less(found: TrajectoryFit, experiment: Experiment) -> None:
    loud = {name: 3.0 * noise for name, noise in NOISE.items()}
    quiet, noisy = expected_information(
        found, [Candidate("noisy", experiment.scenario, loud), Candidate("quiet", experiment.scenario, NOISE)]
    )
    assert (quiet.label, noisy.label) == ("quiet", "noisy")
    assert quiet.gain > 2.0 * noisy.gain


def test_a_candidate_without_noise_is_refused(found: TrajectoryFit, experiment: Experiment) -> None:
    with pytest.raises(IdentificationError, match="noise must be above 0"):
        expected_information(found, [Candidate("free", experiment.scenario, {})])


def test_a_shorter_candidate_brings_less(found: TrajectoryFit, experiment: Experiment) -> None:
    short = dataclasses.replace(experiment.scenario, duration=0.1)
    ranked = expected_information(
        found, [Candidate("short", short, NOISE), Candidate("whole", experiment.scenario, NOISE)]
    )
    assert [one.label for one in ranked] == ["whole", "short"]


@pytest.mark.parametrize("loss", ["huber", "soft_l1"])
def test_a_profile_counts_with_the_loss_of_the_fit(experiment: Experiment, loss: str) -> None:
    damping = FreeParameter("friction.viscous_damping")
    robust = fit(TrajectoryProblem((damping,), (experiment,), Search(loss=loss)))  # type: ignore[arg-type]
    curve, (estimate,) = profile(robust, "friction.viscous_damping"), robust.estimates
    assert curve.low is not None
    assert curve.high is not None
    # The information of a robust loss leaves out its curvature, which makes its intervals a little narrower or wider.
    assert curve.high - curve.low == pytest.approx(2.0 * estimate.half_width, rel=0.2)
