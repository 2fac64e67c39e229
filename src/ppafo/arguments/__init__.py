"""Arguments: one signature defines both the command line and the checks of Python calls.

Functions annotate their parameters with these types: ``mass: Mass | None = None`` is the option ``--mass MASS``,
converted from text with a unit, and in Python a number in SI or such a text. ``Word`` defines all else; the help of a
parameter is its line in the docstring.
"""

from collections.abc import Iterable, Mapping, Sequence
from concurrent import futures
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from ppafo.arguments.reading import (
    ABOVE_ZERO,
    ANY,
    FROM_ZERO,
    MAXIMUM_DIGITS,
    NumberRange,
    fraction,
    minutes,
    point,
    quantity,
    task,
    whole_number,
)
from ppafo.arguments.reading import Word as Word
from ppafo.arguments.values import checked as checked
from ppafo.arguments.values import taken_number, taken_overrides, taken_tasks, taken_whole


def _quantity_word(metavar: str, si_unit: str, allowed: NumberRange = ANY) -> Word:
    """Return the argument type of a quantity: a text with a unit, in Python also a number in SI."""
    read = quantity(si_unit, allowed)
    unit = {"Pa_a": "Pa (absolute)"}.get(si_unit, si_unit)
    limits = f", {allowed.words(unit)}," if allowed.words(unit) else ""
    what = f"a number in {unit}{limits} or a text with its unit such as '1 {si_unit}'"
    return Word(metavar, read, taken_number(allowed, read), what)


def fraction_word(help_text: str = "", lowest: float = 0.0, highest: float = 1.0) -> Word:
    """Return the argument type of a fraction from ``lowest`` to ``highest``."""
    return Word(
        "FRACTION",
        fraction,
        taken_number(NumberRange(lowest, highest=highest), fraction),
        f"a number from {lowest:g} to {highest:g}, or a percentage such as '95%'",
        help=help_text,
    )


def whole_word(lowest: int, help_text: str = "") -> Word:
    """Return the argument type of a whole number not below ``lowest``."""
    what = f"a whole number, {lowest} or more, of at most {MAXIMUM_DIGITS} digits"
    return Word("N", partial(whole_number, lowest=lowest), taken_whole(lowest), what, help=help_text)


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
BodyMass = Annotated[float, _quantity_word("MASS", "kg", NumberRange(lowest=1.0, highest=500.0))]
Length = Annotated[float, _quantity_word("LENGTH", "m", ABOVE_ZERO)]
FigureWidth = Annotated[float, _quantity_word("WIDTH", "m", NumberRange(lowest=0.06, highest=0.4))]
Time = Annotated[float, _quantity_word("TIME", "s")]
Duration = Annotated[float, _quantity_word("TIME", "s", FROM_ZERO)]
Pressure = Annotated[float, _quantity_word("PRESSURE", "Pa_a", ABOVE_ZERO)]
Flow = Annotated[float, _quantity_word("FLOW", "kg/s", ABOVE_ZERO)]
Volume = Annotated[float, _quantity_word("VOLUME", "m^3", ABOVE_ZERO)]
Speed = Annotated[float, _quantity_word("SPEED", "m/s", ABOVE_ZERO)]
Frequency = Annotated[float, _quantity_word("FREQUENCY", "Hz", ABOVE_ZERO)]
Angle = Annotated[float, _quantity_word("ANGLE", "rad")]
Name = Annotated[str, Word("NAME")]
Folder = Annotated[Path, Word("DIR", Path)]
File = Annotated[Path, Word("FILE", Path)]
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
    ),
]
Seed = Annotated[int, whole_word(0, "random seed; default: the file's")]
Executor = Annotated[
    futures.Executor | str,
    Word("MODULE:OBJECT", help="workers of concurrent.futures, such as a cluster's; default: this process"),
]
Threads = Annotated[int, whole_word(1, "number of threads; default: all cores")]
# A level below a half, such as 0.05, is a mistake; at 1 an interval is infinite, and every study is accepted.
Confidence = Annotated[float, fraction_word("confidence of all intervals; default 95%", 0.5, 0.999999)]
MaximumFailed = Annotated[
    float,
    fraction_word(
        "fraction of the runs that may fail before the study is refused; default {default}", highest=0.999999
    ),
]
Fraction = Annotated[float, fraction_word()]
Metrics = Annotated[Sequence[str], Word("NAME", option="--metric")]
Point = Annotated[
    float | str,
    Word("TIME", point, taken_number(read=point), "a number of seconds, a time such as '1.5 s', or 'equilibrium'"),
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
    ),
]
