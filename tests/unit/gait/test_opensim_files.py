"""OpenSim tables: both styles of header are read, mistakes are named, and what is written OpenSim reads."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait.recorded.forms.opensim import read_opensim
from ppafo.signals import Channel, Recording
from ppafo.storage.opensim import write_opensim

NEW = "Walk\nversion=1\nnRows=3\nnColumns=3\ninDegrees=yes\nendheader\ntime\tknee_angle_r\tankle_angle_r\n"
OLD = (
    "name walk.mot\t\t\ndatacolumns 3\t\ndatarows 3\t\nrange 0 0.02\nendheader\n"
    "   time\t knee_angle_r\t ankle_angle_r\n"
)
ROWS = "0.00\t-1.5\t2\n 0.01   -1.6 3e0\n0.02\t-1.7\t.5\n"


def table(text: str, folder: Path) -> Path:
    path = folder / "walk.mot"
    path.write_bytes(text.encode())
    return path


@pytest.mark.parametrize(("head", "said"), [(NEW, 0), (OLD, 1)], ids=["new header", "old header"])
def test_both_styles_of_header_are_read(tmp_path: Path, head: str, said: int) -> None:
    found = read_opensim(table(head + ROWS, tmp_path))
    assert found.time.tolist() == [0.0, 0.01, 0.02]
    assert {name: values.tolist() for name, values in found.columns.items()} == {
        "knee_angle_r": [-1.5, -1.6, -1.7],
        "ankle_angle_r": [2.0, 3.0, 0.5],
    }
    assert set(found.units.values()) == {"deg"}
    assert len(found.remarks) == said


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (NEW.replace("endheader\n", "") + ROWS, "has no line 'endheader': the header is cut off"),
        (NEW.partition("time")[0], "has nothing after 'endheader': the file is cut off"),
        (NEW, "has labels but no rows"),
        (NEW + ROWS.rpartition("0.02")[0], "has 2 rows, but the header states 3: the file is cut off or was edited"),
        (OLD + ROWS + "0.03 1 1\n", "has 4 rows, but the header states 3"),
        (NEW.replace("nRows=3", "nRows=three") + ROWS, "line 3: nRows is 'three', not a whole number"),
        (
            NEW.replace("inDegrees=yes", "inDegrees=maybe") + ROWS,
            "line 5: inDegrees is 'maybe'; it must be 'yes' or 'no'",
        ),
        (
            NEW.replace("endheader", "Angles are in radians.\nendheader") + ROWS,
            "the header states both degrees and radians",
        ),
        (NEW.replace("time\t", "frame\t") + ROWS, "line 7: the first column must be 'time', not 'frame'"),
        (NEW + ROWS.replace("\n 0.01", "\n\n 0.01"), "line 9 has 0 values for 3 columns"),
        (NEW + ROWS.replace("-1.7", "1e999"), "line 10, column 'knee_angle_r': '1e999' is not a finite number"),
        (NEW + ROWS.replace("\t.5", ""), "line 10 has 2 values for 3 columns"),
        (NEW + ROWS.replace("0.01", "0.00"), "line 9, column 'time': the clock stands still: 0 s follows 0 s"),
        (NEW + ROWS.replace("0.02", "-0.5"), "line 10, column 'time': the clock goes backwards: -0.5 s follows 0.01 s"),
        (NEW + ROWS + "\0", "is not a text file"),
    ],
)
def test_a_damaged_table_is_refused_with_line_and_column(tmp_path: Path, text: str, message: str) -> None:
    path = table(text, tmp_path)
    with pytest.raises(DataError) as refused:
        read_opensim(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert str(refused.value).count(str(path)) == 1
    assert message in str(refused.value)


@pytest.fixture
def recording() -> Recording:
    time = np.array([0.0, 0.1, 0.25])
    channels = {"angle": Channel(time + 1.0 / 3.0, "rad"), "torque": Channel(-time, "N m")}
    return Recording("walk of a model", time, channels, "simulated")


def test_a_written_table_is_read_back_bit_by_bit(tmp_path: Path, recording: Recording) -> None:
    found = read_opensim(write_opensim(tmp_path / "walk.sto", recording))
    assert np.array_equal(found.time, recording.time)
    assert all(np.array_equal(found.columns[name], recording[name]) for name in recording.names)
    assert (found.kind, found.units["angle"]) == ("simulated", "rad")


def test_the_written_format_is_that_of_opensim(tmp_path: Path, recording: Recording) -> None:
    lines = write_opensim(tmp_path / "walk.sto", recording).read_text().splitlines()
    assert lines[:5] == ["walk of a model", "version=1", "nRows=3", "nColumns=3", "inDegrees=no"]
    assert "kind=simulated" in lines
    assert "signs=columns have the signs of ppafo" in lines
    end = lines.index("endheader")
    assert lines[end + 1] == "time\tangle\ttorque"
    assert len(lines[end + 2 :]) == 3


def test_two_columns_of_one_label_have_their_numbers(tmp_path: Path) -> None:
    found = read_opensim(table(NEW.replace("ankle_angle_r", "knee_angle_r") + ROWS, tmp_path))
    assert list(found.columns) == ["knee_angle_r#1", "knee_angle_r#2"]
    assert "several columns are named 'knee_angle_r'" in found.remarks[-1]
