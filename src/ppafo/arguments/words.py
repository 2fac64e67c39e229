"""Argument types: name in the help, conversion from text, and accepted Python values.

Functions annotate their parameters with these types: ``mass: Mass | None = None`` is the option ``--mass MASS``,
converted from text with a unit, and in Python a number in SI or such a text. ``Word`` defines all else; the help of a
parameter is its line in the docstring. The module imports nothing that is slow to load.
"""

import math
import numbers
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from ppafo.errors import ArgumentError, UnitError
from ppafo.units import SI, number_text, parse_quantity, split_number
from ppafo.units.shown import units_beside
from ppafo.wording import one_line

_NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|nan|inf)", re.ASCII)
_EXAMPLES = {
    "kg": ("a mass", ("g", "kg")),
    "m": ("a length", ("cm", "m")),
    "s": ("a time", ("ms", "s", "min")),
    "N m": ("a torque", ("N m",)),
    "Pa_a": ("a pressure", ("psi_g", "kPa_a")),
    "kg/s": ("a flow", ("g/s",)),
    "m^3": ("a volume", ("cm^3",)),
    "m/s": ("a speed", ("m/s", "km/h")),
    "Hz": ("a frequency", ("Hz",)),
    "rad": ("an angle", ("deg", "rad")),
}
"""Description and usual units of each quantity, by SI unit."""
_SHOWN_AGAIN = ("Pa_a", "N m", "kg/s", "m^3")
"""SI units of quantities displayed in the unit in which they were given, since usage differs between laboratories."""
_MAXIMUM_DIGITS, _ABOVE_ALL, _MAXIMUM_LEVELS = 40, 10**40, 60
"""Limits of whole numbers (a seed of 128 bits has 39 digits) and of nesting; Python limits digits to thousands."""


@dataclass(frozen=True, slots=True)
class Word:
    """Argument type: display and parsing on the command line, and accepted values of a Python call.

    ``metavar`` is the name in the help. ``read`` converts the text to the value. ``take`` converts a Python value, with
    a ValueError for an unsuitable one, and ``what`` describes the accepted values; without ``take`` the annotated type
    decides. ``option`` is the name of the option if different from the parameter; it also makes an option of a
    parameter that Python passes by position. ``help`` is the default help text. ``const`` is the value of an option
    given without a value. ``off`` is the option that clears a flag. ``is_repeated`` marks several values whose type is
    not just a sequence. With ``takes_all``, ``take`` is called once with all values.
    """

    metavar: str = ""
    read: Callable[[str], Any] = str
    take: Callable[[Any], Any] | None = None
    what: str = ""
    option: str = ""
    help: str = ""
    const: Any = None
    off: str = ""
    is_repeated: bool = False
    takes_all: bool = False


def whole_number(text: str) -> int:
    """Return a whole number, 0 or more; ArgumentError for any other text."""
    return _number_from(text, 0)


def counting_number(text: str) -> int:
    """Return a whole number, 1 or more; ArgumentError for any other text."""
    return _number_from(text, 1)


def _number_from(text: str, least: int) -> int:
    # As people group digits; isdecimal alone would take the digits of any script.
    digits = text.replace("_", "").replace(",", "")
    is_usable = digits.isascii() and digits.isdecimal() and len(digits) <= _MAXIMUM_DIGITS
    if not is_usable or int(digits) < least:
        raise ArgumentError(f"{text}: must be a whole number, {least} or more, of at most {_MAXIMUM_DIGITS} digits")
    return int(digits)


def number(text: str) -> float:
    """Return a number without a unit; ArgumentError for any other text."""
    try:
        return float(number_text(text))
    except ValueError as error:
        raise ArgumentError(f"{text}: must be a number") from error


def fraction(text: str) -> float:
    """Return a number from 0 to 1 from a text such as ``0.02`` or ``2%``; ArgumentError for any other text."""
    try:
        value = float(number_text(text.removesuffix("%"))) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        # Refused below, as a number that is out of range.
        value = math.nan
    if not 0.0 <= value <= 1.0:
        raise ArgumentError(f"{text}: must be a number from 0 to 1, or a percentage")
    return value


@dataclass(frozen=True, slots=True)
class _NumberRange:
    """Range of numbers from ``lowest`` (included) or ``above`` (excluded) to ``highest`` (included)."""

    lowest: float = -math.inf
    above: float = -math.inf
    highest: float = math.inf

    def __contains__(self, value: float) -> bool:
        """Return True if a number is in the range; False for nan."""
        return self.lowest <= value <= self.highest and value > self.above

    def words(self, unit: str) -> str:
        """Return the range as text, such as ``above 0 s, at most 3600 s``; empty for an unlimited range."""
        of = f" {unit}".rstrip()
        ends = (
            (f"above {self.above:g}{of}", self.above > -math.inf),
            (f"at least {self.lowest:g}{of}", self.lowest > -math.inf),
            (f"at most {self.highest:g}{of}", self.highest < math.inf),
        )
        return ", ".join(end for end, is_there in ends if is_there)


ANY = _NumberRange()
ABOVE_ZERO = _NumberRange(above=0.0)
FROM_ZERO = _NumberRange(lowest=0.0)


class NumberWithUnit(float):
    """Number in SI that remembers the unit in which it was given, for display."""

    __slots__ = ("unit",)
    unit: str

    def __new__(cls, value: float, unit: str) -> "NumberWithUnit":
        """Return the number with its unit."""
        given = super().__new__(cls, value)
        given.unit = unit
        return given

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the constructor and its arguments for copy and pickle."""
        return NumberWithUnit, (float(self), self.unit)


def units_given(by_si_unit: Mapping[str, float | None]) -> dict[str, str]:
    """Return the units in which numbers were given, by SI unit; a pressure unit also sets the unit of differences."""
    units: dict[str, str] = {}
    for si_unit, value in by_si_unit.items():
        if isinstance(value, NumberWithUnit) and value.unit != SI:
            units |= units_beside(si_unit, value.unit)
    return units


def quantity(si_unit: str, allowed: _NumberRange = ANY) -> Callable[[str], float]:
    """Return a converter of texts with a unit, such as ``10 min``, to numbers in SI; ArgumentError for other texts.

    A number without unit is refused with examples; a number outside the range is refused.
    """

    def value_of(text: str) -> float:

        # A number alone is answered with what may be meant: the same number, in units that people write.
        if si_unit in _EXAMPLES and _NUMBER.fullmatch(text.strip()):
            what, units = _EXAMPLES[si_unit]
            either = " or ".join(f"'{text.strip()} {unit}'" for unit in units)
            raise ArgumentError(f"{text}: {what} needs its unit: {either}")
        try:
            value = parse_quantity(text, si_unit)
        except UnitError as error:
            raise ArgumentError(f"{text}: {error}") from error
        if value not in allowed:
            raise ArgumentError(f"{text}: must be {allowed.words(si_unit)}")
        return NumberWithUnit(value, split_number(text)[1]) if si_unit in _SHOWN_AGAIN else value

    return value_of


def minutes(text: str) -> float:
    """Return a time [min] from a number or a text with unit; ArgumentError for any other text."""
    try:
        value = float(text) if _NUMBER.fullmatch(text) else parse_quantity(text, "s") / 60.0
    except UnitError as error:
        raise ArgumentError(f"{text!r}: must be a number of minutes, or a time such as '90 s': {error}") from error
    if not 0.0 < value < math.inf:
        raise ArgumentError(f"{text}: must be above 0 min, and finite")
    return value


def times(text: str) -> tuple[float, ...]:
    """Return times [s] from a comma-separated list; ArgumentError for any other text."""
    try:
        found = tuple(float(number_text(part)) for part in text.split(","))
    except ValueError:
        found = (math.nan,)
    if not all(map(math.isfinite, found)):
        raise ArgumentError(f"{text!r}: must be times in seconds, separated by commas, such as 0.63,1.86")
    return found


def task(text: str) -> tuple[str, list[str]]:
    """Return a name and overrides from ``NAME:PATH=VALUE,...``; ArgumentError for any other text."""
    name, colon, overrides = (part.strip() for part in text.partition(":"))
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


def taken_text(value: Any) -> str:
    """Return a text that is not empty; ValueError for anything else.

    A member of a text enumeration or another subclass of str becomes its text content, not its ``str()``.
    """
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        raise ValueError
    return str.__str__(value)


def _single(value: Any) -> Any:
    """Return an array without axes as a Python value, None if masked or a time; any other value unchanged.

    Otherwise a NumPy time would count as a whole number, and a masked value as the hidden number.
    """
    if type(value) is float or getattr(value, "ndim", None) != 0 or not hasattr(value, "item"):
        return value
    is_hidden = bool(getattr(value, "mask", False))
    return None if is_hidden or getattr(value.dtype, "kind", "") in "mM" else value.item()


def taken_flag(value: Any) -> bool:
    """Return True or False, also from NumPy; ValueError for anything else."""
    flag = _single(value)
    if not isinstance(flag, bool):
        raise ValueError
    return flag


def taken_whole(least: int) -> Callable[[Any], int]:
    """Return a converter of whole numbers not below ``least``, also from NumPy, with ValueError for others."""

    def take(value: Any) -> int:
        whole = _single(value)
        if isinstance(whole, bool) or not isinstance(whole, numbers.Integral) or not least <= int(whole) < _ABOVE_ALL:
            raise ValueError
        return int(whole)

    return take


def taken_number(allowed: _NumberRange = ANY, read: Callable[[str], float] | None = None) -> Callable[[Any], float]:
    """Return a converter of finite numbers in a range, also from NumPy, or of texts converted by ``read``."""

    def take(value: Any) -> float:
        if isinstance(value, str) and read is not None and not _NUMBER.fullmatch(value.strip()):
            return read(taken_text(value))
        given = _single(value)
        if isinstance(given, bool) or not isinstance(given, numbers.Real) or not math.isfinite(given):
            raise ValueError
        if float(given) not in allowed:
            raise ValueError
        return given if isinstance(given, NumberWithUnit) else float(given)

    return take


def taken_overrides(value: Any) -> tuple[str, ...]:
    """Return overrides as texts ``PATH=VALUE``, from one, several, or a dictionary; ValueError for anything else.

    The keys of a dictionary are paths or sections with nested dictionaries; values are texts, flags, or numbers in SI
    units.
    """
    if isinstance(value, Mapping):
        return tuple(_overrides_of(value, ""))
    texts = (value,) if isinstance(value, str) else value
    # A table of pandas would be gone through by the names of its columns.
    if isinstance(texts, bytes) or hasattr(texts, "keys") or not isinstance(texts, Iterable):
        raise ValueError
    return tuple(taken_text(text) for text in texts)


def _overrides_of(table: Mapping[Any, Any], section: str) -> Iterator[str]:
    for name, value in table.items():
        path, given = f"{section}{taken_text(name)}", _single(value)
        if isinstance(given, Mapping):
            yield from _overrides_of(given, f"{path}.")
        elif isinstance(given, bool):
            yield f"{path}={str(given).lower()}"
        elif isinstance(given, numbers.Integral):
            yield f"{path}={int(given)} {SI}"
        elif isinstance(given, numbers.Real) and math.isfinite(given):
            yield f"{path}={float(given)!r} {SI}"
        elif isinstance(given, str) and given.strip():
            yield f"{path}={taken_text(given)}"
        else:
            # A number and its unit apart are one text.
            is_pair = isinstance(given, list | tuple) and len(given) == 2 and isinstance(given[1], str)
            example = f"'{given[0]} {given[1]}'" if is_pair else "'12.6 mm^2'"
            what = f"must be a finite number in SI units, a flag or a text such as {example}"
            raise ArgumentError(f"{path} = {one_line(repr(value))}: {what}")


def taken_document(value: Any) -> dict[str, Any]:
    """Return a copy of nested dictionaries as the plain data of a file; ValueError for anything but a dictionary.

    Accepts mappings of any class, lists, iterators, texts and numbers, also from NumPy. Raises ArgumentError for None.
    """
    if not isinstance(value, Mapping):
        raise ValueError
    copies: dict[int, tuple[Any, Any]] = {}
    return {taken_text(name): _plain(each, str(name), 1, copies) for name, each in value.items()}


def _plain(value: Any, path: str, level: int, copies: dict[int, tuple[Any, Any]]) -> Any:
    # What stands in many places, or in itself, is copied once: one that holds itself twice has no end of places. The
    # value is kept beside its copy, so that no other gets its identity.
    if id(value) in copies:
        return copies[id(value)][1]
    given = _single(value)
    if given is None:
        raise ArgumentError(f"{path} = {one_line(repr(value))}: is not a value; omit the key")
    # What is nested deeper than any file is refused by whoever takes it as one.
    if isinstance(given, bytes) or level > _MAXIMUM_LEVELS:
        return given
    if isinstance(given, str):
        return str.__str__(given)
    if isinstance(given, Mapping):
        table: dict[str, Any] = {}
        copies[id(value)] = value, table
        table.update(
            (taken_text(name), _plain(each, f"{path}.{name}", level + 1, copies)) for name, each in given.items()
        )
        return table
    if isinstance(given, Iterable) and not hasattr(given, "keys"):
        row: list[Any] = []
        copies[id(value)] = value, row
        row.extend(_plain(each, f"{path}[{index}]", level + 1, copies) for index, each in enumerate(given))
        return row
    return given


def taken_tasks(value: Any) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return pairs of a name and overrides, from a dictionary, pairs or texts; ValueError for anything else."""
    if isinstance(value, Mapping):
        pairs: Iterable[Any] = value.items()
    else:
        pairs = [
            task(each) if isinstance(each, str) else each for each in ((value,) if isinstance(value, str) else value)
        ]
    return tuple((taken_text(name), taken_overrides(overrides)) for name, overrides in pairs)


def taken_point(value: Any) -> float | str:
    """Return a time [s] from a number or a text with its unit, or ``equilibrium``; ValueError for anything else."""
    if isinstance(value, str) and not _NUMBER.fullmatch(value.strip()):
        return point(value)
    return taken_number()(value)


def _quantity_word(metavar: str, si_unit: str, allowed: _NumberRange = ANY) -> Word:
    """Return the argument type of a quantity: a text with a unit, in Python also a number in SI."""
    read = quantity(si_unit, allowed)
    shown = {"Pa_a": "Pa (absolute)"}.get(si_unit, si_unit)
    ends = f", {allowed.words(shown)}," if allowed.words(shown) else ""
    example = f"'1 {_EXAMPLES[si_unit][1][0]}'"
    return Word(
        metavar,
        read,
        taken_number(allowed, read),
        f"a number in {shown}{ends} or a text with its unit such as {example}",
    )


def fraction_word(help_text: str = "") -> Word:
    """Return the argument type of a fraction from 0 to 1."""
    return Word(
        "FRACTION",
        fraction,
        taken_number(_NumberRange(0.0, highest=1.0), fraction),
        "a number from 0 to 1, or a percentage such as '95%'",
        help=help_text,
    )


def whole_word(least: int, help_text: str = "") -> Word:
    """Return the argument type of a whole number not below ``least``."""
    read = whole_number if least == 0 else counting_number
    what = f"a whole number, {least} or more, of at most {_MAXIMUM_DIGITS} digits"
    return Word("N", read, taken_whole(least), what, help=help_text)


Whole = Annotated[int, whole_word(0)]
Count = Annotated[int, whole_word(1)]
Minutes = Annotated[
    float,
    Word(
        "N",
        minutes,
        taken_number(ABOVE_ZERO, minutes),
        "a number of minutes above 0, or a text with its unit such as '90 s'",
    ),
]
Mass = Annotated[float, _quantity_word("MASS", "kg", ABOVE_ZERO)]
Length = Annotated[float, _quantity_word("LENGTH", "m", ABOVE_ZERO)]
Time = Annotated[float, _quantity_word("TIME", "s")]
Duration = Annotated[float, _quantity_word("TIME", "s", FROM_ZERO)]
Patience = Annotated[float, _quantity_word("TIME", "s", _NumberRange(above=0.0, highest=3600.0))]
Torque = Annotated[float, _quantity_word("TORQUE", "N m", ABOVE_ZERO)]
Pressure = Annotated[float, _quantity_word("PRESSURE", "Pa_a", ABOVE_ZERO)]
Flow = Annotated[float, _quantity_word("FLOW", "kg/s", ABOVE_ZERO)]
Volume = Annotated[float, _quantity_word("VOLUME", "m^3", ABOVE_ZERO)]
Speed = Annotated[float, _quantity_word("SPEED", "m/s", ABOVE_ZERO)]
Frequency = Annotated[float, _quantity_word("FREQUENCY", "Hz", ABOVE_ZERO)]
Angle = Annotated[float, _quantity_word("ANGLE", "rad")]
Name = Annotated[str, Word("NAME")]
Port = Annotated[str, Word("PORT")]
Folder = Annotated[Path, Word("DIR", Path)]
File = Annotated[Path, Word("FILE", Path)]
FileOrName = Annotated[str | Path, Word("FILE")]
Scenario = Annotated[str, Word("SCENARIO", help="name of a scenario or of a walk, or a .toml file")]
SetName = Annotated[str, Word("SET", help="name of a parameter set, or a .toml file")]
Gait = Annotated[str | Path, Word("GAIT", help="name of a gait, or a gait file (.toml)")]
Overrides = Annotated[
    Mapping[str, Any] | Iterable[str],
    Word(
        "PATH=VALUE",
        take=taken_overrides,
        what="texts such as 'valve.area=12.6 mm^2', or a dictionary such as {'valve.area': '12.6 mm^2'}, "
        "where a number is in SI units",
        option="--set",
        help="override one value, for example valve.area=12.6mm^2; may be repeated",
        takes_all=True,
    ),
]
Seed = Annotated[int, whole_word(0, "random seed; default: the file's")]
Threads = Annotated[int, whole_word(1, "number of threads; default: all cores")]
Confidence = Annotated[float, fraction_word("confidence of all intervals; default 95%")]
MaximumFailed = Annotated[
    float, fraction_word("fraction of the runs that may fail before the study is refused; default {default}")
]
Fraction = Annotated[float, fraction_word()]
Side = Annotated[str, Word("right|left", help="which foot; default right")]
Metrics = Annotated[Sequence[str], Word("NAME", option="--metric")]
Point = Annotated[
    float | str, Word("TIME", point, taken_point, "a number of seconds, a time such as '1.5 s', or 'equilibrium'")
]
Tasks = Annotated[
    Mapping[str, Mapping[str, Any] | Sequence[str]] | Sequence[tuple[str, Sequence[str]]],
    Word(
        "NAME:PATH=VALUE[,PATH=VALUE]",
        task,
        taken_tasks,
        "overrides by the name of a task, such as {'slow': {'reference.ramp_time': '2 s'}}",
        option="--task",
        is_repeated=True,
        takes_all=True,
    ),
]
