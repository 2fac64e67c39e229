"""Operations of Python that go on where it would raise, with what compiled code gives there.

A run that diverges divides by zero or takes the root of a negative number; compiled, it ends as one that failed.
"""

import math
from collections.abc import Callable
from types import SimpleNamespace


def quotient(over: float, under: float) -> float:
    """Return a quotient as processors have it: infinite, or no number, where it is by zero."""
    if under != 0.0:
        return over / under
    if over == 0.0 or math.isnan(over):
        return math.nan
    return math.copysign(math.inf, over) * math.copysign(1.0, under)


def whole_part(value: float) -> int:
    """Return a number without its fraction; the lowest integer for what has none or is beyond all of them."""
    return int(value) if -(2.0**63) <= value < 2.0**63 else -(2**63)


def power(base: float, exponent: float) -> float:
    """Return a power as the C library has it: no number for a root of a negative one, where Python's is complex."""
    return float(MATH.pow(base, exponent))


def _going_on(function: Callable[..., float]) -> Callable[..., float]:
    def called(*given: float) -> float:
        try:
            return function(*given)
        except OverflowError:
            return math.inf
        except ValueError:
            return math.nan

    return called


def _logarithm(value: float) -> float:
    return math.log(value) if value > 0.0 else (-math.inf if value == 0.0 else math.nan)


def _root(value: float) -> float:
    return math.nan if value < 0.0 else math.sqrt(value)


MATH = SimpleNamespace(
    **{name: _going_on(value) if callable(value) else value for name, value in vars(math).items() if name[0] != "_"}
    | {"sqrt": _root, "log": _logarithm}
)
"""The module ``math``: infinite where a function overflows, no number where it has no value."""
