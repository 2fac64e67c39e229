"""Reading of recordings from files of all supported formats, result folders and data frames."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Pressure, Word, checked
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError, refused_as
from ppafo.signals import Recording, recording_kind
from ppafo.storage.comma_separated import read_csv
from ppafo.storage.result_folder import CSV_FILE, MANIFEST, NETCDF_FILE, RUN_FILE, read_document, read_stored
from ppafo.wording import argument_text

if TYPE_CHECKING:
    from pandas import DataFrame  # type: ignore[import-untyped]
    from xarray import Dataset

    from ppafo.storage.column_map import ColumnMap

ColumnsLike = Annotated["ColumnMap | str | Path", Word("FILE.toml[:NAME]")]
"""Column map, or text ``FILE.toml[:NAME]`` that selects a map of a file."""

TEXT_SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".log", ".asc")
"""File-name suffixes of text tables."""


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
        from ppafo.storage.frames import recording_of_frame  # a run reads no tables of others

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
        from ppafo.storage.netcdf_reading import read_netcdf
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
        from ppafo.storage.frames import read_parquet

        return read_parquet(file, atmosphere)
    if file.suffix.lower() == ".mat":
        raise DataError(
            f"{file}: the variables of a .mat file have no units: give names and units in a column map, "
            f"{argument_text('columns', 'FILE.toml:NAME')}"
        )
    if not file.exists():
        raise DataError(f"{file}: no such file or folder")
    raise DataError(
        f"{file}: must be a result folder or a .nc, .parquet, {', '.join(TEXT_SUFFIXES)} or (through a column map, "
        f"{argument_text('columns', 'FILE.toml:NAME')}) other text file; another table is read as a pandas DataFrame, "
        "or written as CSV"
    )
