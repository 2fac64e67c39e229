"""The trajectory fit on one step response with planted values."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.run import batch_of, state_row_numbers
from ppafo.identification.fit import FitNumber
from ppafo.identification.trajectory import fitting
from ppafo.identification.trajectory.experiment import (
    FittedExperiment,
    TrajectoryProblem,
    number_at,
    with_numbers,
)
from ppafo.identification.trajectory.fitting import FIT_TOLERANCE, TrajectoryFit, fit, prepare, run_with, signals_of
from ppafo.running import simulate
from ppafo.signals.recording import Recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario

INERTIA = FitNumber("foot_plate.inertia", start=0.010)
FLOW = FitNumber("valve.discharge_coefficient", start=0.10)
DAMPING = FitNumber("friction.viscous_damping", start=0.025)


def fitted(experiment: FittedExperiment, *parameters: FitNumber) -> TrajectoryFit:
    return fit(TrajectoryProblem(parameters, (experiment,)))


@pytest.fixture(scope="module")
def three(experiment: FittedExperiment) -> TrajectoryFit:
    """Flow, inertia and damping from one step response."""
    return fitted(experiment, FLOW, INERTIA, DAMPING)


def test_three_planted_values_are_found_and_called_identified(three: TrajectoryFit, step: Scenario) -> None:
    for estimate in three.estimates:
        assert estimate.verdict == "identified"
        assert {type(number) for number in (estimate.value, estimate.low, estimate.high)} == {float}
        assert estimate.wider_half_width < 0.02 * estimate.value
        # Three standard errors: 3/1.96 half widths.
        assert abs(estimate.value - number_at(step, estimate.path)) < 3.0 / 1.96 * estimate.wider_half_width
        assert estimate.recordings == ("synthetic step-response",)


def test_the_noise_that_was_put_on_the_samples_is_found(three: TrajectoryFit, experiment: FittedExperiment) -> None:
    assert len(three.channels) == 3
    for channel in three.channels:
        assert channel.noise == pytest.approx(experiment.noise[channel.channel], rel=0.12)
        assert channel.rms == pytest.approx(channel.noise, rel=0.12)
    assert three.conflict == ""
    assert three.faults == ()


def test_a_search_that_ends_where_no_run_succeeds_says_which_number_is_favoured(
    three: TrajectoryFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = dataclasses.replace(three.fit, has_converged=False, edge={"foot_plate.inertia": 1})
    monkeypatch.setattr(fitting, "fit_residuals", lambda *_arguments, **_settings: ended)
    (remark,) = fit(three.problem).faults
    value = three["foot_plate.inertia"].value
    assert f"the recordings favour foot_plate.inertia above {value:.4g} kg m^2, where every run fails" in remark
    assert "before it converged" not in remark


def test_fitted_runs_are_those_of_a_simulation_with_the_estimates(three: TrajectoryFit) -> None:
    again = simulate(three.scenarios[0]).recording
    assert three.models[0]["angle"] == pytest.approx(again["angle"], abs=2e-3)
    assert three.models[0].kind == "simulated"
    assert three.measurements[0].kind == "synthetic"


def test_covariance_and_interval_belong_together(three: TrajectoryFit) -> None:
    errors = np.sqrt(np.diag(three.covariance))
    inertia = three["foot_plate.inertia"]
    assert inertia.wider_half_width == pytest.approx(1.96 * errors[1], rel=0.02)


def test_an_estimate_is_found_by_the_short_path_of_the_valve(three: TrajectoryFit) -> None:
    assert three["valves.proportional.discharge_coefficient"] is three.estimates[0]


def test_columns_are_the_runs_that_simulate_makes_with_less_error(experiment: FittedExperiment) -> None:
    numbers = TrajectoryProblem((INERTIA,), (experiment,)).numbers
    prepared = prepare(experiment, {})
    (signals,) = signals_of([prepared], numbers, np.array([[0.010, 0.0084]]))
    assert run_with(prepared, {"foot_plate.inertia": 0.0084}).plant.inertia == 0.0084
    run = dataclasses.replace(plan_run(experiment.scenario), tolerance=FIT_TOLERANCE)
    exact = run_batch(batch_of(run)).record[:, state_row_numbers(run)["state.angle"], 0]
    assert signals["angle"][:, 1] == pytest.approx(exact, abs=1e-12)
    clean = simulate(experiment.scenario).recording
    assert signals["pressure_2"][:, 1] == pytest.approx(clean["pressure_2"], rel=1e-4)
    assert np.abs(signals["angle"][:, 0] - clean["angle"]).max() > 0.01


def test_area_and_discharge_coefficient_are_not_identifiable_together(experiment: FittedExperiment) -> None:
    found = fitted(experiment, FLOW, FitNumber("valve.area"), INERTIA)
    assert [one.verdict for one in found.estimates] == ["not identifiable", "not identifiable", "identified"]
    assert "trades off against valves.proportional.area" in found.estimates[0].explanation
    product = found["valves.proportional.area"].value * found["valves.proportional.discharge_coefficient"].value
    assert product == pytest.approx(31.6e-6 * 0.113, rel=3e-3)


def test_a_number_that_does_nothing_is_not_identifiable_and_says_so(experiment: FittedExperiment) -> None:
    # Chamber 2 would start at the pressure of its regulator; with a start of its own, it never meets that regulator.
    start = {"initial.pressure_2": experiment.scenario.initial.pressure_2}
    apart = dataclasses.replace(experiment, scenario=with_numbers(experiment.scenario, start))
    found = fitted(apart, INERTIA, FitNumber("supply.dorsiflexion_pressure"))
    assert found["supply.dorsiflexion_pressure"].verdict == "not identifiable"
    said = "the recordings are hardly sensitive to this parameter"
    assert found["supply.dorsiflexion_pressure"].explanation == said
    assert found["foot_plate.inertia"].verdict == "identified"


def test_a_bound_that_keeps_the_truth_out_is_named(experiment: FittedExperiment) -> None:
    found = fitted(experiment, FLOW, FitNumber("foot_plate.inertia", start=0.012, low=0.010, high=0.02))
    inertia = found["foot_plate.inertia"]
    assert inertia.verdict == "at its bound"
    assert "at or beyond 0.01 kg m^2" in inertia.explanation
    assert inertia.value == pytest.approx(0.010, rel=1e-6)


def test_a_model_that_lacks_something_holds_for_itself_only(experiment: FittedExperiment) -> None:
    loaded = load_scenario(
        "step-response", ["motion.kind=free", "run.duration=0.35 s", "foot_plate.gravity_torque=0.4 N m"]
    )
    poor = fitted(dataclasses.replace(experiment, scenario=loaded), FLOW)
    assert abs(poor.estimates[0].value - 0.113) > poor.estimates[0].wider_half_width
    assert poor.estimates[0].verdict == "holds for this model only"
    assert not poor.estimates[0].is_identified
    assert "fitted alone, " in poor.conflict


def test_a_prior_decides_where_the_recordings_are_silent(experiment: FittedExperiment) -> None:
    found = fitted(experiment, FLOW, FitNumber("valve.area", start=31.6e-6, deviation=0.316e-6))
    area = found["valves.proportional.area"]
    assert area.value == pytest.approx(31.6e-6, rel=1e-3)
    assert area.wider_half_width == pytest.approx(0.0196 * area.value, rel=0.05)
    assert found["valves.proportional.discharge_coefficient"].verdict == "identified"
    assert "valves.proportional.area" in found["valves.proportional.discharge_coefficient"].explanation


def test_an_initial_pressure_of_one_recording_is_found(experiment: FittedExperiment) -> None:
    start = FitNumber("initial.pressure_2", start=4.4e5, low=4.0e5, high=5.2e5, recordings=("step",))
    (estimate,) = fitted(experiment, start).estimates
    assert (estimate.path, estimate.unit) == ("initial.pressure_2 of step", "Pa")
    assert abs(estimate.value - experiment.scenario.initial.pressure_2) < 3.0 / 1.96 * estimate.wider_half_width
    assert estimate.verdict == "identified"


def test_a_number_limited_to_one_recording_leaves_the_other_alone(
    experiment: FittedExperiment, step: Scenario, recorded: Callable[..., Recording]
) -> None:
    start = f"initial.pressure_2={step.initial.pressure_2} Pa_a"
    low = load_scenario(
        "step-response", ["motion.kind=free", "run.duration=0.35 s", "supply.pressure=45 psi_g", start, "name=low"]
    )
    # The model of the second starts there too, and not at the supply that is fitted.
    second = FittedExperiment(
        "low", load_scenario("step-response", ["motion.kind=free", "run.duration=0.35 s", start]), recorded(low)
    )
    supplies = tuple(FitNumber("supply.pressure", recordings=(label,)) for label in ("step", "low"))
    found = fit(TrajectoryProblem(supplies, (experiment, second)))
    high, less = (estimate.value for estimate in found.estimates)
    assert high == pytest.approx(number_at(step, "supply.pressure"), rel=1e-3)
    assert less == pytest.approx(number_at(low, "supply.pressure"), rel=1e-3)


@pytest.mark.short
@pytest.mark.parametrize("is_right", [True, False], ids=["right model", "model that lacks a torque"])
def test_a_fit_ends_at_the_same_numbers_from_several_starts(experiment: FittedExperiment, is_right: bool) -> None:
    """To a hundredth of each interval, also beside static friction, which trades off against its fall."""
    paths = ["valve.discharge_coefficient"]
    starts = [(0.10,), (0.13,)]
    if is_right:
        paths += ["foot_plate.inertia", "friction.static_torque"]
        starts = [(0.10, 0.010, 0.6), (0.3, 0.0042, 1.0), (0.12, 0.012, 0.35)]
    lacking = ["motion.kind=free", "run.duration=0.35 s", "foot_plate.gravity_torque=0.4 N m"]
    scenario = experiment.scenario if is_right else load_scenario("step-response", lacking)
    fits = [
        fitted(dataclasses.replace(experiment, scenario=scenario), *map(FitNumber, paths, start)) for start in starts
    ]
    ends = np.array([[(one.value, one.low, one.high) for one in found.estimates] for found in fits])
    widths = (ends[:, :, 2] - ends[:, :, 1]).min(axis=0)
    assert np.all(np.ptp(ends, axis=0) < 0.01 * widths[:, None])
    assert {one.verdict == "holds for this model only" for found in fits for one in found.estimates} == {not is_right}


def test_a_cylinder_is_fitted_as_a_vane_is(recorded: Callable[..., Recording]) -> None:
    scenario = load_scenario("step-response", ["device.set=cylinder-lever", "motion.kind=free", "run.duration=0.35 s"])
    experiment = FittedExperiment("cylinder", scenario, recorded(scenario))
    path = "valve.sonic_conductance" if hasattr(scenario.device.valve.orifice, "sonic_conductance") else FLOW.path
    truth = number_at(scenario, path)

    (estimate,) = fitted(experiment, FitNumber(path, start=0.8 * truth)).estimates

    assert estimate.verdict == "identified"
    assert abs(estimate.value - truth) < 3.0 / 1.96 * estimate.wider_half_width < 0.1 * truth
