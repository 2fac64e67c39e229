"""Tables as Parquet files: unit and description of each column, reproducible bytes, detection of damage."""

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.errors import DataError
from ppafo.wording import one_line

if TYPE_CHECKING:
    import pyarrow as pa

_COMPRESSION_LEVEL = 1
"""Compression level of zstd, its fastest."""
_MAXIMUM_VALUES = 200_000_000
"""Largest number of values read from a table; a chunk of channels over time has some millions."""
_FLOATING_TYPES = ("double", "float")
"""Arrow names of floating-point types."""
_LONGEST_SHOWN = 120
"""Largest number of characters quoted from an error message of a library."""


Column = tuple[Any, str, str]
"""Column of a table: an array of a value per row, or a matrix of a list per row; unit; description."""


def parquet_bytes(columns: Mapping[str, Column], described: Mapping[str, str]) -> bytes:
    """Return the Parquet file of columns as bytes, with ``described`` as metadata of the table.

    Equal tables give equal bytes with the same release of pyarrow. Floats are byte-split and compressed, which saves a
    tenth to a third; pages have checksums.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = [_array(values) for values, _, _ in columns.values()]
    fields = [
        pa.field(name, array.type, metadata={"unit": unit, "summary": summary})
        for (name, (_, unit, summary)), array in zip(columns.items(), arrays, strict=True)
    ]
    table, buffer = pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=dict(described))), io.BytesIO()
    # Bytes of one significance are alike from row to row, and texts are few that repeat.
    pq.write_table(
        table,
        buffer,
        compression="zstd",
        compression_level=_COMPRESSION_LEVEL,
        use_dictionary=[field.name for field in table.schema if str(field.type).startswith("dictionary")],
        use_byte_stream_split=[field.name for field in table.schema if str(field.type) in _FLOATING_TYPES],
        write_page_checksum=True,
    )
    return buffer.getvalue()


def _array(values: Any) -> "pa.Array":
    """Return a column as Arrow has it: a list for each row of a matrix, and an empty cell for a text that is None."""
    import pyarrow as pa

    if not isinstance(values, np.ndarray):
        return values
    if values.ndim == 2:
        offsets = np.arange(values.shape[0] + 1, dtype=np.int32) * values.shape[1]
        return pa.ListArray.from_arrays(pa.array(offsets), pa.array(np.ascontiguousarray(values).reshape(-1)))
    return pa.array(values, type=pa.string() if values.dtype == object else None)


def read_parquet(file: io.BufferedIOBase, name: str, columns: Sequence[str] | None = None) -> "pa.Table":
    """Read a table, or some of its columns, and close the file; ``name`` is the file name in messages.

    Raises DataError for a damaged file (checksums included), for far too many values, and for a missing column.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with file, pq.ParquetFile(file, page_checksum_verification=True) as parquet:
            # Counted before memory is taken: a column of one constant takes no room in the file.
            groups = (parquet.metadata.row_group(number) for number in range(parquet.metadata.num_row_groups))
            count = sum(group.column(column).num_values for group in groups for column in range(group.num_columns))
            if count > _MAXIMUM_VALUES:
                raise DataError(f"{name}: has {count:,} values; a table of a study has at most {_MAXIMUM_VALUES:,}")
            missing = [column for column in columns or () if column not in parquet.schema_arrow.names]
            if missing:
                raise DataError(f"{name}: has no column '{one_line(missing[0])}'")
            return parquet.read(columns=None if columns is None else list(columns))
    except (pa.ArrowException, OSError, ValueError) as error:
        raise DataError(f"{name}: is not a complete Parquet file: {one_line(error)[:_LONGEST_SHOWN]}") from error


def matrix_of(column: "pa.ChunkedArray") -> "np.ndarray[Any, Any]":
    """Convert a column of lists of equal length to a matrix, a row for each list."""
    values = column.combine_chunks().flatten().to_numpy(zero_copy_only=False)
    return np.asarray(values.reshape(len(column), -1))


def as_numpy(table: "pa.Table") -> dict[str, "np.ndarray[Any, Any]"]:
    """Return the columns as NumPy arrays; texts become object arrays."""
    return {name: table.column(name).to_numpy() for name in table.column_names}


def encode_texts(codes: "np.ndarray[Any, Any]", texts: Sequence[str]) -> "pa.DictionaryArray":
    """Return a dictionary-encoded text column: ``codes`` are indices into ``texts``, at most 128 of them."""
    import pyarrow as pa

    return pa.DictionaryArray.from_arrays(pa.array(codes, type=pa.int8()), pa.array(list(texts), type=pa.string()))
