"""Runs: columns in, rows out; failures counted."""

from collections.abc import Mapping

import numpy as np
import pytest

from ppafo.errors import StudyError
from ppafo.progress import Progress
from ppafo.running import simulate
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.studies.distributions import Floats
from ppafo.study.runs import FAILED, RunCounter, Runs, scenario_runs, settled
from tests.model_runs import model_runs

SHORT = ("run.duration=0.2 s",)


def runs_of(*metrics: str) -> Runs:
    """Runs of a short task."""
    return scenario_runs(load_scenario("torque-task-proportional", SHORT), metrics, RunCounter(1, None))


def test_each_run_gives_what_it_gives_alone() -> None:
    runs = runs_of("rms_error", "gas_supplied")
    rows = runs.run({"valve.area": np.array([10e-6, 12e-6])})
    alone = simulate("torque-task-proportional", [*SHORT, "valve.area=12 mm^2"]).metrics
    assert rows["rms_error"][1] == pytest.approx(alone["rms_error"].value, rel=1e-9)
    assert rows["gas_supplied"][1] == pytest.approx(alone["gas_supplied"].value, rel=1e-9)
    assert runs.failures == 0


def test_a_run_of_a_study_oscillates_where_it_does_alone() -> None:
    # At 40 ms its command hardly reverses: the swing of the torque alone tells.
    task = "torque-task-slow-valve"
    changes = ["reference.level=4 N m", "supply.pressure=80 psi_g", "controller.dead_band=0"]
    changes += ["controller.proportional_gain=0.5 1/(N m)", "controller.integral_gain=1 1/(N m s)"]
    scenario, columns = load_scenario(task, changes), {"sensors.delay": np.array([0.0, 20e-3, 40e-3])}
    rows = scenario_runs(scenario, ["rms_error"], RunCounter(3, None)).run(columns)
    alone = [simulate(task, [*changes, f"sensors.delay={delay:g} s"]).tracking for delay in columns["sensors.delay"]]
    assert [verdict.kind for verdict in alone] == ["", "oscillates", "oscillates"]
    assert rows["oscillates"].tolist() == [0.0, 1.0, 1.0]


def test_a_run_that_is_refused_is_a_failure_with_its_reason() -> None:
    runs = runs_of("rms_error")
    rows = runs.run({"valve.area": np.array([10e-6, -1.0, 12e-6])})
    assert rows[FAILED].tolist() == [False, True, False]
    assert np.isnan(rows["rms_error"][1])
    assert "valve.area" in runs.reason
    with pytest.raises(StudyError, match=r"trial: 1 of 3 runs failed \(33.3 %\), more than the 10 %.*valve.area"):
        runs.check(rows, 0.1, "trial")
    runs.check(rows, 0.34, "trial")


def test_rows_that_lack_a_metric_are_refused_as_those_that_failed() -> None:
    runs = model_runs(lambda columns: {"y": columns["x"], FAILED: np.zeros(4, dtype=np.bool_)}, ["y"])
    rows = runs.run({"x": np.array([1.0, np.nan, 3.0, 4.0])})
    with pytest.raises(StudyError, match="trial: 1 of 4 runs have no 'y'; choose another metric"):
        runs.check(rows, 0.2, "trial", ["y"])
    runs.check(rows, 0.25, "trial", ["y"])


def test_a_study_that_resumes_counts_on_from_what_is_there() -> None:
    seen: list[Progress] = []
    tally = RunCounter(100, seen.append, 40, 2)
    tally.add(30, 1)
    tally.add(30, 0)
    assert [(item.done, item.failed, item.earlier) for item in seen] == [(70, 3, 70), (100, 3, 70)]


def test_every_run_of_an_ensemble_is_counted_once_with_one_thread_and_with_several() -> None:
    base = load_scenario("torque-task-proportional", SHORT)
    columns = {"valve.area": np.linspace(10e-6, 12e-6, 100)}
    for threads in (1, 2):
        ended: list[int] = []
        run_ensemble(base, columns, ("rms_error",), threads=threads, count=ended.append)
        assert sum(ended) == 100
        ended.clear()
        run_ensemble(base, columns, ("rms_error",), threads=threads, errors=True, count=ended.append)
        assert sum(ended) == 100, "the second run of each, with finer steps, is no further run"


def test_runs_that_fail_are_counted_with_the_first_reason() -> None:
    def model(columns: Mapping[str, Floats]) -> dict[str, Floats]:
        return {"y": np.sqrt(columns["x"])}

    runs = model_runs(model, ["y"])
    with np.errstate(invalid="ignore"):
        runs.run({"x": np.array([1.0, -4.0])})
    last = runs.run({"x": np.array([9.0])})
    assert last["y"].tolist() == [3.0]
    assert (runs.count, runs.failures, runs.reason) == (3, 1, "diverged")


def test_only_a_loop_that_swings_in_the_settled_part_has_its_last_error_replaced() -> None:
    rows = {
        "final_error": np.array([0.1, 0.1, 0.5]),
        "settled_error": np.array([0.4, 0.4, 0.4]),
        "settled_turns": np.array([20.0, 2.0, 20.0]),
    }
    assert settled(rows, "final_error").tolist() == [0.4, 0.1, 0.5]
    assert settled(rows, "settled_error") is rows["settled_error"]
