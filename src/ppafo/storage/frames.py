"""Recordings from tables of other libraries: pandas DataFrame, xarray Dataset, Parquet file.

Channels are columns ``name [unit]``, or plain names with the unit in the attributes, as written by this package.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError, refused_as
from ppafo.signals import Recording
from ppafo.signals.recording import PLAIN_NUMBER, TIME, TIME_UNIT, recording_kind
from ppafo.storage.comma_separated import parse_header, recording_of_columns
from ppafo.wording import one_line


def recording_of_frame(frame: Any, atmosphere: float = STANDARD_ATMOSPHERE) -> Recording:
    """Return the recording in a pandas DataFrame or an xarray Dataset, in SI units; its attributes name title and kind.

    Time is a column, the index, or the coordinate of a Dataset; gauge pressures are relative to ``atmosphere`` [Pa
    absolute]. Raises DataError for a table without time, a column without unit and a cell that is no finite number.
    """
    attributes = dict(frame.attrs)
    if hasattr(frame, "data_vars"):
        names = [TIME, *(str(name) for name in frame.data_vars)]
        if TIME not in frame.coords and TIME not in frame.data_vars:
            known = ", ".join(map(str, frame.coords))
            raise DataError(f"the Dataset has no coordinate '{TIME}'; its coordinates are {known}")
        names = list(dict.fromkeys(names))
        values = [np.asarray(frame[name].values) for name in names]
        units = {name: str(frame[name].attrs.get("units", "")) for name in names}
    else:
        names = [str(name) for name in frame.columns]
        values = [np.asarray(frame[name].to_numpy()) for name in frame.columns]
        units = {str(name): str(unit) for name, unit in dict(attributes.get("units", {})).items()}
        if not any(_is_time(name) for name in names):
            named = str(frame.index.name or "")
            if not _is_time(named):
                known = ", ".join(map(one_line, names))
                raise DataError(f"the table has no column and no index '{TIME} [{TIME_UNIT}]'; available: {known}")
            names, values = [named, *names], [np.asarray(frame.index), *values]
    title, kind = str(attributes.get("title", "")) or "table", str(attributes.get("kind", "measured"))
    return _recording(names, values, units, title, kind, atmosphere)


def read_parquet(path: str | Path, atmosphere: float = STANDARD_ATMOSPHERE) -> Recording:
    """Read a recording from a Parquet file with columns ``name [unit]``, or with units in the column metadata.

    Raises DataError, naming the file, if it cannot be used.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    from ppafo.storage.files import read_bytes

    content = read_bytes(path)
    with refused_as(DataError, str(path), DataError):
        try:
            table = pq.read_table(pa.BufferReader(content))
        except (pa.ArrowException, OSError, ValueError) as error:
            raise DataError(f"is not a readable Parquet file: {one_line(error)}") from error
        units = {
            field.name: (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace") for field in table.schema
        }
        # What pandas keeps of a frame's attributes, as text.
        attributes = json.loads((table.schema.metadata or {}).get(b"PANDAS_ATTRS", b"{}"))
        units |= attributes.get("units", {})
        names = [name for name in table.column_names if name != "__index_level_0__"]
        if not any(map(_is_time, names)):
            raise DataError(f"has no column '{TIME} [{TIME_UNIT}]'; available: {', '.join(map(one_line, names))}")
        values = [table[name].to_numpy() for name in names]
        kind = str(attributes.get("kind", "measured"))
        return _recording(names, values, units, one_line(Path(path).stem), kind, atmosphere)


def _is_time(name: str) -> bool:
    return name.partition("[")[0].strip() == TIME


def _recording(
    names: Sequence[str], values: Sequence[Any], units: Mapping[str, str], label: str, kind: str, atmosphere: float
) -> Recording:
    """Return a recording from columns in any order, with units in their names or in ``units``."""
    pairs = sorted(zip(names, values, strict=True), key=lambda pair: not _is_time(pair[0]))
    heads, columns = [], []
    for name, column in pairs:
        unit, head = units.get(name, ""), name
        # Of a table without units all names are bare, its time too.
        if "[" not in name and (unit or (name == TIME and any(units.values()))):
            head = f"{name} [{PLAIN_NUMBER if unit == '1' else unit or TIME_UNIT}]"
        heads.append(head)
        if np.issubdtype(column.dtype, np.timedelta64):
            columns.append(column / np.timedelta64(1, "s"))
            continue
        try:
            numbers = column.astype(np.float64)
        except (TypeError, ValueError) as error:
            raise DataError(f"column '{one_line(name)}' is not numeric") from error
        wrong = np.flatnonzero(~np.isfinite(numbers))
        if wrong.size:
            raise DataError(f"column '{one_line(name)}': row {wrong[0]} is {numbers[wrong[0]]}, not a finite number")
        columns.append(numbers)
    rows = range(len(columns[0]))
    return recording_of_columns(parse_header(heads), columns, rows, label, recording_kind(kind), atmosphere, "row")
