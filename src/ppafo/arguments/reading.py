"""Argument values from text, as typed on the command line, and the type of an argument.

The module imports nothing that is slow to load.
"""

import contextlib
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ppafo.errors import ArgumentError, UnitError, refused_as
from ppafo.units import SI, parse_quantity, split_number
from ppafo.units.shown import units_beside
from ppafo.wording import number_text

NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|nan|inf)", re.ASCII)
"""Number without a unit."""
_SHOWN_AS_GIVEN = ("Pa_a", "N m", "kg/s", "m^3")
"""SI units of quantities displayed in the unit in which they were given, since usage differs between laboratories."""
MAXIMUM_DIGITS = 40
"""Maximum number of digits of a whole number; a seed of 128 bits has 39."""


@dataclass(frozen=True, slots=True)
class NumberRange:
    """Range of numbers from ``lowest`` (included) or ``above`` (excluded) to ``highest`` (included)."""

    lowest: float = -math.inf
    above: float = -math.inf
    highest: float = math.inf

    def __contains__(self, value: float) -> bool:
        """Return True if a number is in the range; False for nan."""
        return self.lowest <= value <= self.highest and value > self.above

    def words(self, unit: str) -> str:
        """Return the range as text, such as ``above 0 s, at most 3600 s``; empty for an unlimited range."""
        limits = (("above", self.above), ("at least", self.lowest), ("at most", self.highest))
        return ", ".join(f"{words} {limit:g} {unit}".rstrip() for words, limit in limits if math.isfinite(limit))


ANY = NumberRange()
ABOVE_ZERO = NumberRange(above=0.0)
FROM_ZERO = NumberRange(lowest=0.0)


class NumberWithUnit(float):
    """Number in SI that remembers the unit in which it was given, for display."""

    __slots__ = ("unit",)
    unit: str

    def __new__(cls, value: float, unit: str) -> "NumberWithUnit":
        """Return the number with its unit."""
        number = super().__new__(cls, value)
        number.unit = unit
        return number

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the constructor and its arguments for copy and pickle."""
        return NumberWithUnit, (float(self), self.unit)


def whole_number(text: str, lowest: int = 0) -> int:
    """Return a whole number, ``lowest`` or more; ArgumentError for any other text."""
    # Separators of digit groups are allowed; isdecimal alone would accept the digits of any script.
    digits = text.replace("_", "").replace(",", "")
    is_usable = digits.isascii() and digits.isdecimal() and len(digits) <= MAXIMUM_DIGITS
    if not is_usable or int(digits) < lowest:
        raise ArgumentError(f"{text}: must be a whole number, {lowest} or more, of at most {MAXIMUM_DIGITS} digits")
    return int(digits)


def number(text: str) -> float:
    """Return a number without a unit; ArgumentError for any other text."""
    try:
        return float(number_text(text))
    except ValueError as error:
        raise ArgumentError(f"{text}: must be a number") from error


def fraction(text: str) -> float:
    """Return a number from 0 to 1 from a text such as ``0.02`` or ``2%``; ArgumentError for any other text."""
    with contextlib.suppress(UnitError):
        value = parse_quantity(text, "")
        if 0.0 <= value <= 1.0:
            return value
    raise ArgumentError(f"{text}: must be a number from 0 to 1, or a percentage")


def quantity(si_unit: str, allowed: NumberRange = ANY) -> Callable[[str], float]:
    """Return a converter of texts with a unit, such as ``10 min``, to numbers in SI; ArgumentError for other texts.

    A number outside the range is refused.
    """

    def value_of(text: str) -> float:
        with refused_as(ArgumentError, text, UnitError):
            value = parse_quantity(text, si_unit)
        if value not in allowed:
            raise ArgumentError(f"{text}: must be {allowed.words(si_unit)}")
        return NumberWithUnit(value, split_number(text)[1]) if si_unit in _SHOWN_AS_GIVEN else value

    return value_of


def minutes(text: str) -> float:
    """Return a time [min] from a number or a text with unit; ArgumentError for any other text."""
    with refused_as(ArgumentError, f"{text!r}: must be a number of minutes, or a time such as '90 s'", UnitError):
        value = float(text) if NUMBER.fullmatch(text) else parse_quantity(text, "s") / 60.0
    if not 0.0 < value < math.inf:
        raise ArgumentError(f"{text}: must be finite and above 0 min")
    return value


def times(text: str) -> tuple[float, ...]:
    """Return times [s] from a comma-separated list; ArgumentError for any other text."""
    with contextlib.suppress(ValueError):
        seconds = tuple(float(number_text(item)) for item in text.split(","))
        if all(map(math.isfinite, seconds)):
            return seconds
    raise ArgumentError(f"{text!r}: must be times in seconds, separated by commas, such as 0.63,1.86")


def task(text: str) -> tuple[str, list[str]]:
    """Return a name and overrides from ``NAME:PATH=VALUE,...``; ArgumentError for any other text."""
    name, colon, overrides = (item.strip() for item in text.partition(":"))
    if not name or not colon or not overrides:
        raise ArgumentError(f"{text}: is not of the form NAME:PATH=VALUE, for example 'slow:reference.ramp_time=2 s'")
    return name, [item.strip() for item in overrides.split(",")]


def point(text: str) -> float | str:
    """Return a time [s], or ``equilibrium``; ArgumentError for any other text."""
    if text.strip() == "equilibrium":
        return "equilibrium"
    try:
        return quantity("s")(text)
    except ArgumentError as error:
        raise ArgumentError(f"{text!r}: must be a time such as '1.5 s', or 'equilibrium'") from error


def units_given(by_si_unit: Mapping[str, float | None]) -> dict[str, str]:
    """Return the units in which numbers were given, by SI unit; a pressure unit also sets the unit of differences."""
    units: dict[str, str] = {}
    for si_unit, value in by_si_unit.items():
        if isinstance(value, NumberWithUnit) and value.unit != SI:
            units |= units_beside(si_unit, value.unit)
    return units


@dataclass(frozen=True, slots=True)
class Word:
    """Argument type: display and parsing on the command line, and accepted values of a Python call.

    ``metavar`` is the name in the help. ``read`` converts the text to the value. ``take`` converts a Python value, with
    a ValueError for an unsuitable one, and ``what`` describes the accepted values; without ``take`` the annotated type
    decides. ``option`` is the name of the option if different from the parameter; it also makes an option of a
    parameter that Python passes by position. ``help`` is the default help text. ``is_repeated`` marks several values
    whose type is not just a sequence.
    """

    metavar: str = ""
    read: Callable[[str], Any] = str
    take: Callable[[Any], Any] | None = None
    what: str = ""
    option: str = ""
    help: str = ""
    is_repeated: bool = False
