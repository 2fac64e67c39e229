"""Recordings out of NetCDF files, read as the HDF5 files that they are; what could harm the reader is refused.

h5netcdf would print a traceback of its own where it meets a damaged file. Before a number is unpacked, all of them must
lie in this file, in a common form, and in no more memory than such a file can need.
"""

import contextlib
import io
import math
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.errors import DataError
from ppafo.signals import Channel, Recording, recording_kind
from ppafo.signals.recording import PLAIN_NUMBER, TIME, TIME_UNIT
from ppafo.storage.files import read_bytes
from ppafo.storage.netcdf import BETWEEN, PLAIN_NUMBER_IN_NETCDF
from ppafo.wording import one_line

_DAMAGED = (OSError, KeyError, RuntimeError, TypeError, ValueError, OverflowError, MemoryError)
"""Exceptions of h5py on a truncated or damaged file."""
_KINDS_OF_NUMBERS = frozenset("fiu")
"""NumPy's letters for floats, integers and integers without sign."""
_GZIP, _SHUFFLE, _FLETCHER = 1, 2, 3
"""Numbers that HDF5 gives to gzip, to the shuffling of bytes and to the Fletcher checksum."""
_SUPPORTED_FILTERS = frozenset({_GZIP, _SHUFFLE, _FLETCHER})

_BYTES_OF_A_FLOAT = 8
"""Bytes of a number as a recording keeps it, whatever its file has."""
_ALWAYS_ALLOWED = 32_000_000
"""Bytes of memory that any file may ask for."""
_MAXIMUM_GROWTH = 100
"""Largest size of the content over the size of a larger file [-]."""
_CHECKSUM_BYTES = 64
"""Bytes by which a chunk may be larger than its numbers; a Fletcher checksum takes four."""

_PACKING = ("scale_factor", "add_offset")
"""Attributes of the NetCDF conventions by which the numbers of a file are not those that were recorded."""
_GAPS = ("_FillValue", "missing_value")
"""Attributes that name a number that stands for none."""
_LIMITS = {"valid_range": 2, "valid_min": 1, "valid_max": 1}
"""Attributes by which a number outside is none, and how many limits each has."""


def read_netcdf(path: str | Path) -> Recording:
    """Return the recording in a NetCDF file.

    DataError says what is wrong: a file that is damaged, points outside itself, unpacks to far more than it has, or
    whose numbers are packed, have gaps or are outside what the file calls valid.
    """
    import h5py

    content = read_bytes(path)
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            variables = _own_variables(file)
            _check_memory(variables, len(content))
            for name, variable in variables.items():
                _check_is_whole(name, variable)
            time = _channel(TIME, variables.pop(TIME))
            if time.unit != TIME_UNIT:
                raise DataError(f"'{TIME}' is in '{time.unit}', it must be in '{TIME_UNIT}'")
            channels = {name: _channel(name, variable) for name, variable in variables.items()}
            kind = recording_kind(_attribute(file, "kind") or "measured")
            return Recording(_attribute(file, "title") or one_line(Path(path).stem), time.values, channels, kind)
    except _DAMAGED as error:
        raise DataError(f"{path}: is not a whole NetCDF file of a recording: {one_line(error)}") from error
    except DataError as error:
        raise DataError(f"{path}: {error}") from error


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
        if len(getattr(variable, "shape", None) or ()) != 1 or variable.dtype.kind not in _KINDS_OF_NUMBERS:
            raise DataError(f"'{name}' must be numeric and one-dimensional over '{TIME}'")
        if variable.is_virtual or variable.external:
            raise DataError(f"the numbers of '{name}' are in another file; a recording must contain its numbers itself")
    for name, variable in variables.items():
        if variable.size != variables[TIME].size:
            raise DataError(f"'{name}' has {variable.size} values for {variables[TIME].size} times")
        # Only the common filters: gzip within gzip grows without limit.
        properties = variable.id.get_create_plist()
        filters = [properties.get_filter(number)[0] for number in range(properties.get_nfilters())]
        behind_gzip = filters[filters.index(_GZIP) + 1 :] if _GZIP in filters else []
        if not set(filters) <= _SUPPORTED_FILTERS or not set(behind_gzip) <= {_FLETCHER}:
            raise DataError(
                f"'{name}' is compressed in a way that is not supported; save it with gzip, or uncompressed"
            )
    return variables


def _check_memory(variables: Mapping[str, Any], file_bytes: int) -> None:
    """Refuse, before memory is taken, numbers that grow out of all proportion to the file."""
    required = 0
    for variable in variables.values():
        required += variable.size * _BYTES_OF_A_FLOAT
        if variable.chunks is not None:
            required += math.prod(variable.chunks) * variable.dtype.itemsize
    if required > max(_ALWAYS_ALLOWED, _MAXIMUM_GROWTH * file_bytes):
        raise DataError(
            f"requires {required / 1e6:,.0f} MB of memory, the file has {file_bytes / 1e6:.2g} MB; "
            f"a recording requires at most {_MAXIMUM_GROWTH} times its file"
        )


def _check_is_whole(name: str, variable: Any) -> None:
    """Refuse values that nobody wrote, and chunks that unpack to more than they say."""
    size, chunks = variable.size, variable.chunks
    if chunks is None:
        if variable.id.get_storage_size() < size * variable.dtype.itemsize:
            raise DataError(f"'{name}' has {size} values, and the file does not contain them")
        return
    chunk_count = variable.id.get_num_chunks()
    if chunk_count < math.ceil(size / chunks[0]):
        raise DataError(f"'{name}' has {size} values, and the file does not contain all of them")
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
            raise DataError(f"'{name}' decompresses to more than its stated size")


def _channel(name: str, variable: Any) -> Channel:
    """Return a variable as a channel; DataError where its attributes say that some numbers are none."""
    for key in _PACKING:
        if key in variable.attrs:
            raise DataError(f"'{name}' is packed by its attribute '{key}'; save it as plain numbers")
    values = np.asarray(variable[:], dtype=np.float64)
    for key in _GAPS:
        if key in variable.attrs and np.isin(values, np.asarray(variable.attrs[key], dtype=np.float64)).any():
            raise DataError(f"'{name}' has gaps ('{key}'); fill them or cut the file there")
    for key, wanted in _LIMITS.items():
        if key in variable.attrs:
            limits = np.atleast_1d(np.asarray(variable.attrs[key], dtype=np.float64))
            if limits.size != wanted:
                raise DataError(f"'{name}': its attribute '{key}' has {limits.size} numbers, it must have {wanted}")
            is_outside = np.zeros(values.size, dtype=bool)
            if key != "valid_max":
                is_outside |= values < limits[0]
            if key != "valid_min":
                is_outside |= values > limits[-1]
            rows = np.flatnonzero(is_outside)
            if rows.size:
                first = int(rows[0])
                raise DataError(
                    f"'{name}' has {rows.size} values that are not valid ('{key}'), the first {values[first]:g} at row "
                    f"{first + 1}; correct them, cut the file there, or correct the attribute"
                )
    # The channel itself refuses a word that it does not know.
    between: Any = _attribute(variable, BETWEEN) or None
    unit = _attribute(variable, "units")
    return Channel(values, PLAIN_NUMBER if unit == PLAIN_NUMBER_IN_NETCDF else unit, between)


def _attribute(owner: Any, name: str) -> str:
    """Return an attribute of a file or variable as text, empty where there is none; others write texts as bytes."""
    value = owner.attrs.get(name, "")
    return value.decode("utf-8") if isinstance(value, bytes) else str(value)
