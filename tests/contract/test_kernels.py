"""Texts that two kernels of linear algebra print are the same to the digits shown, or the difference is found."""

import pytest

from scripts.kernels import difference


@pytest.mark.parametrize(
    ("first", "second", "is_same"),
    [
        ("inertia  10.01 g m^2  9.77 to 10.22", "inertia  10.02 g m^2   9.78 to 10.22", True),
        ("3,049 runs: 1.2e-05", "3,048 runs: 1.1e-05", True),
        ("variance from share (9.3 %)", "variance from share (10 %)", True),
        ("inertia  10.01 g m^2", "inertia  10.03 g m^2", False),
        ("variance from share (9.3 %), torque (5.4 %)", "variance from share (9.3 %)", False),
        ("identified", "not identifiable", False),
        ("one\ntwo", "one", False),
    ],
)
def test_numbers_may_differ_by_one_in_the_last_digit_and_words_not_at_all(
    first: str, second: str, is_same: bool
) -> None:
    assert (difference(first, second) == "") == is_same
