"""The table that is learnt while walking: how it is read, and what a stride makes of a knot."""

import numpy as np
import pytest

from ppafo.control.walking.assistance import TorqueProfile
from ppafo.control.walking.learning import (
    EMPTY,
    KNOTS,
    Knots,
    LearningRules,
    command_at,
    learn,
    next_table,
    table_position,
)

PLACES = np.linspace(-2.0, KNOTS + 1.0, 701)


def test_the_table_is_straight_between_its_knots_and_zero_outside() -> None:
    knots = [0.01 * number * number - 0.3 for number in range(KNOTS)]
    expected = np.interp(PLACES, np.arange(-1, KNOTS + 1), [0.0, *knots, 0.0], left=0.0, right=0.0)
    assert [command_at(tuple(knots), float(place)) for place in PLACES] == pytest.approx(expected)


def stride(table: Knots, step: float, forgetting: float, samples: int = 4000) -> Knots:
    """The table after a stride with the same step everywhere."""
    places = np.linspace(-1.0, KNOTS, samples, endpoint=False)
    weight = (KNOTS + 1.0) / samples
    for place in places:
        table = next_table(table, float(place), weight, step, forgetting)
    return table


def test_a_stride_moves_a_knot_by_the_mean_step_less_what_is_forgotten() -> None:
    table = stride((0.2,) * KNOTS, step=0.05, forgetting=0.1)
    assert list(table) == pytest.approx([0.2 + 0.05 - 0.1 * 0.2] * KNOTS, abs=2e-3)


def test_only_the_two_knots_at_a_place_learn_each_by_its_share() -> None:
    table = next_table(EMPTY, 3.25, weight=0.5, step=0.1, forgetting=0.0)
    assert table[3] == pytest.approx(0.75 * 0.5 * 0.1)
    assert table[4] == pytest.approx(0.25 * 0.5 * 0.1)
    assert sum(1 for knot in table if knot != 0.0) == 2


def test_knots_stay_commands_that_a_valve_can_carry_out() -> None:
    table = EMPTY
    for _ in range(20):
        table = stride(table, step=0.4, forgetting=0.0, samples=400)
    assert list(table) == [1.0] * KNOTS


def test_the_table_lies_over_the_profile_and_learns_a_lead_later_than_it_is_read() -> None:
    profile = TorqueProfile(5.0, 0.5, 0.2, 0.1)
    assert table_position(profile, 0.3 * 1.2, 1.2) == pytest.approx(0.0)
    assert table_position(profile, 0.6 * 1.2, 1.2) == pytest.approx(KNOTS - 1.0)
    rules = LearningRules(learning_gain=0.5, forgetting=0.0, lead=0.03)
    knot_time = 0.3 * 1.2 / (KNOTS - 1.0)
    since_strike = 0.3 * 1.2 + 6.0 * knot_time + rules.lead
    table = learn(rules, EMPTY, profile, since_strike, 1.2, error=0.4, duration=0.1 * knot_time)
    assert table[6] == pytest.approx(0.1 * 0.5 * 0.4)
    assert sum(1 for knot in table if abs(knot) > 1e-12) == 1
