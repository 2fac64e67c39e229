"""Tables as Parquet: columns with units, the same bytes for the same table, damage found."""

import io
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ppafo.errors import DataError
from ppafo.storage.parquet import as_numpy, encode_texts, parquet_bytes, read_parquet
from ppafo.storage.reading import read_recording


def content() -> bytes:
    """A file with a column of every sort."""
    random = np.random.default_rng(1)
    columns = {
        "run": (np.arange(500), "-", "number"),
        "torque": (random.normal(size=500), "N m", "a torque"),
        "status": (encode_texts(np.arange(500) % 2, ("good", "bad")), "-", "how it ended"),
        "reason": (np.array([*[None] * 3, "why", *[None] * 496], dtype=object), "-", "why"),
        "trace": (random.normal(size=(500, 4)).astype(np.float32), "N m", "over time"),
    }
    return parquet_bytes(columns, {"study": "mine"})


def test_the_same_table_gives_the_same_bytes() -> None:
    assert content() == content()


def test_columns_come_back_with_their_units() -> None:
    table = read_parquet(io.BytesIO(content()), "file")
    columns = as_numpy(table)
    np.testing.assert_array_equal(columns["torque"], np.random.default_rng(1).normal(size=500))
    assert columns["status"][:3].tolist() == ["good", "bad", "good"]
    assert columns["reason"][2:4].tolist() == [None, "why"]
    assert np.stack(columns["trace"]).shape == (500, 4)
    assert table.schema.field("torque").metadata == {b"unit": b"N m", b"summary": b"a torque"}
    assert table.schema.metadata[b"study"] == b"mine"
    assert read_parquet(io.BytesIO(content()), "file", ["run"]).column_names == ["run"]


@pytest.mark.parametrize("damage", [lambda c: c[:-9], lambda c: c[:200], lambda c: c[:0], lambda c: b"PAR1" + c[9:]])
def test_a_file_that_is_not_whole_is_refused(damage: object) -> None:
    with pytest.raises(DataError, match="file: is not a complete Parquet file"):
        read_parquet(io.BytesIO(damage(content())), "file")  # type: ignore[operator]


def test_a_changed_bit_in_the_data_is_found_by_the_checksum_of_its_page() -> None:
    whole = content()
    column = pq.ParquetFile(io.BytesIO(whole)).metadata.row_group(0).column(1)
    place = column.data_page_offset + column.total_compressed_size // 2
    with pytest.raises(DataError, match="not a complete Parquet file"):
        read_parquet(io.BytesIO(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :]), "file")


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (("time [s]", "torque [N m]"), "requires 240 MB of memory, more than 100 times the size of the file"),
        (("time [s]", "torque"), "the header must name columns as"),
        (("angle [rad]", "torque [N m]"), "no column and no index 'time"),
    ],
)
def test_names_are_read_first_and_numbers_only_where_they_fit_the_size_of_the_file(
    names: tuple[str, str], message: str, tmp_path: Path
) -> None:
    zeros = pa.table(dict.fromkeys(names, np.zeros(1_000_000)))
    with pq.ParquetWriter(tmp_path / "zeros.parquet", zeros.schema, compression="zstd") as writer:
        for _ in range(15):
            writer.write_table(zeros)
    with pytest.raises(DataError, match=message) as refused:
        read_recording(tmp_path / "zeros.parquet")
    assert str(refused.value).startswith(f"{tmp_path / 'zeros.parquet'}: ")


def test_a_long_text_that_stands_in_every_row_is_kept_once() -> None:
    one_text = pa.DictionaryArray.from_arrays(pa.array(np.zeros(50_000, dtype=np.int32)), pa.array(["x" * 1_000_000]))
    buffer = io.BytesIO()
    pq.write_table(pa.table({"reason": one_text}), buffer, store_schema=False)
    buffer.seek(0)
    table = read_parquet(buffer, "file")
    assert table.nbytes < 2_000_000
    assert len({id(text) for text in as_numpy(table)["reason"]}) == 1
