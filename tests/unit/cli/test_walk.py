"""``ppafo walk``: what it prints, what it writes, and what it refuses."""

import contextlib
import io
import json
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.storage import read_csv
from ppafo.storage.netcdf import read_netcdf
from ppafo.walking import loading

SHORT = ["--minutes", "0.1"]
FILES = [
    "legs.png",
    "legs.svg",
    "mean-stride-off.csv",
    "mean-stride.csv",
    "mean-stride.png",
    "mean-stride.svg",
    "ppafo.json",
    "recording-off.nc",
    "recording.csv",
    "recording.nc",
    "report.html",
    "strides-off.csv",
    "strides.csv",
    "walk.json",
    "walk.txt",
]


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """One walk, which the tests below only read: its folder, and the lines that it printed."""
    folder, printed = tmp_path_factory.mktemp("walks") / "solenoid", io.StringIO()
    with contextlib.redirect_stdout(printed):
        assert main(["walk", *SHORT, "--out", str(folder)]) == 0
    return folder, printed.getvalue().splitlines()


@pytest.fixture
def walked(ran: tuple[Path, list[str]]) -> Path:
    """The folder of that walk."""
    return ran[0]


def test_a_walk_prints_its_table_and_where_the_files_are(ran: tuple[Path, list[str]]) -> None:
    folder, lines = ran
    assert lines[0] == "solenoid: completed, 4 strides of falisse2019-subject1"
    assert lines[1].startswith(
        "the device helps in push-off but not in swing, against the same walk without it: 1.65 J of net work in "
        "push-off (positive work 7.3 % of the healthy ankle's), ankle 9.04 deg from the healthy one (20.1 deg without)"
    )
    assert lines[4].split() == ["with", "without", "healthy"]
    work = next(line for line in lines if line.startswith("Positive work on the wearer in push-off (J)")).split()
    assert float(work[-3]) > 0.5
    assert float(work[-2]) == 0.0
    assert float(work[-1]) == pytest.approx(22.49)
    assert str(folder) in lines[-1]


def test_a_walk_writes_its_folder_whole(walked: Path) -> None:
    assert names(walked) == FILES
    assert names(walked.parent) == ["solenoid"]
    assert json.loads((walked / "ppafo.json").read_text())["files"] == [name for name in FILES if name != "ppafo.json"]
    document = json.loads((walked / "walk.json").read_text())
    assert document["status"]["kind"] == document["status_off"]["kind"] == "completed"
    assert document["configuration"]["controller"] == "event_on_off"
    assert document["metrics"]["gas"]["unit"] == "kg"


def test_tables_and_recordings_say_the_same_and_that_they_are_simulated(walked: Path) -> None:
    stored = read_netcdf(walked / "recording.nc")
    written = read_csv(walked / "recording.csv")
    assert stored.kind == written.kind == "simulated"
    np.testing.assert_array_equal(stored["angle"], written["angle"])
    strides = (walked / "strides.csv").read_text().splitlines()
    assert strides[0].startswith("# simulated")
    assert strides[1].startswith("stride [-],start [s],gas [kg],positive_push_off_work [J],net_push_off_work [J]")
    gas = [float(line.split(",")[2]) for line in strides[2:]]
    document = json.loads((walked / "walk.json").read_text())
    assert np.mean(gas[2:]) == pytest.approx(document["metrics"]["gas"]["value"])
    mean = (walked / "mean-stride.csv").read_text().splitlines()
    assert len(mean) == 2 + 101
    assert "angle [rad],angle_deviation [rad]" in mean[1]


@pytest.fixture
def bursting(monkeypatch: pytest.MonkeyPatch) -> None:
    """Walks with a supply far from any real one."""
    load = loading.load_walk
    # No file can say it: the check of a scenario's parts would refuse it.
    monkeypatch.setattr(import_module("ppafo.walking.walk"), "check_parts", lambda _scenario: None)

    def changed(*given: Any, **named: Any) -> Any:
        configuration = load(*given, **named)
        supply = replace(configuration.device.supply, pressure=1.0e18)
        return replace(configuration, device=replace(configuration.device, supply=supply))

    monkeypatch.setattr("ppafo.walking.loading.load_walk", changed)


@pytest.mark.usefixtures("bursting")
def test_a_walk_that_diverges_is_a_status_and_exit_code_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["walk", *SHORT, "--out", str(tmp_path / "walk")]) == 1
    captured = capsys.readouterr()
    assert captured.out.startswith("solenoid: diverged")
    assert "\nsolenoid: diverged at t = " in captured.out
    assert "try a smaller run.step" in captured.out
    document = json.loads((tmp_path / "walk" / "walk.json").read_text())
    assert document["status"]["kind"] == "diverged"
    assert "diverged at t" in (tmp_path / "walk" / "report.html").read_text()
    assert "legs.png" not in names(tmp_path / "walk")
