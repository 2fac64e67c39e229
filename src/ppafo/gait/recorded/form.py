"""File format of gait recordings: recognition, reading, and meaning of the columns without a gait map."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ppafo.gait.recorded.mapping import GaitMap, Side
from ppafo.gait.recorded.table import MotionTable


@dataclass(frozen=True, slots=True)
class Convention:
    """Meaning of the columns of a recorded file without a gait map.

    ``columns`` is the map, ``plates`` are force plate columns, to be assigned to the foot by its motion. ``remarks``
    are sentences for the user, ``curve_remarks`` further sentences, each with the one curve of the map that it is on.
    """

    columns: GaitMap
    plates: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    curve_remarks: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class GaitForm:
    """File format of gait recordings.

    - ``name``, ``summary``: name, and summary in a phrase
    - ``suffixes``: file suffixes in lower case, with the dot
    - ``read``: function that returns time [s], columns and units of a file, with an empty ``form``, or raises DataError
    - ``convention``: function that returns the meaning of the columns for a foot and a body mass [kg], used without a
      gait map of the user
    - ``recognises``: function that detects the format by the content of a file, for suffixes that several formats share
    - ``arrange``: function that changes a table before its columns are interpreted
    - ``is_whole``: True if a file contains all curves of a foot, so that no file of another format can be combined with
      it
    """

    name: str
    summary: str
    suffixes: tuple[str, ...]
    read: Callable[[str | Path], MotionTable]
    convention: Callable[[MotionTable, Side, float], Convention]
    recognises: Callable[[str | Path], bool] = lambda _path: True
    arrange: Callable[[MotionTable], MotionTable] = lambda table: table
    is_whole: bool = False
