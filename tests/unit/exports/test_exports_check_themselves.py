"""A unit is compared with Python before it is written, and one with a late command gives what Python gives."""

import json
from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.errors import ProgramError
from ppafo.exports.c_library.expected import expected_csv
from ppafo.exports.fmu import trial
from ppafo.exports.fmu.interface import closed_loop, plant_alone
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario

pytestmark = pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone")
SHORT = ("run.duration=0.3 s", "reference.ramp_time=0.1 s")


@pytest.mark.long
@pytest.mark.parametrize(("interface", "fmi"), [(closed_loop, 2), (closed_loop, 3), (plant_alone, 2), (plant_alone, 3)])
def test_a_unit_with_other_numbers_than_python_is_not_written(
    interface: type, fmi: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = load_scenario("torque-task-slow-valve", SHORT)
    assert functional_unit(interface(scenario), fmi, ["linux64"])

    def of_another_device(run: object, *names: object) -> bytes:
        text = expected_csv(run, *names).decode()  # type: ignore[arg-type]
        head, *rows = text.splitlines()
        last = rows[-1].split(",")
        last[head.split(",").index("pressure_1")] = "7.0"
        return "\n".join([head, *rows[:-1], ",".join(last)]).encode()

    monkeypatch.setattr(trial, "expected_csv", of_another_device)
    with pytest.raises(
        ProgramError, match=r"at 0\.\d+ s: pressure_1 is \d+\.\d+, Python has 7\.0; no file was written"
    ):
        functional_unit(interface(scenario), fmi, ["linux64"])


def test_a_library_that_cannot_be_loaded_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ppafo.exports.fmu.unit.build", lambda *_: b"no library")
    with pytest.raises(ProgramError, match="the FMU was built but cannot be loaded here"):
        functional_unit(closed_loop(load_scenario("torque-task-slow-valve", SHORT)), 2, ["linux64"])


def test_the_shipped_valve_with_a_delay_runs_in_fmpy_as_in_python(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (pip install -e .[dev])")
    file = tmp_path / "valve.fmu"
    assert main(["export", "fmu", "torque-task-slow-valve", "--out", str(file)]) == 0
    assert "written:" in capsys.readouterr().out
    result = simulate("torque-task-slow-valve")
    channels = ["torque", "command", "pressure_1", "pressure_2", "supplied_mass", "vented_mass"]
    found = fmpy.simulate_fmu(str(file), output=[*channels, "metrics.gas_supplied"], output_interval=1e-3)
    for name in channels:
        assert np.array_equal(found[name], result.recording[name]), name
    assert found["metrics.gas_supplied"][-1] == result.metrics["gas_supplied"].value > 3e-4


@pytest.mark.parametrize(
    ("asked", "compared", "not_run"),
    [("linux64", ["linux64"], []), ("linux64,win64", ["linux64"], ["win64"]), ("win64", [], ["win64"])],
)
def test_a_unit_for_a_computer_that_cannot_run_here_is_said_to_be_not_compared(
    asked: str,
    compared: list[str],
    not_run: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("ppafo.exports.fmu.unit.build", lambda *_: b"a library")
    tried: list[int] = []
    monkeypatch.setattr("ppafo.exports.fmu.unit.check_unit", lambda _interface, fmi, *_: tried.append(fmi))
    line = ["export", "fmu", "step-response", "--platforms", asked, "--out"]
    assert main([*line, str(tmp_path / "unit.fmu")]) == 0
    said = capsys.readouterr().out.splitlines()
    assert main([*line, str(tmp_path / "folder"), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert tried == [2, 2] * len(compared)
    assert (document["compared"], document["not_run"]) == (compared, not_run)
    told = f"not compared with Python, since they cannot run on this computer: libraries for {', '.join(not_run)}"
    lists = "'pip install fmpy' gives the command fmpy, whose 'info' lists the variables"
    same = f"linux64: outputs compared with Python, to the bit; {lists}"
    assert said[1:] == [same] * len(compared) + [told] * len(not_run)
