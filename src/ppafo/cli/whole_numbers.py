"""Numbers among the words of a command: one clear line where one is not usable."""

import math

from ppafo.cli.arguments import UsageError

_MAXIMUM_DIGITS = 40
"""A seed of 128 bits has 39; Python refuses thousands of them by an error of its own."""


def whole_number(text: str | None, option: str) -> int | None:
    """Return a whole number from 0 on, None where the option was not given."""
    if text is None:
        return None
    digits = text.replace("_", "").replace(",", "")
    if not digits.isascii() or not digits.isdecimal() or len(digits) > _MAXIMUM_DIGITS:
        raise UsageError(f"{option} {text}: must be a whole number, 0 or more, of at most {_MAXIMUM_DIGITS} digits")
    return int(digits)


def share(text: str | None, option: str) -> float | None:
    """Return a number from 0 to 1 from a text such as ``0.02`` or ``2%``, None where the option was not given."""
    if text is None:
        return None
    try:
        number = float(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        number = math.nan
    if not 0.0 <= number <= 1.0:
        raise UsageError(f"{option} {text}: must be a number from 0 to 1, or a percentage")
    return number
