"""Faults of record and device, known in recordings of the simulated test bench: the right one is named."""

import pytest

from ppafo.analyses.validate.result import verdict
from scripts.known_faults import FAULTS, NOTHING, Fault, judged, validated

pytestmark = [pytest.mark.long, pytest.mark.thorough]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda one: one.title)
def test_what_is_wrong_is_named(fault: Fault) -> None:
    found = validated(fault, 5)
    assert judged(fault, found) == "right"
    # Small faults stay within the usual limits of 3 % of full range; then the verdict says what these limits may hide.
    # Five outliers among 501 samples are what any logger has.
    is_small = all(channel.rms <= 0.0303 * channel.full_range for channel in found.recordings[0].channels)
    assert found.passes is (is_small or fault.title == "five outliers in pressure_1")
    assert ("may hide a wrong number" in verdict(found)) is found.passes
    assert found.causes.found.in_words in verdict(found)


@pytest.mark.parametrize("seed", range(6, 10))
def test_the_right_set_agrees(seed: int) -> None:
    found = validated(NOTHING, seed)
    assert found.passes
    assert found.causes.is_noise
