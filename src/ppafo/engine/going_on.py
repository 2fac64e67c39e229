"""Operations of Python that go on where it would raise, with what compiled code gives there.

A run that diverges divides by zero or takes the root of a negative number; compiled, it ends as one that failed.
"""

import math
from collections.abc import Callable
from types import SimpleNamespace

LOWEST_INTEGER = -(2**63)
"""The lowest integer of 64 bits, which processors give for a number that is none of these integers."""


def quotient(dividend: float, divisor: float) -> float:
    """Return a quotient as IEEE 754 has it: by zero it is infinite, and NaN for zero by zero."""
    if divisor != 0.0:
        return dividend / divisor
    if dividend == 0.0 or math.isnan(dividend):
        return math.nan
    return math.copysign(math.inf, dividend) * math.copysign(1.0, divisor)


def whole_part(value: float) -> int:
    """Return a number without its fraction; ``LOWEST_INTEGER`` for NaN and for what 64 bits do not hold."""
    return int(value) if LOWEST_INTEGER <= value < -LOWEST_INTEGER else LOWEST_INTEGER


def power(base: float, exponent: float) -> float:
    """Return a power as the C library has it: NaN for a root of a negative number, where Python's is complex."""
    return float(MATH.pow(base, exponent))


def _square_root(value: float) -> float:
    """Return a square root, NaN of a negative number."""
    return math.nan if value < 0.0 else math.sqrt(value)


def _logarithm(value: float) -> float:
    """Return a natural logarithm: minus infinity of 0, NaN of a negative number."""
    return math.log(value) if value > 0.0 else (-math.inf if value == 0.0 else math.nan)


def _without_errors(function: Callable[..., float]) -> Callable[..., float]:
    """Return a function of ``math`` that is infinite where it overflows, and NaN where it has no value."""

    def called(*arguments: float) -> float:
        try:
            return function(*arguments)
        except OverflowError:
            return math.inf
        except ValueError:
            return math.nan

    return called


def _math() -> SimpleNamespace:
    """Return the module ``math`` with functions that go on."""
    public = {name: value for name, value in vars(math).items() if not name.startswith("_")}
    going_on = {name: _without_errors(value) if callable(value) else value for name, value in public.items()}
    return SimpleNamespace(**going_on | {"sqrt": _square_root, "log": _logarithm})


MATH = _math()
"""The module ``math``: infinite where a function overflows, NaN where it has no value."""
