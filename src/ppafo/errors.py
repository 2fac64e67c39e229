"""Exceptions raised intentionally by ppafo, in one class tree, with one-line messages."""

import contextlib
import re
from collections.abc import Callable, Iterator

_LONG_WORD = re.compile(r"([^\s/\\]{60})[^\s/\\]{40,}|(\S{200})\S{400,}")
"""Word longer than any that this package writes: a name or a value of somebody else."""


class PpafoError(Exception):
    """Base class of ppafo's errors: fault and remedy in a one-line message.

    ``parts`` are the separate statements of a message with several. ``argument`` is the faulty argument of the call, if
    the message itself does not name it.
    """

    parts: tuple[str, ...] = ()
    argument: str = ""

    def __str__(self) -> str:
        """Return the message on one printable line, whatever it quotes; of a very long word its begin."""
        text = " ".join(super().__str__().split())
        printable = (each if each.isprintable() else "\N{REPLACEMENT CHARACTER}" for each in text)
        return _LONG_WORD.sub(r"\1\2...", "".join(printable))


class ArgumentError(PpafoError):
    """Unusable argument of a function or command; the message names it and the accepted values."""


class UnitError(PpafoError):
    """Text that is not a quantity, or has an unsuitable unit."""


class ParameterError(PpafoError):
    """Unusable parameter set, value or override."""


class DataError(PpafoError):
    """Recording or result file that cannot be read or written."""


class ScenarioError(PpafoError):
    """Invalid scenario file or object."""


class SimulationError(PpafoError):
    """Run that could not be carried out, for example without a compiled model."""


class ProgramError(SimulationError):
    """Controller, valve, profile or meter that cannot be compiled; the message starts with file and line if known."""


class KindError(PpafoError):
    """Unusable controller, valve, profile or metric of another package."""


class StudyError(PpafoError):
    """Invalid study file, or results that belong to another study."""


class IdentificationError(PpafoError):
    """Recording that does not allow the requested estimate."""


@contextlib.contextmanager
def at_fault(argument: str) -> Iterator[None]:
    """Record the faulty argument on errors raised in a ``with`` block; an outer block takes precedence.

    The argument check of the called function puts this name before the message.
    """
    try:
        yield
    except PpafoError as error:
        error.argument = argument
        raise


@contextlib.contextmanager
def refused_as(kind: Callable[[str], PpafoError], place: object, *caught: type[BaseException]) -> Iterator[None]:
    """Convert exceptions of a ``with`` block to another error, one line after ``place`` (file, key or option)."""
    try:
        yield
    except caught as error:
        raise kind(f"{place}: {' '.join(str(error).split())}") from error


class Faults(list[PpafoError]):
    """Errors of independent checks, collected so that all of them are raised together.

    A ``with`` block of the list is one check: its error is kept, and the next check is made.
    """

    def __enter__(self) -> None:
        """Begin a check."""

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        """Keep the error of a check. Returns True if there is one."""
        if not isinstance(error, PpafoError):
            return False
        self.append(error)
        return True

    def raise_all(self) -> None:
        """Raise a PpafoError of the class of the first error, with all messages; nothing without an error."""
        parts = tuple(dict.fromkeys(part for error in self for part in error.parts or (str(error),)))
        if len(parts) == 1:
            # One alone keeps its traceback and its class.
            raise self[0]
        if parts:
            listed = "; ".join(f"({number}) {part}" for number, part in enumerate(parts, 1))
            several = type(self[0])(f"{len(parts)} things are wrong: {listed}")
            several.parts = parts
            raise several
