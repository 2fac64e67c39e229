"""Recordings as NetCDF files, and as the Dataset of xarray that opens them too; loading xarray takes longer than a run.

Read as the HDF5 files that they are: h5netcdf prints a traceback of its own where it meets a damaged one.
"""

import io
import json
import math
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError, one_line
from ppafo.parameters.joint import ANKLE, Joint
from ppafo.signals import CHANNELS, Channel, Recording, recording_kind
from ppafo.signals.recording import PLAIN_NUMBER, TIME, TIME_UNIT
from ppafo.storage.files import read_bytes, write_file

if TYPE_CHECKING:
    import xarray

_PLAIN_NUMBER_IN_NETCDF = "1"
_BETWEEN = "between_samples"


def dataset_of(
    recording: Recording,
    scenario: Mapping[str, Any] | None = None,
    units: Mapping[str, str] | None = None,
    atmosphere: float = STANDARD_ATMOSPHERE,
) -> "xarray.Dataset":
    """Return the recording as a Dataset over time [s]; ``scenario`` goes into an attribute as JSON.

    ``units`` are other units than those of SI by the name of a channel, in which gauge pressure counts from
    ``atmosphere`` [Pa absolute]. DataError for a channel that is not there, UnitError for a unit that does not fit it.
    """
    import xarray

    joint = joint_of(scenario)
    variables = {name: (TIME, recording[name], channel_attributes(recording, name, joint)) for name in recording.names}
    for name, unit in (units or {}).items():
        values = recording.in_unit(name, unit, atmosphere)
        variables[name] = (TIME, values, channel_attributes(recording, name, joint) | {"units": unit})
    coordinates = {TIME: (TIME, recording.time, _TIME_ATTRIBUTES)}
    return xarray.Dataset(variables, coordinates, global_attributes(recording, scenario))


def global_attributes(recording: Recording, scenario: Mapping[str, Any] | None) -> dict[str, str]:
    """Return what a NetCDF file says of the whole recording."""
    attributes = {"title": recording.label, "kind": recording.kind}
    if scenario is not None:
        attributes["scenario"] = json.dumps(scenario, ensure_ascii=False, allow_nan=False)
    return attributes


_TIME_ATTRIBUTES = {"units": TIME_UNIT, "long_name": "time"}


def joint_of(scenario: Mapping[str, Any] | None) -> Joint:
    """Return what the device of a scenario's document turns; the ankle where it does not say."""
    device = (scenario or {}).get("device")
    words = device.get("joint") if isinstance(device, Mapping) else None
    return Joint(**words) if isinstance(words, Mapping) else ANKLE


def channel_attributes(recording: Recording, name: str, joint: Joint = ANKLE) -> dict[str, str]:
    """Return unit and long name of a channel, about a joint; a plain number has the unit 1, as NetCDF asks."""
    unit = recording.unit(name)
    summary = joint.said(CHANNELS[name].summary) if name in CHANNELS else name.replace("_", " ")
    between = recording.channels[name].between
    declared = {} if between is None else {_BETWEEN: between}
    return {"units": _PLAIN_NUMBER_IN_NETCDF if unit == PLAIN_NUMBER else unit, "long_name": summary, **declared}


_DAMAGED = (OSError, KeyError, RuntimeError, TypeError, ValueError, OverflowError, MemoryError)
"""What h5py raises where a file is cut off or damaged."""

_NUMBERS = frozenset("fiu")
_BYTES_OF_A_NUMBER = 8
_ALWAYS_ALLOWED, _MOST_GROWTH = 32_000_000, 100
"""Bytes of memory that any file may ask for, and how often its own size a larger one may."""

_GZIP, _SHUFFLE, _FLETCHER = 1, 2, 3
_FILTERS = frozenset({_GZIP, _SHUFFLE, _FLETCHER})
"""Numbers that HDF5 gives to gzip, to the shuffling of bytes and to the Fletcher checksum."""

_CHECKSUM_ROOM = 64
_PACKED = ("scale_factor", "add_offset")
_GAPS = ("_FillValue", "missing_value")
"""Attributes of the NetCDF conventions by which the numbers of a file are not those that were recorded."""

_LIMITS = {"valid_range": 2, "valid_min": 1, "valid_max": 1}
"""Attributes by which a value outside is none, and how many numbers each has."""


def write_netcdf(path: str | Path, recording: Recording, scenario: Mapping[str, Any] | None = None) -> Path:
    """Write a recording as NetCDF; returns the path."""
    return write_file(path, netcdf_bytes(recording, scenario))


def netcdf_bytes(recording: Recording, scenario: Mapping[str, Any] | None = None) -> bytes:
    """Return the content of the NetCDF file of a recording; the same recording gives the same bytes."""
    import h5netcdf

    buffer = io.BytesIO()
    # Nothing in the file depends on when it was made, so that equal recordings are equal bytes.
    with h5netcdf.File(buffer, "w") as file:
        file.dimensions = {TIME: len(recording)}
        file.attrs.update(global_attributes(recording, scenario))
        time = file.create_variable(TIME, (TIME,), data=recording.time)
        time.attrs.update(_TIME_ATTRIBUTES)
        for name in recording.names:
            variable = file.create_variable(name, (TIME,), data=recording[name])
            variable.attrs.update(channel_attributes(recording, name, joint_of(scenario)))
    return buffer.getvalue()


def read_netcdf(path: str | Path) -> Recording:
    """Return the recording in a NetCDF file; one that points outside itself or unpacks to far more is refused.

    DataError says what is wrong with it.
    """
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
        variables = _own_variables(file)
        # Refuse, before memory is taken, numbers that the file does not hold or that grow out of all proportion.
        file_bytes = len(content)
        wanted = 0
        for name, variable in variables.items():
            if variable.size != variables[TIME].size:
                raise DataError(f"'{name}' has {variable.size} values for {variables[TIME].size} times")
            # What is not stored plain or by the common filters is refused: gzip within gzip grows without limit.
            properties = variable.id.get_create_plist()
            filters = [properties.get_filter(number)[0] for number in range(properties.get_nfilters())]
            after = filters[filters.index(_GZIP) + 1 :] if _GZIP in filters else []
            if not set(filters) <= _FILTERS or not set(after) <= {_FLETCHER}:
                raise DataError(
                    f"'{name}' is compressed in a way that is not supported; save it with gzip, or uncompressed"
                )
            wanted += variable.size * _BYTES_OF_A_NUMBER
            if variable.chunks is not None:
                wanted += math.prod(variable.chunks) * variable.dtype.itemsize
        if wanted > max(_ALWAYS_ALLOWED, _MOST_GROWTH * file_bytes):
            raise DataError(
                f"requires {wanted / 1e6:,.0f} MB of memory, the file has {file_bytes / 1e6:.2g} MB; "
                f"a recording requires at most {_MOST_GROWTH} times its file"
            )
        for name, variable in variables.items():
            _check_chunks(name, variable)
        time = _channel(TIME, variables.pop(TIME))
        if time.unit != TIME_UNIT:
            raise DataError(f"'{TIME}' is in '{time.unit}', it must be in '{TIME_UNIT}'")
        channels = {name: _channel(name, variable) for name, variable in variables.items()}
        label = _attribute(file, "title") or one_line(Path(path).stem)
        kind = recording_kind(_attribute(file, "kind") or "measured")
        return Recording(label, time.values, channels, kind)


def _own_variables(file: Any) -> dict[str, Any]:
    """Return the variables by name; none is opened before it is known to lie in this file."""
    import h5py

    names = [str(name) for name in file]
    if TIME not in names:
        raise DataError(f"there is no variable '{TIME}'")
    for name in names:
        if not isinstance(file.get(name, getlink=True), h5py.HardLink):
            raise DataError(f"'{name}' is a link; a recording must contain its numbers itself")
    variables = {name: file[name] for name in names}
    for name, variable in variables.items():
        if len(getattr(variable, "shape", None) or ()) != 1 or variable.dtype.kind not in _NUMBERS:
            raise DataError(f"'{name}' must be numbers over '{TIME}' alone")
        if variable.is_virtual or variable.external:
            raise DataError(f"the numbers of '{name}' are in another file; a recording must contain its numbers itself")
    return variables


def _check_chunks(name: str, variable: Any) -> None:
    """Refuse values that nobody wrote, and chunks that unpack to more than they say."""
    size, chunks = variable.size, variable.chunks
    if chunks is None:
        if variable.id.get_storage_size() < size * variable.dtype.itemsize:
            raise DataError(f"'{name}' has {size} values, and the file does not contain them")
        return
    count = variable.id.get_num_chunks()
    if count < -(-size // chunks[0]):
        raise DataError(f"'{name}' has {size} values, and the file does not contain all of them")
    most = chunks[0] * variable.dtype.itemsize + _CHECKSUM_ROOM
    for number in range(count):
        stored = variable.id.get_chunk_info(number)
        # Unpacked here, with a limit, before the library takes as much memory as a damaged chunk asks for.
        unpacker = zlib.decompressobj()
        packed = b"" if variable.compression is None else variable.id.read_direct_chunk(stored.chunk_offset)[1]
        try:
            grown = len(unpacker.decompress(packed, most + 1)) > most
        except zlib.error:
            grown = False  # not packed after all, or damaged: the library says so
        if grown or stored.size > 2 * most:
            raise DataError(f"'{name}' expands to more than it states")


def _channel(name: str, variable: Any) -> Channel:
    for key in _PACKED:
        if key in variable.attrs:
            raise DataError(f"'{name}' is packed by its attribute '{key}'; save it as plain numbers")
    values = np.asarray(variable[:], dtype=np.float64)
    for key in _GAPS:
        if key in variable.attrs and np.isin(values, np.asarray(variable.attrs[key], dtype=np.float64)).any():
            raise DataError(f"'{name}' has gaps ('{key}'); fill them or cut the file there")
    for key, count in _LIMITS.items():
        if key not in variable.attrs:
            continue
        limits = np.atleast_1d(np.asarray(variable.attrs[key], dtype=np.float64))
        if limits.size != count:
            raise DataError(f"'{name}': its attribute '{key}' has {limits.size} numbers, it must have {count}")
        is_below, is_above = values < limits[0], values > limits[-1]
        outside = np.flatnonzero({"valid_min": is_below, "valid_max": is_above}.get(key, is_below | is_above))
        if outside.size:
            first = int(outside[0])
            raise DataError(
                f"'{name}' has {outside.size} values that are not valid ('{key}'), the first {values[first]:g} at row "
                f"{first + 1}; correct them, cut the file there, or correct the attribute"
            )
    # The channel itself refuses a word that is none.
    between: Any = _attribute(variable, _BETWEEN) or None
    # The unit that ``channel_attributes`` wrote as this text.
    text = _attribute(variable, "units")
    return Channel(values, PLAIN_NUMBER if text == _PLAIN_NUMBER_IN_NETCDF else text, between)


def _attribute(place: Any, name: str) -> str:
    """Return an attribute as text, empty where there is none; other programs write texts as bytes."""
    value = place.attrs.get(name, "")
    return value.decode("utf-8") if isinstance(value, bytes) else str(value)
