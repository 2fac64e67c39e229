"""Walks by chance: what must hold of every course, wearer and device, and of every fault of the plant."""

import numpy as np
import pytest

from ppafo.model.plant_faults import PLANT_FAULTS
from scripts.drawn_walks import AFTER, ON_TOES, VALVES, with_fault, without_faults

pytestmark = pytest.mark.long
SEED = 7

SEEN = [(part, kind) for part, kinds in PLANT_FAULTS.items() for kind in kinds if part != "controller"]
SLOWLY = {"creeping"}
"""What takes more than two strides to become anything."""


@pytest.mark.parametrize("valve", VALVES)
def test_no_drawn_walk_without_a_fault_stops_or_pauses_to_its_end(valve: str) -> None:
    found = without_faults(valve, 40, SEED)
    assert not [item for item in found if item.stopped or item.paused]
    assert max(item.on_toes for item in found) <= ON_TOES


@pytest.mark.parametrize("valve", VALVES)
@pytest.mark.parametrize(("part", "kind"), SEEN)
def test_a_drawn_fault_is_found_within_two_strides_or_harmless(valve: str, part: str, kind: str) -> None:
    for item in with_fault(valve, part, kind, 3, SEED):
        assert item.found <= 2.0 or item.after <= AFTER or (kind in SLOWLY and np.isfinite(item.found))
