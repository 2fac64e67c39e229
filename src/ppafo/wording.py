"""Wording of messages: argument names, nearest names, counts, lists of names, one-line text."""

import contextlib
import difflib
import math
import re
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from contextvars import ContextVar
from os.path import commonprefix
from pathlib import Path
from typing import Literal, TypeVar

Value = TypeVar("Value")

_SMALLEST_FRACTION = 1.0e-4
"""Smallest fraction that is printed as a number [-]."""
LONGEST_SHOWN = 40
"""Largest number of characters quoted in a message from a name or cell."""


def count_of(number: int, noun: str) -> str:
    """Format a count with its noun: ``1 decay`` or ``3 decays``."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def number_text(text: str) -> str:
    """Check that a text is an ASCII number for ``float`` or ``int``. Raises ValueError, also for ``1_000``."""
    if not text.isascii() or "_" in text:
        raise ValueError(f"{one_line(repr(text))[:LONGEST_SHOWN]} is not a number")
    return text


_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)


def finite_number(text: str) -> float | None:
    """Return the number in a table cell, None if the cell is no finite number."""
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    return value if math.isfinite(value) else None


def without_exponent(value: float, form: str) -> str:
    """Format a number by ``form``, with thousands written out instead of an exponent; zero without sign or exponent.

    >>> without_exponent(2641.3, ".3g"), without_exponent(2.0e7, ".3g"), without_exponent(0.12345, ".3g")
    ('2640', '2e+07', '0.123')
    >>> without_exponent(0.0, "+.3g"), without_exponent(0.0, ".1e"), without_exponent(-0.3, ".0f")
    ('0', '0', '0')
    """
    if value == 0.0:
        return "0" if form[-1:] == "e" else f"{0.0:{form.removeprefix('+')}}"
    text = f"{value:{form}}"
    text = text if text.strip("-0.") else text.removeprefix("-")
    is_long = "e+0" in text and form[-1:] == "g" and abs(value) < 1.0e6
    return f"{float(text):{form.partition('.')[0]}.0f}" if is_long else text


def percentage(fraction: float, digits: int) -> str:
    """Format a fraction [-] as a percentage with ``digits`` significant digits, without exponent: ``120 %``.

    One that is no more than rounding error counts as small: ``below 0.01 %``.
    """
    if 0.0 < abs(fraction) < _SMALLEST_FRACTION:
        return f"below {100.0 * _SMALLEST_FRACTION:g} %"
    return f"{float(f'{100.0 * fraction:.{digits}g}'):.12g} %"


def said_missing(names: Sequence[str]) -> str:
    """Format a statement on missing items: ``'a', 'b' and 'c' are missing``."""
    quoted = [f"'{name}'" for name in folded(names)]
    listed = " and ".join(filter(None, (", ".join(quoted[:-1]), quoted[-1])))
    return f"{listed} is missing" if len(names) == 1 else f"{listed} are missing"


def folded(names: Iterable[str]) -> list[str]:
    """Return names with one item for more than three numbered ones: ``time_01 ... time_20``."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(name.rstrip("0123456789"), []).append(name)
    ends = ([f"{group[0]} ... {group[-1]}"] if len(group) > 3 else group for group in groups.values())
    return [name for group in ends for name in group]


_OF_DATA_SHEETS: Mapping[str, tuple[str, str]] = {
    "cv": ("sonic_conductance", ", 3.87 L/(s bar) for each Cv [US gal/min, psi]"),
    "kv": ("sonic_conductance", ", 4.48 L/(s bar) for each Kv [m^3/h, bar]"),
    "qn": ("sonic_conductance", ", qn/254 L/(s bar) for qn [L/min] from 6 to 5 bar gauge"),
    "c": ("sonic_conductance", ", C of ISO 6358"),
    "b": ("critical_ratio", ", b of ISO 6358"),
    "diameter": ("area", ", pi/4 of the diameter squared"),
}
"""Name in a set, and conversion as text, of what data sheets state of a valve.

Nominal flow qn goes from 7 to 6 bar absolute, by ISO 6358 with b = 0.3; a Cv of 1 passes 984 L/min at these pressures,
by ANSI/(NFPA) T3.21.3, and a Kv is 1.156 Cv.
"""
_SPELT_OTHERWISE = {"kvs": "kv", "qnn": "qn", "nominal_flow": "qn", "flow_coefficient": "cv", "flow_factor": "kv"}
_SPELT_OTHERWISE |= dict.fromkeys(("orifice", "orifice_diameter", "bore", "nominal_diameter", "dn"), "diameter")


def nearest_name(name: str, allowed: Iterable[str], likeness: float = 0.6) -> str:
    """Return a hint such as ``, did you mean 'angle'?`` for an unknown name; empty if no name is near.

    A text that resembles no allowed name by ``likeness`` may be one word of a name: its first, or any other.
    """
    word = str(name)
    known = list(allowed)
    before, dot, last = word.rpartition(".")
    meant, conversion = _OF_DATA_SHEETS.get(_SPELT_OTHERWISE.get(last.lower(), last.lower()), ("", ""))
    if meant and f"{before}{dot}{meant}" in known:
        too = f", with '{before}{dot}critical_ratio' 0.3" if meant == "sonic_conductance" else ""
        return f", which is '{before}{dot}{meant}'{conversion}{too}"
    # 0.6 finds a transposed or forgotten letter, and is difflib's own default.
    near = difflib.get_close_matches(word, known, n=max(len(known), 1), cutoff=likeness)
    # A section that both have makes names alike that have nothing else in common.
    ends = [name.rpartition(".") for name in near]
    near = ["".join(end) for end in ends if not dot or end[0] != before or _likeness(last, end[2]) >= 0.5]
    if near:
        # Of names that are as near, the one that begins like it: 'time_02' and not 'time_31' for 'time_01'.
        alike = [name for name in known if name in near and _likeness(name, word) == _likeness(near[0], word)]
        near = [max(alike, key=lambda name: len(commonprefix([name, word])))]  # noqa: RUF071 - of names, no paths
        # Of numbered names that of the same number: 'time_02' and not 'time_20' for 'time_2'.
        near = [name for name in known if _without_zeros(name) == _without_zeros(word)] or near
    else:
        # A word at the beginning of a name, else anywhere in it, as ``rms`` is in ``rms_error``.
        words = [(re.split(r"[^0-9a-z]+", name.lower()), name) for name in known]
        near = [name for found, name in words if found[0] == word.lower()] or [
            name for found, name in words if word.lower() in found[1:]
        ]
    return f", did you mean '{near[0]}'?" if near else ""


def known_names(name: str, known: Iterable[str]) -> str:
    """Return the end of a refusal of an unknown name: the nearest known name, and all known names."""
    names = list(known)
    return f"{nearest_name(name, names)}; available: {', '.join(names) or 'none'}"


def check_known(name: str, known: Iterable[str], error: type[Exception], said: str) -> None:
    """Raise an ``error`` for an unknown name: what is ``said`` of it, the nearest known name, and all known names."""
    names = list(known)
    if name not in names:
        raise error(f"{said}{known_names(name, names)}")


def _without_zeros(name: str) -> str:
    return re.sub(r"(?<!\d)0+(?=\d)", "", name)


def _likeness(name: str, word: str) -> float:
    return difflib.SequenceMatcher(None, name, word).ratio()


def first_twice(names: Iterable[str]) -> str | None:
    """Return the first repeated name; None if all differ."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None


def one_line(text: object) -> str:
    """Convert a text to one line for a message, with a mark for each unprintable character."""
    words = " ".join(str(text).split())
    return "".join(character if character.isprintable() else "\N{REPLACEMENT CHARACTER}" for character in words)


def reason(error: OSError | ValueError) -> str:
    """Return the reason of a failed file access as the end of a sentence, with the nearest name of an absent file."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else one_line(error)
    hint = ""
    if isinstance(error, FileNotFoundError) and error.filename:
        absent = Path(error.filename)
        hint = nearest_name(absent.name, (file.name for file in absent.parent.glob(f"*{absent.suffix}")))
    return f"{text[:1].lower()}{text[1:]}{hint}"


@contextlib.contextmanager
def set_within(variable: ContextVar[Value], value: Value) -> Iterator[None]:
    """Set a context variable in a ``with`` block."""
    token = variable.set(value)
    try:
        yield
    finally:
        variable.reset(token)


Reader = Literal["caller", "function", "command line"]
_reader: ContextVar[Reader] = ContextVar("_reader", default="caller")


def read_by(new_reader: Reader) -> AbstractContextManager[None]:
    """Set the reader of messages in a ``with`` block: Python caller, package function, or command line.

    Messages name arguments for a Python caller and options on the command line, and neither for a function of the
    package, whose arguments the user never gave.
    """
    return set_within(_reader, new_reader)


def reader() -> Reader:
    """Return the reader of messages in force."""
    return _reader.get()


def argument_text(name: str, value: str = "", option: str = "") -> str:
    """Format an argument, optionally with its value, as its caller wrote it.

    On the command line this is the ``option``, by default the name with dashes: ``--peak-flow '4 g/s'``.

    >>> argument_text("peak_flow"), argument_text("peak_flow", "4 g/s")
    ('peak_flow', "peak_flow='4 g/s'")
    """
    if _reader.get() != "command line":
        return f"{name}={value!r}" if value else name
    option = option or f"--{name.replace('_', '-')}"
    return f"{option} {shlex.quote(value)}" if value else option


_configuration: ContextVar[str] = ContextVar("_configuration", default="")


def said_of_configuration(name: str) -> AbstractContextManager[None]:
    """Set the configuration that messages name in a ``with`` block, also in overrides."""
    return set_within(_configuration, name)


def subject_text(scenario: str) -> str:
    """Return the subject of a message on a scenario: current configuration, else scenario name."""
    return _configuration.get() or scenario


def changed_text(overrides: Iterable[str]) -> str:
    """Return the statement of a result on the values that overrides changed; empty without overrides.

    >>> changed_text(["valve.area=9 mm^2", "run.duration=2 s"])
    'values changed: valve.area=9 mm^2, run.duration=2 s'
    """
    listed = ", ".join(overrides)
    return f"values changed: {listed}" if listed else ""


def override_text(overrides: Iterable[str]) -> str:
    """Format overrides as their caller writes them: command-line words, or a Python argument.

    >>> override_text(["run.duration=2 s"])
    "overrides=['run.duration=2 s']"
    >>> with said_of_configuration("fast"):
    ...     override_text(["valve.area=2 mm^2"])
    "overrides=['fast:valve.area=2 mm^2']"
    """
    if name := _configuration.get():
        overrides = [f"{name}:{override}" for override in overrides]
    if _reader.get() != "command line":
        return f"overrides={list(overrides)!r}"
    return shlex.join(word for override in overrides for word in ("--set", override))


def place(file: str, line: int) -> str:
    """Return a line as named in messages: by relative path below the working folder, otherwise by file name."""
    path = Path(file)
    try:
        path = path.relative_to(Path.cwd())
    except (ValueError, OSError):
        path = Path(path.name)
    return f"{one_line(path)}:{line}"
