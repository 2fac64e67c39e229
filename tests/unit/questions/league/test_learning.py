"""Iterative learning over repetitions of a task."""

import dataclasses

import numpy as np
import pytest

import ppafo
from ppafo.control.controllers.feedback import KNOTS
from ppafo.errors import ScenarioError
from ppafo.questions.league.learning import LearningLaw, knot_errors, learn, with_table
from ppafo.signals import Channel, Recording
from ppafo.simulation.scenario import Scenario

TASK = "torque-task-proportional"
LEARNER = ("reference.level=4 N m", "controller.kind=damped_proportional", "controller.proportional_gain=1.7 1/(N m)")


@pytest.fixture(scope="module")
def task() -> Scenario:
    """The torque task within reach of the supply, with the controller that learns."""
    return ppafo.load_scenario(TASK, LEARNER)


def test_learning_converges_on_the_nominal_device(task: Scenario) -> None:
    learning = learn(task)
    assert learning.is_converged
    assert learning.errors[learning.best] == min(learning.errors)
    assert min(learning.errors) < 0.15 * learning.errors[0]
    assert all(later < earlier for earlier, later in zip(learning.errors[:6], learning.errors[1:6], strict=False))


def test_the_best_table_gives_the_best_error_again(task: Scenario) -> None:
    learning = learn(task, LearningLaw(repetitions=4))
    assert not learning.is_converged
    assert len(learning.errors) == 4
    assert ppafo.simulate(learning.scenario).metrics["rms_error"].value == learning.errors[learning.best]


def test_without_memory_of_the_error_the_first_step_is_gain_times_error(task: Scenario) -> None:
    law = LearningLaw(gain=0.5, memory=1.0, filter_share=1.0, lead=0.0, repetitions=2)
    first = ppafo.simulate(task).recording
    expected = np.clip(0.5 * knot_errors(first, 0.1, 0.0), -1.0, 1.0)
    second = ppafo.simulate(with_table(task, expected)).metrics["rms_error"].value
    assert learn(task, law).errors[1] == pytest.approx(second, rel=1e-12)


def test_the_error_at_a_knot_is_that_of_a_straight_error_there_a_lead_later() -> None:
    time = np.linspace(0.0, 3.0, 3001)
    channels = {"reference": Channel(2.0 * time, "N m"), "torque": Channel(np.zeros_like(time), "N m")}
    errors = knot_errors(Recording("line", time, channels), 0.1, 0.02)
    assert errors[1:-2] == pytest.approx(2.0 * (0.1 * np.arange(1, KNOTS - 2) + 0.02), abs=1e-6)
    assert np.isfinite(errors).all()


def test_knots_beyond_the_recording_learn_nothing() -> None:
    time = np.linspace(0.0, 1.0, 1001)
    channels = {"reference": Channel(np.ones_like(time), "N m"), "torque": Channel(np.zeros_like(time), "N m")}
    errors = knot_errors(Recording("short", time, channels), 0.1, 0.0)
    assert errors[:11] == pytest.approx(1.0)
    assert errors[11:] == pytest.approx(0.0)


def test_a_controller_without_a_table_is_refused() -> None:
    with pytest.raises(ScenarioError, match="only the controller 'damped_proportional' has a table to learn, not pid"):
        learn(ppafo.load_scenario(TASK))


def test_a_task_longer_than_the_table_is_refused_with_the_spacing_that_would_do(task: Scenario) -> None:
    with pytest.raises(
        ScenarioError, match=r"reaches to 3 s, the task lasts 6 s: make controller.knot_spacing .* 0.2 s"
    ):
        learn(dataclasses.replace(task, duration=6.0))


@pytest.mark.parametrize("wrong", [{"gain": 0.0}, {"repetitions": 0}, {"filter_share": 0.0}, {"memory": 1.5}])
def test_a_law_that_cannot_learn_is_refused(task: Scenario, wrong: dict[str, float]) -> None:
    with pytest.raises(ScenarioError, match="learning needs at least one repetition"):
        learn(task, LearningLaw(**wrong))  # type: ignore[arg-type]
