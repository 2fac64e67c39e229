"""Runs of a scenario as columns: the same numbers as one by one, failures counted and named."""

import numpy as np
import pytest

from ppafo.errors import StudyError
from ppafo.progress import Progress
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.simulate import simulate
from ppafo.studies.outcomes import Outcomes, Tally, check_failures, check_metrics, join, scenario_model

SHORT = ("run.duration=0.2 s",)


def test_each_run_gives_what_it_gives_alone() -> None:
    scenario = load_scenario("torque-task-proportional", SHORT)
    outcomes = scenario_model(scenario, ["rms_error", "gas_supplied"])({"valve.area": np.array([10e-6, 12e-6])})
    alone = simulate("torque-task-proportional", [*SHORT, "valve.area=12 mm^2"]).metrics
    assert outcomes.metrics["rms_error"][1] == pytest.approx(alone["rms_error"].value, rel=1e-9)
    assert outcomes.metrics["gas_supplied"][1] == pytest.approx(alone["gas_supplied"].value, rel=1e-9)
    assert outcomes.failures == 0


def test_a_run_that_is_refused_is_a_failure_with_its_reason() -> None:
    scenario = load_scenario("torque-task-proportional", SHORT)
    outcomes = scenario_model(scenario, ["rms_error"])({"valve.area": np.array([10e-6, -1.0, 12e-6])})
    assert outcomes.failed.tolist() == [False, True, False]
    assert np.isnan(outcomes.metrics["rms_error"][1])
    assert "valve.area" in outcomes.reason
    with pytest.raises(StudyError, match=r"trial: 1 of 3 runs failed \(33.3 %\), more than the 10 %.*valve.area"):
        check_failures(outcomes, 0.1, "trial")
    check_failures(outcomes, 0.34, "trial")


def test_metrics_are_checked_before_anything_runs() -> None:
    closed, opened = load_scenario("torque-task-proportional"), load_scenario("step-response")
    with pytest.raises(StudyError, match="no metric 'rms_eror', did you mean 'rms_error'"):
        check_metrics(["rms_eror"], closed)
    with pytest.raises(StudyError, match="has no 'rms_error': its controller follows no reference"):
        check_metrics(["rms_error"], opened)
    with pytest.raises(StudyError, match="'peak_error' is named twice"):
        check_metrics(["peak_error", "peak_error"], closed)


def test_pieces_are_joined_with_the_first_reason() -> None:
    def piece(failed: bool, reason: str) -> Outcomes:
        return Outcomes({"x": np.array([1.0])}, np.array([failed]), reason)

    whole = join([piece(False, ""), piece(True, "first"), piece(True, "second")])
    assert (whole.runs, whole.failures, whole.reason) == (3, 2, "first")


def test_progress_grows_where_there_are_more_runs_than_were_thought() -> None:
    seen: list[Progress] = []
    tally = Tally(100, seen.append)
    for runs in (100, 100, 200):
        tally.add(runs, 1)
    assert [(item.total, item.done, item.failed) for item in seen] == [(100, 100, 1), (200, 200, 2), (400, 400, 3)]
