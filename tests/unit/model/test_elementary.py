"""Exponential, logarithm, power, sine and cosine against numbers of forty digits."""

import math

import mpmath
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ppafo.model.elementary import exponential, logarithm, power, sine_and_cosine

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


@given(st.floats(-1000.0, 1000.0))
def test_sine_and_cosine_of_turns_are_right_to_two_units_of_the_last_place_of_one(turns: float) -> None:
    sine, cosine = sine_and_cosine(turns)
    assert abs(sine - mpmath.sinpi(2 * mpmath.mpf(turns))) < 3e-16
    assert abs(cosine - mpmath.cospi(2 * mpmath.mpf(turns))) < 3e-16


def test_an_array_of_turns_has_the_bits_of_each_alone() -> None:
    turns = np.linspace(-2.0, 2.0, 1001)
    alone = np.array([sine_and_cosine(float(one)) for one in turns])
    assert np.array_equal(np.stack(sine_and_cosine(turns), axis=1), alone)
    quarters = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    assert np.array_equal(sine_and_cosine(quarters), ([0, 1, 0, -1, 0], [1, 0, -1, 0, 1]))


def test_what_has_no_logarithm_ends_all_the_same() -> None:
    assert logarithm(0.0) < -700.0
    assert logarithm(float("inf")) != logarithm(1.0)
    assert exponential(1e6) == exponential(709.0)
    assert exponential(0.0) == 1.0
    assert logarithm(1.0) == 0.0


def test_what_is_no_number_stays_none() -> None:
    assert all(math.isnan(found) for found in (exponential(math.nan), power(math.nan, 2.0), power(2.0, math.nan)))


@given(st.floats(-709.0, -708.39))
def test_a_subnormal_exponential_is_right_to_its_last_digit(exponent: float) -> None:
    assert abs(mpmath.mpf(exponential(exponent)) - mpmath.exp(exponent)) <= 5e-324 + 3e-16 * mpmath.exp(exponent)
