"""What the slap of the foot comes from: shares that add up, and falls from one state."""

import itertools
from dataclasses import replace
from math import radians

import pytest

from ppafo.questions.timing.slap import FIRST_STRIKE, STRIKES, Falls, falls_of, shares_of
from ppafo.walking import load_walk, walk
from ppafo.walking.motion import walk_of
from ppafo.walking.walk import with_device_off

CONFIGURATION = load_walk("solenoid")


def test_shares_of_a_game_whose_answer_is_known() -> None:
    """Of what two do only together each gets one half, of what three do one third; alone and last are what they say."""
    worth = {"a": 5.0, "b": -2.0, "c": 0.0, "d": 1.0}
    values = {}
    for size in range(5):
        for names in itertools.combinations("abcd", size):
            together = 6.0 * ({"a", "b"} <= set(names)) + 9.0 * ({"b", "c", "d"} <= set(names))
            values[frozenset(names)] = 100.0 + sum(worth[name] for name in names) + together
    shares = {one.factor: one for one in shares_of(values, "abcd")}
    assert {name: one.share for name, one in shares.items()} == pytest.approx({"a": 8.0, "b": 4.0, "c": 3.0, "d": 4.0})
    assert {name: one.alone for name, one in shares.items()} == worth
    assert {name: one.last for name, one in shares.items()} == {"a": 11.0, "b": 13.0, "c": 9.0, "d": 10.0}
    assert sum(one.share for one in shares.values()) == values[frozenset("abcd")] - values[frozenset()]


@pytest.fixture(scope="module")
def own() -> Falls:
    return falls_of(CONFIGURATION, ())


def test_a_foot_that_is_given_its_own_state_comes_down_as_it_walks(own: Falls) -> None:
    imposed = falls_of(CONFIGURATION, own.strikes)
    assert imposed.walked == own.walked
    assert imposed.imposed == pytest.approx(own.walked, rel=1e-9)
    strides = walk("solenoid", (FIRST_STRIKE + STRIKES + 1.5) * walk_of(CONFIGURATION).gait.stride_time / 60.0).strides
    # A stride of the table begins with the second strike, for the first one is where the walk begins.
    walked = strides["slap_rate"][FIRST_STRIKE - 1 : FIRST_STRIKE - 1 + STRIKES]
    assert own.walked == pytest.approx(float(walked.mean()), rel=1e-9)


def test_a_foot_that_falls_further_or_without_the_device_comes_down_faster(own: Falls) -> None:
    higher = [replace(strike, angle=strike.angle - radians(5.0)) for strike in own.strikes]
    assert falls_of(CONFIGURATION, higher).imposed < own.walked - radians(20.0)
    bare = falls_of(with_device_off(CONFIGURATION), [replace(strike, pressures=()) for strike in own.strikes])
    assert bare.imposed < own.walked < bare.walked < 0.0, "from its height it is the device that slows the foot"
