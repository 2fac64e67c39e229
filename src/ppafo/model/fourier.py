"""Periodic functions as Fourier series of eight harmonics, with their time derivatives."""

from typing import Annotated, NamedTuple

from ppafo.model.turns import TURN, sine_and_cosine

HARMONICS = 8
"""Harmonics that the engine follows; those of the built-in gait above are below 0.04 deg and 0.4 % of body weight."""


class Harmonic(NamedTuple):
    """Cosine and sine of a multiple of an angle, or the coefficients of both."""

    cosine: float
    sine: float


class Series(NamedTuple):
    """Mean, and the coefficients from the first harmonic on, all in the unit of the function."""

    mean: float
    harmonics: Annotated[tuple[Harmonic, ...], HARMONICS]


def harmonics(turns: float) -> tuple[Harmonic, ...]:
    """Cosines and sines of 1 to 8 times an angle."""
    s1, c1 = sine_and_cosine(turns)
    c2, s2 = c1 * c1 - s1 * s1, 2.0 * s1 * c1
    c3, s3 = c2 * c1 - s2 * s1, s2 * c1 + c2 * s1
    c4, s4 = c2 * c2 - s2 * s2, 2.0 * s2 * c2
    c5, s5 = c4 * c1 - s4 * s1, s4 * c1 + c4 * s1
    c6, s6 = c3 * c3 - s3 * s3, 2.0 * s3 * c3
    c7, s7 = c4 * c3 - s4 * s3, s4 * c3 + c4 * s3
    c8, s8 = c4 * c4 - s4 * s4, 2.0 * s4 * c4
    return (
        Harmonic(cosine=c1, sine=s1),
        Harmonic(cosine=c2, sine=s2),
        Harmonic(cosine=c3, sine=s3),
        Harmonic(cosine=c4, sine=s4),
        Harmonic(cosine=c5, sine=s5),
        Harmonic(cosine=c6, sine=s6),
        Harmonic(cosine=c7, sine=s7),
        Harmonic(cosine=c8, sine=s8),
    )


def value_at(series: Series, at: tuple[Harmonic, ...]) -> float:
    """Value of a series, in its unit."""
    by = series.harmonics
    low = term_value(by[0], at[0]) + term_value(by[1], at[1]) + term_value(by[2], at[2]) + term_value(by[3], at[3])
    high = term_value(by[4], at[4]) + term_value(by[5], at[5]) + term_value(by[6], at[6]) + term_value(by[7], at[7])
    return series.mean + low + high


def rate_at(series: Series, at: tuple[Harmonic, ...], frequency: float) -> float:
    """Time derivative of a series, in its unit per second; ``frequency`` of the first harmonic [Hz]."""
    by = series.harmonics
    low = (
        term_rate(by[0], at[0])
        + 2.0 * term_rate(by[1], at[1])
        + 3.0 * term_rate(by[2], at[2])
        + 4.0 * term_rate(by[3], at[3])
    )
    high = (
        5.0 * term_rate(by[4], at[4])
        + 6.0 * term_rate(by[5], at[5])
        + 7.0 * term_rate(by[6], at[6])
        + 8.0 * term_rate(by[7], at[7])
    )
    return TURN * frequency * (low + high)


def acceleration_at(series: Series, at: tuple[Harmonic, ...], frequency: float) -> float:
    """Second time derivative of a series, in its unit per second squared; ``frequency`` as in ``rate_at``."""
    by = series.harmonics
    low = (
        term_value(by[0], at[0])
        + 4.0 * term_value(by[1], at[1])
        + 9.0 * term_value(by[2], at[2])
        + 16.0 * term_value(by[3], at[3])
    )
    high = (
        25.0 * term_value(by[4], at[4])
        + 36.0 * term_value(by[5], at[5])
        + 49.0 * term_value(by[6], at[6])
        + 64.0 * term_value(by[7], at[7])
    )
    angular = TURN * frequency
    return -angular * angular * (low + high)


def term_value(one: Harmonic, at: Harmonic) -> float:
    """Value of a harmonic with the coefficients ``one`` where its angle has the cosine and the sine ``at``."""
    return one.cosine * at.cosine + one.sine * at.sine


def term_rate(one: Harmonic, at: Harmonic) -> float:
    """As ``term_value``, a quarter of a turn later: the derivative with respect to the angle."""
    return one.sine * at.cosine - one.cosine * at.sine
