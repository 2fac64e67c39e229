"""The torque of a walk for OpenSim: names, sign, times, and a script that reads it."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.errors import ScenarioError
from ppafo.exports.opensim import device_torque, opensim_files
from ppafo.exports.opensim.add_device import read_torque
from ppafo.storage.opensim import read_opensim
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import walk


@pytest.fixture(scope="module")
def walked() -> WalkResult:
    return walk("solenoid", 0.1)


def test_the_whole_walk_is_in_opensims_sign(walked: WalkResult, tmp_path: Path) -> None:
    for name, content in opensim_files(walked, "left").items():
        (tmp_path / name).write_bytes(content)
    name, times, torques = read_torque(tmp_path / "device_torque.sto")
    assert name == "ankle_angle_l_device"
    assert times == walked.recording.time.tolist()
    assert torques == (-walked.recording["external_torque"]).tolist()
    table = read_opensim(tmp_path / "walk.sto")
    assert table.kind == "simulated"
    assert np.array_equal(table.columns["ankle_angle_l_device_moment"], torques)
    # In push-off the device turns the toes down, which is below 0 in OpenSim.
    pushing = walked.recording["command"] == 1.0
    assert np.mean(np.array(torques)[pushing]) < -1.0
    assert "ankle_angle_l_device" in (tmp_path / "README.md").read_text(encoding="utf-8")


def test_the_mean_stride_lies_on_heel_strikes(walked: WalkResult) -> None:
    strikes = (0.6217, 1.855, 3.08)
    laid = device_torque(walked, "right", strikes)
    values = laid["ankle_angle_r_device"]
    assert laid.time[[0, -1]].tolist() == [strikes[0], strikes[-1]]
    assert values[:101][:-1].tolist() == values[100:-1].tolist()
    phases = (laid.time[:100] - strikes[0]) / (strikes[1] - strikes[0])
    mean = walked.averages["external_torque"].mean
    assert -values[:100] == pytest.approx(np.interp(phases, np.linspace(0.0, 1.0, 101), mean))


@pytest.mark.parametrize("strikes", [(0.5,), (0.5, 0.6), (1.5, 0.5), (0.5, 9.0)])
def test_times_that_are_no_heel_strikes_are_refused(walked: WalkResult, strikes: tuple[float, ...]) -> None:
    with pytest.raises(ScenarioError, match="--strikes"):
        device_torque(walked, "right", strikes)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "has no line 'endheader'"),
        ("a\nendheader\ntime\tx\n0\t1\n1\t2\n", "ends in '_device'"),
        ("a\nendheader\ntime\tx_device\n0\t1\n", "is cut off"),
        ("a\nendheader\ntime\tx_device\n0\t1\n1\n", "is cut off"),
        ("a\nendheader\ntime\tx_device\n0\t1\n0\t2\n", "times must grow"),
        ("a\nendheader\ntime\tx_device\n0\t1\n1\tnan\n", "must be finite"),
    ],
)
def test_a_damaged_table_is_refused_by_the_script(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "torque.sto").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=said):
        read_torque(tmp_path / "torque.sto")


def test_the_command_writes_the_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "for opensim"
    words = ["export", "opensim", "solenoid", "--minutes", "0.1", "--strikes", "0.5,1.6", "--out", str(folder)]
    assert main(words) == 0
    names = {"README.md", "add_device.py", "device_torque.sto", "walk.sto", "ppafo.json"}
    assert {path.name for path in folder.iterdir()} == names
    assert "add_device.py' MODEL.osim --out with-device.osim" in capsys.readouterr().out


COURSE = """schema_version = 1
name = "short"
description = "A few steps."

[[segment]]
kind = "walk"
speed = "1.2 m/s"
duration = "4 s"
"""


@pytest.mark.parametrize(("given", "end"), [([], 4.0), (["--minutes", "2 s"], 2.0)])
def test_a_walk_is_as_long_as_its_course_unless_minutes_are_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], given: list[str], end: float
) -> None:
    (tmp_path / "short.toml").write_text(COURSE, encoding="utf-8")
    words = ["export", "opensim", "solenoid", "--set", f"course={tmp_path / 'short.toml'}", *given]
    assert main([*words, "--out", str(tmp_path / "out")]) == 0, capsys.readouterr().err
    _, times, _ = read_torque(tmp_path / "out" / "device_torque.sto")
    # A segment is a whole number of strides.
    assert (times[0], times[-1]) == (0.0, pytest.approx(end, abs=0.6))


def test_a_motion_may_begin_below_0_s_and_the_help_says_how(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["export", "opensim", "--help"])
    assert "--strikes=-0.4,0.8" in capsys.readouterr().out
    words = ["export", "opensim", "solenoid", "--minutes", "0.1", "--strikes=-0.4,0.8", "--out", str(tmp_path / "out")]
    assert main(words) == 0
    _, times, _ = read_torque(tmp_path / "out" / "device_torque.sto")
    assert (times[0], times[-1]) == (-0.4, 0.8)
    assert "goes from -0.4 to 0.8 s" in (tmp_path / "out" / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("times", ["", "a,b", "0.5", "0.5,nan", "1,2,1.5"])
def test_bad_strikes_are_one_line_and_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], times: str
) -> None:
    assert main(["export", "opensim", "solenoid", "--strikes", times, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "--strikes" in said
    assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()
