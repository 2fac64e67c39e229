"""Markers in .trc files: read with empty cells as gaps, and refused in one line where they are damaged."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait.recorded.forms.motion_capture import read_trc

HEAD = (
    "PathFileType\t4\t(X/Y/Z)\twalk.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n100\t100\t3\t2\tmm\n"
    "Frame#\tTime\tRKNE\t\t\tR.Ankle\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n"
)
ROWS = "1\t0.00\t1\t2\t3\t4\t5\t6\n2\t0.01\t\t\t\t4\t5\t6\n3\t0.02\t1\t2\tnan\n"


def table(text: str, folder: Path) -> Path:
    path = folder / "walk.trc"
    path.write_bytes(text.encode())
    return path


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_markers_are_read_and_what_was_not_seen_is_a_gap(tmp_path: Path, end: str) -> None:
    found = read_trc(table((HEAD + ROWS).replace("\n", end), tmp_path))
    knee, ankle = (np.array([found.columns[f"{name}.{axis}"] for axis in "xyz"]) for name in ("RKNE", "R.Ankle"))
    assert (set(found.units.values()), found.time.tolist()) == ({"mm"}, [0.0, 0.01, 0.02])
    assert np.isnan(knee[:, 1]).all()
    assert knee[:2, 2].tolist() == [1.0, 2.0]
    assert np.isnan(ankle[:, 2]).all()
    assert ankle[:, 1].tolist() == [4.0, 5.0, 6.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,angle\n0,1\n", "is not a .trc file: line 1 must begin with 'PathFileType'"),
        (HEAD, "has no rows"),
        (HEAD.replace("\tmm\n", "\tinch\n") + ROWS, "line 3: Units is 'inch'; allowed are m, cm, mm"),
        (HEAD.replace("Time", "Clock") + ROWS, "line 4: must have 'Frame#', 'Time'"),
        (HEAD + ROWS.replace("\t6\n2", "\t6\t7\n2"), "line 7 has 9 values for 8 columns"),
        (HEAD + ROWS.replace("0.01", "nan"), "line 8, column 'time': 'nan' is not a finite number"),
        ("\xff", "is not a .trc file"),
    ],
)
def test_a_damaged_table_is_refused_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    path = table(text, tmp_path)
    with pytest.raises(DataError) as refused:
        read_trc(path)
    assert message in str(refused.value)
    assert str(refused.value).startswith(f"{path}: ")
    assert "\n" not in str(refused.value)


def test_two_markers_of_one_name_have_their_numbers(tmp_path: Path) -> None:
    found = read_trc(table(HEAD.replace("R.Ankle", "RKNE") + ROWS, tmp_path))
    assert [found.columns[f"RKNE#2.{axis}"][1] for axis in "xyz"] == [4.0, 5.0, 6.0]
    assert found.remarks == ("several markers are named 'RKNE': they were renamed 'RKNE#1', 'RKNE#2'",)


def test_the_same_marker_twice_is_one(tmp_path: Path) -> None:
    rows = "1\t0.00\t1\t2\t3\t1\t2\t3\n2\t0.01\t\t\t\t\t\t\n"
    found = read_trc(table(HEAD.replace("R.Ankle", "RKNE") + rows, tmp_path))
    assert (list(found.columns), found.remarks) == (["RKNE.x", "RKNE.y", "RKNE.z"], ())
