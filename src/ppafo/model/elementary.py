"""Exponential, logarithm, power, sine and cosine from plain arithmetic alone: the same bits on every machine.

Library functions differ between platforms, processors and browsers in the last bits. Most functions here compute
constants at the start of a run; ``sine_and_cosine_of_turns`` is a short series for vector code in the time stepping.
"""

import math

import numpy as np

from ppafo.model.columns import Numeric

LOGARITHM_OF_2 = 0.6931471805599453
_UPPER_PART = 0.693147180369123816490
_LOWER_PART = 1.90821492927058770002e-10
"""Logarithm of 2 in two parts: the upper part has few enough bits that its product with an integer is exact."""
_LARGEST_EXPONENT = 709.0
_ROOT_OF_HALF = 0.7071067811865476
_MAXIMUM_DOUBLINGS = 1100
_TERMS_OF_EXPONENTIAL = 14
_TERMS_OF_LOGARITHM = 12
_TERMS_OF_SINE = 9
TURN = 6.283185307179586
QUARTER_TURN = 1.5707963267948966
TURNS_OF_RADIAN = 1.0 / TURN
ROUNDING = 1.5 * 2.0**52
"""Added to a number and subtracted again, it leaves the nearest whole number, without a branch or an integer."""
DOUBLINGS = 12
"""Number of doublings from the small fraction of a step, at which a series is evaluated, to the whole step."""
SMALLEST_FRACTION = 0.5**DOUBLINGS
TERMS = 9
"""Number of terms of the series that are doubled, including order 0."""


def exponential(exponent: float) -> float:
    """Exponential function [-] of a number [-], within 2e-16; constant beyond -709 and 709, NaN for NaN.

    Below -708.39 the result is subnormal with fewer digits: its absolute error is 5e-324.
    """
    # The negated comparison is true for NaN, for which every direct one is false.
    if not abs(exponent) >= 0.0:
        return exponent
    # Beyond these exp leaves the range of floats; the loop below would go on for as long.
    inside = max(-_LARGEST_EXPONENT, min(exponent, _LARGEST_EXPONENT))
    # Cody and Waite: whole doublings times the upper part of ln 2 are exact, and the lower part mends the rest.
    doublings = int(inside / LOGARITHM_OF_2 + (0.5 if inside >= 0.0 else -0.5))
    rest = inside - doublings * _UPPER_PART
    rest = rest - doublings * _LOWER_PART
    series = 0.0
    for term in range(_TERMS_OF_EXPONENTIAL):
        series = (series + 1.0) * rest / float(_TERMS_OF_EXPONENTIAL - term)
    value = 1.0 + series
    # Products with 2 and 0.5 are exact, and every language has them.
    factor = 2.0 if doublings > 0 else 0.5
    for _ in range(abs(doublings)):
        value = value * factor
    return value


def logarithm(number: float) -> float:
    """Natural logarithm [-] of a positive, normal number [-], within 3e-16 relative or 1e-16 absolute."""
    doublings = 0
    mantissa = number
    # Halving is exact. The limit ends the loop for infinity, which no halving brings down.
    while mantissa >= 2.0 * _ROOT_OF_HALF and doublings < _MAXIMUM_DOUBLINGS:
        mantissa = mantissa * 0.5
        doublings = doublings + 1
    while mantissa < _ROOT_OF_HALF and doublings > -_MAXIMUM_DOUBLINGS:
        mantissa = mantissa * 2.0
        doublings = doublings - 1
    # ln m = 2 artanh((m - 1) / (m + 1)): within a factor of root 2 about 1 the argument is below 0.18.
    share = (mantissa - 1.0) / (mantissa + 1.0)
    square = share * share
    series = 0.0
    for term in range(_TERMS_OF_LOGARITHM):
        series = (series + 1.0 / float(2 * (_TERMS_OF_LOGARITHM - term) + 1)) * square
    # Small terms first, so that the large upper part is rounded once.
    small = 2.0 * share + (2.0 * share * series + doublings * _LOWER_PART)
    return doublings * _UPPER_PART + small


def power(base: float, exponent: float) -> float:
    """Power [-] of a positive base [-]; its relative error is 3e-16 times (1 + the absolute value of its logarithm)."""
    return exponential(exponent * logarithm(base))


def raised(base: Numeric, exponent: float) -> Numeric:
    """Power [-] of a positive base [-]; of an array by NumPy, whose last bits are those of this computer."""
    return base**exponent if isinstance(base, np.ndarray) else power(base, exponent)


def sine_and_cosine(turns: Numeric) -> tuple[Numeric, Numeric]:
    """Sine and cosine [-] of a number or an array of turns, within 2e-16 for exact turns."""
    # To the nearest quarter turn, within which nine terms give all digits.
    quarters = np.rint(4.0 * turns)
    angle = 2.0 * math.pi * (turns - 0.25 * quarters)
    square = angle * angle
    # Zeros of the shape of the argument, a float or an array.
    sine = 0.0 * square
    cosine = 0.0 * square
    for order in range(_TERMS_OF_SINE, 0, -1):
        sine = (1.0 + sine) * -square / float(2 * order * (2 * order + 1))
        cosine = (1.0 + cosine) * -square / float(2 * order * (2 * order - 1))
    sine = angle + angle * sine
    cosine = 1.0 + cosine
    # Which of the four quarters it is, as signs and shares, which arrays can have one by one.
    is_odd = quarters - 2.0 * np.floor(0.5 * quarters)
    is_later = 0.5 * (quarters - is_odd)
    sign = 1.0 - 2.0 * (is_later - 2.0 * np.floor(0.5 * is_later))
    even = 1.0 - is_odd
    return sign * (even * sine + is_odd * cosine), sign * (even * cosine - is_odd * sine)


def sine_and_cosine_of_turns(turns: float) -> tuple[float, float]:
    """Sine and cosine [-] of a number of turns, within 1e-9, by power series about the nearest half turn.

    A library sine would be a function call for each run, which prevents vector code over runs.
    """
    half_turns = (2.0 * turns + ROUNDING) - ROUNDING
    # 1 or -1 for an odd number of half turns, hence the square.
    odd = half_turns - 2.0 * ((0.5 * half_turns + ROUNDING) - ROUNDING)
    sign = 1.0 - 2.0 * odd * odd
    angle = TURN * (turns - 0.5 * half_turns)
    square = angle * angle
    fourth = square * square
    eighth = fourth * fourth
    # Terms in pairs, and pairs in pairs: a third as many operations wait for one another as in one row.
    low = (1.0 - 1.0 / 6.0 * square) + (1.0 / 120.0 - 1.0 / 5040.0 * square) * fourth
    high = (1.0 / 362880.0 - 1.0 / 39916800.0 * square) + (1.0 / 6227020800.0 - 1.0 / 1307674368000.0 * square) * fourth
    sine = (low + high * eighth) * angle
    low = (1.0 - 0.5 * square) + (1.0 / 24.0 - 1.0 / 720.0 * square) * fourth
    high = (1.0 / 40320.0 - 1.0 / 3628800.0 * square) + (1.0 / 479001600.0 - 1.0 / 87178291200.0 * square) * fourth
    return sign * sine, sign * (low + high * eighth)
