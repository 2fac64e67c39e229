"""Results: what a run gives back, in Python and on disk."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo import read_result
from ppafo.cli.main import main
from ppafo.documents.json_text import plain
from ppafo.metrics import Metric
from ppafo.signals import Channel, Recording
from ppafo.simulation.scenario import Scenario, scenario_document
from ppafo.simulation.simulate import DeferredResult, Result, Status


@pytest.fixture
def result(step_response: Scenario) -> Result:
    """A result made by hand, so that no model is compiled."""
    channels = {"angle": Channel(np.array([0.3, 0.4]), "rad"), "pressure_1": Channel(np.array([1e5, 2e5]), "Pa")}
    recording = Recording("step-response", np.array([0.0, 0.1]), channels, kind="simulated")
    metrics = {"angle_range": Metric(0.1, "rad", "range"), "broken": Metric(float("inf"), "N m", "no number")}
    measured = DeferredResult((recording, metrics))
    return Result(step_response, Status("completed"), {"ppafo": "0"}, {"step": 1e-3, "steps": 100}, measured)


def test_a_result_is_shown_with_its_status_and_a_line_for_every_metric(result: Result) -> None:
    assert repr(result).splitlines() == [
        "Result of 'step-response', 0.5 s: completed",
        "  angle_range  5.73 deg",
        "  broken       inf N m",
    ]
    diverged = dataclasses.replace(result, status=Status("diverged", 0.05, "diverged at t = 0.05 s"))
    assert repr(diverged).startswith("Result of 'step-response', 0.5 s: diverged at t = 0.05 s\n")


def test_a_stored_result_is_shown_as_its_run_was(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = ppafo.simulate("cylinder-servo", ["run.duration=0.5 s"])
    lines = str(run).splitlines()
    assert lines[1].startswith("the angle follows its reference") or "no verdict" in lines[1]
    shown = repr(ppafo.read_result(run.save(tmp_path / "run"))).splitlines()
    assert shown[0] == f"StoredResult in {tmp_path / 'run'}: completed"
    assert shown[1 : len(lines)] == lines[1:]
    # The command stores the verdict that it prints, whose remedies were tried.
    words = ["simulate", "torque-task-proportional", "--set", "controller.proportional_gain=5 1/(N m)", "--out"]
    main([*words, str(tmp_path / "told")])
    printed = capsys.readouterr().out.splitlines()
    assert "; to try" not in printed[1]
    assert repr(ppafo.read_result(tmp_path / "told")).splitlines()[1] == printed[1]


def test_a_stored_result_is_the_dataset_of_its_run(tmp_path: Path) -> None:
    run = ppafo.simulate("step-response", ["run.duration=0.05 s"])
    stored = ppafo.read_result(run.save(tmp_path / "run"))
    assert stored.dataset().identical(run.dataset())
    in_psi = stored.dataset(units={"pressure_1": "psi_g"})["pressure_1"]
    # Chamber 1 starts at the atmosphere; 1 psi is 6894.757 Pa.
    assert in_psi.attrs["units"] == "psi_g"
    assert in_psi.attrs["long_name"] == "gauge pressure in chamber 1, whose volume grows with the angle"
    in_bar = stored.dataset(units={"pressure_2": "bar_a", "angle": "deg"})
    assert in_bar["pressure_2"].attrs["long_name"] == stored.dataset()["pressure_2"].attrs["long_name"]
    assert in_bar["pressure_2"].attrs["long_name"] == "absolute pressure in chamber 2"
    assert float(in_psi[0]) == pytest.approx(0.0, abs=1e-9)
    absolute = float(stored["pressure_1"][-1])
    assert float(in_psi[-1]) == pytest.approx((absolute - 101325.0) / 6894.757293, rel=1e-8)
    for result in (run, stored):
        with pytest.raises(ppafo.PpafoError, match="units='psi_g': must be units by channel"):
            result.dataset(units="psi_g")  # type: ignore[arg-type]


def test_the_document_holds_every_number_of_the_device_in_si(result: Result) -> None:
    device = result.to_dict()["scenario"]["device"]
    scenario = result.scenario
    assert device["actuator"]["torque_constant"] == scenario.device.actuator.torque_constant
    assert device["supply"]["pressure"] == scenario.device.supply.pressure
    assert device["valve"].items() >= scenario.device.valve.settings.items()
    assert device["valve"]["area"] == scenario.device.valve.area


def test_a_number_that_json_does_not_know_becomes_null(result: Result) -> None:
    document = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert document["metrics"]["broken"]["value"] is None
    assert document["metrics"]["angle_range"] == {"value": 0.1, "unit": "rad", "summary": "range"}


def test_plain_data_has_python_numbers_and_the_type_of_what_is_not_data() -> None:
    assert plain({"a": (np.int64(3), np.float64(0.5), True, None)}) == {"a": [3, 0.5, True, None]}
    assert type(plain(np.int64(3))) is int
    assert plain(Path) == "builtins.type"


def test_a_saved_result_is_read_back(result: Result, tmp_path: Path) -> None:
    stored = read_result(result.save(tmp_path / "task", {"figure.png": b"png"}))
    assert stored.recording == result.recording
    assert stored.metrics["angle_range"] == result.metrics["angle_range"]
    assert math.isnan(stored.metrics["broken"].value)
    # Values of channels as of a result, gauge pressures from the atmosphere of its device.
    assert stored["pressure_1", "psi_g"].tolist() == result["pressure_1", "psi_g"].tolist()
    assert (stored["time"].tolist(), stored["angle"].tolist()) == (result["time"].tolist(), result["angle"].tolist())
    assert stored.document["scenario"] == json.loads(json.dumps(scenario_document(result.scenario)))
    assert (tmp_path / "task" / "figure.png").read_bytes() == b"png"


def test_the_ten_reversals_of_the_torque_task_switch_each_valve_of_the_pair_ten_times() -> None:
    result = ppafo.simulate("torque-task-solenoid")
    assert np.count_nonzero(np.diff(np.sign(result.recording["command"]))) == 10
    assert result.metrics["switchings"].value == 20.0
