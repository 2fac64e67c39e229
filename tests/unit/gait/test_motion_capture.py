"""Text exports of motion capture: one walk written as each system writes it gives one gait."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait.recorded import ImportSettings, import_gait
from ppafo.gait.recorded.mapping import load_map
from ppafo.gait.recorded.source import form_of, read_table
from ppafo.signals.recording import Floats
from tests.unit.gait.laboratory import MASS, STRIDE, markers, trc

TIME = np.arange(0.0, 5.2, 0.01)
POINTS = {name: point[:, : TIME.size] for name, point in markers(TIME).items()}
NAMES = list(POINTS)
ROWS = np.concatenate([POINTS[name] for name in NAMES]).T


def cells(row: Floats, mark: str = ",") -> str:
    return mark.join(f"{value:.4f}" for value in row)


def nexus(path: Path) -> Path:
    lines = ["Trajectories", "100", ",," + ",".join(f"Walker:{name},," for name in NAMES)]
    lines += ["Frame,Sub Frame," + "X,Y,Z," * len(NAMES), ",," + "mm,mm,mm," * len(NAMES)]
    lines += [f"{number},0,{cells(row)}" for number, row in enumerate(ROWS, 1)]
    lines += ["", "Devices", "1000", ",,Imported AMTI - Force,,,Imported AMTI - Moment,,"]
    lines += ["Frame,Sub Frame,Fx,Fy,Fz,Mx,My,Mz", ",,N,N,N,Nmm,Nmm,Nmm"]
    lines += [f"{n // 10 + 1},{n % 10},0,0,{-n},0,0,0" for n in range(10 * len(ROWS))]
    path.write_text("\n".join(lines) + "\n")
    return path


def qualisys(path: Path) -> Path:
    lines = [f"NO_OF_FRAMES\t{len(ROWS)}", f"NO_OF_MARKERS\t{len(NAMES)}", "FREQUENCY\t100", "DATA_INCLUDED\t3D"]
    lines += ["MARKER_NAMES\t" + "\t".join(NAMES)]
    path.write_text("\n".join([*lines, *(cells(row, "\t") for row in ROWS)]) + "\n")
    return path


def counted_qualisys(path: Path) -> Path:
    lines = qualisys(path).read_text().splitlines()
    axes = "\t".join(f"{name} {axis}" for name in NAMES for axis in "XYZ")
    rows = [f"{number + 1}\t{number / 100:.5f}\t{row}" for number, row in enumerate(lines[5:])]
    path.write_text("\n".join([*lines[:5], f"Frame\tTime\t{axes}", *rows]) + "\n")
    return path


def motive(path: Path) -> Path:
    wide, labels = len(NAMES) * 3, "".join(f",Walker:{name}" * 3 for name in NAMES)
    stated = "Export Frame Rate,100.0,Length Units,Meters,Coordinate Space,Global"
    lines = [f"Format Version,1.23,Take Name,walk,{stated}", ""]
    lines += [",Type" + ",Marker" * wide + ",Rigid Body", f",Name{labels},Foot", ",ID" + ",1" * wide + ",2"]
    lines += [",," + "Position," * wide + "Rotation", "Frame,Time (Seconds)," + "X,Y,Z," * len(NAMES) + "X"]
    lines += [f"{n},{n / 100:.6f},{cells(row * 1e-3)},0.5" for n, row in enumerate(ROWS)]
    path.write_text("\n".join(lines) + "\n")
    return path


def dflow(path: Path) -> Path:
    head = "\t".join(f"{name}.Pos{axis}" for name in NAMES for axis in "XYZ")
    rows = [f"{n / 100:.6f}\t{n}\t{cells(row * 1e-3, chr(9))}" for n, row in enumerate(ROWS)]
    path.write_text("\n".join([f"TimeStamp\tFrameNumber\t{head}", *rows]) + "\n")
    return path


def bts(path: Path) -> Path:
    head = "\t".join(f"{name}.{axis}" for name in NAMES for axis in "XYZ")
    lines = ["BTS ASCII format", "", "Type:         \tPoint 3D tracks", "Measure unit: \tmm", ""]
    lines += [f"Tracks:       \t{len(NAMES)}", "Frequency:    \t100 Hz", f"Frames:       \t{len(ROWS)}"]
    lines += ["Start time:   \t0.000", "", f" Frame\t  Time\t{head}\t"]
    lines += [f"{n + 1}\t{n / 100:.3f}\t{cells(row, chr(9))}\t" for n, row in enumerate(ROWS)]
    path.write_text("\n".join(lines) + "\n")
    return path


FILES = {
    "bts": (bts, ".emt"),
    "nexus": (nexus, ".csv"),
    "qualisys": (qualisys, ".tsv"),
    "qualisys with frames": (counted_qualisys, ".tsv"),
    "motive": (motive, ".csv"),
    "dflow": (dflow, ".txt"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_walk_exported_by_any_system_is_the_same_gait(name: str, tmp_path: Path) -> None:
    write, suffix = FILES[name]
    path = write(tmp_path / f"walk{suffix}")
    assert form_of(path).name == name.split(maxsplit=1)[0]
    found = import_gait([path], ImportSettings(MASS))
    assert found.gait.stride_time == pytest.approx(STRIDE, abs=0.01)
    table = read_table(path)
    scale = {"mm": 1.0, "m": 1000.0}[table.units["RKNE.x"]]
    assert np.allclose(table.columns["RKNE.z"] * scale, POINTS["RKNE"][2], atol=0.06)
    assert table.time[-1] - table.time[0] == pytest.approx(TIME[-1] - TIME[0])


def test_forces_of_plates_in_a_nexus_export_are_upwards_and_at_the_times_of_the_frames(tmp_path: Path) -> None:
    table = read_table(nexus(tmp_path / "walk.csv"))
    assert table.columns["force plate 1.z"][:3].tolist() == [0.0, 10.0, 20.0]
    assert table.units["force plate 1.z"] == "N"


@pytest.mark.parametrize("lost", ["", "NaN", "0.0000"])
def test_a_lost_marker_is_the_same_gap_however_it_is_written(lost: str, tmp_path: Path) -> None:
    path = dflow(tmp_path / "walk.txt")
    lines = path.read_text().splitlines()
    at = 2 + 3 * NAMES.index("RANK")
    for number in range(200, 204):
        row = lines[number].split("\t")
        row[at : at + 3] = [lost] * 3
        lines[number] = "\t".join(row)
    path.write_text("\n".join(lines) + "\n")
    whole = import_gait([dflow(tmp_path / "whole.txt")], ImportSettings(MASS))
    found = import_gait([path], ImportSettings(MASS, least_strides=1))
    assert len(found.strides) == len(whole.strides) - 1
    assert any(f"marker 'RANK' was lost in 4 of {TIME.size} frames" in remark for remark in found.remarks)
    filled = import_gait([path], ImportSettings(MASS, longest_gap=0.1))
    assert len(filled.strides) == len(whole.strides)
    assert np.degrees(filled.gait.ankle_angle.mean - whole.gait.ankle_angle.mean) == pytest.approx(0.0, abs=0.1)


# Rounded to 0.1 mm a marker at rest repeats itself, until it jumps; at 0.1 um three frames of one place are a gap.
@pytest.mark.parametrize(
    ("write", "mark", "name", "first", "count"), [(dflow, "\t", "RKNE", 250, 6), (bts, "\t", "RHEE", 242, 2)]
)
def test_a_marker_that_is_held_until_it_jumps_was_lost_and_one_at_rest_was_not(
    write: Callable[[Path], Path], mark: str, name: str, first: int, count: int, tmp_path: Path
) -> None:
    path = write(tmp_path / f"walk{'.txt' if write is dflow else '.emt'}")
    lines = path.read_text().splitlines()
    at = 2 + 3 * NAMES.index(name)
    for number in range(first, first + count):
        row, before = lines[number].split(mark), lines[first - 1].split(mark)
        lines[number] = mark.join([*row[:at], *before[at : at + 3], *row[at + 3 :]])
    path.write_text("\n".join(lines) + "\n")
    found = import_gait([path], ImportSettings(MASS, least_strides=1))
    said = f"'{name}' was lost in {count} of"
    assert any(said in remark and "position unchanged" in remark for remark in found.remarks)
    whole = import_gait([dflow(tmp_path / "whole.txt")], ImportSettings(MASS))
    assert not any("lost" in remark for remark in whole.remarks)


@pytest.mark.parametrize(
    ("forward", "vertical", "said"),
    [
        ("y", "z", "shank_angle has a range of 0 deg in the whole recording"),
        ("-x", "z", "shank_angle.forward = '-x' is reversed: 'RTOE' is behind 'RHEE' along it; the axis is 'x'"),
        ("x", "y", "is no shank upright along it"),
    ],
)
def test_a_wrong_axis_of_a_map_is_named_before_any_sign(forward: str, vertical: str, said: str, tmp_path: Path) -> None:
    path, axes = trc(tmp_path / "walk.trc", TIME, POINTS), f'forward = "{forward}"\nvertical = "{vertical}"'
    (tmp_path / "map.toml").write_text(
        f'schema_version = 1\n[shank_angle]\nknee = "RKNE"\nankle = "RANK"\n{axes}\n'
        f'[ankle_angle]\nheel = "RHEE"\ntoe = "RTOE"\npositive = "dorsiflexion"\n{axes}\n'
    )
    with pytest.raises(DataError, match=said) as refused:
        import_gait([path], ImportSettings(MASS, columns=load_map(tmp_path / "map.toml")))
    assert not refused.value.parts
