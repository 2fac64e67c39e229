"""Scalar versions of the functions of ``columns``, for translated programs of one run."""

import math

from ppafo.model import columns
from ppafo.model.declaration import PlainFunction


def root(number: float) -> float:
    """Square root of a number."""
    return math.sqrt(number)


def larger(first: float, second: float) -> float:
    """Larger of two numbers."""
    return max(first, second)


def smaller(first: float, second: float) -> float:
    """Smaller of two numbers."""
    return min(first, second)


def choose(test: bool, yes: float, no: float) -> float:
    """First number where a test holds, else the second."""
    return yes if test else no


def truncated(number: float) -> float:
    """Integer part of a number from -2^63 to 2^63, as a float."""
    return float(int(number))


def whole(number: float) -> int:
    """Convert a float with an integer value to int."""
    return int(number)


FOR_ONE_RUN: dict[PlainFunction, PlainFunction] = {
    columns.root: root,
    columns.larger: larger,
    columns.smaller: smaller,
    columns.choose: choose,
    columns.truncated: truncated,
    columns.whole: whole,
}
"""Scalar replacement of each array function in a program of one run."""
