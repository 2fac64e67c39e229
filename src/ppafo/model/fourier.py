"""Periodic functions as Fourier series of eight harmonics, with their time derivatives."""

from typing import NamedTuple

from ppafo.model.turns import TURN, sine_and_cosine


class Series(NamedTuple):
    """Mean, and cosine and sine coefficients of the harmonics 1 to 8, all in the unit of the function."""

    mean: float
    cosine_1: float
    sine_1: float
    cosine_2: float
    sine_2: float
    cosine_3: float
    sine_3: float
    cosine_4: float
    sine_4: float
    cosine_5: float
    sine_5: float
    cosine_6: float
    sine_6: float
    cosine_7: float
    sine_7: float
    cosine_8: float
    sine_8: float


class Harmonics(NamedTuple):
    """Cosines and sines of 1 to 8 times an angle."""

    cosine_1: float
    sine_1: float
    cosine_2: float
    sine_2: float
    cosine_3: float
    sine_3: float
    cosine_4: float
    sine_4: float
    cosine_5: float
    sine_5: float
    cosine_6: float
    sine_6: float
    cosine_7: float
    sine_7: float
    cosine_8: float
    sine_8: float


def harmonics(turns: float) -> Harmonics:
    """Cosines and sines [-] of all harmonics at a phase in turns, by doubling and adding angles."""
    s1, c1 = sine_and_cosine(turns)
    c2, s2 = c1 * c1 - s1 * s1, 2.0 * s1 * c1
    c3, s3 = c2 * c1 - s2 * s1, s2 * c1 + c2 * s1
    c4, s4 = c2 * c2 - s2 * s2, 2.0 * s2 * c2
    c5, s5 = c4 * c1 - s4 * s1, s4 * c1 + c4 * s1
    c6, s6 = c3 * c3 - s3 * s3, 2.0 * s3 * c3
    c7, s7 = c4 * c3 - s4 * s3, s4 * c3 + c4 * s3
    c8, s8 = c4 * c4 - s4 * s4, 2.0 * s4 * c4
    return Harmonics(c1, s1, c2, s2, c3, s3, c4, s4, c5, s5, c6, s6, c7, s7, c8, s8)


def value_at(series: Series, at: Harmonics) -> float:
    """Value of a series, in its unit."""
    low = series.cosine_1 * at.cosine_1 + series.sine_1 * at.sine_1
    low += series.cosine_2 * at.cosine_2 + series.sine_2 * at.sine_2
    low += series.cosine_3 * at.cosine_3 + series.sine_3 * at.sine_3
    low += series.cosine_4 * at.cosine_4 + series.sine_4 * at.sine_4
    high = series.cosine_5 * at.cosine_5 + series.sine_5 * at.sine_5
    high += series.cosine_6 * at.cosine_6 + series.sine_6 * at.sine_6
    high += series.cosine_7 * at.cosine_7 + series.sine_7 * at.sine_7
    high += series.cosine_8 * at.cosine_8 + series.sine_8 * at.sine_8
    return series.mean + low + high


def rate_at(series: Series, at: Harmonics, frequency: float) -> float:
    """Time derivative of a series, in its unit per second; ``frequency`` of the first harmonic [Hz]."""
    low = series.sine_1 * at.cosine_1 - series.cosine_1 * at.sine_1
    low += 2.0 * (series.sine_2 * at.cosine_2 - series.cosine_2 * at.sine_2)
    low += 3.0 * (series.sine_3 * at.cosine_3 - series.cosine_3 * at.sine_3)
    low += 4.0 * (series.sine_4 * at.cosine_4 - series.cosine_4 * at.sine_4)
    high = 5.0 * (series.sine_5 * at.cosine_5 - series.cosine_5 * at.sine_5)
    high += 6.0 * (series.sine_6 * at.cosine_6 - series.cosine_6 * at.sine_6)
    high += 7.0 * (series.sine_7 * at.cosine_7 - series.cosine_7 * at.sine_7)
    high += 8.0 * (series.sine_8 * at.cosine_8 - series.cosine_8 * at.sine_8)
    return TURN * frequency * (low + high)


def acceleration_at(series: Series, at: Harmonics, frequency: float) -> float:
    """Second time derivative of a series, in its unit per second squared; ``frequency`` as in ``rate_at``."""
    low = series.cosine_1 * at.cosine_1 + series.sine_1 * at.sine_1
    low += 4.0 * (series.cosine_2 * at.cosine_2 + series.sine_2 * at.sine_2)
    low += 9.0 * (series.cosine_3 * at.cosine_3 + series.sine_3 * at.sine_3)
    low += 16.0 * (series.cosine_4 * at.cosine_4 + series.sine_4 * at.sine_4)
    high = 25.0 * (series.cosine_5 * at.cosine_5 + series.sine_5 * at.sine_5)
    high += 36.0 * (series.cosine_6 * at.cosine_6 + series.sine_6 * at.sine_6)
    high += 49.0 * (series.cosine_7 * at.cosine_7 + series.sine_7 * at.sine_7)
    high += 64.0 * (series.cosine_8 * at.cosine_8 + series.sine_8 * at.sine_8)
    angular = TURN * frequency
    return -angular * angular * (low + high)
