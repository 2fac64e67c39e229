"""The functions of ``columns`` for one run, whose numbers are no columns: what a translated program has of them."""

import math

from ppafo.model import columns


def root(number: float) -> float:
    """Square root of a number of one run."""
    return math.sqrt(number)


def larger(first: float, second: float) -> float:
    """The larger of two numbers of one run."""
    return max(first, second)


def smaller(first: float, second: float) -> float:
    """The smaller of two numbers of one run."""
    return min(first, second)


def choose(test: bool, yes: float, no: float) -> float:
    """The first number where a test holds, else the second."""
    return yes if test else no


def truncated(number: float) -> float:
    """A number from -2^63 to 2^63 without its fraction, as a float."""
    return float(int(number))


def whole(number: float) -> int:
    """A whole number of one run as an int."""
    return int(number)


FOR_ONE_RUN = {
    columns.root: root,
    columns.larger: larger,
    columns.smaller: smaller,
    columns.choose: choose,
    columns.truncated: truncated,
    columns.whole: whole,
}
"""Scalar replacement of each array function in a program of one run."""
