"""Table of a valve's opening in a parameter set: rows in the set, or a file with the columns command and opening.

    [valves.main.opening]
    command = [0.05, 0.2, 0.6]
    opening = [0.0, 0.03, 0.7]
    origin = "datasheet"
    source = "flow over command, figure 4"

Both are sizes from 0 to 1; the ends (0, 0) and (1, 1) may be left out. ``valves.main.area`` is the full opening.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ppafo.documents.regular_file import MAXIMUM_BYTES_TYPED, decoded, read_regular_file
from ppafo.documents.toml_text import label
from ppafo.errors import ParameterError
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import SECTION
from ppafo.model.effects.opening import NODES
from ppafo.parameters.declared import Field, InnerTable, Many, Words
from ppafo.parameters.parameter_set import TEXT_ENTRY, Entry
from ppafo.wording import one_line, reason

COLUMNS = ("command", "opening")
_SIZE = Quantity("", "", "size", None, 0.0, 1.0, plain=True)


def fields_of_opening(valve: str) -> dict[str, Field]:
    """Return the fields of the table of a valve by path."""
    path = f"valves.{valve}.opening"
    return {
        path: InnerTable("opening over the command, in place of a straight line beyond the dead band"),
        f"{path}.file": Words("CSV file with the columns command and opening, relative to the folder of the set"),
        **{f"{path}.{name}": Many(_SIZE, f"{name} of each node, from 0 to 1") for name in COLUMNS},
        **{f"{path}.{name}": TEXT_ENTRY[name] for name in ("origin", "source", "note")},
    }


def entries_of_opening(table: Mapping[str, Any], folder: Path, where: str) -> dict[str, Entry]:
    """Return the numbers of a table by path; ``where`` names it in messages. Raises ParameterError for a bad table."""
    lists = [list(table.get(name, ())) for name in COLUMNS]
    if "file" in table:
        if any(lists):
            raise ParameterError(f"{where} has a file and numbers; give one of them")
        where = label(str(folder / table["file"]))
        lists = _read(folder / table["file"], where)
    if len(lists[0]) != len(lists[1]):
        raise ParameterError(f"{where}: {len(lists[0])} commands and {len(lists[1])} openings; give as many of both")
    rows = [(float(command), float(opening)) for command, opening in zip(*lists, strict=True)]
    inner = [row for row in rows if row not in ((0.0, 0.0), (1.0, 1.0))]
    before = (0.0, 0.0)
    for number, (command, opening) in enumerate([*inner, (1.0, 1.0)], 1):
        if not (command > before[0] and before[1] <= opening <= 1.0):
            raise ParameterError(
                f"{where}: row {number}, command {command:g} with opening {opening:g}, must have a command above "
                f"{before[0]:g} and an opening from {before[1]:g} to 1; at command 1 it is 1, the valve's area"
            )
        before = command, opening
    if not 0 < len(inner) <= NODES:
        raise ParameterError(f"{where}: {len(inner)} rows between (0, 0) and (1, 1); must be from 1 to {NODES}")
    known = {name: table[name] for name in ("origin", "source", "note") if name in table}
    return {
        f"{SECTION}.opening.{name}_{number:02}": Entry(value, "", **known)
        for number, row in enumerate(inner, 1)
        for name, value in zip(COLUMNS, row, strict=True)
    }


def _read(path: Path, where: str) -> list[list[float]]:
    """Return the columns command and opening of a CSV file; ParameterError names file and line of a fault."""
    try:
        text = decoded(read_regular_file(path, MAXIMUM_BYTES_TYPED))
    except (OSError, ValueError) as error:
        raise ParameterError(f"{where}: cannot be read: {reason(error)}") from error
    lines = [[cell.strip() for cell in line.split(",")] for line in text.splitlines() if line.strip()]
    header = lines[0] if lines else []
    if sorted(header) != sorted(COLUMNS):
        raise ParameterError(f"{where}: must begin with 'command,opening', not '{one_line(','.join(header))}'")
    columns: list[list[float]] = [[], []]
    for number, cells in enumerate(lines[1:], 2):
        for cell, name in zip(cells, header, strict=False):
            try:
                columns[COLUMNS.index(name)].append(float(cell))
            except ValueError:
                raise ParameterError(f"{where}, line {number}: {name} = '{one_line(cell)}': must be a number") from None
    return columns
