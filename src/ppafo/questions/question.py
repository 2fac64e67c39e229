"""What a question declares so that it is a command, a Python verb and a page, and what it can do once it is solved."""

import argparse
import importlib
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ppafo.answers.solved import Solved as Solved  # noqa: PLC0414  (other packages know it by this module)

_NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|nan|inf)", re.ASCII)


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument of the command: its words, the parameter of ``solve`` that it fills, what argparse needs to know.

    ``words`` are a name for a positional argument, else options. ``type`` turns the text into the value that ``solve``
    takes; ``nargs``, ``const``, ``action`` and ``choices`` are those of argparse.
    """

    words: tuple[str, ...]
    parameter: str
    help: str
    metavar: str | None = None
    type: Callable[[str], Any] | None = None
    default: Any = None
    nargs: str | None = None
    action: str | None = None
    choices: Sequence[str] | None = None
    is_required: bool = False
    const: Any = None

    def add_to(self, parser: argparse.ArgumentParser) -> None:
        """Add this argument to the parser of its command."""
        default = list(self.default) if self.action == "append" else self.default
        options: dict[str, Any] = {"help": self.help, "default": default}
        if self.action not in ("store_true", "store_false"):
            options |= {"metavar": self.metavar, "type": self.type, "choices": self.choices}
        if self.words[0].startswith("-"):
            options |= {"dest": self.parameter, "required": self.is_required}
        if self.nargs is not None:
            options["nargs"] = self.nargs
        if self.const is not None:
            options["const"] = self.const
        if self.action is not None:
            options["action"] = self.action
        words = self.words if self.words[0].startswith("-") else (self.parameter,)
        parser.add_argument(*words, **options)


@dataclass(frozen=True, slots=True)
class Question:
    """A question: its command, what the help says of it, what solves it (``module:function``), and what it takes.

    ``group`` is the heading of ``ppafo --help`` under which it stands, such as ``decide``. ``solve`` takes the
    parameters of the arguments, and ``progress`` where it is long work, and returns a ``Solved``. ``library`` is the
    ``TomlKind`` of the files that come with the package (``module:NAME``), for ``--list``, and ``listing`` returns the
    entries of that list where these are more than the words of the files. ``default_folder`` (``module:function``)
    takes the values of the arguments by name and returns where the answer is written unless ``--out`` says so; without
    it nothing is. ``fills_folder`` is true where solving itself fills the folder, an argument ``out`` of its own, so
    that a later call resumes; the data of its answer name it as ``folder``. ``instead_of_file`` are the parameters any
    of which stands in place of the file.
    """

    name: str
    summary: str
    group: str
    solve: str
    arguments: tuple[Argument, ...]
    library: str = ""
    listing: str = ""
    default_folder: str = ""
    fills_folder: bool = False
    instead_of_file: tuple[str, ...] = ()

    def solver(self) -> Callable[..., Solved]:
        """Load and return the function that solves the question."""
        found: Callable[..., Solved] = load_name(self.solve)
        return found


def load_name(place: str) -> Any:
    """Return what ``module:name`` stands for."""
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


_MAXIMUM_DIGITS = 40
"""A seed of 128 bits has 39; Python refuses thousands of them by an error of its own."""


def whole_number(text: str) -> int:
    """Return a whole number from 0 on; ArgumentTypeError for any other text."""
    return _number_from(text, 0)


def counting_number(text: str) -> int:
    """Return a whole number from 1 on; ArgumentTypeError for any other text."""
    return _number_from(text, 1)


def _number_from(text: str, least: int) -> int:
    digits = text.replace("_", "").replace(",", "")
    is_usable = digits.isascii() and digits.isdecimal() and len(digits) <= _MAXIMUM_DIGITS
    if not is_usable or int(digits) < least:
        raise argparse.ArgumentTypeError(
            f"{text}: must be a whole number, {least} or more, of at most {_MAXIMUM_DIGITS} digits"
        )
    return int(digits)


def fraction(text: str) -> float:
    """Return a number from 0 to 1 from a text such as ``0.02`` or ``2%``; ArgumentTypeError for any other text."""
    from ppafo.units import number_text

    try:
        number = float(number_text(text.removesuffix("%"))) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        number = math.nan
    if not 0.0 <= number <= 1.0:
        raise argparse.ArgumentTypeError(f"{text}: must be a number from 0 to 1, or a percentage")
    return number


def quantity(si_unit: str) -> Callable[[str], float]:
    """Return what turns a text with a unit, such as ``10 min``, into a number in SI; ArgumentTypeError for others."""

    def number(text: str) -> float:
        from ppafo.errors import UnitError
        from ppafo.units import parse_quantity

        try:
            return parse_quantity(text, si_unit)
        except UnitError as error:
            raise argparse.ArgumentTypeError(f"{text}: {error}") from error

    return number


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


SET = Argument(
    ("--set",),
    "overrides",
    "override one value, for example valve.area=12.6mm^2; may be repeated",
    metavar="PATH=VALUE",
    action="append",
    default=(),
)
SEED = Argument(("--seed",), "seed", "random seed; default: that of the file", metavar="N", type=whole_number)
THREADS = Argument(
    ("--threads",), "threads", "number of threads; default: all cores", metavar="N", type=counting_number
)
CONFIDENCE = Argument(
    ("--confidence",),
    "confidence",
    "confidence of all intervals; default 95%%",
    metavar="FRACTION",
    type=fraction,
    default=0.95,
)


def maximum_failed(default: float) -> Argument:
    """Return the argument for the fraction of runs that may fail."""
    return Argument(
        ("--maximum-failed",),
        "maximum_failed",
        f"fraction of the runs that may fail before the study is refused; default {100.0 * default:g}%%",
        metavar="FRACTION",
        type=fraction,
        default=default,
    )
