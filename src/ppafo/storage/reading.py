"""Reading of recordings from files of all supported formats, result folders and data frames."""

import io
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from ppafo.arguments import Pressure, Word, checked
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError, refused_as
from ppafo.signals import Recording, recording_kind
from ppafo.signals.recording import PLAIN_NUMBER, TIME, TIME_UNIT, Floats
from ppafo.storage.comma_separated import HeaderColumn, parse_header, read_csv, recording_of_columns
from ppafo.storage.netcdf import read_netcdf
from ppafo.storage.result_folder import CSV_FILE, MANIFEST, NETCDF_FILE, RUN_FILE, read_document, read_stored
from ppafo.wording import one_line

if TYPE_CHECKING:
    import pyarrow as pa
    from pandas import DataFrame  # type: ignore[import-untyped]
    from xarray import Dataset

    from ppafo.storage.column_map import ColumnMap

ColumnsLike = Annotated["ColumnMap | str | Path", Word("FILE.toml[:NAME]")]
"""Column map, or text ``FILE.toml[:NAME]`` that selects a map of a file."""

TEXT_SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".log", ".asc")
"""File-name suffixes of text tables."""


def recording_of_frame(frame: Any, atmosphere: float = STANDARD_ATMOSPHERE) -> Recording:
    """Return the recording in a pandas DataFrame or an xarray Dataset, in SI units; its attributes name title and kind.

    Time is a column, the index, or the coordinate of a Dataset; gauge pressures are relative to ``atmosphere`` [Pa
    absolute]. Raises DataError for a table without time, a column without unit and a cell that is no finite number.
    """
    attributes = dict(frame.attrs)
    header, named = _named_columns(frame)
    title = str(attributes.get("title", "")) or "table"
    kind = str(attributes.get("kind", "measured"))
    values = [_numbers(name, np.asarray(column)) for name, column in named]
    return recording_of_columns(header, values, range(len(values[0])), title, recording_kind(kind), atmosphere, "row")


def read_parquet(path: str | Path, atmosphere: float = STANDARD_ATMOSPHERE) -> Recording:
    """Read a recording from a Parquet file with columns ``name [unit]``, or with units in the column metadata.

    Raises DataError, naming the file, if it cannot be used.
    """
    from pyarrow import ArrowException

    from ppafo.storage import parquet
    from ppafo.storage.files import read_bytes

    def framed(table: "pa.Table") -> Any:
        frame = table.to_pandas()
        units = {
            field.name: (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace") for field in table.schema
        }
        frame.attrs |= {"units": units | frame.attrs.get("units", {}), "title": one_line(Path(path).stem)}
        return frame

    def header(schema: "pa.Schema") -> object:
        return _named_columns(framed(schema.empty_table()))

    table = parquet.read_parquet(io.BytesIO(read_bytes(path)), str(path), check_schema=header)
    with refused_as(DataError, str(path), DataError, ArrowException):
        return recording_of_frame(framed(table), atmosphere)


def _is_time(name: str) -> bool:
    return name.partition("[")[0].strip() == TIME


def _columns_of(frame: Any) -> list[tuple[str, Any]]:
    """Return name and column of a DataFrame or a Dataset, time first. Raises DataError for a table without time."""
    if hasattr(frame, "data_vars"):
        if TIME not in frame.coords and TIME not in frame.data_vars:
            known = ", ".join(map(str, frame.coords))
            raise DataError(f"the Dataset has no coordinate '{TIME}'; its coordinates are {known}")
        names = dict.fromkeys([TIME, *map(str, frame.data_vars)])
        return [(name, frame[name]) for name in names]
    columns = [(str(name), column) for name, column in frame.items()]
    if not any(_is_time(name) for name, _ in columns):
        columns = [(str(frame.index.name or ""), frame.index), *columns]
    if not any(_is_time(name) for name, _ in columns):
        known = ", ".join(one_line(name) for name, _ in columns[1:])
        raise DataError(f"the table has no column and no index '{TIME} [{TIME_UNIT}]'; available: {known}")
    return sorted(columns, key=lambda column: not _is_time(column[0]))


def _named_columns(frame: Any) -> tuple[list[HeaderColumn], list[tuple[str, Any]]]:
    """Return header and columns, with units in their names, in their attributes or in those of the frame."""
    columns = _columns_of(frame)
    units = (
        {name: str(column.attrs.get("units", "")) for name, column in columns}
        if hasattr(frame, "data_vars")
        else {str(name): str(unit) for name, unit in dict(frame.attrs.get("units", {})).items()}
    )
    heads = []
    for name, _ in columns:
        unit = units.get(name, "")
        head = name
        # Of a table without units all names are bare, its time too.
        if "[" not in name and (unit or (name == TIME and any(units.values()))):
            head = f"{name} [{PLAIN_NUMBER if unit == '1' else unit or TIME_UNIT}]"
        heads.append(head)
    return parse_header(heads), columns


def _numbers(name: str, column: NDArray[Any]) -> Floats:
    """Return a column as numbers, a duration in s. Raises DataError for a cell that is no finite number."""
    if np.issubdtype(column.dtype, np.timedelta64):
        column = column / np.timedelta64(1, "s")
    try:
        numbers = column.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise DataError(f"column '{one_line(name)}' is not numeric") from error
    wrong = np.flatnonzero(~np.isfinite(numbers))
    if wrong.size:
        raise DataError(f"column '{one_line(name)}': row {wrong[0]} is {numbers[wrong[0]]}, not a finite number")
    return numbers


@checked
def read_recording(
    path: "str | Path | DataFrame | Dataset",
    *,
    atmosphere: Pressure = STANDARD_ATMOSPHERE,
    columns: ColumnsLike | None = None,
) -> Recording:
    """Read a recording from a ``.nc`` or ``.parquet`` file, a text table such as ``.csv``, or a result folder.

    A pandas DataFrame or an xarray Dataset is taken as well: columns ``name [unit]``, or units in its ``attrs``.

    Arguments:
        path: a file, a result folder, a pandas DataFrame or an xarray Dataset
        atmosphere: pressure [Pa absolute] from which gauge pressure in a table counts
        columns: a column map, or the name of one, ``logger.toml:bench``, for a table with other columns, signs or
            separators and for a ``.mat`` file

    Returns:
        a Recording, its channels of shape (samples,) in SI units, pressures absolute

    Raises:
        DataError: a file that is not usable

    >>> import ppafo
    >>> folder = ppafo.simulate("step-response").save("step")
    >>> ppafo.read_recording(folder).names[:3]
    ('angle', 'angular_velocity', 'pressure_1')
    """
    if not isinstance(path, str | Path):
        return recording_of_frame(path, atmosphere=atmosphere)
    file = Path(path)
    if columns is not None:
        from ppafo.storage.column_map import column_map_of
        from ppafo.storage.foreign import read_foreign

        column_map, map_name = column_map_of(columns)
        return read_foreign(file, column_map, atmosphere=atmosphere, map_name=map_name)
    if file.is_dir() and ((file / RUN_FILE).exists() or (file / MANIFEST).exists()):
        return read_stored(file).recording
    if file.is_dir():
        if not (file / NETCDF_FILE).is_file():
            raise DataError(f"{file}: contains no result of a walk or a simulation (no {NETCDF_FILE}, no {RUN_FILE})")
        file /= NETCDF_FILE
    if file.suffix == ".nc":
        from ppafo.storage.trial_reading import check_can_be_read

        # The HDF5 library can crash on a damaged file, or go round in it for ever, and would take this process with it.
        check_can_be_read(file, read_netcdf, "h5py")
        return read_netcdf(file)
    if file.suffix.lower() in TEXT_SUFFIXES:
        recording = read_csv(file, atmosphere=atmosphere)
        run_file = file.parent / RUN_FILE
        if file.name != CSV_FILE or not run_file.exists():
            return recording
        described = read_document(file.parent)["recording"]
        with refused_as(DataError, run_file, DataError):
            kind = recording_kind(str(described.get("kind", recording.kind)))
        return replace(recording, label=str(described.get("label", recording.label)), kind=kind)
    if file.suffix.lower() == ".parquet":
        return read_parquet(file, atmosphere)
    if not file.exists():
        raise DataError(f"{file}: no such file or folder")
    raise DataError(
        f"{file}: must be a result folder or a .nc, .parquet, {', '.join(TEXT_SUFFIXES)} or (through a column map) "
        ".mat or other text file"
    )
