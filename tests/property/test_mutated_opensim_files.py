"""Damaged OpenSim tables are read whole or refused in one line; nothing else ever comes out."""

import os
import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from ppafo.errors import DataError
from ppafo.gait.recorded.forms.opensim import read_opensim

GOOD = (
    b"Coordinates\nnRows=4\nnColumns=3\n\nAngles are in degrees.\n\nendheader\n"
    b"time\tknee_angle_r\tankle_angle_r\n0.0\t1\t2\n0.1\t3\t-4.5\n0.2\t5e-1\t6\n0.3\t7\t8\n"
)
PIECES = [
    b"nan",
    b"\t",
    b"\n",
    b"endheader",
    b"nRows=",
    b"-",
    b"1e400",
    b"\0",
    b"\xff",
    b"inDegrees=no",
    b"time",
    b" ",
    b"",
]


def check_is_read_whole_or_refused(content: bytes) -> None:
    descriptor, name = tempfile.mkstemp(suffix=".mot")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
        try:
            table = read_opensim(name)
        except DataError as error:
            assert str(error).startswith(f"{name}: ")
            assert "\n" not in str(error)
            return
        assert table.time.size >= 1
        assert np.all(np.isfinite(table.time))
        assert np.all(np.diff(table.time) > 0.0)
        for label, values in table.columns.items():
            assert label
            assert values.size == table.time.size
    finally:
        Path(name).unlink()


@settings(max_examples=100)
@given(st.data())
def test_a_table_with_pieces_put_in_cut_out_or_changed(data: st.DataObject) -> None:
    content = GOOD
    for _ in range(data.draw(st.integers(1, 4))):
        first = data.draw(st.integers(0, len(content)))
        last = data.draw(st.integers(first, min(len(content), first + 30)))
        piece = data.draw(st.one_of(st.sampled_from(PIECES), st.binary(max_size=6)))
        content = content[:first] + piece + content[last:]
    check_is_read_whole_or_refused(content)


@settings(max_examples=100)
@given(st.binary(max_size=400))
def test_any_bytes(content: bytes) -> None:
    check_is_read_whole_or_refused(content)


def test_the_table_that_is_damaged_is_good_before() -> None:
    descriptor, name = tempfile.mkstemp(suffix=".mot")
    with os.fdopen(descriptor, "wb") as file:
        file.write(GOOD)
    assert read_opensim(name).columns["ankle_angle_r"].tolist() == [2.0, -4.5, 6.0, 8.0]
    Path(name).unlink()
