"""Recordings as NetCDF files, which xarray opens too; loading xarray itself takes longer than a whole run.

Read as the HDF5 files that they are: h5netcdf prints a traceback of its own where it meets a damaged one.
"""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.errors import DataError, one_line
from ppafo.signals import Channel, Recording, recording_kind
from ppafo.signals.channels import TIME, TIME_UNIT
from ppafo.storage.dataset import channel_attributes, global_attributes, time_attributes, unit_of_attribute
from ppafo.storage.files import read_bytes, write_file

_DAMAGED = (OSError, KeyError, RuntimeError, TypeError, ValueError, OverflowError, MemoryError)
"""What h5py raises where a file is cut off or damaged."""


def write_netcdf(path: str | Path, recording: Recording, scenario: Mapping[str, Any] | None = None) -> Path:
    """Write a recording as NetCDF; returns the path."""
    return write_file(path, netcdf_bytes(recording, scenario))


def netcdf_bytes(recording: Recording, scenario: Mapping[str, Any] | None = None) -> bytes:
    """Return the content of the NetCDF file of a recording; the same recording gives the same bytes."""
    import h5netcdf

    buffer = io.BytesIO()
    with h5netcdf.File(buffer, "w") as file:
        file.dimensions = {TIME: len(recording)}
        file.attrs.update(global_attributes(recording, scenario))
        time = file.create_variable(TIME, (TIME,), data=recording.time)
        time.attrs.update(time_attributes())
        for name in recording.names:
            variable = file.create_variable(name, (TIME,), data=recording[name])
            variable.attrs.update(channel_attributes(recording, name))
    return buffer.getvalue()


def read_netcdf(path: str | Path) -> Recording:
    """Return the recording in a NetCDF file."""
    content = read_bytes(path)
    try:
        return _recording(content, path)
    except _DAMAGED as error:
        raise DataError(f"{path}: is not a whole NetCDF file of a recording: {one_line(error)}") from error
    except DataError as error:
        raise DataError(f"{path}: {error}") from error


def _recording(content: bytes, path: str | Path) -> Recording:
    import h5py

    with h5py.File(io.BytesIO(content), "r") as file:
        if TIME not in file:
            raise DataError(f"there is no variable '{TIME}'")
        time = _channel(TIME, file[TIME])
        if time.unit != TIME_UNIT:
            raise DataError(f"'{TIME}' is in '{time.unit}', it must be in '{TIME_UNIT}'")
        channels = {str(name): _channel(name, variable) for name, variable in file.items() if name != TIME}
        label = _attribute(file, "title") or Path(path).stem
        kind = recording_kind(_attribute(file, "kind") or "measured")
        return Recording(label, time.values, channels, kind)


def _channel(name: str, variable: Any) -> Channel:
    if len(getattr(variable, "shape", ())) != 1:
        raise DataError(f"'{name}' must be numbers over '{TIME}' alone")
    unit = unit_of_attribute(_attribute(variable, "units"))
    return Channel(np.asarray(variable[:], dtype=np.float64), unit)


def _attribute(place: Any, name: str) -> str:
    """Return an attribute as text, empty where there is none; other programs write texts as bytes."""
    value = place.attrs.get(name, "")
    return value.decode("utf-8") if isinstance(value, bytes) else str(value)
