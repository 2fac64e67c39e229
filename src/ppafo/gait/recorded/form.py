"""A form of gait recordings: how its files are known and read, and what their columns mean without a gait map."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ppafo.gait.recorded.mapping import GaitMap, Side
from ppafo.gait.recorded.table import MotionTable


@dataclass(frozen=True, slots=True)
class Convention:
    """The map of files that come without one, columns of force plates to choose by the foot's motion, and remarks."""

    columns: GaitMap
    plates: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


def any_file(_path: str | Path) -> bool:
    """Recognise every file with a suffix of the form."""
    return True


def as_it_is(table: MotionTable) -> MotionTable:
    """Return a table as it was read."""
    return table


@dataclass(frozen=True, slots=True)
class GaitForm:
    """A form of gait recordings. ``suffixes`` are in lower case, with their dot.

    ``read`` returns time [s], columns and units of a file, DataError where it cannot be read, and ``convention`` what
    its columns mean for a side and a body mass [kg]. ``recognises`` tells files of the form from others with their
    suffix, by content. Where no gait map of the user says what columns mean, ``arrange`` may change them before.
    ``is_whole`` is true where a file has all curves of a foot, so that no file of another form can add one.
    """

    name: str
    summary: str
    suffixes: tuple[str, ...]
    read: Callable[[str | Path], MotionTable]
    convention: Callable[[MotionTable, Side, float], Convention]
    recognises: Callable[[str | Path], bool] = any_file
    arrange: Callable[[MotionTable], MotionTable] = as_it_is
    is_whole: bool = False
