"""What a column map takes of a MATLAB file, by the names of its variables: ``M(:,3)``, ``log.pressure``."""

import re

import numpy as np

from ppafo.errors import DataError, nearest_name
from ppafo.signals.recording import TIME, Floats
from ppafo.storage.column_map import ColumnMap, MappedTable, in_map, shown_names
from ppafo.storage.matlab import MatlabFile


def read_mapped_matlab(file: MatlabFile, columns: ColumnMap, map_name: str) -> MappedTable:
    """Return what a map takes of a MATLAB file, numbers in the file's own units.

    DataError names the key of a channel whose variable is not there or not usable, and the map where ``map_name`` says
    which.
    """
    numbers: dict[str, Floats] = {}
    clock: list[str] | None = None
    dates: list[str] | None = None
    with in_map(map_name):
        for name, mapped in columns.channels.items():
            if mapped.column is None:
                continue
            variable = _variable(f"channels.{name}.column", mapped.column, file)
            if name == TIME and variable in file.texts:
                clock = file.texts[variable]
            else:
                numbers[name] = file.columns[variable]
        date = columns.channels[TIME].date
        if date is not None:
            dates = file.texts.get(_variable(f"channels.{TIME}.date", date, file))
        size = _common_length(numbers, clock)
        for name, values in numbers.items():
            gaps = np.flatnonzero(~np.isfinite(values))
            if gaps.size:
                first = int(gaps[0])
                raise DataError(f"channels.{name}.column: sample {first + 1} is {values[first]}, not a finite number")
    return MappedTable(
        size=size, numbers=numbers, clock=clock, dates=dates, rows=range(1, size + 1), noun="sample", kind="measured"
    )


def _variable(key: str, column: int | str, file: MatlabFile) -> str:
    """Return the name of the variable that a map has at ``key``; a number is a column of the file's only matrix."""
    if isinstance(column, int):
        matrices = sorted({name.partition("(")[0] for name in file.columns if "(:," in name and "." not in name})
        if len(matrices) != 1:
            raise DataError(f"{key} = {column}: columns of a .mat file have names; it has {shown_names(file.columns)}")
        column = f"{matrices[0]}(:,{column})"
    name = re.sub(r"\s+", "", column) if "(" in column else column
    if name not in file.columns and name not in file.texts:
        known = (*file.columns, *file.texts)
        raise DataError(
            f"{key} = {column!r}: the file has no such column{nearest_name(name, known)}; it has {shown_names(known)}"
            f"{file.said_of_objects()}"
        )
    return name


def _common_length(numbers: dict[str, Floats], clock: list[str] | None) -> int:
    """Return the number of samples that all columns have; DataError where they have several, or there is no column."""
    lengths = {name: values.size for name, values in numbers.items()}
    if clock:
        lengths[TIME] = len(clock)
    if len(set(lengths.values())) != 1:
        listed = ", ".join(f"channels.{name} has {length}" for name, length in lengths.items())
        raise DataError(f"all columns must have the same number of samples: {listed or 'there is no column'}")
    return next(iter(lengths.values()))
