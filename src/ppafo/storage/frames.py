"""Recordings in tables of other libraries: a pandas DataFrame, an xarray Dataset, a Parquet file.

Channels are columns ``name [unit]``, or plain names whose unit stands in the attributes, as this package writes them.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError, UnitError, refused_as
from ppafo.signals import Channel, Recording, RecordingKind
from ppafo.signals.recording import PLAIN_NUMBER, TIME, TIME_UNIT, recording_kind
from ppafo.storage.comma_separated import HeaderColumn, check_clock, in_si, parse_header
from ppafo.wording import one_line

PANDAS_READERS = {
    ".xlsx": "read_excel({path!r})",
    ".xls": "read_excel({path!r})",
    ".ods": "read_excel({path!r})",
    ".json": "read_json({path!r})",
    ".feather": "read_feather({path!r})",
    ".h5": "read_hdf({path!r})",
    ".hdf5": "read_hdf({path!r})",
    ".pkl": "read_pickle({path!r})",
}
"""Call of pandas that reads a table, by its suffix."""
OTHER_READERS = {
    ".npz": "DataFrame(dict(numpy.load({path!r})))",
    ".tdms": "DataFrame(nptdms.TdmsFile({path!r}).as_dataframe())",
}
"""Call that reads a table into pandas with another library, by its suffix."""


def remedy_for(path: str | Path) -> str:
    """Advice to read a table of another format with pandas, as the end of a message; empty for an unknown suffix."""
    table = _read_by_pandas(path)
    # The same advice, behind the one to do without a file.
    return f"; in Python give the table itself, {table}, or{written_as_csv(path)[1:]}" if table else ""


def written_as_csv(path: str | Path) -> str:
    """Advice to write a table of another format as CSV with pandas; empty for an unknown suffix."""
    table = _read_by_pandas(path)
    return f"; write it as CSV: {table}.to_csv({f'{path}.csv'!r}, index=False)" if table else ""


def _read_by_pandas(path: str | Path) -> str:
    call = (PANDAS_READERS | OTHER_READERS).get(Path(path).suffix.lower())
    return "" if call is None else f"pandas.{call.format(path=str(path))}"


def recording_of_frame(
    frame: Any, label: str = "", kind: RecordingKind = "measured", atmosphere: float = STANDARD_ATMOSPHERE
) -> Recording:
    """Recording in a pandas DataFrame or an xarray Dataset, in SI units.

    Arguments:
        frame: table with time as a column, as the index, or as the coordinate of a Dataset
        label: name of the recording; default: ``frame.attrs["title"]``
        kind: where the numbers come from, unless ``frame.attrs["kind"]`` says it
        atmosphere: level from which gauge pressure counts [Pa absolute]

    Raises DataError for a table without time, a column without unit and a cell that is no finite number.
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
                raise DataError(f"the table has no column and no index '{TIME} [{TIME_UNIT}]'; it has {known}")
            names, values = [named, *names], [np.asarray(frame.index), *values]
    at = next(place for place, name in enumerate(names) if _is_time(name))
    order = [at, *(place for place in range(len(names)) if place != at)]
    cells = [_cell(names[place], units) for place in order]
    columns = [_numbers(names[place], values[place]) for place in order]
    title = label or str(attributes.get("title", "")) or "table"
    return _recording(cells, columns, title, recording_kind(str(attributes.get("kind", kind))), atmosphere)


def read_parquet(path: str | Path, atmosphere: float = STANDARD_ATMOSPHERE) -> Recording:
    """Recording in a Parquet file whose columns are ``name [unit]``, or have their unit among their metadata.

    Raises DataError, with the file, for one that is not usable.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    from ppafo.storage.files import read_bytes

    content = read_bytes(path)
    with refused_as(DataError, str(path), DataError):
        try:
            table = pq.read_table(pa.BufferReader(content))
        except (pa.ArrowException, OSError, ValueError) as error:
            raise DataError(f"is not a Parquet file that can be read: {one_line(error)}") from error
        units = {
            field.name: (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace") for field in table.schema
        }
        # What pandas keeps of a frame's attributes, as text.
        attributes = json.loads((table.schema.metadata or {}).get(b"PANDAS_ATTRS", b"{}"))
        units |= attributes.get("units", {})
        kind = recording_kind(str(attributes.get("kind", "measured")))
        names = [name for name in table.column_names if name != "__index_level_0__"]
        at = next((place for place, name in enumerate(names) if _is_time(name)), None)
        if at is None:
            raise DataError(f"has no column '{TIME} [{TIME_UNIT}]'; it has {', '.join(map(one_line, names))}")
        names = [names[at], *(name for name in names if name != names[at])]
        columns = [_numbers(name, table[name].to_numpy()) for name in names]
        cells = [_cell(name, units) for name in names]
        return _recording(cells, columns, one_line(Path(path).stem), kind, atmosphere)


def _is_time(name: str) -> bool:
    return name.partition("[")[0].strip() == TIME


def _cell(name: str, units: Mapping[str, str]) -> str:
    """Return the header of a column, with its unit from the attributes where the name does not state it."""
    unit = units.get(name, "")
    # Of a table without units all names are bare, its time too.
    if "[" in name or not (unit or (name == TIME and any(units.values()))):
        return name
    return f"{name} [{PLAIN_NUMBER if unit == '1' else unit or TIME_UNIT}]"


def _numbers(name: str, values: Any) -> Any:
    if np.issubdtype(values.dtype, np.timedelta64):
        return values / np.timedelta64(1, "s")
    try:
        numbers = values.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise DataError(f"column '{one_line(name)}' is not of numbers") from error
    wrong = np.flatnonzero(~np.isfinite(numbers))
    if wrong.size:
        raise DataError(f"column '{one_line(name)}': row {wrong[0]} is {numbers[wrong[0]]}, not a finite number")
    return numbers


def _recording(
    cells: Sequence[str], values: Sequence[Any], label: str, kind: RecordingKind, atmosphere: float
) -> Recording:
    columns: list[HeaderColumn] = parse_header(list(cells))
    if not len(values[0]):
        raise DataError("has a header but no samples")
    series = []
    for column, numbers in zip(columns, values, strict=True):
        with refused_as(DataError, f"column '{column.name} [{column.unit}]'", UnitError):
            series.append(in_si(column, numbers, atmosphere))
    check_clock(series[0], range(len(series[0])), "row")
    channels = {
        column.name: Channel(numbers, column.si_unit, column.between, column.unit)
        for column, numbers in zip(columns[1:], series[1:], strict=True)
    }
    return Recording(label, series[0], channels, kind)
