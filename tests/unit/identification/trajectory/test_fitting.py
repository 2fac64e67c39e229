import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.run import batch_of
from ppafo.errors import IdentificationError
from ppafo.identification.trajectory import (
    Experiment,
    FreeParameter,
    Prior,
    Search,
    TrajectoryFit,
    TrajectoryProblem,
    fit,
    search,
)
from ppafo.identification.trajectory.fitting import residuals_of
from ppafo.identification.trajectory.problem import number_at, with_numbers
from ppafo.identification.trajectory.residuals import FIT_TOLERANCE, run_with, trajectories
from ppafo.identification.trajectory.search import Optimum
from ppafo.running import simulate
from ppafo.signals.recording import Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.sampled import state_row_numbers
from ppafo.simulation.scenario import Scenario

INERTIA = FreeParameter("foot_plate.inertia", start=0.010)
FLOW = FreeParameter("valve.discharge_coefficient", start=0.10)
DAMPING = FreeParameter("friction.viscous_damping", start=0.025)


def fitted(experiment: Experiment, *parameters: FreeParameter, search: Search | None = None) -> TrajectoryFit:
    return fit(TrajectoryProblem(parameters, (experiment,), search or Search()))


@pytest.fixture(scope="module")
def three(experiment: Experiment) -> TrajectoryFit:
    """Flow, inertia and damping from one step response."""
    return fitted(experiment, FLOW, INERTIA, DAMPING)


def test_three_planted_values_are_found_and_called_identified(three: TrajectoryFit, step: Scenario) -> None:
    for estimate in three.estimates:
        assert estimate.verdict == "identified"
        assert {type(number) for number in (estimate.value, estimate.low, estimate.high)} == {float}
        assert estimate.relative_half_width < 0.02
        # Three standard errors: 3/1.96 half widths.
        assert abs(estimate.value - number_at(step, estimate.path)) < 3.0 / 1.96 * estimate.half_width
        assert estimate.recordings == ("synthetic step-response",)


@pytest.mark.parametrize("goes_on", [False, True])
def test_a_search_that_ends_above_a_fit_with_a_number_held_goes_on_from_there_or_has_not_settled(
    experiment: Experiment, monkeypatch: pytest.MonkeyPatch, goes_on: bool
) -> None:
    residuals = residuals_of(TrajectoryProblem((FLOW, INERTIA), (experiment,)))
    start = np.array([item.coordinate(item.start) for item in residuals.ranges])

    def cost(point: np.ndarray) -> float:
        return 0.5 * float(np.sum(np.square(residuals.of_data(point[None, :]))))

    def stuck(_residuals: object, point: np.ndarray, _search: Search) -> Optimum:
        end = point if goes_on else start
        return Optimum(residuals, end, cost(end), 1, np.eye(2), True)

    monkeypatch.setattr(search, "_refine", stuck)
    found = search.optimum(residuals, Search())
    assert found.has_converged == goes_on
    assert (found.cost < 0.9 * cost(start)) == goes_on


def test_residuals_are_white_and_as_large_as_the_noise(three: TrajectoryFit) -> None:
    assert len(three.channels) == 3
    for channel in three.channels:
        assert channel.is_given
        assert channel.chi_square == pytest.approx(1.0, abs=0.25)
        assert abs(channel.autocorrelation) < 0.2
    assert three.uncertainty.inflation < 1.3
    assert three.remarks == ()


def test_fitted_runs_are_those_of_a_simulation_with_the_estimates(three: TrajectoryFit) -> None:
    again = simulate(three.scenarios[0]).recording
    assert three.models[0]["angle"] == pytest.approx(again["angle"], abs=2e-3)
    assert three.models[0].kind == "simulated"
    assert three.measurements[0].kind == "synthetic"


def test_covariance_and_correlation_belong_together(three: TrajectoryFit) -> None:
    errors = np.sqrt(np.diag(three.covariance))
    assert three.correlation == pytest.approx(three.covariance / np.outer(errors, errors))
    inertia = three.estimate("foot_plate.inertia")
    assert inertia.half_width == pytest.approx(1.96 * errors[1], rel=0.02)


def test_an_estimate_is_found_by_the_short_path_of_the_valve(three: TrajectoryFit) -> None:
    assert three.estimate("valve.discharge_coefficient") is three.estimates[0]
    with pytest.raises(IdentificationError, match="was not fitted, did you mean"):
        three.estimate("foot_plate.inertias")


def test_columns_are_the_runs_that_simulate_makes_with_less_error(experiment: Experiment) -> None:
    residuals = residuals_of(TrajectoryProblem((INERTIA,), (experiment,)))
    points = np.log(np.array([[0.010], [0.0084]]))
    signals = trajectories(residuals.experiments, residuals.ranges, points)[0]
    alone = run_with(residuals.experiments[0], {"foot_plate.inertia": 0.0084})
    assert alone.plant.inertia == 0.0084
    run = dataclasses.replace(plan_run(experiment.scenario), tolerance=FIT_TOLERANCE)
    exact = run_batch(batch_of(run)).record[:, state_row_numbers(run)["state.angle"], 0]
    assert signals["angle"][:, 1] == pytest.approx(exact, abs=1e-12)
    clean = simulate(experiment.scenario).recording
    assert signals["angle"][:, 1] == pytest.approx(clean["angle"], abs=1e-4)
    assert signals["pressure_2"][:, 1] == pytest.approx(clean["pressure_2"], rel=1e-4)
    assert np.abs(signals["angle"][:, 0] - clean["angle"]).max() > 0.01


def test_area_and_discharge_coefficient_are_not_identifiable_together(experiment: Experiment) -> None:
    found = fitted(experiment, FLOW, FreeParameter("valve.area"), INERTIA)
    verdicts = [estimate.verdict for estimate in found.estimates]
    assert verdicts == ["not identifiable", "not identifiable", "identified"]
    assert "valves.proportional.area (correlation -1.00)" in found.estimates[0].explanation
    product = found.values["valves.proportional.area"] * found.values["valves.proportional.discharge_coefficient"]
    assert product == pytest.approx(31.6e-6 * 0.113, rel=2e-3)


def test_all_torques_together_are_not_identifiable_without_a_known_one(experiment: Experiment) -> None:
    torque = FreeParameter("actuator.torque_constant")
    static, dynamic = FreeParameter("friction.static_torque"), FreeParameter("friction.dynamic_torque")
    found = fitted(experiment, torque, INERTIA, DAMPING, static, dynamic)
    assert found.estimate("actuator.torque_constant").verdict == "not identifiable"
    assert "trades off against" in found.estimate("foot_plate.inertia").explanation


def test_a_number_that_does_nothing_is_not_identifiable_and_says_so(experiment: Experiment) -> None:
    # Chamber 2 would start at the pressure of its regulator; with a start of its own, it never meets that regulator.
    start = {"initial.pressure_2": experiment.scenario.initial_pressure_2}
    apart = dataclasses.replace(experiment, scenario=with_numbers(experiment.scenario, start))
    found = fitted(apart, INERTIA, FreeParameter("supply.dorsiflexion_pressure"))
    assert found.estimate("supply.dorsiflexion_pressure").verdict == "not identifiable"
    assert "hardly sensitive" in found.estimate("supply.dorsiflexion_pressure").explanation


def test_a_bound_that_keeps_the_truth_out_is_named(experiment: Experiment) -> None:
    found = fitted(experiment, FLOW, FreeParameter("foot_plate.inertia", start=0.012, low=0.010, high=0.02))
    inertia = found.estimate("foot_plate.inertia")
    assert inertia.verdict == "at its bound"
    assert "lower bound, 0.01 kg m^2" in inertia.explanation
    assert inertia.value == pytest.approx(0.010, rel=1e-3)


def test_a_model_that_lacks_something_caps_its_verdicts(experiment: Experiment) -> None:
    whole = fitted(experiment, FLOW)
    wrong = dataclasses.replace(
        experiment,
        scenario=load_scenario(
            "step-response", ["motion.kind=free", "run.duration=0.35 s", "foot_plate.gravity_torque=0.4 N m"]
        ),
    )
    poor = fitted(wrong, FLOW)
    # Wider, but nowhere near the error: residuals alone cannot say how far a wrong model is off.
    assert poor.estimates[0].half_width > 1.5 * whole.estimates[0].half_width
    assert abs(poor.estimates[0].value - 0.113) > 10.0 * poor.estimates[0].half_width
    assert poor.estimates[0].verdict == "holds for this model only"
    assert not poor.estimates[0].is_identified
    assert poor.misfit, poor.remarks
    unknown = fitted(dataclasses.replace(wrong, noise={}), FLOW)
    assert unknown.estimates[0].verdict == "holds for this model only"
    assert unknown.misfit, unknown.remarks


def test_a_prior_decides_where_the_recordings_are_silent(experiment: Experiment) -> None:
    prior = Prior(31.6e-6, 0.316e-6)
    found = fitted(experiment, FLOW, FreeParameter("valve.area", start=28e-6, prior=prior))
    area = found.estimate("valve.area")
    assert area.value == pytest.approx(31.6e-6, rel=1e-3)
    assert area.relative_half_width == pytest.approx(0.0196, rel=0.05)
    assert "prior" in area.explanation
    assert found.estimate("valve.discharge_coefficient").verdict == "identified"


@pytest.mark.parametrize("loss", ["huber", "soft_l1"])
def test_a_robust_loss_withstands_stray_samples(experiment: Experiment, loss: str) -> None:
    angle = experiment.recording["angle"].copy()
    angle[60:140:4] += 0.2
    stray = dataclasses.replace(experiment, recording=experiment.recording.with_channel("angle", angle, "rad"))
    plain = fitted(stray, FLOW, INERTIA, search=Search())
    robust = fitted(stray, FLOW, INERTIA, search=Search(loss=loss))  # type: ignore[arg-type]
    for found in (plain, robust):
        # Least squares would be 3 % off. The noise of the angle has heavy tails, which both come to know.
        assert found.values["foot_plate.inertia"] == pytest.approx(0.0084, rel=2e-3)
        assert any(sensor.channel == "angle" and sensor.noise.is_heavy for sensor in found.uncertainty.sensors)


def test_an_initial_pressure_of_one_recording_is_found(experiment: Experiment) -> None:
    start = FreeParameter("initial.pressure_2", start=4.4e5, low=4.0e5, high=5.2e5, recordings=("step",))
    found = fitted(experiment, start)
    (estimate,) = found.estimates
    assert estimate.path == "initial.pressure_2 of step"
    assert estimate.unit == "Pa"
    truth = experiment.scenario.initial_pressure_2
    assert abs(estimate.value - truth) < 3.0 / 1.96 * estimate.half_width
    assert estimate.verdict == "identified"


def test_a_start_that_comes_out_below_the_atmosphere_is_refused_with_what_it_hints_at(
    experiment: Experiment, step: Scenario, recorded: Callable[..., Recording]
) -> None:
    drawn = recorded(with_numbers(step, {"initial.pressure_1": 8.0e4}))
    start = FreeParameter("initial.pressure_1", start=101325.0, recordings=("step",))
    with pytest.raises(
        IdentificationError, match=r"initial.pressure_1.* below the atmosphere .* gauge pressure is read"
    ):
        fitted(dataclasses.replace(experiment, recording=drawn), start)


def test_a_number_limited_to_one_recording_leaves_the_other_alone(
    experiment: Experiment, step: Scenario, recorded: Callable[..., Recording]
) -> None:
    start = f"initial.pressure_2={step.initial_pressure_2} Pa_a"
    low = load_scenario(
        "step-response", ["motion.kind=free", "run.duration=0.35 s", "supply.pressure=45 psi_g", start, "name=low"]
    )
    # The model of the second starts there too, and not at the supply that is fitted.
    second = Experiment(
        "low", load_scenario("step-response", ["motion.kind=free", "run.duration=0.35 s", start]), recorded(low)
    )
    supplies = tuple(FreeParameter("supply.pressure", recordings=(label,)) for label in ("step", "low"))
    found = fit(TrajectoryProblem(supplies, (experiment, second)))
    high, less = (estimate.value for estimate in found.estimates)
    assert high == pytest.approx(number_at(step, "supply.pressure"), rel=1e-3)
    assert less == pytest.approx(number_at(low, "supply.pressure"), rel=1e-3)


def test_further_starts_find_what_the_first_one_misses(experiment: Experiment) -> None:
    far = [FreeParameter("foot_plate.inertia", start=0.0042), FreeParameter("valve.discharge_coefficient", start=0.3)]
    found = fitted(experiment, *far, search=Search(other_starts=2))
    assert found.values["foot_plate.inertia"] == pytest.approx(0.0084, rel=0.01)


def test_the_same_problem_gives_the_same_numbers(experiment: Experiment) -> None:
    first, second = (fitted(experiment, FLOW, INERTIA, search=Search(other_starts=1)) for _ in range(2))
    assert first.values == second.values


def test_a_search_that_is_cut_short_says_so(experiment: Experiment) -> None:
    found = fitted(experiment, FLOW, INERTIA, DAMPING, search=Search(maximum_evaluations=2))
    assert any("before it converged" in remark for remark in found.remarks)


def test_half_widths_of_a_logarithm_are_ratios(three: TrajectoryFit) -> None:
    flow = three.estimates[0]
    assert math.sqrt(flow.low * flow.high) == pytest.approx(flow.value)
