"""How a league is presented, and an entrant that learns."""

import dataclasses

import numpy as np
import pytest

import ppafo
from ppafo.answers.style import PROPORTIONAL, SOLENOID
from ppafo.answers.writing import row_texts, text_of
from ppafo.control.controllers.feedback import KNOTS
from ppafo.errors import ScenarioError
from ppafo.questions.league.answer import League, league_table
from ppafo.questions.league.bound import LowerBound, Optimum, Played
from ppafo.questions.league.sampled_bound import SampledBound
from ppafo.questions.league.standing import (
    ENTRANTS,
    FORESEEN,
    LearningLaw,
    Robustness,
    Standing,
    knot_errors,
    learn,
    with_table,
)
from ppafo.questions.league.torque import TorqueBound, TorqueContest, bound_sentence, disagreement
from ppafo.signals import Channel, Recording
from ppafo.simulation.scenario import Scenario

ENTRANT = next(entrant for entrant in ENTRANTS if entrant.name == "pid-paper")
ONE = np.zeros(1)


def optimum(rms_error: float, gas: float) -> Optimum:
    return Optimum(rms_error, gas, ONE, ONE, ONE)


@pytest.fixture(scope="module")
def league() -> League:
    """One standing beside a bound of three points."""
    result = ppafo.simulate("torque-task-proportional", ["reference.level=4 N m"])
    bound = LowerBound(optimum(0.1, 4e-4), (optimum(0.3, 3e-4), optimum(1.0, 1e-4)), 150, 0.002, 0.004)
    played = (Played(0.101, 4e-4), Played(0.3, 3.06e-4), Played(1.0, 1e-4))
    robustness = Robustness(tuple({"rms_error": error, "gas_supplied": 1.0} for error in (0.2, 0.4, 0.3)))
    measures = {name: metric.value for name, metric in result.metrics.items()}
    control = result.scenario.control
    standing = Standing(ENTRANT, control.settings, control.period, measures, robustness, "ppafo simulate x")
    least = {ENTRANT.name: bound.gas_at(measures["rms_error"])}
    bounds = {"proportional": TorqueBound(bound, played, least, 0.1, (FORESEEN, "spool frequency"))}
    return League(
        TorqueContest("x", ("a=b",), "ppafo2011"), (standing,), {"on_off": "it has no spool"}, 3, 1, bounds, ""
    )


def test_a_row_has_a_cell_for_every_heading_and_the_distances_to_the_bound(league: League) -> None:
    (row,) = row_texts(league_table(league))
    assert len(row) == len(league_table(league).head)
    standing = league.standings[0]
    error, gas = standing.measures["rms_error"], standing.measures["gas_supplied"]
    assert league.error_above_least(standing) == pytest.approx(error - 0.1)
    least = 4e-4 + (error - 0.1) / 0.2 * (3e-4 - 4e-4)
    assert league.gas_above_least(standing) == pytest.approx(gas - least)
    assert row[-2:] == ["0.3000", "0.4000"]


def test_the_notes_say_bound_draws_and_who_is_absent(league: League) -> None:
    text = text_of(league.answer())
    assert "1 controller, each on 3 draws: x with a=b" in text
    assert "RMS (N m)" in text
    assert "device: ppafo2011" in text
    assert "gas (g)" in text
    assert "no control reaches an RMS error below 0.1 N m, and that takes 0.4 g" in text
    assert "the error agrees within 1 %, the gas within 2 %" in text
    assert "on_off is absent: it has no spool" in text
    assert disagreement(league.bounds["proportional"]) == pytest.approx((0.01, 0.02))


def test_an_error_that_counts_as_none_and_a_bound_without_runs_are_said_so(league: League) -> None:
    none = dataclasses.replace(league.bounds["proportional"].bound, unmeasurable=0.1)
    text = bound_sentence("solenoid", TorqueBound(none, (), {}, 0.85, (FORESEEN,), SampledBound(0.8553, 0.8531, ())))
    assert "an RMS error of 0.1 N m, which counts as zero, takes at least 0.4 g" in text
    assert "no run can confirm it" in text
    assert "the best decisions found reach 0.8553 N m, and none is below 0.8531 N m" in text


def test_the_head_of_a_distance_to_a_bound_lists_what_it_relaxes_and_a_bound_that_lives_on_that_says_nothing(
    league: League,
) -> None:
    heads = [column.title for column in league_table(league).head]
    assert f"error above minimum ({FORESEEN}, spool frequency)" in heads
    assert f"gas above minimum ({FORESEEN}, spool frequency)" in heads
    lives_on_it = dataclasses.replace(league.bounds["proportional"], least_gas={}, least_error=None)
    silent = dataclasses.replace(league, bounds={"proportional": lives_on_it})
    assert row_texts(league_table(silent))[0][6] == row_texts(league_table(silent))[0][8] == "-"
    assert "error above minimum" in [column.title for column in league_table(silent).head]


def test_without_a_bound_the_figure_has_only_marks_and_the_table_dashes(league: League) -> None:
    bare = dataclasses.replace(league, bounds={}, without_bound="no CasADi")
    axes = bare.plot().axes[0]
    assert [text.get_text() for text in axes.texts] == ["pid-paper"]
    assert axes.get_legend() is None
    assert row_texts(league_table(bare))[0][6] == "-"
    assert "no lower bound: no CasADi" in text_of(bare.answer())


def test_the_bound_ends_upwards_or_to_the_left_where_its_error_counts_as_none(league: League) -> None:
    ends = []
    for unmeasurable in (0.004, 0.1):
        bound = dataclasses.replace(league.bounds["proportional"].bound, unmeasurable=unmeasurable)
        changed = dataclasses.replace(league, bounds={"proportional": TorqueBound(bound, (), {}, 0.1)})
        line = changed.plot().axes[0].lines[-1]
        ends.append((np.ptp(np.asarray(line.get_xdata())), np.ptp(np.asarray(line.get_ydata()))))
    assert ends[0][0] == 0.0 < ends[0][1]
    assert ends[1][1] == 0.0 < ends[1][0]


def test_the_figure_has_the_looks_of_the_valves_and_the_error_that_no_decisions_at_a_sample_rate_are_below(
    league: League,
) -> None:
    standing = league.standings[0]
    pair = dataclasses.replace(standing, entrant=dataclasses.replace(standing.entrant, name="pair", valve="solenoid"))
    sampled = TorqueBound(league.bounds["proportional"].bound, (), {}, 0.85, (FORESEEN,))
    both = dataclasses.replace(league, standings=(standing, pair), bounds={"solenoid": sampled})
    axes = both.plot().axes[0]
    marks = [(line.get_marker(), line.get_color()) for line in axes.lines if line.get_marker() not in ("None", "")]
    assert marks == [(look.marker, look.colour) for look in (PROPORTIONAL, SOLENOID)]
    named = {text.get_text(): text.get_position()[1] for text in axes.texts}
    assert abs(named["pair"] - named["pid-paper"]) > 0.05, "names of equal marks are apart"
    (least,) = [line for line in axes.lines if line.get_label() == "solenoid, at its sample rate"]
    assert list(least.get_xdata()) == pytest.approx([0.85, 0.85])


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
