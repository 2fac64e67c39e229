"""When a muscle counts as active in a stride: planted bursts, gaps and the strike in between."""

import numpy as np
import pytest

from ppafo.questions.walk.muscle_timing import Spans, active_spans, agreement


def curve(*spans: tuple[int, int]) -> np.ndarray:
    """An activation of a tenth, and of 0.9 in spans [% of the stride]."""
    found = np.full(101, 0.1)
    for start, stop in spans:
        found[start:stop] = 0.9
    return found


@pytest.mark.parametrize(
    ("planted", "found"),
    [
        (((10, 40),), ((10, 40),)),
        (((85, 101), (0, 15)), ((85, 15),)),
        (((10, 20), (23, 40)), ((10, 40),)),
        (((10, 40), (70, 74)), ((10, 40),)),
        (((10, 40), (70, 75)), ((10, 40), (70, 75))),
        (((98, 101),), ()),
        (((97, 101), (0, 3)), ((97, 3),)),
        (((0, 98),), ((0, 100),)),
        (((0, 101),), ((0, 100),)),
    ],
)
def test_planted_bursts_are_found_and_short_gaps_and_bursts_are_left_out(
    planted: tuple[tuple[int, int], ...], found: Spans
) -> None:
    assert active_spans(curve(*planted)) == found


def test_what_is_below_a_fifth_of_the_largest_is_not_active() -> None:
    rising = np.linspace(0.0, 1.0, 101)
    assert active_spans(rising) == ((21, 0),)


@pytest.mark.parametrize(
    ("first", "second", "fraction"),
    [
        (((10, 40),), ((10, 40),), 1.0),
        (((85, 15),), ((85, 15),), 1.0),
        (((85, 15),), ((95, 25),), 0.8),
        (((0, 50),), ((50, 0),), 0.0),
        (((0, 100),), ((0, 60),), 0.6),
        ((), ((0, 60),), 0.4),
    ],
)
def test_agreement_is_the_fraction_of_the_stride_in_which_both_are_alike(
    first: Spans, second: Spans, fraction: float
) -> None:
    assert agreement(first, second) == pytest.approx(fraction)
