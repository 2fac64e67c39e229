"""The league as a table and a figure, from a league made by hand."""

import dataclasses

import numpy as np
import pytest

import ppafo
from ppafo.reporting.league_figure import league_figure
from ppafo.reporting.league_table import HEAD, bound_sentence, disagreement, league_rows, league_table
from ppafo.studies.league import ENTRANTS, League, LowerBound, Optimum, Standing
from ppafo.studies.league.lower_bound import Played
from ppafo.studies.league.standing import Bounded, Robustness

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
    robustness = Robustness(np.array([0.2, 0.4, 0.3]), np.ones(3))
    standing = Standing(ENTRANT, result, "ppafo simulate x", robustness, None)
    bounds = {"proportional": Bounded(bound, played)}
    return League("x", ("a=b",), (standing,), {"on_off": "it has no spool"}, 3, bounds, "")


def test_a_row_has_a_cell_for_every_heading_and_the_distances_to_the_bound(league: League) -> None:
    (row,) = league_rows(league)
    assert len(row) == len(HEAD)
    standing = league.standings[0]
    error, gas = standing.value("rms_error"), standing.value("gas_supplied")
    assert error is not None
    assert gas is not None
    assert league.error_above_least(standing) == pytest.approx(error - 0.1)
    least = 4e-4 + (error - 0.1) / 0.2 * (3e-4 - 4e-4)
    assert league.gas_above_least(standing) == pytest.approx(gas - least)
    assert row[-2:] == ("0.3000", "0.4000")


def test_the_notes_say_bound_draws_and_who_is_absent(league: League) -> None:
    text = "\n".join(league_table(league))
    assert "x with a=b: errors in N m" in text
    assert "no control has an RMS error below 0.1 N m, which takes 0.4 g" in text
    assert "the error is within 1 %, the gas within 2 %" in text
    assert "on_off is absent: it has no spool" in text
    assert disagreement(league.bounds["proportional"]) == pytest.approx((0.01, 0.02))


def test_an_error_that_counts_as_none_and_a_bound_without_runs_are_said_so(league: League) -> None:
    none = dataclasses.replace(league.bounds["proportional"].bound, unmeasurable=0.1)
    text = bound_sentence("solenoid", Bounded(none, ()))
    assert "an RMS error of 0.1 N m, which counts as none, takes at least 0.4 g" in text
    assert "no run can confirm it" in text


def test_without_a_bound_the_figure_has_only_marks_and_the_table_dashes(league: League) -> None:
    bare = dataclasses.replace(league, bounds={}, without_bound="no CasADi")
    labels = league_figure(bare).axes[0].get_legend_handles_labels()[1]
    assert labels == ["pid-paper"]
    assert league_rows(bare)[0][6] == "-"
    assert "no lower bound: no CasADi" in "\n".join(league_table(bare))


def test_the_bound_ends_upwards_or_to_the_left_where_its_error_counts_as_none(league: League) -> None:
    ends = []
    for unmeasurable in (0.004, 0.1):
        bound = dataclasses.replace(league.bounds["proportional"].bound, unmeasurable=unmeasurable)
        changed = dataclasses.replace(league, bounds={"proportional": Bounded(bound, ())})
        line = league_figure(changed).axes[0].lines[-1]
        ends.append((np.ptp(np.asarray(line.get_xdata())), np.ptp(np.asarray(line.get_ydata()))))
    assert ends[0][0] == 0.0 < ends[0][1]
    assert ends[1][1] == 0.0 < ends[1][0]
