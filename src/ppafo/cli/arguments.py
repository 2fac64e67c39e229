"""Types of arguments: what each is called in the help, and how its text is read; nothing heavy is loaded for them.

A verb annotates its parameters with them: ``mass: Mass | None = None`` is the option ``--mass MASS``, whose text is
read with its unit. ``Word`` says the rest; help of a parameter is its line in the docstring of the verb.
"""

import argparse
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

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
"""What a quantity is called, and the units in which people write it."""
_MAXIMUM_DIGITS = 40
"""A seed of 128 bits has 39; Python refuses thousands of them by an error of its own."""


@dataclass(frozen=True, slots=True)
class Word:
    """How the text of a parameter is written and read.

    ``metavar`` is its name in the help, ``read`` turns the text into the value. ``option`` is its name where that is
    not the name of the parameter, and makes an option of a parameter that Python takes by position. ``help`` is that
    of every verb which says nothing else. ``const`` is what an option without its value stands for, ``off`` the option
    that switches a flag off. ``is_repeated`` is said of several values whose type is not a sequence alone.
    """

    metavar: str = ""
    read: Callable[[str], Any] = str
    option: str = ""
    help: str = ""
    const: Any = None
    off: str = ""
    is_repeated: bool = False


def whole_number(text: str) -> int:
    """Return a whole number from 0 on; ArgumentTypeError for any other text."""
    return _number_from(text, 0)


def counting_number(text: str) -> int:
    """Return a whole number from 1 on; ArgumentTypeError for any other text."""
    return _number_from(text, 1)


def _number_from(text: str, least: int) -> int:
    # As people group digits; isdecimal alone would take the digits of any script.
    digits = text.replace("_", "").replace(",", "")
    is_usable = digits.isascii() and digits.isdecimal() and len(digits) <= _MAXIMUM_DIGITS
    if not is_usable or int(digits) < least:
        raise argparse.ArgumentTypeError(
            f"{text}: must be a whole number, {least} or more, of at most {_MAXIMUM_DIGITS} digits"
        )
    return int(digits)


def number(text: str) -> float:
    """Return a number without a unit; ArgumentTypeError for any other text."""
    from ppafo.units import number_text

    try:
        return float(number_text(text))
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text}: must be a number") from error


def fraction(text: str) -> float:
    """Return a number from 0 to 1 from a text such as ``0.02`` or ``2%``; ArgumentTypeError for any other text."""
    from ppafo.units import number_text

    try:
        value = float(number_text(text.removesuffix("%"))) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        # Refused below, as a number that is out of range.
        value = math.nan
    if not 0.0 <= value <= 1.0:
        raise argparse.ArgumentTypeError(f"{text}: must be a number from 0 to 1, or a percentage")
    return value


def quantity(si_unit: str, longest: float = math.inf) -> Callable[[str], float]:
    """Return what turns a text with a unit, such as ``10 min``, into a number in SI; ArgumentTypeError for others.

    Where there is a ``longest`` the number is a time [s] above 0. A number alone is refused with examples.
    """

    def value_of(text: str) -> float:
        from ppafo.errors import UnitError
        from ppafo.units import parse_quantity

        # A number alone is answered with what may be meant: the same number, in units that people write.
        if si_unit in _EXAMPLES and _NUMBER.fullmatch(text.strip()):
            what, units = _EXAMPLES[si_unit]
            either = " or ".join(f"'{text.strip()} {unit}'" for unit in units)
            raise argparse.ArgumentTypeError(f"{text}: {what} needs its unit: {either}")
        try:
            value = parse_quantity(text, si_unit)
        except UnitError as error:
            raise argparse.ArgumentTypeError(f"{text}: {error}") from error
        if longest < math.inf and not 0.0 < value <= longest:
            raise argparse.ArgumentTypeError(f"{text}: must be above 0 s, at most {longest:g} s")
        return value

    return value_of


def minutes(text: str) -> float:
    """Return minutes from a number or a time with its unit; ArgumentTypeError for any other text."""
    from ppafo.errors import UnitError
    from ppafo.units import parse_quantity

    try:
        return float(text) if _NUMBER.fullmatch(text) else parse_quantity(text, "s") / 60.0
    except UnitError as error:
        raise argparse.ArgumentTypeError(
            f"{text!r}: must be a number of minutes, or a time such as '90 s': {error}"
        ) from error


def times(text: str) -> tuple[float, ...]:
    """Return times [s] that are separated by commas; ArgumentTypeError for any other text."""
    from ppafo.units import number_text

    try:
        found = tuple(float(number_text(part)) for part in text.split(","))
    except ValueError:
        found = (math.nan,)
    if not all(map(math.isfinite, found)):
        raise argparse.ArgumentTypeError(f"{text!r}: must be times in seconds, separated by commas, such as 0.63,1.86")
    return found


def task(text: str) -> tuple[str, list[str]]:
    """Return a name and overrides from ``NAME:PATH=VALUE,...``; ArgumentTypeError for any other text."""
    name, colon, overrides = (part.strip() for part in text.partition(":"))
    if not name or not colon or not overrides:
        raise argparse.ArgumentTypeError(
            f"{text}: is not of the form NAME:PATH=VALUE, for example 'slow:reference.ramp_time=2 s'"
        )
    return name, [item.strip() for item in overrides.split(",")]


def point(text: str) -> float | str:
    """Return a time [s], or ``equilibrium``; ArgumentTypeError for any other text."""
    if text.strip() == "equilibrium":
        return "equilibrium"
    try:
        return quantity("s")(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{text!r}: must be a time such as '1.5 s', or 'equilibrium'") from error


Whole = Annotated[int, Word("N", whole_number)]
Count = Annotated[int, Word("N", counting_number)]
Minutes = Annotated[float, Word("N", minutes)]
Mass = Annotated[float, Word("MASS", quantity("kg"))]
Length = Annotated[float, Word("LENGTH", quantity("m"))]
Time = Annotated[float, Word("TIME", quantity("s"))]
Patience = Annotated[float, Word("TIME", quantity("s", 3600.0))]
Torque = Annotated[float, Word("TORQUE", quantity("N m"))]
Pressure = Annotated[float, Word("PRESSURE", quantity("Pa_a"))]
Flow = Annotated[float, Word("FLOW", quantity("kg/s"))]
Volume = Annotated[float, Word("VOLUME", quantity("m^3"))]
Speed = Annotated[float, Word("SPEED", quantity("m/s"))]
Frequency = Annotated[float, Word("FREQUENCY", quantity("Hz"))]
Angle = Annotated[float, Word("ANGLE", quantity("rad"))]
Name = Annotated[str, Word("NAME")]
Port = Annotated[str, Word("PORT")]
Folder = Annotated[Path, Word("DIR", Path)]
File = Annotated[Path, Word("FILE", Path)]
FileOrName = Annotated["str | Path", Word("FILE")]
Scenario = Annotated[str, Word("SCENARIO", help="name of a scenario or of a walk, or a .toml file")]
SetName = Annotated[str, Word("SET", help="name of a parameter set, or a .toml file")]
Gait = Annotated["str | Path", Word("GAIT", help="name of a gait, or a gait file (.toml)")]
Overrides = Annotated[
    Sequence[str],
    Word(
        "PATH=VALUE",
        option="--set",
        help="override one value, for example valve.area=12.6mm^2; may be repeated",
    ),
]
Seed = Annotated[int, Word("N", whole_number, help="random seed; default: the file's")]
Threads = Annotated[int, Word("N", counting_number, help="number of threads; default: all cores")]
Confidence = Annotated[float, Word("FRACTION", fraction, help="confidence of all intervals; default 95%")]
MaximumFailed = Annotated[
    float,
    Word(
        "FRACTION", fraction, help="fraction of the runs that may fail before the study is refused; default {default}"
    ),
]
Side = Annotated[str, Word("right|left", help="which foot; default right")]
Metrics = Annotated[Sequence[str], Word("NAME", option="--metric")]
