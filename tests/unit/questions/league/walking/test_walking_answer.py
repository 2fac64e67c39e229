"""The walking league as a table, a document and a figure, from a league made by hand."""

import dataclasses

import numpy as np
import pytest

from ppafo.answers.writing import files_of, row_texts, text_of
from ppafo.questions.league.answer import League, league_table
from ppafo.questions.league.standing import WALKING_ENTRANTS, Bounded, Robustness, Standing
from ppafo.questions.league.walking.bound import PlayedStride, WalkingBound
from ppafo.questions.league.walking.contest import WalkingContest, bound_sentence, disagreement
from ppafo.questions.league.walking.measures import MEASURES
from ppafo.questions.league.walking.solver import Guess, StrideOptimum, Strike
from ppafo.questions.league.walking.task import walking_task

ENTRANT = next(entrant for entrant in WALKING_ENTRANTS if entrant.name == "event_proportional")
OFF = next(entrant for entrant in WALKING_ENTRANTS if entrant.name == "off")
ONE = np.zeros(1)
GUESS = Guess(*(ONE,) * 7)


def optimum(rms_error: float, gas: float, height: float = 0.0) -> StrideOptimum:
    return StrideOptimum(rms_error, gas, height, 0.08, 1.0, ONE, ONE, Strike(1.5, 0.0, 1e5, 1e5), GUESS)


def measures(**given: float) -> dict[str, float]:
    return dict.fromkeys(MEASURES, 0.0) | {"toes_clear": 1.0} | given


@pytest.fixture(scope="module")
def league() -> League:
    """A controller and the switched-off device beside a bound of three points."""
    task = walking_task()
    own = {ENTRANT.name: optimum(0.5, 2.0e-4, 0.004)}
    bound = WalkingBound(
        optimum(0.1, 4e-4), (optimum(0.5, 3e-4), optimum(1.0, 1e-4)), own, 0.08, 120, 0.002, 0.005, 3.0
    )
    played = (PlayedStride(0.101, 4e-4, 0.0), PlayedStride(0.5, 3.06e-4, -0.002), PlayedStride(1.0, 1e-4, 0.01))
    drawn = (
        measures(torque_error=0.4, lagged_error=0.2, toe_height=0.01),
        measures(torque_error=0.6, lagged_error=0.3, toe_height=-0.01, toes_clear=0.5, safe_state=1.0),
        None,
    )
    walked = measures(
        torque_error=0.5,
        torque_lag=0.024,
        lagged_error=0.25,
        toe_height=0.004,
        event_error=0.0169,
        slap_rate=-6.0,
        push_off_work=1.25,
        gas=6.5e-4,
        switchings=7.0,
    )
    standing = Standing(ENTRANT, {}, 0.001, walked, Robustness(drawn), "ppafo walk x")
    idle = measures(torque_error=3.0, lagged_error=3.0, toe_height=-0.09, toe_strikes=1.0, toes_clear=0.0)
    off = Standing(OFF, {}, 0.001, idle, None, "ppafo walk y")
    bounds = {"proportional": Bounded(bound, played, {ENTRANT.name: 2.0e-4}, 0.1)}
    contest = WalkingContest(task)
    return League(contest, (standing, off), {"servo": "there is no such valve"}, 3, 1, bounds, "")


def test_a_row_has_a_cell_for_every_heading_and_the_distances_to_the_bound(league: League) -> None:
    row, off = row_texts(league_table(league))
    assert len(row) == len(off) == len(league_table(league).head)
    assert row[2:7] == ["0.500", "0.400", "0.024", "0.250", "0.0169"]
    assert row[7:10] == ["4", "-344", "1.25"]
    assert row[10:] == ["0.650", "0.450", "7", "inf", "33"]
    assert off[10:] == ["0.000", "-", "0", "-", "-"]


def test_the_notes_say_task_bound_draws_and_what_went_wrong(league: League) -> None:
    text = text_of(league.answer())
    assert "5 N m at 0.53 of the stride" in text
    assert "event_proportional paused or stopped in 1 of the draws" in text
    assert "event_proportional diverged in 1 of the draws" in text
    assert "off begins 100 % of its strides on the toes" in text
    assert "servo is absent: there is no such valve" in text


def test_the_sentence_of_a_bound_says_how_far_the_engine_disagrees(league: League) -> None:
    bounded = league.bounds["proportional"]
    assert disagreement(bounded) == pytest.approx((0.001, 0.02, 0.002))
    sentence = bound_sentence("proportional", bounded)
    assert "minimum error is 0.1 N m, with 0.4 g" in sentence
    assert "the error agrees within 0.001 N m, the gas within 2 %, the toes within 2 mm" in sentence


def test_the_document_has_every_number_in_si_units(league: League) -> None:
    document = league.to_dict()
    standing = document["standings"][0]
    assert standing["measures"]["gas"] == 6.5e-4
    assert standing["least_gas"] == 2.0e-4
    assert standing["source"] == ENTRANT.source
    assert standing["robustness"]["drawn"][2] is None
    assert document["lower_bounds"]["proportional"]["least_error_first"][0]["rms_error"] == 0.1
    assert set(document["measures"]) == set(MEASURES)


def test_the_files_are_those_of_a_league_and_the_page_names_everybody(league: League) -> None:
    files = files_of(league.answer())
    assert sorted(files) == ["league.json", "league.png", "league.svg", "league.txt", "report.html"]
    page = files["report.html"].decode()
    for text in ("event_proportional", "ppafo walk x", "ppafo walk y", "toes above the ground", "simulated"):
        assert text in page


def test_the_figure_has_a_mark_for_each_and_the_bound_as_a_line(league: League) -> None:
    (axes,) = league.plot().axes
    lines = {str(line.get_label()): line for line in axes.lines}
    assert list(np.asarray(lines["lower bound, proportional"].get_ydata())) == pytest.approx([0.4, 0.3, 0.1])
    marks = [
        np.asarray(line.get_xydata()).tolist() for line in axes.lines if line.get_marker() not in ("None", None, "")
    ]
    for place in ([0.25, 0.65], [3.0, 0.0]):
        assert any(mark == [pytest.approx(place)] for mark in marks)
    named = {text.get_text() for text in axes.texts}
    assert {"event_proportional", "off"} <= named


def test_without_a_bound_its_columns_are_empty_and_the_reason_is_said(league: League) -> None:
    without = dataclasses.replace(league, bounds={}, without_bound="the lower bound needs CasADi")
    row = row_texts(league_table(without))[0]
    assert (row[3], row[11]) == ("-", "-")
    assert "no lower bound: the lower bound needs CasADi" in text_of(without.answer())
    assert without.plot().axes
