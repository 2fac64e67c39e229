"""Every error that ppafo raises on purpose: one tree, one clear line each."""

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence


class PpafoError(Exception):
    """Something a user can put right; the message is one line that says what and how.

    ``parts`` are its statements one by one, where there are several; ``argument`` is the one of the call that is at
    fault, where the message does not say so itself.
    """

    parts: tuple[str, ...] = ()
    argument: str = ""


class ArgumentError(PpafoError):
    """An argument of a function or of a command is not usable; the message names it and says what it takes."""


class UnitError(PpafoError):
    """A text is not a quantity, or its unit does not fit; the reader of a file adds the file and the key."""


class ParameterError(PpafoError):
    """A parameter set, a value or an override is not usable."""


class DataError(PpafoError):
    """A recording or result file cannot be read or written."""


class ScenarioError(PpafoError):
    """A scenario file or object asks for something that is not possible."""


class SimulationError(PpafoError):
    """A run could not be carried out, for example because no model could be compiled."""


class ProgramError(SimulationError):
    """A law, valve, profile or meter cannot be compiled; the message begins with its file and line where it has one."""


class KindError(PpafoError):
    """A controller, valve, profile or metric of another package cannot be used."""


class StudyError(PpafoError):
    """A study file asks for something that is not possible, or its results belong to another study."""


class IdentificationError(PpafoError):
    """A recording does not allow the requested estimate."""


@contextlib.contextmanager
def at_fault(argument: str) -> Iterator[None]:
    """Note on an error raised within a ``with`` block the argument that is at fault; an outer block has the last word.

    The door of the function that was called puts its name before the message.
    """
    try:
        yield
    except PpafoError as error:
        error.argument = argument
        raise


@contextlib.contextmanager
def refused_as(kind: Callable[[str], PpafoError], place: object, *caught: type[Exception]) -> Iterator[None]:
    """Raise what is caught inside as another error, after the place that it is about: a file, a key, an option."""
    try:
        yield
    except caught as error:
        raise kind(f"{place}: {error}") from error


def check_all(chains: Iterable[Sequence[Callable[[], None]]]) -> None:
    """Call all checks; raise one PpafoError, of the class of the first, that says everything that they found.

    A check of a chain rests on those before it: it is not called where one of them failed.
    """
    found: list[PpafoError] = []
    for chain in chains:
        with noted_in(found):
            for check in chain:
                check()
    raise_noted(found)


@contextlib.contextmanager
def noted_in(found: list[PpafoError]) -> Iterator[None]:
    """Add what is raised within a ``with`` block to a list, for ``raise_noted``, and go on behind the block."""
    try:
        yield
    except PpafoError as error:
        found.append(error)


def raise_noted(found: Sequence[PpafoError]) -> None:
    """Raise one PpafoError, of the class of the first, that says everything that was noted, each thing once."""
    parts = tuple(dict.fromkeys(part for error in found for part in error.parts or (str(error),)))
    if len(parts) == 1:
        # One alone keeps its traceback and its class.
        raise found[0]
    if parts:
        listed = "; ".join(f"({number}) {part}" for number, part in enumerate(parts, 1))
        several = type(found[0])(f"{len(parts)} things are wrong: {listed}")
        several.parts = parts
        raise several
