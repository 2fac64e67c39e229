"""Tables as Parquet files: unit and description of each column, reproducible bytes, detection of damage."""

import io
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.errors import DataError, refused_as
from ppafo.storage.files import check_growth
from ppafo.wording import one_line

if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.parquet as pq

_COMPRESSION_LEVEL = 1
"""Compression level of zstd, its fastest."""
_BYTES_OF_A_VALUE = 8
"""Bytes per number in memory, independent of the type and the encoding in the file."""
_ALWAYS_ALLOWED = 100_000_000
"""Memory that reading may take for a file of any size [bytes]; a block of a study has less than this in constants."""
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
    table = pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=dict(described)))
    buffer = io.BytesIO()
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


def read_parquet(
    file: io.BufferedIOBase,
    name: str,
    columns: Sequence[str] | None = None,
    check_schema: "Callable[[pa.Schema], object] | None" = None,
) -> "pa.Table":
    """Read a table, or some of its columns, and close the file; ``name`` is the file name in messages.

    ``check_schema`` may refuse the schema before any value is read. Texts stay encoded, each kept once. Raises
    DataError for a damaged file (checksums included), a file that expands to far more than its size, and a missing
    column.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with file, pq.ParquetFile(file, page_checksum_verification=True) as parquet:
            schema = parquet.schema_arrow
            missing = [column for column in columns or () if column not in schema.names]
            if missing:
                raise DataError(f"{name}: has no column '{one_line(missing[0])}'")
            with refused_as(DataError, name, DataError):
                if check_schema is not None:
                    check_schema(schema)
                # Before memory is allocated: a column of one constant takes no space in the file.
                check_growth(_expanded_bytes(parquet.metadata), file.seek(0, io.SEEK_END), _ALWAYS_ALLOWED)
            # Each text is kept once: a long one may stand in every row.
            texts = [column.path for column in parquet.schema if column.physical_type == "BYTE_ARRAY"]
            encoded = pq.ParquetFile(
                file, metadata=parquet.metadata, read_dictionary=texts, page_checksum_verification=True
            )
            return encoded.read(columns=None if columns is None else list(columns))
    except (pa.ArrowException, OSError, ValueError) as error:
        raise DataError(f"{name}: is not a complete Parquet file: {one_line(error)[:_LONGEST_SHOWN]}") from error


def _expanded_bytes(metadata: "pq.FileMetaData") -> int:
    """Memory of all values of a file [bytes], by the counts that its metadata state."""
    required = 0
    for number in range(metadata.num_row_groups):
        group = metadata.row_group(number)
        for index in range(group.num_columns):
            column = group.column(index)
            width = metadata.schema.column(index).length or 0
            count = max(column.num_values, group.num_rows)
            required += max(count * max(width, _BYTES_OF_A_VALUE), column.total_uncompressed_size)
    return required


def matrix_of(column: "pa.ChunkedArray") -> "np.ndarray[Any, Any]":
    """Convert a column of lists of equal length to a matrix, a row for each list."""
    values = column.combine_chunks().flatten().to_numpy(zero_copy_only=False)
    return np.asarray(values.reshape(len(column), -1))


def as_numpy(table: "pa.Table") -> dict[str, "np.ndarray[Any, Any]"]:
    """Return the columns as NumPy arrays; texts become object arrays, an empty cell None; a truth is 1 or 0, or nan."""
    return {name: _numpy(table.column(name)) for name in table.column_names}


def _numpy(column: "pa.ChunkedArray") -> "np.ndarray[Any, Any]":
    import pyarrow as pa

    if pa.types.is_boolean(column.type):
        return np.asarray(column.cast("float64").to_numpy())
    if not pa.types.is_dictionary(column.type):
        return np.asarray(column.to_numpy())
    encoded = column.combine_chunks()
    texts = np.array([*encoded.dictionary.to_pylist(), None], dtype=object)
    return np.asarray(texts[encoded.indices.fill_null(-1).to_numpy()])


def encode_truths(numbers: "np.ndarray[Any, Any]") -> "pa.BooleanArray":
    """Return a column of truth values, true for 1, false for 0, missing for nan."""
    import pyarrow as pa

    return pa.array(numbers == 1.0, mask=np.isnan(numbers))


def encode_texts(codes: "np.ndarray[Any, Any]", texts: Sequence[str]) -> "pa.DictionaryArray":
    """Return a dictionary-encoded text column: ``codes`` are indices into ``texts``, at most 128 of them."""
    import pyarrow as pa

    return pa.DictionaryArray.from_arrays(pa.array(codes, type=pa.int8()), pa.array(list(texts), type=pa.string()))
