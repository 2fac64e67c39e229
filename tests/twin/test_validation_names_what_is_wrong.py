"""Faults of record and device, known in recordings of the simulated test bench: the right one is named."""

import pytest

from scripts.known_faults import FAULTS, NOTHING, Fault, judged, validated

pytestmark = [pytest.mark.long, pytest.mark.thorough]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda one: one.title)
def test_what_is_wrong_is_named(fault: Fault) -> None:
    found = validated(fault, 5)
    # Five outliers among 501 samples are what any logger has: they are named, and are no disagreement.
    assert found.passes is (fault.title == "five outliers in pressure_1")
    assert judged(fault, found) == "right"


@pytest.mark.parametrize("seed", range(6, 10))
def test_the_right_set_agrees(seed: int) -> None:
    found = validated(NOTHING, seed)
    assert found.passes
    assert found.causes.is_noise
