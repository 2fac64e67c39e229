"""A recording from wherever it is: a NetCDF file, a CSV file or a result folder."""

from dataclasses import replace
from pathlib import Path

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError
from ppafo.signals import Recording, recording_kind
from ppafo.storage.comma_separated import read_csv
from ppafo.storage.netcdf import read_netcdf
from ppafo.storage.result_folder import CSV_FILE, RUN_FILE, read_document, read_result
from ppafo.storage.trial_reading import check_can_be_read

WALK_RECORDING = "recording.nc"
"""What the folder of a walk has in place of a result."""


def read_recording(path: str | Path, atmosphere: float = STANDARD_ATMOSPHERE) -> Recording:
    """Return the recording in a ``.nc`` or ``.csv`` file, or in a result folder or that of a walk.

    Gauge pressure in a CSV file counts from ``atmosphere`` [Pa absolute]. DataError for a file that is not usable.
    """
    place = Path(path)
    if place.is_dir():
        recording = place / WALK_RECORDING
        if recording.is_file() and not (place / RUN_FILE).exists():
            return _of_strangers(recording)
        if not (place / RUN_FILE).exists():
            raise DataError(
                f"{place}: contains no result of a walk or a simulation (no {WALK_RECORDING}, no {RUN_FILE})"
            )
        return read_result(place).recording
    if place.suffix == ".nc":
        return _of_strangers(place)
    if place.suffix == ".csv":
        return _of_its_folder(read_csv(place, atmosphere=atmosphere), place)
    raise DataError(f"{path}: is neither a .nc or .csv file nor a result folder")


def _of_strangers(path: Path) -> Recording:
    """Return the recording in a NetCDF file that another process has read first.

    The HDF5 library can crash on a damaged file, or go round in it for ever, and would take this process with it.
    """
    check_can_be_read(path, "ppafo.storage.netcdf", "read_netcdf", "h5py")
    return read_netcdf(path)


def _of_its_folder(recording: Recording, path: Path) -> Recording:
    """Return the recording with what ``run.json`` beside it says of it, where it is the one of a result folder."""
    if path.name != CSV_FILE or not (path.parent / RUN_FILE).exists():
        return recording
    described = read_document(path.parent)["recording"]
    try:
        kind = recording_kind(str(described.get("kind", recording.kind)))
    except DataError as error:
        raise DataError(f"{path.parent / RUN_FILE}: {error}") from error
    return replace(recording, label=str(described.get("label", recording.label)), kind=kind)
