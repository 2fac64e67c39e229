"""The walking league: who stands where, what draws say, and what happens without the bound."""

import shlex

import pytest

from ppafo.cli.main import build_parser
from ppafo.errors import ScenarioError
from ppafo.questions.league.answer import League
from ppafo.questions.league.solve import play
from ppafo.questions.league.standing import WALKING_ENTRANTS, Entrant
from ppafo.questions.league.walking import bound
from ppafo.questions.league.walking.contest import WalkingContest, clear_fraction, safe_states
from ppafo.questions.league.walking.task import walking_task
from ppafo.walking.loading import load_walk
from ppafo.walking.planning import law_of

BY_NAME = {entrant.name: entrant for entrant in WALKING_ENTRANTS}
CHOSEN = tuple(BY_NAME[name] for name in ("off", "event_on_off-solenoid", "event_proportional"))


@pytest.fixture(scope="module")
def small() -> League:
    """Three entrants and one that there is not, with a few draws and without the bound."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bound, "find_spec", lambda _: None)
        unknown = Entrant("servo", "off", "servo")
        return play(WalkingContest(walking_task(minutes=0.1)), draws=4, entrants=(*CHOSEN, unknown))


def test_standings_are_in_order_of_the_torque_error(small: League) -> None:
    errors = [standing.measures["torque_error"] for standing in small.standings]
    assert errors == sorted(errors)
    assert small.standings[-1].entrant.name == "off"


def test_without_help_the_toes_drag_and_with_it_they_clear(small: League) -> None:
    by_name = {standing.entrant.name: standing for standing in small.standings}
    off, helped = by_name["off"], by_name["event_on_off-solenoid"]
    assert off.measures["toe_height"] < -0.05
    assert off.measures["gas"] == 0.0
    assert off.robustness is not None
    assert clear_fraction(off.robustness) == 0.0
    assert helped.measures["toe_height"] > off.measures["toe_height"] + 0.03


def test_draws_have_a_spread_and_nobody_vents_for_good(small: League) -> None:
    for standing in small.standings:
        robust = standing.robustness
        assert robust is not None
        assert len(robust.drawn) == 4
        assert (robust.failed, safe_states(robust)) == (0, 0)
        assert robust.not_exceeded("torque_error", 1.0) > robust.not_exceeded("torque_error", 0.0)


def test_an_entrant_that_cannot_walk_is_absent_with_the_reason(small: League) -> None:
    assert "no valve 'servo'" in small.absent["servo"]


def test_without_casadi_there_is_no_bound_and_it_is_said(small: League) -> None:
    assert small.bounds == {}
    assert "ppafo[optimal]" in small.without_bound
    assert small.gas_above_least(small.standings[0]) is None
    assert small.error_above_least(small.standings[0]) is None


def test_the_command_of_a_standing_walks_it_again(small: League) -> None:
    standing = next(item for item in small.standings if item.entrant.name == "event_proportional")
    words = shlex.split(standing.command)
    assert words[0] == "ppafo"
    parsed = build_parser("walk").parse_args(words[1:])
    again = load_walk(parsed.configuration, parsed.overrides, parsed.gait)
    own = walking_task(minutes=0.1).configuration(standing.entrant.kind, standing.entrant.valve)
    assert (law_of(again), again.control.settings) == (law_of(own), standing.settings)
    assert again.device == own.device


def test_a_league_that_nobody_can_walk_is_refused() -> None:
    with pytest.raises(ScenarioError, match="no controller can perform the task"):
        play(WalkingContest(walking_task()), draws=0, entrants=[Entrant("servo", "off", "servo")])
    with pytest.raises(ScenarioError, match="draws = -1"):
        play(WalkingContest(walking_task()), draws=-1)
