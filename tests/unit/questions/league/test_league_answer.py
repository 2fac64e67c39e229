"""The league as a table and a figure, from a league made by hand."""

import dataclasses

import numpy as np
import pytest

import ppafo
from ppafo.answers.text import row_texts, text_of
from ppafo.questions.league.answer import league_table
from ppafo.questions.league.bound_solver import Optimum
from ppafo.questions.league.entrants import ENTRANTS
from ppafo.questions.league.lower_bound import LowerBound, Played
from ppafo.questions.league.solve import League
from ppafo.questions.league.standing import Bounded, Robustness, Standing
from ppafo.questions.league.torque_contest import TorqueContest
from ppafo.questions.league.torque_presentation import bound_sentence, disagreement

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
    bounds = {"proportional": Bounded(bound, played, least)}
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
    text = bound_sentence("solenoid", Bounded(none, (), {}))
    assert "an RMS error of 0.1 N m, which counts as zero, takes at least 0.4 g" in text
    assert "no run can confirm it" in text


def test_without_a_bound_the_figure_has_only_marks_and_the_table_dashes(league: League) -> None:
    bare = dataclasses.replace(league, bounds={}, without_bound="no CasADi")
    labels = bare.plot().axes[0].get_legend_handles_labels()[1]
    assert labels == ["pid-paper"]
    assert row_texts(league_table(bare))[0][6] == "-"
    assert "no lower bound: no CasADi" in text_of(bare.answer())


def test_the_bound_ends_upwards_or_to_the_left_where_its_error_counts_as_none(league: League) -> None:
    ends = []
    for unmeasurable in (0.004, 0.1):
        bound = dataclasses.replace(league.bounds["proportional"].bound, unmeasurable=unmeasurable)
        changed = dataclasses.replace(league, bounds={"proportional": Bounded(bound, (), {})})
        line = changed.plot().axes[0].lines[-1]
        ends.append((np.ptp(np.asarray(line.get_xdata())), np.ptp(np.asarray(line.get_ydata()))))
    assert ends[0][0] == 0.0 < ends[0][1]
    assert ends[1][1] == 0.0 < ends[1][0]
