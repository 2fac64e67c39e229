"""Recordings as CSV."""

import time
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.signals import Channel, Recording, RecordingKind
from ppafo.storage import read_csv, write_csv


def recording(kind: RecordingKind = "measured") -> Recording:
    channels = {"angle": Channel(np.array([1.0 / 3.0, 1e-17, -2.0]), "rad"), "command": Channel(np.ones(3), "-")}
    return Recording("bench", np.array([0.0, 0.1, 0.30000000000000004]), channels, kind)


def written(folder: Path, content: str | bytes) -> Path:
    path = folder / "given.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_the_first_line_names_channels_with_units(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "bench.csv", recording())
    assert path.read_text().splitlines()[0] == "time [s],angle [rad],command [-]"


def test_a_file_is_read_back_exactly(tmp_path: Path) -> None:
    assert read_csv(write_csv(tmp_path / "bench.csv", recording())) == recording()


@pytest.mark.parametrize("kind", ["simulated", "synthetic"])
def test_a_recording_that_nobody_measured_says_so_in_the_file(tmp_path: Path, kind: RecordingKind) -> None:
    path = write_csv(tmp_path / "bench.csv", recording(kind))
    assert path.read_text().startswith(f"# {kind}: ")
    assert read_csv(path) == recording(kind)


@pytest.mark.parametrize(
    ("comment", "kind"),
    [
        ("# synthetic: by hand", "synthetic"),
        ("#simulated:", "simulated"),
        ("# measurement: run 3", "measured"),
        ("# measured: in May", "measured"),
        ("# not simulated: an honest file", "measured"),
    ],
)
def test_only_a_comment_that_begins_with_a_kind_names_one(tmp_path: Path, comment: str, kind: RecordingKind) -> None:
    assert read_csv(written(tmp_path, f"# bench 3\n{comment}\ntime [s],angle [rad]\n0,1\n")).kind == kind


def test_other_units_become_si_on_the_way_in(tmp_path: Path) -> None:
    path = written(tmp_path, "time [ms],angle [deg],pressure_1 [psi_g],command [%]\n0,90,0,50\n1,180,10,-100\n")
    found = read_csv(path, atmosphere=1e5)
    assert found.time.tolist() == [0.0, 0.001]
    assert found["angle"].tolist() == pytest.approx([np.pi / 2.0, np.pi])
    assert found["pressure_1"].tolist() == pytest.approx([1e5, 1e5 + 68947.57293168361])
    assert found["command"].tolist() == [0.5, -1.0]


def test_windows_files_with_comments_and_a_byte_order_mark_are_read(tmp_path: Path) -> None:
    path = written(tmp_path, b"\xef\xbb\xbf# bench 3\r\ntime [s],angle [rad]\r\n0,1\r\n1,2\r\n\r\n")
    assert read_csv(path)["angle"].tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "is empty"),
        ("# only a remark\n", "has no header"),
        ("time [s],angle [rad]\n", "has a header but no samples"),
        (b"\x89HDF\r\n\x1a\n\xff\xfe", r"not a text file in UTF-8 \(byte 0 is invalid\)"),
        (b"time [s]\x00\n0\n", "not a text file"),
        ("time [s],angle [rad]\n0,1\n1,2", "cut off"),
        ("time [s],angle [rad]\n0,1\n1\n", "line 3 has 1 values for 2 columns"),
        ("time [s],angle [rad]\n0,1\n1,fast\n", r"line 3, column 'angle \[rad\]': 'fast' is not a finite number"),
        (
            "time [s],angle [rad]\n0,1\n1,nan\n",
            r"line 3, column 'angle \[rad\]': 'nan' is not a finite number",
        ),
        ("time [s],angle [rad]\n0,1\n1, \n", "'' is not a finite number"),
        ("time [s],command [V]\n0,1\n1,10\n", "'command' is dimensionless; give factor in a column map"),
        ("time [s],angle [rad]\n0,1\n1,\uff12\n", "line 3, column 'angle \\[rad\\]': '\uff12' is not a finite number"),
        ("time [s],angle [rad]\n0,1\n0,2\n", "line 3, column 'time': the clock stands still"),
        ("# a\ntime [s],angle [rad]\n1,1\n0,2\n", "line 4, column 'time': the clock goes backwards"),
        ("time,angle\n0,1\n", "name columns as 'name \\[unit\\]', separated by commas, not as 'time'"),
        ("\ntime [s]\n0\n", "line 1 is empty; it must contain the header"),
        (
            "time [s],angle [rad]\n0,1\n\n1,2\n",
            "line 3 is blank, and rows follow; remove the line, or add its 2 values",
        ),
        ("angle [rad],time [s]\n0,1\n", "the first column must be 'time \\[s\\]', not 'angle'"),
        ("Zeit [s],angle [rad]\n0,1\n", "not 'Zeit'; other names are read through a column map"),
        ("time [s],angle [rad],angle [deg]\n0,1,1\n", "the column 'angle' occurs twice"),
        ("time [s],angle [m]\n0,1\n", "column 'angle \\[m\\]': unit 'm' does not fit: an angle is needed"),
        ("time [s],pressure_1 [psi]\n0,1\n", "column 'pressure_1 \\[psi\\]': 'psi' needs the kind of pressure"),
        ("time [s],pressure_1 [psi_d]\n0,1\n", "a pressure level is needed"),
        ("time [s],residual [N)]\n0,1\n", "column 'residual \\[N\\)\\]'"),
        ("# sythetic: by hand\ntime [s]\n0\n", "'# sythetic:' names no kind of recording, did you mean 'synthetic'\\?"),
        (
            "# synthetic: a\n# simulated: b\ntime [s]\n0\n",
            "name two kinds of recording, synthetic and simulated",
        ),
        ('time [s],angle [rad]\n0,"1\n', "not a CSV file|not a number"),
    ],
)
def test_an_unusable_file_is_one_line_that_names_it(tmp_path: Path, content: str | bytes, message: str) -> None:
    path = written(tmp_path, content)
    with pytest.raises(DataError, match=message) as caught:
        read_csv(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_an_earlier_file_stays_where_writing_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_csv(tmp_path / "bench.csv", recording())

    def interrupted(self: Path, target: Path) -> Path:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_csv(path, recording().with_channel("torque", np.zeros(3), "N m"))
    assert read_csv(path) == recording()
    assert list(tmp_path.iterdir()) == [path]


def test_table_with_very_many_columns_or_blank_lines_is_refused_at_once(tmp_path: Path) -> None:
    names = ",".join(f"c{index} [m]" for index in range(30_000))
    start = time.process_time()
    with pytest.raises(DataError, match="column 'c29999' occurs twice"):
        read_csv(written(tmp_path, f"time [s],{names},c29999 [m]\n0\n"))
    assert time.process_time() - start < 3.0
    with pytest.raises(DataError, match="line 3 is blank, and rows follow; remove the line, or add its 2 values"):
        read_csv(written(tmp_path, "time [s],angle [rad]\n0,1\n\n\n1,1\n"))
    assert len(read_csv(written(tmp_path, "time [s],angle [rad]\n0,1\n1,1\n\n\n"))) == 2


def test_what_a_channel_declares_between_its_samples_is_in_the_header(tmp_path: Path) -> None:
    supply = Channel(np.array([4.0e5, 5.0e5]), "Pa", "hold")
    declared = Recording("bench", np.array([0.0, 1.0]), {"supply_pressure": supply})
    path = write_csv(tmp_path / "bench.csv", declared)
    assert path.read_text().splitlines()[0] == "time [s],supply_pressure [Pa_a] hold"
    assert read_csv(path).is_held("supply_pressure")
    path.write_text("time [s],command [-] linaer\n0,1\n")
    with pytest.raises(DataError, match=r"column 'command': 'linaer' .* must be hold or linear, did you mean 'linear'"):
        read_csv(path)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_a_table_is_read_whatever_mark_its_encoding_has(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "bench.csv"
    path.write_text("time [s],angle [rad]\n0,1\n1,2\n", encoding=encoding)
    assert read_csv(path)["angle"].tolist() == [1.0, 2.0]
