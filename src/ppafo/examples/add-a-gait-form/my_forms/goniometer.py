"""Text files of a goniometer: a line that names it, a line of names, then time [ms] and angles [deg]."""

from pathlib import Path

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.recorded.form import Convention, GaitForm
from ppafo.gait.recorded.mapping import AngleMap, GaitMap, ShankMap, Side
from ppafo.gait.recorded.table import MotionTable
from ppafo.storage.files import read_bytes

FIRST_LINE = b"# goniometer"


def recognises(path: str | Path) -> bool:
    """Recognise a file by its first line; other devices write .txt too."""
    return read_bytes(path).startswith(FIRST_LINE)


def read(path: str | Path) -> MotionTable:
    """Return time [s] and the columns as they stand, each with its unit."""
    lines = read_bytes(path).decode("utf-8", errors="replace").splitlines()[1:]
    names = lines[0].split() if lines else []
    try:
        rows = np.loadtxt(lines[1:], ndmin=2)
    except ValueError as error:
        raise DataError(f"{path}: {error}") from error
    if rows.shape[1] != len(names) or names[:1] != ["ms"]:
        raise DataError(
            f"{path}: has {rows.shape[1]} columns below {len(names)} names, of which the first must be 'ms'"
        )
    columns = {name: rows[:, number] for number, name in enumerate(names) if number > 0}
    return MotionTable(str(path), 1e-3 * rows[:, 0], columns, dict.fromkeys(columns, "deg"))


def convention(table: MotionTable, side: Side, body_mass: float) -> Convention:
    """Say what the columns of a foot mean: shank_r leans with the ankle in front, ankle_r counts dorsiflexion."""
    foot = side[0]
    return Convention(
        GaitMap(
            shank_angle=ShankMap(terms=(f"shank_{foot}",)),
            ankle_angle=AngleMap(terms=(f"ankle_{foot}",), positive="dorsiflexion"),
        )
    )


FORM = GaitForm(
    name="goniometer",
    summary="text files of a goniometer",
    suffixes=(".txt",),
    read=read,
    convention=convention,
    recognises=recognises,
)
