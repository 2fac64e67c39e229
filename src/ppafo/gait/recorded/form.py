"""A form of gait recordings: how its files are known and read, and what their columns mean without a gait map."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ppafo.gait.recorded.mapping import GaitMap, Side
from ppafo.gait.recorded.table import MotionTable


@dataclass(frozen=True, slots=True)
class Convention:
    """Meaning of the columns of a file without a gait map.

    ``columns`` is the map, ``plates`` are columns of force plates to choose from by the foot's motion, ``remarks``
    sentences for whoever reads the file.
    """

    columns: GaitMap
    plates: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class GaitForm:
    """A form of gait recordings: its name, a summary in a phrase, and suffixes in lower case, with their dot.

    ``read`` gives time [s], columns and units of a file, the ``form`` of the table left empty, or a DataError;
    ``convention`` the meaning of its columns for a foot and a body mass [kg], where no gait map of the user does;
    ``recognises`` tells by its content whether a file is of the form, where others have the same suffix; ``arrange``
    changes a table before its columns are interpreted. ``is_whole`` is true where a file has all curves of a foot, so
    that no file of another form can add one.
    """

    name: str
    summary: str
    suffixes: tuple[str, ...]
    read: Callable[[str | Path], MotionTable]
    convention: Callable[[MotionTable, Side, float], Convention]
    recognises: Callable[[str | Path], bool] = lambda _path: True
    arrange: Callable[[MotionTable], MotionTable] = lambda table: table
    is_whole: bool = False
