"""A form of gait recordings: how its files are known and read, and what their columns mean without a gait map."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

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


class FileReader(Protocol):
    """Reader of a file of a form."""

    def __call__(self, path: str | Path, /) -> MotionTable:
        """Return time [s], columns and units of a file, its ``form`` left empty; DataError where it cannot be read."""


class ConventionOf(Protocol):
    """Meaning of the columns of a file of a form, where no gait map of the user gives it."""

    def __call__(self, table: MotionTable, side: Side, body_mass: float, /) -> Convention:
        """Return the convention for a foot, and for forces over a body mass [kg]."""


class FileTest(Protocol):
    """Content check for a gait form whose file suffix is shared with other forms."""

    def __call__(self, path: str | Path, /) -> bool:
        """Return whether a file is of the form, by its content."""


class TableChange(Protocol):
    """Conversion of a table before its columns are interpreted, where no gait map of the user does it."""

    def __call__(self, table: MotionTable, /) -> MotionTable:
        """Return the table with the columns that the convention of its form is about."""


def any_file(_path: str | Path) -> bool:
    """Recognise every file with a suffix of the form."""
    return True


def as_it_is(table: MotionTable) -> MotionTable:
    """Return a table as it was read."""
    return table


@dataclass(frozen=True, slots=True)
class GaitForm:
    """A form of gait recordings: its name, a summary in a phrase, and suffixes in lower case, with their dot.

    ``is_whole`` is true where a file has all curves of a foot, so that no file of another form can add one.
    """

    name: str
    summary: str
    suffixes: tuple[str, ...]
    read: FileReader
    convention: ConventionOf
    recognises: FileTest = any_file
    arrange: TableChange = as_it_is
    is_whole: bool = False
