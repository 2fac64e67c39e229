"""A walk as a functional mock-up unit: the closed loop and the plant on its leg have the bits of the lanes."""

import importlib
from pathlib import Path

import numpy as np
import pytest

from ppafo.exports.fmu.interface import closed_loop, plant_alone
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.walking import load_walk
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import walk
from scripts.instances import STEP, Instance

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (pip install -e .[dev])")
pytestmark = pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone")
SECONDS = 6.0
NAME = "proportional"


def written(folder: Path, name: str, fmi: int, is_plant: bool = False, overrides: tuple[str, ...] = ()) -> str:
    """Write the unit of a walk; its path."""
    interface = (plant_alone if is_plant else closed_loop)(load_walk(name, overrides))
    ((file, content),) = functional_unit(interface, fmi, ["linux64"]).items()
    (folder / file).write_bytes(content)
    return str(folder / file)


@pytest.fixture(scope="module", params=[2, 3])
def loop(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> str:
    """The closed loop, of both versions of FMI."""
    return written(tmp_path_factory.mktemp("loop"), NAME, request.param)


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The device on its leg."""
    return written(tmp_path_factory.mktemp("plant"), NAME, 2, is_plant=True)


@pytest.fixture(scope="module")
def walked() -> WalkResult:
    """The walk by Python."""
    return walk(NAME, minutes=SECONDS / 60.0)


def outputs_of(unit: str) -> list[str]:
    """Names of the outputs."""
    variables = fmpy.read_model_description(unit).modelVariables
    return [item.name for item in variables if item.causality == "output" and item.type != "Clock"]


def test_fmpy_finds_no_fault_and_every_output_is_that_of_the_lanes(loop: str, walked: WalkResult) -> None:
    assert importlib.import_module("fmpy.validation").validate_fmu(loop) == []
    names, recording = outputs_of(loop), walked.recording
    given = {"stop_time": SECONDS, "step_size": STEP, "output_interval": STEP}
    # The controller decides nothing more at the end of a run.
    found = fmpy.simulate_fmu(loop, output=names, start_values={"run.duration": SECONDS}, **given)
    assert len(found) == len(recording)
    shown = [name for name in names if name in recording.names]
    assert len(shown) > 12
    assert {name: float(np.abs(found[name] - recording[name]).max()) for name in shown} == dict.fromkeys(shown, 0.0)


def test_wearer_controller_and_sensors_are_parameters_and_metrics_can_be_read(loop: str, walked: WalkResult) -> None:
    found = {item.name: item for item in fmpy.read_model_description(loop).modelVariables}
    changes = {name: found[name].variability for name in ("wearer.foot_mass", "wearer.residual_share", "run.duration")}
    assert changes == {"wearer.foot_mass": "fixed", "wearer.residual_share": "tunable", "run.duration": "fixed"}
    assert {"controller.peak_torque", "sensors.force_bandwidth", "valve.area"} <= set(found)
    instance = Instance(loop, {"run.duration": SECONDS})
    instance.go_to(SECONDS)
    read = {
        name: instance.get(f"metrics.{name}")
        for name in ("gas", "positive_push_off_work", "net_push_off_work", "strides")
    }
    assert read == pytest.approx({name: walked.metrics[name].value for name in read}, rel=1e-12)
    instance.close()


def test_a_parameter_that_is_tuned_acts_and_one_that_would_change_the_steps_is_refused(
    loop: str, capfd: pytest.CaptureFixture[str]
) -> None:
    plain, tuned = Instance(loop), Instance(loop)
    for instance in (plain, tuned):
        instance.go_to(2.0)
    tuned.set("controller.peak_torque", 3.0)
    for instance in (plain, tuned):
        instance.go_to(4.0)
    assert tuned.get("net_push_off_work") < plain.get("net_push_off_work")
    tuned.set("valve.area", 200.0e-6)
    with pytest.raises(Exception, match="DoStep"):
        tuned.go_to(4.1)
    assert "other steps of the engine" in capfd.readouterr().out
    plain.close()


@pytest.mark.parametrize("overrides", [(), ("run.step=0.5 ms", "valve.area=60 mm^2")])
def test_under_the_commands_of_a_walk_the_plant_on_its_leg_moves_with_its_bits(
    plant: str, overrides: tuple[str, ...], tmp_path: Path
) -> None:
    unit = written(tmp_path, NAME, 2, is_plant=True, overrides=overrides) if overrides else plant
    recording = walk(NAME, minutes=SECONDS / 60.0, overrides=overrides).recording
    seen = ("angle", "pressure_1", "pressure_2", "torque", "supplied_mass", "external_torque", "contact", "toe_force")
    instance = Instance(unit)
    assert set(seen) < set(outputs_of(unit))
    differences = dict.fromkeys(seen, 0.0)
    steps = round(instance_step(unit) / STEP * 1000.0)
    for number in range(len(recording)):
        for part in range(1000 // steps if number else 0):
            instance.go_to((number - 1) * STEP + (part + 1) * STEP * steps / 1000.0)
        for name in seen:
            differences[name] = max(differences[name], abs(instance.get(name) - recording[name][number]))
        instance.set("command", float(recording["command"][number]))
    assert differences == dict.fromkeys(seen, 0.0)
    instance.close()


def instance_step(unit: str) -> float:
    """Step [s] of a plant, of which communication steps are multiples."""
    (found,) = [item for item in fmpy.read_model_description(unit).modelVariables if item.name == "run.step"]
    return float(found.start)
