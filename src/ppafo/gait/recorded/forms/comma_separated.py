"""CSV files of gait recordings: with the names and units of this package, or plain with any usual delimiter.

The header of a CSV file need not be ``name [unit]``: a name alone, or with the unit in other brackets, is accepted.
"""

import re
from dataclasses import replace
from pathlib import Path

from ppafo.errors import DataError, UnitError, refused_as
from ppafo.gait.recorded.delimited import NumberBlock, cells_of, delimiter_of, lines_of, table_of
from ppafo.gait.recorded.form import Convention, GaitForm
from ppafo.gait.recorded.mapping import Side, package_map, setting_text
from ppafo.gait.recorded.table import COUNTERS, MotionTable
from ppafo.storage.comma_separated import kind_of_comments
from ppafo.units import to_si
from ppafo.wording import one_line

_NAME = re.compile(r"(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?")

_TIMES = {"time": "s", "t": "s", "time_s": "s", "time_ms": "ms"}

_LONGEST_SHOWN = 40
"""Largest number of characters of a name in a message."""


def _convention(_table: MotionTable, side: Side, _body_mass: float) -> Convention:
    """Return the map of the package's column names and signs; raises DataError for a left foot."""
    if side != "right":
        raise DataError(
            "the package's column names in a CSV file are of the right foot; for the left foot, name columns of both "
            f"angles in a gait map ({setting_text('columns')}), or omit {setting_text('side')}"
        )
    return Convention(package_map())


def plain_names(path: str | Path) -> list[str]:
    """Return the column names of a plain CSV file; an empty list for a CSV file of the package.

    A plain file has a foreign delimiter, or a column without a unit in square brackets.
    """
    header = _header(path)
    is_plain = delimiter_of(header) != "," or not all("[" in cell for cell in header.split(","))
    return [name for name, _ in _named_columns(header)] if is_plain else []


def _named_columns(header: str) -> list[tuple[str, str]]:
    cells = cells_of(header, delimiter_of(header))
    return [(match[1], match[2] or "") for cell in cells if (match := _NAME.fullmatch(cell))]


def read_plain_csv(path: str | Path) -> MotionTable:
    """Return the motion table of a CSV file; units are empty if the header does not state them, gaps are NaN.

    Row counters before the time column, such as a pandas index or frame numbers, are skipped. Raises DataError with the
    line of a value that cannot be read.
    """
    lines = lines_of(path)
    first = next((number for number, line in enumerate(lines) if line.strip() and not line.startswith("#")), 0)
    header = _header(path)
    delimiter = delimiter_of(header)
    pairs = _named_columns(header)
    names = [name for name, _ in pairs]
    units = [unit for _, unit in pairs]
    at = next((place for place, name in enumerate(names) if name.lower() in _TIMES), 0)
    at = at if all(name.lower() in COUNTERS for name in names[:at]) else 0
    clock = names[at] if names[at].lower() in _TIMES else ""
    problem = (
        f"{path}: the first column must be 'time', not {one_line(names[at])[:_LONGEST_SHOWN]!r}, or 0 to 100 percent "
        f"of a mean stride with {setting_text('stride_time')}, or frames with time.rate of a gait map"
    )
    if "" in names[at:]:
        raise DataError(f"{path}: a column has no name")
    # A decimal comma shows only where commas do not separate the cells.
    has_comma = delimiter != "," and any(re.search(r"\d,\d", line) for line in lines[first + 1 :])
    with refused_as(DataError, str(path), DataError):
        kind = kind_of_comments(line for line in lines if line.startswith("#"))
    with refused_as(DataError, f"{path}: column {clock!r}", UnitError):
        seconds = to_si(1.0, units[at] or _TIMES[clock.lower()], "s") if clock else 1.0
    block = NumberBlock(
        lines=lines, first=first + 1, delimiter=delimiter, decimal="," if has_comma else ".", is_ragged=False
    )
    try:
        table = table_of(path, block, [*[""] * at, *names[at:]], units, clock, seconds=seconds, kind=kind)
    except DataError as error:
        raise DataError(str(error) if clock else problem) from error
    return table if clock else replace(table, problem=problem)


def _header(path: str | Path) -> str:
    return next((line for line in lines_of(path) if line.strip() and not line.startswith("#")), "")


FORM = GaitForm(
    name="csv",
    summary="CSV files with the names and signs of this package, or others with a gait map",
    suffixes=(".csv", ".txt", ".tsv"),
    read=read_plain_csv,
    # The first line of a .txt file may mark it as a file of markers.
    recognises=lambda path: Path(path).suffix.lower() != ".txt" or not _header(path).startswith("PathFileType"),
    convention=_convention,
    is_whole=True,
)
