"""Fourier series and their derivatives."""

import math

import numpy as np
import pytest

from ppafo.model.elementary import sine_and_cosine_of_turns
from ppafo.model.gait import Harmonic, Series, acceleration_at, harmonics, rate_at, value_at

FREQUENCY = 0.9


def some_series() -> Series:
    chance = np.random.default_rng(3)
    mean, *terms = (float(value) for value in chance.standard_normal(17))
    return Series(mean=mean, harmonics=tuple(map(Harmonic, terms[0::2], terms[1::2])))


def expected(series: Series, time: float, derivative: int) -> float:
    angular = 2.0 * math.pi * FREQUENCY
    total = series.mean if derivative == 0 else 0.0
    for order in range(1, 9):
        a, b = series.harmonics[order - 1]
        turned = order * angular * time + derivative * math.pi / 2
        total += (order * angular) ** derivative * (a * math.cos(turned) + b * math.sin(turned))
    return total


@pytest.mark.parametrize("time", [0.0, 0.123, 0.7, 1.05])
def test_value_and_derivatives_agree_with_the_sum_of_sines(time: float) -> None:
    series = some_series()
    at = harmonics(FREQUENCY * time)
    assert value_at(series, at) == pytest.approx(expected(series, time, 0), abs=1e-7)
    assert rate_at(series, at, FREQUENCY) == pytest.approx(expected(series, time, 1), abs=1e-5)
    assert acceleration_at(series, at, FREQUENCY) == pytest.approx(expected(series, time, 2), abs=1e-3)


@pytest.mark.parametrize("turns", [-1.3, -0.25, 0.0, 0.1, 0.5, 0.74, 3.9])
def test_sine_and_cosine_are_those_of_the_library(turns: float) -> None:
    sine, cosine = sine_and_cosine_of_turns(turns)
    assert sine == pytest.approx(math.sin(2.0 * math.pi * turns), abs=1e-9)
    assert cosine == pytest.approx(math.cos(2.0 * math.pi * turns), abs=1e-9)
