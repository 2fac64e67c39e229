"""CSV files: of this package, with its names and units, and plain ones with any usual delimiter.

A CSV file need not have the header ``name [unit]``: names alone or with the unit in brackets will do.
"""

import re
from pathlib import Path
from typing import Literal

from ppafo.documents.regular_file import decoded
from ppafo.errors import DataError, one_line, refused_as
from ppafo.gait.recorded.form import Convention, GaitForm
from ppafo.gait.recorded.mapping import Side, package_map
from ppafo.gait.recorded.table import MotionTable
from ppafo.storage.column_map import ColumnMap, MappedChannel
from ppafo.storage.comma_separated import kind_of_comments, read_csv
from ppafo.storage.doubled_names import doubled, said_of_doubled, told_apart, without_copies
from ppafo.storage.files import read_bytes
from ppafo.storage.foreign import read_foreign

_DELIMITERS: dict[str, Literal["comma", "semicolon", "tab"]] = {",": "comma", ";": "semicolon", "\t": "tab"}

_NAME = re.compile(r"(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?")

_TIMES = {"time": "s", "t": "s", "time_s": "s", "time_ms": "ms"}

_LONGEST_SHOWN = 40
"""Letters of a name that a message shows."""


def _recognises(path: str | Path) -> bool:
    """Recognise a table by its suffix; a .txt file may be one of markers, which says so in its first line."""
    return Path(path).suffix.lower() != ".txt" or not _text(path).startswith("PathFileType")


def _read(path: str | Path) -> MotionTable:
    """Return a table of this package, or a plain one."""
    if is_plain(path):
        return read_plain_csv(path)
    _check_first_name(path, _named_columns(_header(path))[0][0])
    recording = read_csv(path)
    columns = {name: recording[name] for name in recording.names}
    units = {name: recording.unit(name) for name in recording.names}
    return MotionTable(str(path), recording.time, columns, units, kind=recording.kind)


def _convention(_table: MotionTable, side: Side, _body_mass: float) -> Convention:
    """Return the map of columns with the names and signs of the package, which do not name the foot."""
    if side != "right":
        raise DataError("a CSV file without a gait map has the columns of one foot; --side left has no meaning there")
    return Convention(package_map(side))


def is_plain(path: str | Path) -> bool:
    """Return whether a CSV file has other delimiters than the package, or a column without unit in square brackets."""
    header = _header(path)
    return _delimiter(header) != "," or not all("[" in cell for cell in header.split(","))


def plain_names(path: str | Path) -> list[str]:
    """Return the names in the header of a plain CSV file."""
    return [name for name, _ in _named_columns(_header(path))]


def _named_columns(header: str) -> list[tuple[str, str]]:
    cells = [cell.strip().strip('"').strip() for cell in header.split(_delimiter(header))]
    return [(match[1], match[2] or "") for cell in cells if (match := _NAME.fullmatch(cell))]


def _delimiter(header: str) -> str:
    # The most frequent one; a tie goes to the comma, which stands first.
    return max(_DELIMITERS, key=header.count)


def read_plain_csv(path: str | Path) -> MotionTable:
    """Return the table of a plain CSV file; units are empty where the header does not state one.

    DataError names the line of what cannot be read.
    """
    header = _header(path)
    delimiter, pairs = _delimiter(header), _named_columns(header)
    names, units = [name for name, _ in pairs], [unit for _, unit in pairs]
    _check_first_name(path, names[0])
    if "" in names:
        raise DataError(f"{path}: a column has no name; every column needs a name of its own")
    written, names = names, told_apart(names)
    channels = {f"c{number}": MappedChannel(column=number + 1) for number in range(1, len(names))}
    channels["time"] = MappedChannel(column=1, unit=units[0] or _TIMES[names[0].lower()])
    mapped = ColumnMap(
        delimiter=_DELIMITERS[delimiter],
        # A decimal comma shows only where commas do not separate the cells.
        decimal="point" if delimiter == "," or not re.search(r"\d,\d", _text(path)) else "comma",
        channels=channels,
    )
    recording = read_foreign(path, mapped)
    twins = doubled(written[1:], names[1:])
    named = {name: recording[f"c{number}"] for number, name in enumerate(names) if number > 0}
    columns = without_copies(named, twins)
    stated = dict(zip((*names, *written), (*units, *units), strict=True))
    with refused_as(DataError, str(path), DataError):
        kind = kind_of_comments(line for line in _text(path).splitlines() if line.startswith("#"))
    remarks = tuple(said_of_doubled(twins, columns, "columns"))
    return MotionTable(
        str(path), recording.time, columns, {name: stated[name] for name in columns}, kind=kind, remarks=remarks
    )


def _check_first_name(path: str | Path, name: str) -> None:
    if name.lower() not in _TIMES:
        raise DataError(
            f"{path}: the first column must be 'time', it is {one_line(name)[:_LONGEST_SHOWN]!r}; a mean stride over 0 "
            "to 100 % is written out as time, at least twice in a row"
        )


def _header(path: str | Path) -> str:
    lines = (line for line in _text(path).splitlines() if line.strip() and not line.startswith("#"))
    return next(lines, "")


def _text(path: str | Path) -> str:
    content = read_bytes(path)
    try:
        return decoded(content)
    except UnicodeDecodeError:
        return content.decode("utf-8", errors="replace")


FORM = GaitForm(
    name="csv",
    summary="CSV files with the names and signs of this package, or others with a gait map",
    suffixes=(".csv", ".txt", ".tsv"),
    read=_read,
    recognises=_recognises,
    convention=_convention,
    is_whole=True,
)
