"""CSV files whose header is not ``name [unit]``: names alone or with the unit in brackets, any usual delimiter."""

import re
from pathlib import Path

from ppafo.errors import DataError, first_twice, one_line
from ppafo.signals.recording import Floats
from ppafo.storage.column_map import ColumnMap, MappedChannel
from ppafo.storage.files import read_bytes
from ppafo.storage.foreign import read_foreign

_DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab"}
_NAME = re.compile(r"(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?")
_TIMES = {"time": "s", "t": "s", "time_s": "s", "time_ms": "ms"}
_LONGEST_SHOWN = 40

Columns = tuple[Floats, dict[str, Floats], dict[str, str]]


def is_plain(path: str | Path) -> bool:
    """Tell whether the first column of a CSV file has a header without its unit in square brackets."""
    return "[" not in re.split(r"[,;\t]", _header(path))[0]


def read_plain_csv(path: str | Path) -> Columns:
    """Return time [s], columns, and their units, empty where the header does not state one.

    DataError names the line of what cannot be read.
    """
    header = _header(path)
    delimiter = max(_DELIMITERS, key=header.count)
    cells = [cell.strip().strip('"').strip() for cell in header.split(delimiter)]
    pairs = [match.groups() for cell in cells if (match := _NAME.fullmatch(cell))]
    names, units = [str(name) for name, _ in pairs], [unit or "" for _, unit in pairs]
    if names[0].lower() not in _TIMES:
        raise DataError(f"{path}: the first column must be 'time', it is {one_line(names[0])[:_LONGEST_SHOWN]!r}")
    twice = first_twice(names)
    if twice is not None or "" in names:
        what = "a column has no name" if twice is None else f"there are two columns {one_line(twice)!r}"
        raise DataError(f"{path}: {what}; every column needs a name of its own")
    channels = {f"c{number}": MappedChannel(column=number + 1) for number in range(1, len(names))}
    channels["time"] = MappedChannel(column=1, unit=units[0] or _TIMES[names[0].lower()])
    mapped = ColumnMap(
        delimiter=_DELIMITERS[delimiter],
        decimal="point" if delimiter == "," or not re.search(r"\d,\d", _text(path)) else "comma",
        channels=channels,
    )
    recording = read_foreign(path, mapped)
    columns = {name: recording[f"c{number}"] for number, name in enumerate(names) if number > 0}
    return recording.time, columns, dict(zip(names, units, strict=True))


def _header(path: str | Path) -> str:
    lines = (line for line in _text(path).splitlines() if line.strip() and not line.startswith("#"))
    return next(lines, "")


def _text(path: str | Path) -> str:
    return read_bytes(path).decode("utf-8-sig", errors="replace")
