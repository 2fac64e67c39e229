"""Every error that ppafo raises on purpose: one tree, one clear line each."""

import difflib
from collections.abc import Iterable


class PpafoError(Exception):
    """Something a user can put right; the message is one line that says what and how."""


class UnitError(PpafoError):
    """A text is not a quantity, or its unit does not fit; whoever reads a file adds the file and the key."""


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


def nearest_name(name: str, allowed: Iterable[str]) -> str:
    """Return a hint such as ``, did you mean 'angle'?``, or an empty text where no allowed name is near."""
    near = difflib.get_close_matches(str(name), list(allowed), n=1, cutoff=0.6)
    return f", did you mean '{near[0]}'?" if near else ""


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
