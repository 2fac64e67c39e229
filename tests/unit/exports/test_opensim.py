"""Walks and recordings for OpenSim: names, signs, times."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.errors import ScenarioError
from ppafo.exports.opensim import device_torque, opensim_files
from ppafo.gait import load_gait, walk_recording
from ppafo.gait.recorded.forms.opensim import read_opensim
from ppafo.storage import write_csv
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import walk


@pytest.fixture(scope="module")
def walked() -> WalkResult:
    return walk("solenoid", minutes=0.1)


def test_the_whole_walk_is_in_opensims_sign(walked: WalkResult, tmp_path: Path) -> None:
    for name, content in opensim_files(walked, "left", ()).items():
        (tmp_path / name).write_bytes(content)
    device = read_opensim(tmp_path / "device_torque.sto")
    torques = device.columns["ankle_angle_l_device"]
    assert np.array_equal(device.time, walked.recording.time)
    assert np.array_equal(torques, -walked.recording["external_torque"])
    table = read_opensim(tmp_path / "walk.sto")
    assert table.kind == "simulated"
    assert np.array_equal(table.columns["ankle_angle_l_device_moment"], torques)
    # In push-off the device turns the toes down, which is below 0 in OpenSim.
    assert np.mean(torques[walked.recording["command"] == 1.0]) < -1.0
    for name in ("device_torque.sto", "walk.sto"):
        head = (tmp_path / name).read_text(encoding="utf-8").partition("endheader")[0]
        assert "above 0 in dorsiflexion" in head
        (signs,) = [line.removeprefix("signs=") for line in head.splitlines() if line.startswith("signs=")]
        *named, others = signs.split("; ")
        assert {sentence.split()[0] for sentence in named} <= set(read_opensim(tmp_path / name).columns)
        assert others == "other columns have the signs of ppafo"
        assert "ankle_angle_l_device" in signs


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
    with pytest.raises(ScenarioError, match=r"^strikes: "):
        device_torque(walked, "right", strikes)


def test_a_recording_is_written_with_what_it_has(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_csv(tmp_path / "walk.csv", walk_recording(load_gait("falisse2019-subject1"), 2))
    words = ["export", "opensim", str(tmp_path / "walk.csv"), "--out", str(tmp_path / "out")]
    assert main(words) == 0
    assert "left out: ankle_moment, vertical_force" in capsys.readouterr().out
    assert main([*words, "--body-mass", "1 g"]) == 2
    assert main([*words, "--body-mass", "62 kg"]) == 0
    table = read_opensim(tmp_path / "out" / "recording.sto")
    assert table.kind == "synthetic"
    assert {"ankle_angle_r", "ankle_angle_r_moment", "ground_force_r_vy"} <= set(table.columns)


def test_a_motion_may_begin_below_0_s_and_the_help_says_how(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["export", "opensim", "--help"])
    assert "--strikes=-0.4,0.8" in capsys.readouterr().out
    folder = tmp_path / "for opensim"
    words = ["export", "opensim", "solenoid", "--minutes", "0.1", "--strikes=-0.4,0.8", "--out", str(folder)]
    assert main(words) == 0
    assert {path.name for path in folder.iterdir()} == {"device_torque.sto", "walk.sto", "ppafo.json"}
    assert "load '" in capsys.readouterr().out
    times = read_opensim(folder / "device_torque.sto").time
    assert (times[0], times[-1]) == (-0.4, 0.8)
