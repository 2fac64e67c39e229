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

from ppafo.documents.toml_text import label
from ppafo.errors import Faults, ParameterError
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import SECTION
from ppafo.model.effects.opening import NODES
from ppafo.parameters.number_table import lines_of_table, numbers_of_table
from ppafo.parameters.parameter_set import Entry
from ppafo.wording import one_line

COLUMNS = ("command", "opening")
SIZE = Quantity("", "", "size", None, 0.0, 1.0, plain=True)
"""Size of a command or an opening [-]."""


def entries_of_opening(table: Mapping[str, Any], folder: Path, where: str) -> dict[str, Entry]:
    """Return the numbers of a table by path; ``where`` names it in messages. Raises ParameterError for a bad table."""
    lists = [list(table.get(name, ())) for name in COLUMNS]
    places = [f"row {number}" for number in range(1, len(lists[0]) + 1)]
    if "file" in table:
        if any(lists):
            raise ParameterError(f"{where} has a file and numbers; give one of them")
        where = f"{where}.file: {label(str(folder / table['file']))}"
        (_, header), *lines = lines_of_table(folder / table["file"], where, ",".join(COLUMNS))
        if sorted(header) != sorted(COLUMNS):
            raise ParameterError(f"{where}: must begin with 'command,opening', not '{one_line(','.join(header))}'")
        rows = numbers_of_table(lines, header, where)
        lists = [[row[header.index(name)] for row in rows] for name in COLUMNS]
        places = [f"line {number}" for number, _ in lines]
    if len(lists[0]) != len(lists[1]):
        raise ParameterError(f"{where}: {len(lists[0])} commands and {len(lists[1])} openings; give as many of both")
    nodes = [
        (place, float(command), float(opening))
        for place, command, opening in zip(places, *lists, strict=True)
        if (command, opening) not in ((0.0, 0.0), (1.0, 1.0))
    ]
    wrong = Faults()
    before = (0.0, 0.0)
    for place, command, opening in nodes:
        if not (before[0] < command < 1.0 and before[1] <= opening <= 1.0):
            wrong.append(
                ParameterError(
                    f"{where}: {place}, command {command:g} with opening {opening:g}, must have a command above "
                    f"{before[0]:g} and an opening from {before[1]:g} to 1; at command 1 it is 1, the valve's area"
                )
            )
        before = command, opening
    if not 0 < len(nodes) <= NODES:
        wrong.append(ParameterError(f"{where}: {len(nodes)} rows between (0, 0) and (1, 1); must be from 1 to {NODES}"))
    wrong.raise_all()
    known = {name: table[name] for name in ("origin", "source", "note") if name in table}
    return {
        f"{SECTION}.opening.{name}_{number:02}": Entry(value, "", **known)
        for number, (_, *node) in enumerate(nodes, 1)
        for name, value in zip(COLUMNS, node, strict=True)
    }
