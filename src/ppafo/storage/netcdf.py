"""Recordings as NetCDF files and as xarray Datasets.

NetCDF files are written without xarray, whose import takes longer than a simulation, and read by h5py: with h5netcdf a
damaged file would print a traceback. Before any number is decompressed, all data must be inside the file, in a common
format, and need no more memory than is plausible for the file.
"""

import contextlib
import io
import json
import math
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import ArgumentError, DataError
from ppafo.parameters.joint import ANKLE, JointNames
from ppafo.signals import CHANNELS, Channel, Recording, recording_kind
from ppafo.signals.recording import PLAIN_NUMBER, TIME, TIME_UNIT
from ppafo.storage.files import check_growth, read_bytes
from ppafo.units import conversion
from ppafo.wording import one_line

if TYPE_CHECKING:
    import xarray

PLAIN_NUMBER_IN_NETCDF = "1"
"""Unit of a plain number in the NetCDF conventions."""
BETWEEN = "between_samples"
"""Channel attribute for an unusual interpolation between samples."""
_TIME_ATTRIBUTES = {"units": TIME_UNIT, "long_name": "time"}
_DAMAGED = (OSError, KeyError, RuntimeError, TypeError, ValueError, OverflowError, MemoryError)
"""Exceptions that h5py raises for a truncated or damaged file."""
_KINDS_OF_NUMBERS = frozenset("fiu")
"""NumPy kind codes of floats, signed and unsigned integers."""
# HDF5 filter numbers of gzip, byte shuffling and the Fletcher checksum.
_GZIP = 1
_SHUFFLE = 2
_FLETCHER = 3
_SUPPORTED_FILTERS = frozenset({_GZIP, _SHUFFLE, _FLETCHER})

_BYTES_OF_A_FLOAT = 8
"""Bytes per number in a recording, independent of the type in the file."""
_ALWAYS_ALLOWED = 32_000_000
"""Memory that reading may take for a file of any size [bytes]."""
_CHECKSUM_BYTES = 64
"""Largest excess of a chunk over its numbers [bytes]; a Fletcher checksum takes four."""

_PACKING = ("scale_factor", "add_offset")
"""NetCDF attributes of packed variables, in which stored numbers differ from the values."""
_GAPS = ("_FillValue", "missing_value")
"""NetCDF attributes with the fill value of missing samples."""
_LIMITS = {"valid_range": 2, "valid_min": 1, "valid_max": 1}
"""NetCDF attributes of the valid range, with their number of limits; values outside are missing."""


def read_netcdf(path: str | Path) -> Recording:
    """Read a recording from a NetCDF file.

    Raises DataError for a file that is damaged, refers to other files, or decompresses to far more than its size, and
    for numbers that are packed, have gaps or are outside the stated valid range.
    """
    import h5py

    content = read_bytes(path)
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            # Numbers over time alone, in the file itself.
            variables = dict(own_items(file))
            if TIME not in variables:
                raise DataError(f"has no variable '{TIME}'")
            for name, variable in variables.items():
                if len(getattr(variable, "shape", None) or ()) != 1 or variable.dtype.kind not in _KINDS_OF_NUMBERS:
                    raise DataError(f"'{name}' must be numeric and one-dimensional over '{TIME}'")
            for name, variable in variables.items():
                if variable.size != variables[TIME].size:
                    raise DataError(f"'{name}' has {variable.size} values for {variables[TIME].size} times")
                # Only the common filters: gzip within gzip grows without limit.
                properties = variable.id.get_create_plist()
                filters = [properties.get_filter(number)[0] for number in range(properties.get_nfilters())]
                behind_gzip = filters[filters.index(_GZIP) + 1 :] if _GZIP in filters else []
                if not set(filters) <= _SUPPORTED_FILTERS or not set(behind_gzip) <= {_FLETCHER}:
                    raise DataError(f"'{name}' has an unsupported compression")
            # Before memory is allocated: numbers must not need far more than the size of the file.
            chunks = [math.prod(item.chunks) * item.dtype.itemsize for item in variables.values() if item.chunks]
            required = sum(chunks) + sum(_BYTES_OF_A_FLOAT * item.size for item in variables.values())
            check_growth(required, len(content), _ALWAYS_ALLOWED)
            for name, variable in variables.items():
                _check_is_whole(name, variable)
            time = _channel(TIME, variables.pop(TIME))
            if time.unit != TIME_UNIT:
                raise DataError(f"'{TIME}' must be in '{TIME_UNIT}', not in '{time.unit}'")
            channels = {name: _channel(name, variable) for name, variable in variables.items()}
            kind = recording_kind(_attribute(file, "kind") or "measured")
            return Recording(_attribute(file, "title") or one_line(Path(path).stem), time.values, channels, kind)
    except _DAMAGED as error:
        raise DataError(f"{path}: is not a complete NetCDF recording: {one_line(error)}") from error
    except DataError as error:
        raise DataError(f"{path}: {error}") from error


def own_items(group: Any) -> Iterator[tuple[str, Any]]:
    """Yield name and content of each item of a group. Raises DataError for links and external data, before opening."""
    import h5py

    for name in map(str, group):
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise DataError(f"'{one_line(name)}' is an HDF5 link; save its numbers in the file itself")
        node = group[name]
        if isinstance(node, h5py.Dataset) and (node.is_virtual or node.external):
            raise DataError(
                f"the numbers of '{one_line(name)}' are stored in another file; save them in the file itself"
            )
        yield name, node


def _check_is_whole(name: str, variable: Any) -> None:
    """Raise DataError for values never written, and for chunks that decompress to more than stated."""
    size = variable.size
    chunks = variable.chunks
    if chunks is None:
        if variable.id.get_storage_size() < size * variable.dtype.itemsize:
            raise DataError(f"'{name}' should have {size} values, but the file contains none of them")
        return
    chunk_count = variable.id.get_num_chunks()
    if chunk_count < math.ceil(size / chunks[0]):
        raise DataError(f"'{name}' should have {size} values, but the file contains only some of them")
    allowed_bytes = chunks[0] * variable.dtype.itemsize + _CHECKSUM_BYTES
    for number in range(chunk_count):
        chunk = variable.id.get_chunk_info(number)
        content = b""
        if variable.compression is not None:
            compressed = variable.id.read_direct_chunk(chunk.chunk_offset)[1]
            # With a limit, before the library takes as much memory as it asks. Where it is not compressed after all, or
            # damaged, the library says so.
            with contextlib.suppress(zlib.error):
                content = zlib.decompressobj().decompress(compressed, allowed_bytes + 1)
        if len(content) > allowed_bytes or chunk.size > 2 * allowed_bytes:
            raise DataError(f"'{name}' decompresses to more than its stated size: the file is damaged")


def _channel(name: str, variable: Any) -> Channel:
    """Convert a variable to a channel. Raises DataError if its attributes mark numbers as missing or packed."""
    for key in _PACKING:
        if key in variable.attrs:
            raise DataError(f"'{name}' is packed (attribute '{key}')")
    values = np.asarray(variable[:], dtype=np.float64)
    for key in _GAPS:
        if key in variable.attrs and np.isin(values, np.asarray(variable.attrs[key], dtype=np.float64)).any():
            raise DataError(f"'{name}' has missing values (attribute '{key}')")
    for key, wanted in _LIMITS.items():
        if key in variable.attrs:
            limits = np.atleast_1d(np.asarray(variable.attrs[key], dtype=np.float64))
            if limits.size != wanted:
                raise DataError(f"'{name}': attribute '{key}' must have {wanted} numbers, not {limits.size}")
            is_below = (values < limits[0]) & (key != "valid_max")
            is_above = (values > limits[-1]) & (key != "valid_min")
            rows = np.flatnonzero(is_below | is_above)
            if rows.size:
                first = int(rows[0])
                raise DataError(f"'{name}' is {values[first]:g} at row {first + 1}, outside its '{key}'")
    # The channel itself refuses a word that it does not know.
    between: Any = _attribute(variable, BETWEEN) or None
    unit = _attribute(variable, "units")
    return Channel(values, PLAIN_NUMBER if unit == PLAIN_NUMBER_IN_NETCDF else unit, between)


def _attribute(owner: Any, name: str) -> str:
    """Return an attribute of a file or variable as text, whether stored as text or bytes; empty if absent."""
    value = owner.attrs.get(name, "")
    return value.decode("utf-8") if isinstance(value, bytes) else str(value)


def dataset_of(
    recording: Recording,
    scenario: Mapping[str, Any] | None = None,
    units: Mapping[str, str] | None = None,
    atmosphere: float = STANDARD_ATMOSPHERE,
) -> "xarray.Dataset":
    """Return a recording as a Dataset over time [s], with ``scenario`` as a JSON attribute.

    ``units`` maps channels to units other than SI; gauge pressures in them are relative to ``atmosphere`` [Pa
    absolute]. Raises DataError for an unknown channel, UnitError for a unit that does not fit.
    """
    import xarray

    if not isinstance(units, Mapping | None):
        raise ArgumentError(f"units={units!r}: must be units by channel, such as {{'pressure_1': 'psi_g'}}")
    joint = joint_of(scenario)
    variables = {name: (TIME, recording[name], channel_attributes(recording, name, joint)) for name in recording.names}
    for name, unit in (units or {}).items():
        attributes = channel_attributes(recording, name, joint) | {"units": unit}
        if recording.unit(name) == "Pa" and conversion(unit, "Pa_a")[2]:
            attributes["long_name"] = attributes["long_name"].replace("absolute", "gauge")
        variables[name] = (TIME, recording.in_unit(name, unit, atmosphere), attributes)
    coordinates = {TIME: (TIME, recording.time, _TIME_ATTRIBUTES)}
    return xarray.Dataset(variables, coordinates, global_attributes(recording, scenario))


def global_attributes(recording: Recording, scenario: Mapping[str, Any] | None) -> dict[str, str]:
    """Return the global attributes of a NetCDF file: label, kind, and the scenario document as JSON."""
    attributes = {"title": recording.label, "kind": recording.kind}
    if scenario is not None:
        attributes["scenario"] = json.dumps(scenario, ensure_ascii=False, allow_nan=False)
    return attributes


def joint_of(scenario: Mapping[str, Any] | None) -> JointNames:
    """Return the joint names of a scenario document, by default of the ankle."""
    device = (scenario or {}).get("device")
    joint = device.get("joint") if isinstance(device, Mapping) else None
    return JointNames(**joint) if isinstance(joint, Mapping) else ANKLE


def channel_attributes(recording: Recording, name: str, joint: JointNames = ANKLE) -> dict[str, str]:
    """Return unit and long name of a channel at a joint; a plain number has the unit 1 by the NetCDF conventions."""
    unit = recording.unit(name)
    summary = joint.said(CHANNELS[name].summary) if name in CHANNELS else name.replace("_", " ")
    between = recording.channels[name].between
    declared = {} if between is None else {BETWEEN: between}
    return {"units": PLAIN_NUMBER_IN_NETCDF if unit == PLAIN_NUMBER else unit, "long_name": summary, **declared}


def netcdf_bytes(recording: Recording, scenario: Mapping[str, Any] | None = None) -> bytes:
    """Return the NetCDF file of a recording as bytes; equal recordings give equal bytes."""
    import h5netcdf

    buffer = io.BytesIO()
    # The file does not depend on when it was made, so that equal recordings are equal bytes.
    with h5netcdf.File(buffer, "w") as file:
        file.dimensions = {TIME: len(recording)}
        file.attrs.update(global_attributes(recording, scenario))
        time = file.create_variable(TIME, (TIME,), data=recording.time)
        time.attrs.update(_TIME_ATTRIBUTES)
        for name in recording.names:
            variable = file.create_variable(name, (TIME,), data=recording[name])
            variable.attrs.update(channel_attributes(recording, name, joint_of(scenario)))
    return buffer.getvalue()
