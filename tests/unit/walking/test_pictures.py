"""Pictures of a walk: what they show is what was walked."""

from functools import lru_cache

import numpy as np
import pytest

from ppafo.walking import WalkComparison, compare_walks, load_walk
from ppafo.walking.figures.legs import legs_of, phases_of_last_stride

CONFIGURATIONS = ("solenoid", "proportional")


@lru_cache(maxsize=4)
def compared(name: str) -> WalkComparison:
    return compare_walks(load_walk(name), minutes=0.15)


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_drop_foot_is_seen_without_the_device_and_lifted_with_it(name: str) -> None:
    pair = compared(name)
    turns = phases_of_last_stride(pair.with_device, 100)
    late = np.flatnonzero(turns % 1.0 > 0.7)
    bare, worn = legs_of(pair.without_device, turns), legs_of(pair.with_device, turns)
    lowest = [shown.toe[late, 1].min() for shown, _, _ in (bare, worn)]
    assert lowest[0] < -0.06, "the toes drag"
    assert lowest[1] > lowest[0] + 0.05, "and are lifted"
    assert worn[1].toe[late, 1].min() > -0.002
    assert sum(worn[2]) < sum(bare[2])
