"""Reading of TOML files by name or path, with one-line messages, and writing of TOML values."""

import copy
import json
import os
import re
import tomllib
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from datetime import date, time
from functools import lru_cache
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from ppafo.documents.json_text import MAXIMUM_LEVELS, is_nested_too_deeply
from ppafo.documents.regular_file import MAXIMUM_BYTES_TYPED, decoded, read_regular_file
from ppafo.errors import PpafoError
from ppafo.wording import nearest_name, one_line, reason

_SUFFIX = ".toml"
NAME = r"^[a-z0-9][a-z0-9_-]*$"
"""Pattern of the name of a set or scenario."""
NAME_RULE = "must consist of lower-case letters, digits, '-' and '_'"
SCHEMA = "https://json-schema.org/draft/2020-12/schema"
"""JSON Schema version of the published file layouts."""
LONGEST_VALUE = 60
"""Largest number of characters of a value in a message."""
_LONGEST_LABEL = 200
_KEPT_AT_EACH_END = 60
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+"""
_DEEP_KEY = re.compile(
    rf"(?:^[ \t]*+\[{{0,2}}+|[{{,])[ \t]*+(?>{_PART}\.[ \t]*+){{{MAXIMUM_LEVELS}}}", re.ASCII | re.MULTILINE
)
"""Pattern of a key with too many dots, for which parsing time grows at least quadratically."""
KEY_LINE = re.compile(
    r"""\s*(?P<key>(?P<opens>\[{1,2})\s*(?P<table>[^]#]+?)\s*\]{1,2}|(?P<name>[\w."' -]+?)(?=\s*=))"""
)
"""Header of a table, or key of a value, at the begin of a line."""
_SIGNS = {"scenario": {"device", "controller"}, "parameter set": {"default_valve", "valves"}}
"""Keys that only files of a kind have, by the noun of the kind."""
_WITH_COMMA = re.compile(r"(?<![\w.,])[+-]?\d[\d.]*,[\d.,]*\d")
"""Number with a decimal comma, or with commas between thousands."""
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_TOO_DEEP = f"has tables nested deeper than {MAXIMUM_LEVELS} levels; a few are enough"


def beside(name: str, folder: Path, known: Collection[str] = ()) -> str:
    """Make a path relative to ``folder`` relative to the working directory; a bundled name is unchanged."""
    is_path = name not in known and (Path(name).suffix == ".toml" or "/" in name)
    return str(folder / name) if is_path else name


@dataclass(frozen=True, slots=True)
class TomlFile:
    """Document of a TOML file, not yet checked, with what messages need: label of the file, error type, bytes.

    ``folder`` is the one of its relative paths. ``content`` is empty for plain data that were in no file.
    """

    label: str
    document: dict[str, Any]
    error: type[PpafoError]
    content: bytes = b""
    folder: Path = Path()


@dataclass(frozen=True, slots=True)
class TomlKind:
    """Kind of TOML file: noun for messages, name for ``--schema``, folder of bundled files, and error type."""

    noun: str
    schema: str
    shipped: Traversable
    error: type[PpafoError]

    def names(self) -> tuple[str, ...]:
        """Return the names of the bundled files."""
        names = (Path(file.name) for file in self.shipped.iterdir())
        return tuple(sorted(name.stem for name in names if name.suffix == _SUFFIX))

    def read(self, name_or_path: str | Path) -> bytes:
        """Read a bundled file by name, or any other file by path."""
        name = str(name_or_path)
        path = Path(name_or_path)
        if name in self.names():
            return (self.shipped / (name + _SUFFIX)).read_bytes()
        is_there = os.path.exists(path)  # noqa: PTH110  # Path.exists raises where no file can have the name
        if path.suffix != _SUFFIX and not is_there:
            hint = nearest_name(name, self.names())
            known = f"available: {', '.join(self.names())}, or " if self.names() else ""
            raise self.error(f"there is no {self.noun} '{label(name)}'{hint}; {known}give a .toml file")
        try:
            return read_regular_file(path, MAXIMUM_BYTES_TYPED)
        except (OSError, ValueError) as error:
            raise self.error(f"{label(name)}: cannot be read: {reason(error)}") from error

    def load(self, name_or_path: str | Path) -> TomlFile:
        """Read and parse a bundled file by name, or any other file by path."""
        return self.parse(self.read(name_or_path), label(str(name_or_path)), Path(name_or_path).parent)

    def parse(self, content: bytes, file: str, folder: Path = Path()) -> TomlFile:
        """Parse the bytes of a file; ``file`` is its label in messages, ``folder`` that of its relative paths."""
        try:
            text = decoded(content)
        except UnicodeDecodeError as error:
            raise self.error(f"{file}: is not a text file in UTF-8 (byte {error.start} is invalid)") from error
        if not text.strip():
            raise self.error(f"{file}: is empty; 'ppafo doctor --schema {self.schema}' prints its format")
        # Before the parser, whose time grows with the square of the dots.
        if _DEEP_KEY.search(text):
            raise self.error(f"{file}: {_TOO_DEEP}")
        try:
            # A copy, since overrides are written into a document and the parsed one is kept.
            document = copy.deepcopy(_document(text))
        except tomllib.TOMLDecodeError as error:
            said = _comma(text, str(error)) or _twice(text, str(error)) or f"is not valid TOML: {one_line(error)}"
            raise self.error(f"{file}: {said}") from error
        except (RecursionError, ValueError) as error:
            raise self.error(f"{file}: is not usable TOML: it is nested too deeply, or a number is too long") from error
        self.check_depth(document, file)
        for other, keys in _SIGNS.items():
            if self.noun not in (other, "scenario", "walk") and keys <= document.keys():
                raise self.error(f"{file}: is a {other}, not a {self.noun}")
        return TomlFile(file, document, self.error, content, folder)

    def check_depth(self, document: Mapping[str, Any], file: str) -> None:
        """Raise an error for tables nested too deeply; ``file`` is the label in messages."""
        if is_nested_too_deeply(document):
            raise self.error(f"{file}: {_TOO_DEEP}")


def _comma(text: str, error: str) -> str:
    """Return the message on a number with a comma in it; empty for another ``error`` of the parser."""
    found = re.search(r"\(at line (\d+), column (\d+)\)", error)
    line, column = (text.split("\n")[int(found[1]) - 1], int(found[2]) - 1) if found else ("", 0)
    numbers = (each for each in _WITH_COMMA.finditer(line) if each.start() < column <= each.end())
    number = next(numbers, None)
    key = KEY_LINE.match(line)
    # Of a list the comma separates two numbers.
    if found is None or number is None or key is None or "[" in line[: number.start()]:
        return ""
    return f"line {found[1]}: {one_line(key['key'])} = {number[0]}: a number has a point for its decimals, and no comma"


def _twice(text: str, error: str) -> str:
    """Return the message on a key or table that a file gives twice; empty for another ``error`` of the parser."""
    found = re.search(r"\bCannot .*\(at (?:line (\d+)|end)", error)
    lines = text.split("\n")[: int(found[1] or 10**9)] if found else []
    # The parser is at the end of a value, which may have several lines.
    keys = ((number, KEY_LINE.match(line)) for number, line in reversed([*enumerate(lines, 1)]))
    return next((f"line {number}: {one_line(key['key'])} is given twice; omit one" for number, key in keys if key), "")


@lru_cache(maxsize=16)
def _document(text: str) -> dict[str, Any]:
    """Parse TOML text, with a cache because a run reads the same set several times; callers copy the result."""
    return tomllib.loads(text, parse_float=_float)


def _float(text: str) -> float:
    """Parse a number. Raises TOMLDecodeError for a nonzero number so small that it would become 0."""
    value = float(text)
    if value == 0.0 and text.lower().partition("e")[0].strip("+-0_."):
        raise tomllib.TOMLDecodeError(
            f"{one_line(text)} is too close to 0 for a 64-bit number and would become 0; write 0 or a larger number"
        )
    return value


def value_text(value: object) -> str:
    """Format a text, a number, a flag or a list of texts as a TOML value."""
    if isinstance(value, float):
        return repr(float(value))
    # TOML escapes the characters that JSON does in the same way, but for DEL.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def assignments(values: Mapping[str, Any]) -> Iterator[str]:
    """Yield a TOML line for each value."""
    for key, value in values.items():
        yield f"{_key(key)} = {value_text(value)}"


def table_lines(name: str, table: Mapping[str, Any]) -> Iterator[str]:
    """Yield the TOML lines of a table and its inner tables, each after an empty line."""
    inner = {key: value for key, value in table.items() if isinstance(value, Mapping)}
    yield from ("", f"[{name}]", *assignments({key: value for key, value in table.items() if key not in inner}))
    for key, value in inner.items():
        yield from table_lines(f"{name}.{_key(key)}", value)


def _key(key: str) -> str:
    return key if _BARE_KEY.fullmatch(key) else value_text(key)


def label(file: str) -> str:
    """Return the label of a file in messages: its name on one line, shortened in the middle if very long."""
    name = one_line(file)
    return name if len(name) <= _LONGEST_LABEL else f"{name[:_KEPT_AT_EACH_END]}...{name[-_KEPT_AT_EACH_END:]}"


def _spelt(value: object) -> str:
    """Spell a value as in a file: ``true``, ``2020-01-01``, a list or table of such values."""
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key} = {_spelt(item)}' for key, item in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_spelt, value))}]"
    # Python takes a date and time for a date.
    return (
        str(value).lower() if isinstance(value, bool) else str(value) if isinstance(value, date | time) else repr(value)
    )


def quote(value: object) -> str:
    """Quote a value for a message, shortened to one line."""
    quoted = one_line(_spelt(value))
    return quoted if len(quoted) <= LONGEST_VALUE else f"{quoted[:LONGEST_VALUE]}..."
