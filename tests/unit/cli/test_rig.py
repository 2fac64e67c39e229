"""``ppafo rig``."""

import json
import shlex
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.storage import read_csv


def test_recordings_of_one_bench_share_a_folder_and_its_truth(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for experiment in ("static-torque", "valve-map"):
        assert main(["rig", "simulate", experiment, "--seed", "7", "--out", str(tmp_path)]) == 0
    assert "synthetic" in capsys.readouterr().out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["rig.json", "static-torque.csv", "valve-map.csv"]
    truth = json.loads((tmp_path / "rig.json").read_text())
    assert "synthetic" in truth["notice"]
    assert {name: item["seed"] for name, item in truth["recordings"].items()} == {
        "static-torque.csv": 7,
        "valve-map.csv": 7,
    }
    assert (tmp_path / "static-torque.csv").read_text().startswith("# synthetic")
    assert read_csv(tmp_path / "valve-map.csv").kind == "synthetic"


def test_the_command_that_compares_a_recording_names_its_motion_and_the_motion_is_found_without_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["rig", "simulate", "step-response", "--preset", "ideal-laboratory", "--out", str(tmp_path)]) == 0
    (command,) = (row for row in capsys.readouterr().out.splitlines() if row.startswith("to compare: ppafo "))
    words = shlex.split(command.removeprefix("to compare: ppafo "))
    assert words[-2:] == ["--motion", "leg"]
    assert main(words) == 0
    capsys.readouterr()
    assert main(words[:-2]) == 1
    verdict = capsys.readouterr().out.splitlines()[0]
    assert "; the vane seems to be coupled to a leg (--motion leg); " in verdict
