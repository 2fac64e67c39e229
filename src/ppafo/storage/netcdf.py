"""Recordings as NetCDF files. Written and read by h5netcdf alone: loading xarray takes longer than a whole run."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.errors import DataError
from ppafo.signals import Channel, Recording
from ppafo.signals.channels import TIME, TIME_UNIT
from ppafo.storage.dataset import channel_attributes, global_attributes, time_attributes, unit_of_attribute
from ppafo.storage.files import read_bytes, write_file


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
    except (OSError, KeyError, RuntimeError, TypeError, ValueError) as error:
        raise DataError(f"{path}: is not a whole NetCDF file of a recording: {' '.join(str(error).split())}") from error
    except DataError as error:
        raise DataError(f"{path}: {error}") from error


def _recording(content: bytes, path: str | Path) -> Recording:
    import h5netcdf

    with h5netcdf.File(io.BytesIO(content), "r") as file:
        if TIME not in file.variables:
            raise DataError(f"there is no variable '{TIME}'")
        unit = str(file.variables[TIME].attrs.get("units", ""))
        if unit != TIME_UNIT:
            raise DataError(f"'{TIME}' is in '{unit}', it must be in '{TIME_UNIT}'")
        channels = {
            str(name): _channel(str(name), variable) for name, variable in file.variables.items() if name != TIME
        }
        label = str(file.attrs.get("title", Path(path).stem))
        is_synthetic = str(file.attrs.get("synthetic", "no")) == "yes"
        return Recording(label, np.asarray(file.variables[TIME][:], dtype=np.float64), channels, is_synthetic)


def _channel(name: str, variable: Any) -> Channel:
    if variable.dimensions != (TIME,):
        raise DataError(
            f"'{name}' must run over '{TIME}' alone, not over {', '.join(variable.dimensions) or 'nothing'}"
        )
    unit = unit_of_attribute(str(variable.attrs.get("units", "")))
    return Channel(np.asarray(variable[:], dtype=np.float64), unit)
