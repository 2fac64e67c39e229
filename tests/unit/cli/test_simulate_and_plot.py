"""``ppafo simulate`` and ``ppafo export figure``."""

import contextlib
import dataclasses
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from ppafo import read_result
from ppafo.cli.main import main
from ppafo.loading import load_scenario
from ppafo.report.recording_figure import recording_figure
from ppafo.report.style import render_figure
from ppafo.running import simulate
from ppafo.signals import Channel, Recording
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result, Status, compile_models
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.storage.netcdf import netcdf_bytes
from ppafo.storage.owned_folder import check_owned_folder, marked_folder, write_marked_folder
from ppafo.units.shown import counted_from, shown_in

FILES = ["figure.png", "figure.svg", "recording.csv", "recording.nc", "report.html", "run.json"]


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A run that is shared by the tests below: its folder, and what it printed."""
    folder, printed = tmp_path_factory.mktemp("results") / "step", io.StringIO()
    with contextlib.redirect_stdout(printed):
        assert main(["simulate", "step-response", "--out", str(folder)]) == 0
    return folder, printed.getvalue()


@pytest.fixture
def saved(ran: tuple[Path, str]) -> Path:
    """The folder of that run, whose files the tests do not change."""
    return ran[0]


def test_a_run_writes_a_whole_result_folder_and_nothing_else(saved: Path) -> None:
    assert names(saved) == FILES
    assert names(saved.parent) == ["step"]
    assert read_result(saved).document["status"]["kind"] == "completed"
    assert read_result(saved).recording.kind == "simulated"


def test_the_same_command_gives_the_same_files_without_a_folder_under_out_and_json_alone_is_printed(
    saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "step-response", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["metrics"]["gas_supplied"]["unit"] == "kg"
    assert document["folder"] == "out/step-response"
    assert names(tmp_path / "out" / "step-response") == FILES
    for name in FILES:
        assert (tmp_path / "out" / "step-response" / name).read_bytes() == (saved / name).read_bytes(), name


def test_a_saved_result_is_drawn_again_without_running_it(
    saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*arguments: object) -> None:
        raise AssertionError("it ran")

    monkeypatch.setattr("ppafo.simulation.simulate.simulate", never)
    assert main(["export", "figure", str(saved), "--out", str(tmp_path / "new" / "again.png")]) == 0
    assert (tmp_path / "new" / "again.png").read_bytes() == (saved / "figure.png").read_bytes()


def test_the_end_of_a_walk_is_drawn_and_the_folder_stays_that_of_the_walk(tmp_path: Path) -> None:
    time = 0.1 * np.arange(101)
    recording = Recording("left leg", time, {"angle": Channel(1.5 + 0.1 * np.sin(time), "rad")}, kind="simulated")
    folder = tmp_path / "walk"
    write_marked_folder(folder, {"recording.nc": netcdf_bytes(recording, None), "walk.json": b"{}"}, "walk")
    assert main(["export", "figure", str(folder)]) == 0
    assert names(folder) == ["figure.png", "figure.svg", "ppafo.json", "recording.nc", "walk.json"]
    check_owned_folder(folder, marked_folder("walk"))
    assert main(["export", "figure", str(folder)]) == 0
    assert main(["export", "figure", str(folder), "--out", str(tmp_path / "end.pdf")]) == 0
    (tmp_path / "foreign").mkdir()
    (folder / "recording.nc").rename(tmp_path / "foreign" / "recording.nc")
    assert main(["export", "figure", str(tmp_path / "foreign")]) == 2
    assert names(tmp_path / "foreign") == ["recording.nc"]


def test_gauge_pressure_of_a_bench_and_of_a_walk_counts_from_the_atmosphere_of_the_device(tmp_path: Path) -> None:
    time, level = 0.1 * np.arange(11), np.full(11, 83e3 + 1e5)
    recording = Recording("high", time, {"pressure_1": Channel(level, "Pa")}, "simulated")
    device = {"supply": {"atmospheric_pressure": 83e3}}
    (tmp_path / "rig").mkdir()
    (tmp_path / "rig" / "high.csv").write_bytes(marked_csv_bytes(recording))
    (tmp_path / "rig" / "rig.json").write_text(json.dumps({"recordings": {"high.csv": {"device": device}}}))
    walked = {"recording.nc": netcdf_bytes(recording, None)}
    walked["walk.json"] = json.dumps({"configuration": {"device": device}}).encode()
    write_marked_folder(tmp_path / "walk", walked, "walk")
    with shown_in(counted_from({}, 83e3)):
        drawn = render_figure(recording_figure(recording), ("png",))["png"]
    for figure in (tmp_path / "rig" / "high.png", tmp_path / "walk" / "figure.png"):
        assert main(["export", "figure", str(figure.parent)]) == 0
        assert figure.read_bytes() == drawn
    (tmp_path / "walk" / "walk.json").write_text('{"configuration": {"device": [3]}}')
    assert main(["export", "figure", str(tmp_path / "walk")]) == 2


def test_a_diverged_run_is_written_and_told_on_the_side_with_exit_code_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    simulated = simulate(load_scenario("step-response", ["run.duration=0.1 s"]))

    def diverging(scenario: Scenario) -> Result:
        assert scenario.name == "step-response"
        status = Status("diverged", 0.01, "diverged at t = 0.01 s; try a smaller run.step")
        return dataclasses.replace(simulated, status=status)

    monkeypatch.setattr("ppafo.simulation.simulate.simulate", diverging)
    folder = tmp_path / "step"
    assert main(["simulate", "step-response", "--json", "--out", str(folder)]) == 1
    printed = capsys.readouterr()
    assert printed.err == "ppafo: step-response: diverged at t = 0.01 s; try a smaller run.step\n"
    assert json.loads(printed.out)["status"]["kind"] == "diverged"
    assert names(folder) == FILES
    assert read_result(folder).document["status"]["kind"] == "diverged"


HELD_UP = """
import signal, sys, time
from pathlib import Path
# Whoever runs the tests in the background lets them ignore interrupts, and a child would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)
write = Path.write_bytes
def slow(self, content):
    written = write(self, content)
    if Path(sys.argv[1]).parent in self.parents:  # not what is kept for later runs
        print("writing", flush=True)
        time.sleep(60)
    return written
Path.write_bytes = slow
from ppafo.cli.main import main
sys.exit(main(["simulate", "step-response", "--out", sys.argv[1]]))
"""


@pytest.mark.skipif(os.name == "nt", reason="signals work differently there")
def test_an_interrupt_while_writing_ends_with_130_and_leaves_nothing(tmp_path: Path) -> None:
    compile_models([load_scenario("step-response")])
    command = [sys.executable, "-c", HELD_UP, str(tmp_path / "step")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert "writing\n" in process.stdout  # after the text of the run, which waits for no file
        time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=30)
    assert process.returncode == 130
    *_, last = error.splitlines()  # before it, that the model is compiled anew where the cache has no more room for it
    assert last == "ppafo: interrupted; no file is incomplete"
    assert names(tmp_path) == []
