"""The plant alone as a functional mock-up unit: under the commands of a closed loop it moves as that did."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from ppafo.exports.fmu.interface import plant_alone
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.simulation.loading import load_scenario
from scripts.instances import Instance

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (pip install -e .[dev])")
pytestmark = pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone")
FREE = (
    "torque-task-proportional",
    ("motion.kind=free", "run.duration=0.3 s", "reference.ramp_time=0.1 s", "motion.external_torque=3 N m"),
)
LED = ("torque-task-proportional", ())


def written(folder: Path, name: str, overrides: tuple[str, ...], fmi: int) -> str:
    """Write the unit of a plant; its path."""
    ((file, content),) = functional_unit(plant_alone(load_scenario(name, overrides)), fmi, ["linux64"]).items()
    (folder / file).write_bytes(content)
    return str(folder / file)


@pytest.fixture(scope="module")
def free(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A free vane, FMI 2."""
    return written(tmp_path_factory.mktemp("free"), *FREE, fmi=2)


@pytest.fixture(scope="module")
def moved(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A locked vane, which inputs move, FMI 3."""
    return written(tmp_path_factory.mktemp("moved"), *LED, fmi=3)


@pytest.mark.parametrize("name", ["free", "moved"])
def test_fmpy_and_the_toolbox_find_no_fault(name: str, request: pytest.FixtureRequest) -> None:
    unit = request.getfixturevalue(name)
    assert importlib.import_module("fmpy.validation").validate_fmu(unit) == []
    pytest.importorskip("fmu_manipulation_toolbox", reason="fmu-manipulation-toolbox is not installed")
    command = [sys.executable, "-m", "fmu_manipulation_toolbox", "-input", unit, "-check"]
    assert subprocess.run(command, capture_output=True, check=False).returncode == 0


def test_inputs_and_outputs_are_those_of_the_motion(free: str, moved: str) -> None:
    given, shown = {}, {}
    for name, unit in {"free": free, "moved": moved}.items():
        variables = fmpy.read_model_description(unit).modelVariables
        given[name] = {item.name: item.unit for item in variables if item.causality == "input"}
        shown[name] = {item.name for item in variables if item.causality == "output"}
        assert not [item.name for item in variables if item.name.startswith(("sensors.", "reference.", "metrics."))]
    assert given["free"] == {"command": None, "external_torque": "N m"}
    assert given["moved"] == {"command": None, "angle": "rad", "angular_velocity": "rad/s"}
    assert shown["free"] - shown["moved"] == {"angle", "angular_velocity"}
    assert {"torque", "pressure_1", "pressure_2", "supplied_mass", "vented_mass"} <= shown["moved"]


def test_the_torque_on_a_free_vane_turns_it_against_plantarflexion(free: str) -> None:
    angles = []
    for torque in (-2.0, 2.0):
        instance = Instance(free, {"external_torque": torque})
        instance.go_to(0.1)
        angles.append(instance.get("angle"))
        instance.close()
    start = load_scenario(*FREE).motion.angle
    assert angles[0] > start > angles[1]


def test_a_step_that_the_engine_does_not_take_and_an_input_that_is_no_number_are_refused(
    free: str, capfd: pytest.CaptureFixture[str]
) -> None:
    instance = Instance(free, {"command": 5.0})
    with pytest.raises(Exception, match="DoStep"):
        instance.slave.doStep(0.0, 0.0014)
    assert "a communication step is a multiple of run.step, 0.001 s" in capfd.readouterr().out
    instance.go_to(0.05)
    full = Instance(free, {"command": 1.0})
    full.go_to(0.05)
    assert instance.get("pressure_1") == full.get("pressure_1") > 1.5e5
    instance.set("external_torque", float("nan"))
    with pytest.raises(Exception, match="DoStep"):
        instance.go_to(0.06)
    assert "an input is no finite number" in capfd.readouterr().out
    instance.close()
    full.close()
