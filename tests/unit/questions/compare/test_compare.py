"""Comparisons of scenarios, with and without uncertainty."""

from dataclasses import replace

import numpy as np
import pytest

import ppafo
from ppafo.errors import StudyError
from ppafo.questions.compare.answer import all_remarks
from ppafo.questions.compare.solve import compare

STUDY = "torque-task-uncertainty"


def test_the_paper_comes_out_and_holds_over_the_uncertainty_of_the_device() -> None:
    comparison = compare(study=STUDY, baseline="solenoid", draws=400)
    solenoid = next(case for case in comparison.cases if case.configuration == "solenoid")
    proportional = next(case for case in comparison.cases if case.configuration == "proportional")
    less_error = 1.0 - proportional.metrics["rms_error"].value / solenoid.metrics["rms_error"].value
    less_gas = 1.0 - proportional.metrics["gas_supplied"].value / solenoid.metrics["gas_supplied"].value
    assert less_error == pytest.approx(0.15, abs=0.01)
    assert less_gas == pytest.approx(0.63, abs=0.02)
    pairs = {item.metric: item for item in comparison.pairs("as written", "proportional")}
    for name in ("rms_error", "gas_supplied"):
        assert pairs[name].pairs == 400
        assert pairs[name].difference.high < 0.0
        assert pairs[name].change_low < pairs[name].change < pairs[name].change_high < 0.0
    assert pairs["gas_supplied"].better is not None
    assert pairs["gas_supplied"].better.low > 0.98


def test_all_configurations_see_the_same_draws() -> None:
    scenario = ppafo.load_scenario("torque-task-proportional", ["run.duration=0.3 s"])
    comparison = compare({"one": scenario, "same": scenario}, STUDY, draws=64)
    one, same = (case.outcomes for case in comparison.cases)
    assert one is not None
    assert same is not None
    assert np.ptp(one.metrics["rms_error"]) > 0.0
    assert np.array_equal(one.metrics["rms_error"], same.metrics["rms_error"])
    assert all(item.equal == 1.0 for item in comparison.pairs("as written", "same"))


def test_tasks_change_every_configuration() -> None:
    tasks = {"slow": ["reference.ramp_time=2 s"], "low": ["reference.level=3 N m"]}
    comparison = compare(["torque-task-solenoid", "torque-task-proportional"], tasks=tasks)
    assert [(case.task, case.configuration) for case in comparison.cases] == [
        ("slow", "torque-task-solenoid"),
        ("slow", "torque-task-proportional"),
        ("low", "torque-task-solenoid"),
        ("low", "torque-task-proportional"),
    ]
    assert {case.scenario.reference.settings["ramp_time"] for case in comparison.of_task("slow")} == {2.0}
    assert {case.scenario.reference.settings["level"] for case in comparison.of_task("low")} == {3.0}
    alone = ppafo.simulate("torque-task-solenoid", ["reference.level=3 N m"])
    assert comparison.of_task("low")[0].metrics["rms_error"].value == alone.metrics["rms_error"].value


def test_without_a_reference_there_is_gas_and_no_error() -> None:
    slow = ppafo.load_scenario("step-response", ["valve.area=5 mm^2"])
    comparison = compare({"as it is": ppafo.load_scenario("step-response"), "small valve": slow})
    assert comparison.metrics == ("gas_supplied", "mechanical_work", "gas_per_work", "switchings")


def test_mistakes_are_one_line() -> None:
    with pytest.raises(StudyError, match="nothing to compare"):
        compare()
    with pytest.raises(StudyError, match="needs at least two configurations, there is 1"):
        compare(["torque-task-solenoid"])
    with pytest.raises(StudyError, match="two of the scenarios are named 'torque-task-solenoid'"):
        compare(["torque-task-solenoid", "torque-task-solenoid"])
    with pytest.raises(StudyError, match="baseline: no configuration 'solenoids', did you mean 'solenoid'"):
        compare(study=STUDY, baseline="solenoids")
    with pytest.raises(StudyError, match="draws = 3: must be at least 32"):
        compare(study=STUDY, draws=3)
    with pytest.raises(StudyError, match=r"confidence = 1\.0"):
        compare(study=STUDY, confidence=1.0)


def test_a_scenario_that_was_changed_in_python_is_not_changed_back_in_silence() -> None:
    scenario = ppafo.load_scenario("torque-task-proportional")
    other = replace(scenario, name="longer", duration=4.0)
    with pytest.raises(StudyError, match="'longer' was changed in Python"):
        compare([scenario, other], tasks={"slow": ["reference.ramp_time=2 s"]})


def test_configurations_that_do_another_thing_are_said_to() -> None:
    base = ppafo.load_scenario("torque-task-proportional")
    lower = ppafo.load_scenario("torque-task-proportional", ["reference.level=3 N m"])
    wider = ppafo.load_scenario("torque-task-proportional", ["valve.area=12 mm^2"])
    remarks = all_remarks(compare({"base": base, "lower": lower, "wider": wider}))
    assert len(remarks) == 1
    assert "lower follow a different reference" in remarks[0]
    assert all_remarks(compare({"base": base, "wider": wider})) == []
