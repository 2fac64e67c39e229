"""Products, shifts and limits of whole numbers by shifts and additions alone, and gains as such numbers.

A gain is a fraction of 15 bits and a number of places: ``(value * fraction >> 15) >> places``, rounded down each time.
"""

import math
from typing import NamedTuple

FRACTION_BITS = 15
LARGEST_FRACTION: int = 2**FRACTION_BITS - 1
HALF: int = 2 ** (FRACTION_BITS - 1)
"""Added before fifteen shifts to the right: a half of what is left."""
MOST_PLACES = 30
WIDEST = 2**30
"""Size of the largest value that ``fraction_of`` takes without leaving 32 bits."""


class Gain(NamedTuple):
    """A factor from 0 up as a fraction of 15 bits and the places by which the product is shifted right."""

    fraction: float
    places: float


def fraction_of(value: int, fraction: int) -> int:
    """``value`` (2^30 at most in size) times ``fraction`` / 2^15, rounded down at every bit of the fraction."""
    total = 0
    left = fraction
    for _ in range(FRACTION_BITS):
        total = (total + value if left & 1 == 1 else total) >> 1
        left = left >> 1
    return total


def nearest_fraction_of(value: int, fraction: int) -> int:
    """``value`` (2^14 at most in size) times ``fraction`` / 2^15, rounded to the nearest; 16 bits hold all of it."""
    total = HALF
    left = fraction
    for _ in range(FRACTION_BITS):
        total = (total + value if left & 1 == 1 else total) >> 1
        left = left >> 1
    return total


def shifted(value: int, places: int) -> int:
    """``value`` divided by 2 to the power ``places``, rounded down."""
    result = value
    for _ in range(places):
        result = result >> 1
    return result


def limited(value: int, limit: int) -> int:
    """``value`` within ``limit`` to both sides."""
    return max(min(value, limit), -limit)


def gain_of(factor: float) -> Gain:
    """A factor from 0 to 32767 times 2^15 as a gain: as many bits as there are, the largest one where it is larger."""
    if not factor > 0.0:
        return Gain(0.0, 0.0)
    _, exponent = math.frexp(factor)
    places = min(MOST_PLACES, max(0, FRACTION_BITS - exponent))
    fraction = math.floor(math.ldexp(factor, places) + 0.5)
    if fraction > LARGEST_FRACTION and places > 0:
        places -= 1
        fraction = math.floor(math.ldexp(factor, places) + 0.5)
    return Gain(float(min(fraction, LARGEST_FRACTION)), float(places))
