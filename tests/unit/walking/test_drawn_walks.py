"""Walks by chance: what must hold of every task sequence, wearer and device, and of every fault of the plant."""

import numpy as np
import pytest

from ppafo.model.fault_catalogue import PLANT_FAULTS
from scripts.drawn_walks import (
    AFTER,
    AT_REST,
    MOST_WITHOUT,
    ON_HEEL,
    ON_TOES,
    SETTLED,
    TWO_STRIDES,
    VALVES,
    growth,
    with_fault,
    without_faults,
)

pytestmark = pytest.mark.long
SEED = 7

SEEN = [(part, kind) for part, kinds in PLANT_FAULTS.items() for kind in kinds if part != "controller"]
MOST_PINCHED = 0.01
"""Part of drawn walks in which a vented chamber presses a heel that carries: 2 of 400 with the solenoid pair."""

BEHIND_A_KINK = 0.7
"""Time after its flag [s] in which a chamber empties whose hose is kinked: no valve reaches its gas."""


@pytest.mark.parametrize(("count", "seed"), [(16, SEED), pytest.param(300, 8, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("valve", VALVES)
def test_no_drawn_walk_without_a_fault_stops_pauses_on_presses_against_the_wearer_or_is_long_without_help(
    valve: str, count: int, seed: int
) -> None:
    found = without_faults(valve, count, seed)
    assert not [item for item in found if item.stopped or item.paused]
    assert max(item.on_toes for item in found) <= ON_TOES
    assert max(item.at_rest for item in found) <= AT_REST
    # After a pause, a stop of the person, a climb or a stumble.
    assert max(item.unhelped for item in found) <= MOST_WITHOUT
    # What is left is the gas of a vented chamber, pinched by a foot that came down on its toes.
    assert sum(item.on_heel > ON_HEEL for item in found) <= MOST_PINCHED * count


@pytest.mark.parametrize("count", [1, pytest.param(3, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("valve", VALVES)
@pytest.mark.parametrize(("part", "kind"), SEEN)
def test_a_drawn_fault_is_found_within_two_strides_or_harmless_and_leaves_at_most_two_newton_metres(
    valve: str, part: str, kind: str, count: int
) -> None:
    for item in with_fault(valve, part, kind, count, SEED):
        assert item.found <= TWO_STRIDES or max(item.until, item.after) <= AFTER
        assert item.settles <= (BEHIND_A_KINK if kind == "kinked" else SETTLED)


def test_growth_is_how_far_a_stride_is_above_those_that_ended_a_stride_before() -> None:
    peaks = np.array([[0.1, 0.0], [0.2, 0.0], [0.6, 0.0], [0.3, 0.5]])
    assert growth(peaks) == pytest.approx(np.array([[0.0, 0.0], [0.0, 0.0], [0.5, 0.0], [0.15, 0.5]]))
