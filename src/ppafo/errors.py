"""Every error that ppafo raises on purpose: one tree, one clear line each."""

import contextlib
import difflib
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence


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


def count_of(number: int, noun: str) -> str:
    """Return a number with its noun, ``1 decay`` or ``3 decays``."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def said_missing(names: Sequence[str]) -> str:
    """Return a statement that all of these are missing: ``'a', 'b' and 'c' are missing``."""
    quoted = [f"'{name}'" for name in names]
    listed = " and ".join(filter(None, (", ".join(quoted[:-1]), quoted[-1])))
    return f"{listed} is missing" if len(quoted) == 1 else f"{listed} are missing"


_OF_DATA_SHEETS: Mapping[str, str] = {
    "cv": "3.87 L/(s bar) for each Cv [US gal/min, psi]",
    "kv": "4.48 L/(s bar) for each Kv [m^3/h, bar]",
    "qn": "qn/254 L/(s bar) for qn [L/min] from 6 to 5 bar gauge",
}
"""Flow of a valve on data sheets, in C of ISO 6358 at b = 0.3; ``parameters/flow_coefficients.py`` derives it."""
_C, _B = "sonic_conductance", "critical_ratio"
_SPELT_OTHERWISE = {"kvs": "kv", "qnn": "qn", "nominal_flow": "qn", "flow_coefficient": "cv", "flow_factor": "kv"}


def nearest_name(name: str, allowed: Iterable[str]) -> str:
    """Return a hint such as ``, did you mean 'angle'?``, or an empty text where no allowed name is near.

    One that is far from all in letters may be
    short for one: its first word, or another.
    """
    word, known = str(name), list(allowed)
    before, dot, last = word.rpartition(".")
    sheet = _OF_DATA_SHEETS.get(_SPELT_OTHERWISE.get(last.lower(), last.lower()))
    if sheet is not None and any(name.rpartition(".")[2] == _C for name in known):
        return f", which is '{before}{dot}{_C}', {sheet}, with '{before}{dot}{_B}' 0.3"
    # 0.6 finds a transposed or forgotten letter, and is difflib's own default.
    near = difflib.get_close_matches(word, known, n=max(len(known), 1), cutoff=0.6)
    if near:
        # Of names that are as near, the one that begins like it: 'time_02' and not 'time_31' for 'time_01'.
        alike = [name for name in known if name in near and _likeness(name, word) == _likeness(near[0], word)]
        near = [max(alike, key=lambda name: _letters_shared(name, word))]
    else:
        # A word at the beginning of a name, else anywhere in it, as ``rms`` is in ``rms_error``.
        words = [(re.split(r"[^0-9A-Za-z]+", name), name) for name in known]
        near = [name for found, name in words if found[0] == word] or [
            name for found, name in words if word in found[1:]
        ]
    return f", did you mean '{near[0]}'?" if near else ""


def _likeness(name: str, word: str) -> float:
    return difflib.SequenceMatcher(None, name, word).ratio()


def _letters_shared(name: str, word: str) -> int:
    """Number of letters with which both begin."""
    pairs = enumerate(zip(name, word, strict=False))
    return next((number for number, (own, other) in pairs if own != other), min(len(name), len(word)))


def first_twice(names: Iterable[str]) -> str | None:
    """Return the first name that was there before, None where all differ; quick for any number of names."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None


def one_line(text: object) -> str:
    """Return a text for a message: on one line, with a mark for whatever cannot be printed."""
    words = " ".join(str(text).split())
    return "".join(character if character.isprintable() else "\N{REPLACEMENT CHARACTER}" for character in words)


def reason(error: OSError | ValueError) -> str:
    """Return why a file could not be read or written, as the end of a sentence."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else one_line(error)
    return text[:1].lower() + text[1:]
