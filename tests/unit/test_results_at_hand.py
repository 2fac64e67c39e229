"""Results handed on: pickled, copied, in the units that are asked for, and in a notebook."""

import copy
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.cli.new import new
from ppafo.errors import DataError, UnitError
from ppafo.report.finding import Finding

TASK = "torque-task-proportional"
STUDY = "torque-task-uncertainty"


MADE: dict[str, Callable[[], Any]] = {
    "simulate": lambda: ppafo.simulate(TASK),
    "simulate_many": lambda: ppafo.simulate_many([TASK, "torque-task-solenoid"]),
    "walk": lambda: ppafo.walk("solenoid", minutes=0.1),
    "compare_walks": lambda: ppafo.compare_walks("solenoid", minutes=0.1),
    "evaluate": lambda: ppafo.evaluate(ppafo.simulate(TASK).recording),
    "audit": lambda: ppafo.audit("ppafo2011"),
    "load_design": lambda: ppafo.load_design("push-off"),
    "load_gait": lambda: ppafo.load_gait(ppafo.list_gaits()[0]),
    "load_scenario": lambda: ppafo.load_scenario("step-response"),
    "load_study": lambda: ppafo.load_study(STUDY),
    "load_tuning": lambda: ppafo.load_tuning("pid-gains"),
    "load_walk": lambda: ppafo.load_walk("solenoid"),
    "bottle": lambda: ppafo.bottle(gas_per_stride="0.3 g"),
    # Gains of the second follow from numbers of the device by functions that no module has.
    "compare": lambda: ppafo.compare([TASK, "swing-foot-angle"]),
    "find": lambda: ppafo.find(TASK, vary="supply.pressure=20..90 psi_g", such_that="rms_error <= 0.5 N m", grid=3),
    "linearise": lambda: ppafo.linearise(TASK, overrides={"reference.level": 3.0}),
}
IN_A_FOLDER: dict[str, Callable[[Path], Any]] = {
    "read_recording": lambda folder: ppafo.read_recording(ppafo.simulate(TASK).save(folder / "run")),
    "read_result": lambda folder: ppafo.read_result(ppafo.simulate(TASK).save(folder / "run")),
}
COPIES: dict[str, Callable[[Any], Any]] = {
    "pickled": lambda result: pickle.loads(pickle.dumps(result)),
    "copied": copy.copy,
    "copied deeply": copy.deepcopy,
}


@pytest.mark.parametrize("name", [*MADE, *IN_A_FOLDER])
def test_a_result_can_be_pickled_and_copied_and_still_prints_and_draws_itself(name: str, tmp_path: Path) -> None:
    result = MADE[name]() if name in MADE else IN_A_FOLDER[name](tmp_path)
    for make in COPIES.values():
        other = make(result)
        assert type(other) is type(result)
        assert str(other) == str(result)
        if hasattr(other, "plot") and getattr(other, "figures", None) != {}:
            assert other.plot().axes
        if isinstance(other, Finding):
            assert other.to_dict() == result.to_dict()


def test_an_audit_is_a_finding_and_a_loop_over_it_goes_through_its_items(tmp_path: Path) -> None:
    audited = ppafo.audit("ppafo2011-printed")
    assert isinstance(audited, Finding)
    assert not audited.passed
    assert next(finding.severity for finding in audited) == "error"
    assert tuple(audited) == audited.found.findings
    audited.save(tmp_path / "audit")
    assert "no changed value" not in (tmp_path / "audit" / "audit-ppafo2011-printed.txt").read_text()
    with pytest.raises(TypeError, match="not iterable"):
        iter(ppafo.bottle(gas_per_stride="0.3 g"))


def test_every_scenario_and_walk_can_be_pickled_and_copied_whatever_its_gains_follow(tmp_path: Path) -> None:
    new("scenario", "ramp", out=tmp_path / "ramp.toml")
    given = [
        *map(ppafo.load_scenario, (*ppafo.list_scenarios(), tmp_path / "ramp.toml")),
        *map(ppafo.load_walk, ppafo.list_walks()),
    ]
    for make in COPIES.values():
        assert list(map(make, given)) == given


def test_a_pickled_scenario_runs_in_another_process_with_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", "python")
    # Its gains follow from numbers of the device by functions that no module has.
    scenario = ppafo.load_scenario("swing-foot-angle", overrides={"run.duration": 0.02})
    (tmp_path / "scenario").write_bytes(pickle.dumps(scenario))
    program = (
        "import pickle, pathlib, sys, ppafo\n"
        "scenario = pickle.loads(pathlib.Path(sys.argv[1]).read_bytes())\n"
        "result = ppafo.simulate(scenario)\n"
        "sys.stdout.buffer.write(pickle.dumps((scenario, result.recording)))\n"
    )
    told = subprocess.run([sys.executable, "-c", program, tmp_path / "scenario"], capture_output=True, check=True)
    returned, recording = pickle.loads(told.stdout)
    assert returned == scenario
    assert recording == ppafo.simulate(scenario).recording


def test_a_channel_is_given_in_si_and_in_the_unit_that_is_asked() -> None:
    result = ppafo.simulate(TASK, {"supply.atmospheric_pressure": 90.0e3})
    pressure = result.recording["pressure_1"]
    np.testing.assert_array_equal(result["pressure_1"], pressure)
    np.testing.assert_allclose(result["pressure_1", "kPa_g"], 1e-3 * (pressure - 90.0e3), rtol=1e-9, atol=1e-6)
    data = result.dataset(units={"pressure_1": "kPa_g", "angle": "deg"})
    assert data["pressure_1"].attrs["units"] == "kPa_g"
    assert data["pressure_2"].attrs["units"] == "Pa"
    table = result.to_dataframe(units={"angle": "deg"})
    assert table["angle"].iloc[0] == pytest.approx(75.0)
    assert table.index.name == "time"
    with pytest.raises(UnitError, match="channel 'angle' in 'psi_g'"):
        _ = result["angle", "psi_g"]
    with pytest.raises(DataError, match="no channel 'torqe', did you mean 'torque'"):
        _ = result["torqe"]


def test_a_result_that_is_read_back_has_the_figure_of_its_run(tmp_path: Path) -> None:
    result = ppafo.simulate("torque-task-proportional", overrides=["run.duration=0.3 s", "supply.pressure=3 bar_g"])
    again = ppafo.read_result(result.save(tmp_path / "run")).plot()
    assert [axes.get_title("left") for axes in again.axes] == [axes.get_title("left") for axes in result.plot().axes]
    assert "Pressure (bar gauge)" in [axes.get_title("left") for axes in again.axes]
