"""The walking league: who stands where, what draws say, and what happens without the bound."""

import shlex

import pytest

from ppafo.cli.main import build_parser
from ppafo.errors import ScenarioError
from ppafo.studies.league.walking import (
    WALKING_ENTRANTS,
    WalkingEntrant,
    WalkingLeague,
    bound,
    walking_league,
    walking_task,
)
from ppafo.walking.loading import load_walk

BY_NAME = {entrant.name: entrant for entrant in WALKING_ENTRANTS}
CHOSEN = tuple(BY_NAME[name] for name in ("off", "event_on_off-solenoid", "event_proportional"))


@pytest.fixture(scope="module")
def small() -> WalkingLeague:
    """Three entrants and one that there is not, with a few draws and without the bound."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bound, "find_spec", lambda _: None)
        unknown = WalkingEntrant("servo", "off", "servo")
        return walking_league(walking_task(minutes=0.1), draws=4, entrants=(*CHOSEN, unknown))


def test_standings_are_in_order_of_the_torque_error(small: WalkingLeague) -> None:
    errors = [standing.measures["torque_error"] for standing in small.standings]
    assert errors == sorted(errors)
    assert small.standings[-1].entrant.name == "off"


def test_without_help_the_toes_drag_and_with_it_they_clear(small: WalkingLeague) -> None:
    by_name = {standing.entrant.name: standing for standing in small.standings}
    off, helped = by_name["off"], by_name["event_on_off-solenoid"]
    assert off.measures["toe_height"] < -0.05
    assert off.measures["gas"] == 0.0
    assert off.robustness is not None
    assert off.robustness.clear == 0.0
    assert helped.measures["toe_height"] > off.measures["toe_height"] + 0.03


def test_draws_have_a_spread_and_nobody_vents_for_good(small: WalkingLeague) -> None:
    for standing in small.standings:
        robust = standing.robustness
        assert robust is not None
        assert len(robust.drawn) == 4
        assert (robust.failed, robust.safe_states) == (0, 0)
        assert robust.error(1.0) > robust.error(0.0)


def test_an_entrant_that_cannot_walk_is_absent_with_the_reason(small: WalkingLeague) -> None:
    assert "no valve 'servo'" in small.absent["servo"]


def test_without_casadi_there_is_no_bound_and_it_is_said(small: WalkingLeague) -> None:
    assert small.bounds == {}
    assert "ppafo[optimal]" in small.without_bound
    assert small.gas_above_least(small.standings[0]) is None
    assert small.error_above_least(small.standings[0]) is None


def test_the_command_of_a_standing_walks_it_again(small: WalkingLeague) -> None:
    standing = next(item for item in small.standings if item.entrant.name == "event_proportional")
    words = shlex.split(standing.command)
    assert words[0] == "ppafo"
    parsed = build_parser("walk").parse_args(words[1:])
    again = load_walk(parsed.config, parsed.overrides, parsed.gait)
    assert (again.controller, again.settings) == (standing.configuration.controller, standing.configuration.settings)
    assert again.device == standing.configuration.device


def test_a_league_that_nobody_can_walk_is_refused() -> None:
    with pytest.raises(ScenarioError, match="no entrant can walk"):
        walking_league(walking_task(), draws=0, entrants=[WalkingEntrant("servo", "off", "servo")])
    with pytest.raises(ScenarioError, match="draws = -1"):
        walking_league(walking_task(), draws=-1)
