"""Comparisons: pairs on known distributions, and configurations on tasks."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.analyses.compare import best_probabilities, compare, compare_pairs, pareto_front
from ppafo.errors import StudyError
from ppafo.studies.distributions import Distribution
from ppafo.studies.draws import Uncertainty
from ppafo.studies.study import RandomValue


def test_pairs_are_counted_and_incomplete_ones_left_out() -> None:
    first = np.array([1.0, 2.0, 4.0, np.nan, 5.0])
    second = np.array([0.5, 2.0, 6.0, 1.0, np.nan])
    item = compare_pairs(first, second, -1, 0.95)
    assert item is not None
    assert item.pairs == 3
    assert item.difference.value == pytest.approx((-0.5 + 0.0 + 2.0) / 3)
    assert item.change == pytest.approx(0.0)
    assert item.better is not None
    assert (item.better.value, item.equal) == pytest.approx((1 / 3, 1 / 3))


def test_more_is_better_where_the_metric_says_so() -> None:
    first, second = np.ones(10), np.array([2.0] * 7 + [0.5] * 3)
    less, more, neither = (compare_pairs(first, second, better, 0.95) for better in (-1, 1, 0))
    assert less is not None
    assert less.better is not None
    assert less.better.value == pytest.approx(0.3)
    assert more is not None
    assert more.better is not None
    assert more.better.value == pytest.approx(0.7)
    assert neither is not None
    assert neither.better is None


def test_configurations_that_are_equally_good_are_called_different_no_more_often_than_is_said() -> None:
    normals = Uncertainty(tuple(RandomValue(f"x{number}", Distribution("normal", (0.0, 1.0))) for number in range(6)))
    differs, is_better = [], []
    for seed in range(300):
        drawn = normals.replicated_columns(256, seed)
        shared = drawn["x0"] ** 2 + drawn["x1"]
        first = shared + 0.3 * drawn["x2"] + 0.2 * drawn["x4"] ** 3
        item = compare_pairs(first, shared + 0.3 * drawn["x3"] + 0.2 * drawn["x5"] ** 3, -1, 0.95)
        assert item is not None
        assert item.better is not None
        differs.append(not item.difference.low <= 0.0 <= item.difference.high)
        is_better.append(not item.better.low <= 0.5 <= item.better.high)
    assert 0.01 <= np.mean(differs) <= 0.08
    assert 0.01 <= np.mean(is_better) <= 0.08


def test_common_draws_see_a_difference_that_separate_draws_do_not() -> None:
    random = np.random.default_rng(3)
    device = random.normal(0.0, 1.0, 400)
    first, second = 10.0 + device, 9.95 + device + random.normal(0.0, 0.05, 400)
    together = compare_pairs(first, second, -1, 0.95)
    apart = compare_pairs(first, random.permutation(second), -1, 0.95)
    assert together is not None
    assert apart is not None
    assert together.difference.high < 0.0
    assert together.difference.width < 0.1 * apart.difference.width


def test_a_baseline_of_zero_has_no_relative_change() -> None:
    item = compare_pairs(np.zeros(5), np.ones(5), -1, 0.95)
    assert item is not None
    assert math.isnan(item.change)
    assert item.difference.value == 1.0


def test_no_pair_gives_nothing() -> None:
    assert compare_pairs(np.array([np.nan]), np.array([1.0]), -1, 0.95) is None


def test_the_best_of_several_is_counted_with_ties_for_all() -> None:
    values = [np.array([1.0, 3.0, 2.0, np.nan]), np.array([2.0, 1.0, 2.0, 0.0]), np.array([3.0, 4.0, 5.0, 1.0])]
    assert [share.value for share in best_probabilities(values, -1, 0.95)] == pytest.approx([2 / 3, 2 / 3, 0.0])


def test_the_front_has_what_nothing_beats_in_all_goals() -> None:
    points = np.array([[1.0, 5.0], [2.0, 2.0], [3.0, 1.0], [3.0, 2.0], [2.0, 2.0], [np.nan, 0.0]])
    assert pareto_front(points).tolist() == [True, True, True, False, True, False]


STUDY = "torque-task-uncertainty"


def test_the_paper_comes_out_and_holds_over_the_uncertainty_of_the_device() -> None:
    (cases,) = compare(study=STUDY, baseline="solenoid", draws=400).found.tasks.values()
    solenoid = next(case for case in cases if case.configuration == "solenoid")
    proportional = next(case for case in cases if case.configuration == "proportional")
    less_error = 1.0 - proportional.metrics["rms_error"].value / solenoid.metrics["rms_error"].value
    less_gas = 1.0 - proportional.metrics["gas_supplied"].value / solenoid.metrics["gas_supplied"].value
    assert less_error == pytest.approx(0.15, abs=0.01)
    assert less_gas == pytest.approx(0.63, abs=0.02)
    pairs = proportional.pairs
    for name in ("rms_error", "gas_supplied"):
        assert pairs[name].pairs == 400
        assert pairs[name].difference.high < 0.0
        assert pairs[name].change_low < pairs[name].change < pairs[name].change_high < 0.0
    assert pairs["gas_supplied"].better is not None
    assert pairs["gas_supplied"].better.low > 0.98


def test_all_configurations_see_the_same_draws() -> None:
    scenario = ppafo.load_scenario("torque-task-proportional", ["run.duration=0.3 s"])
    answer = compare({"one": scenario, "same": scenario}, study=STUDY, draws=64)
    (cases,) = answer.found.tasks.values()
    one, same = (case.rows for case in cases)
    assert one is not None
    assert same is not None
    assert np.ptp(one["rms_error"]) > 0.0
    assert np.array_equal(one["rms_error"], same["rms_error"])
    assert all(item.equal == 1.0 for item in cases[1].pairs.values())
    assert "gas_per_work" not in cases[0].best, "a locked ankle does no work, so none is the best in it"
    # No percentage of nothing, and no better one of two works.
    assert re.search(r"^mechanical_work +J +- +- +0 \[0, 0\] +-$", str(answer), re.MULTILINE)


def test_tasks_change_every_configuration() -> None:
    tasks = {"slow": ["reference.ramp_time=2 s"], "low": ["reference.level=3 N m"]}
    comparison = compare(["torque-task-solenoid", "torque-task-proportional"], tasks=tasks).found
    assert [(task, case.configuration) for task, cases in comparison.tasks.items() for case in cases] == [
        ("slow", "torque-task-solenoid"),
        ("slow", "torque-task-proportional"),
        ("low", "torque-task-solenoid"),
        ("low", "torque-task-proportional"),
    ]
    slow, low = comparison.tasks.values()
    assert {case.scenario.reference.ramp_time for case in slow} == {2.0}
    assert {case.scenario.reference.level for case in low} == {3.0}
    alone = ppafo.simulate("torque-task-solenoid", ["reference.level=3 N m"])
    assert low[0].metrics["rms_error"].value == alone.metrics["rms_error"].value


def test_without_a_reference_there_is_gas_and_no_error() -> None:
    slow = ppafo.load_scenario("step-response", ["valve.area=5 mm^2"])
    comparison = compare({"as it is": ppafo.load_scenario("step-response"), "small valve": slow}).found
    of_valve = ("switchings", "peak_torque", "command_reversals")
    assert tuple(comparison.metrics) == ("gas_supplied", "mechanical_work", "gas_per_work", *of_valve)


def test_a_run_that_ends_early_uses_little_gas_and_is_not_the_best() -> None:
    light = ["foot_plate.inertia=1e-12 kg m^2"]
    whole, ends = (ppafo.load_scenario("step-response", ["motion.kind=free", *more]) for more in ([], light))
    answer = compare({"whole": whole, "ends": ends})
    (cases,) = answer.found.tasks.values()
    assert [case.verdict for case in cases] == ["completed", "diverged"]
    assert cases[1].value("gas_supplied") < cases[0].value("gas_supplied")
    assert not cases[1].is_on_front
    assert "best:" not in str(answer)
    assert not answer.passed


def test_the_error_of_what_is_controlled_ranks_and_outputs_of_a_study_are_shown(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(
        'schema_version = 1\nname = "s"\noutputs.metrics = ["gas_leaked", "final_pressure_1_error"]\n'
        '[[configurations]]\nname = "a"\nscenario = "pressure-loop"\n'
        '[[configurations]]\nname = "b"\nscenario = "pressure-loop"\noverrides = ["supply.pressure=60 psi_g"]\n'
    )
    answer = compare(study=tmp_path / "s.toml")
    assert tuple(answer.found.metrics)[:3] == ("rms_pressure_1_error", "gas_leaked", "final_pressure_1_error")
    assert re.search(r"^best: rms_pressure_1_error: b ", str(answer), re.MULTILINE)
    assert "Gas leaked (g)" in str(answer)


FAST = ["controller.proportional_gain=60 1/(N m)", "controller.derivative_gain=0.05 s/(N m)", "valve.delay=5 ms"]


def test_a_loop_that_oscillates_is_said_and_is_on_no_front() -> None:
    fast = ppafo.load_scenario("torque-task-proportional", FAST)
    given = {"paper": ppafo.load_scenario("torque-task-proportional"), "fast": fast}
    finding = compare(given)
    assert finding.passed
    assert not compare(given, check=True).passed
    (cases,) = finding.found.tasks.values()
    assert [(case.verdict, case.is_on_front) for case in cases] == [
        ("beyond reach on purpose", True),
        ("oscillates", False),
    ]
    assert not any(case.follows for case in cases)
    said = [text for text in finding.found.remarks if "the torque loop oscillates" in text]
    assert len(said) == 1
    assert "controller.derivative_gain=0 s/(N m)'] it gives what the actuator can give" in said[0]


def test_a_scenario_that_was_changed_in_python_is_not_changed_back_in_silence() -> None:
    scenario = ppafo.load_scenario("torque-task-proportional")
    other = replace(scenario, name="longer", run=replace(scenario.run, duration=4.0))
    with pytest.raises(StudyError, match="'longer' was changed in Python"):
        compare([scenario, other], tasks={"slow": ["reference.ramp_time=2 s"]})


def test_a_value_that_is_drawn_for_all_and_set_in_one_is_refused() -> None:
    study = {
        "schema_version": 1,
        "name": "drawn",
        "configurations": [{"name": "one", "scenario": "torque-task-proportional"}],
        "vary": [{"path": "supply.pressure", "kind": "uniform", "minimum": "45 psi_g", "maximum": "55 psi_g"}],
        "sample": {"method": "random", "runs": 8},
        "outputs": {"metrics": ["rms_error"]},
    }
    pair = {
        "one": ppafo.load_scenario("torque-task-proportional"),
        "other": ppafo.load_scenario("torque-task-proportional", ["supply.pressure=60 psi_g"]),
    }
    with pytest.raises(StudyError, match=r"the study draws 'supply\.pressure' for every configuration"):
        compare(pair, study=study, draws=32)
