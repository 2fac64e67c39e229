"""Exponential, logarithm and power against numbers of forty digits."""

import mpmath
from hypothesis import given
from hypothesis import strategies as st

from ppafo.model.elementary import exponential, logarithm, power

mpmath.mp.dps = 40


@given(st.floats(-700.0, 700.0))
def test_exponential_is_right_to_two_units_of_the_last_place(exponent: float) -> None:
    assert abs(mpmath.mpf(exponential(exponent)) / mpmath.exp(exponent) - 1) < 3e-16


@given(st.floats(1e-300, 1e300))
def test_logarithm_is_right_to_two_units_of_the_last_place(number: float) -> None:
    exact = mpmath.log(mpmath.mpf(number))
    assert abs(logarithm(number) - exact) < 4e-16 * max(abs(exact), mpmath.mpf(1) / 3)


@given(st.floats(0.01, 100.0), st.floats(-40.0, 40.0))
def test_power_loses_no_more_than_its_logarithm_explains(base: float, exponent: float) -> None:
    exact = mpmath.mpf(base) ** mpmath.mpf(exponent)
    assert abs(power(base, exponent) / exact - 1) < 4e-16 * (1 + abs(mpmath.log(exact)))


def test_what_has_no_logarithm_ends_all_the_same() -> None:
    assert logarithm(0.0) < -700.0
    assert logarithm(float("inf")) != logarithm(1.0)
    assert exponential(1e6) == exponential(709.0)
    assert exponential(0.0) == 1.0
    assert logarithm(1.0) == 0.0
