"""The plant alone as a functional mock-up unit: under the commands of a closed loop it moves as that did."""

import ctypes
import importlib
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ppafo.exports.fmu.interface import plant_alone
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.running import simulate
from ppafo.signals.recording import Recording
from ppafo.simulation.loading import load_scenario
from scripts.instances import STEP, Instance, begin

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (pip install -e .[dev])")
pytestmark = pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone")
FREE = (
    "torque-task-proportional",
    ("motion.kind=free", "run.duration=0.3 s", "reference.ramp_time=0.1 s", "motion.external_torque=3 N m"),
)
LED = ("torque-task-proportional", ())
MOVED = ("torque-task-moving-ankle", ("run.duration=0.5 s",))


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


def driven(instance: Instance, recording: Recording, channels: tuple[str, ...], seen: tuple[str, ...]) -> list[float]:
    """Largest difference of what is seen, with inputs of a recording from each of its samples to the next."""
    largest = [0.0] * len(seen)
    for number in range(len(recording)):
        if number:
            instance.go_to(number * STEP)
        found = [abs(instance.get(name) - recording[name][number]) for name in seen]
        largest = [max(pair) for pair in zip(largest, found, strict=True)]
        for name in channels:
            instance.set(name, float(recording[name][number]))
    return largest


@pytest.mark.parametrize("which", ["free", "moved"])
def test_tools_may_show_units_of_the_bench_and_know_the_limits_of_the_inputs(
    which: str, request: pytest.FixtureRequest
) -> None:
    described = fmpy.read_model_description(request.getfixturevalue(which))
    factors = {unit.name: unit.displayUnits[0] for unit in described.unitDefinitions if unit.displayUnits}
    shown = {item.name: item for item in described.modelVariables}
    for name, unit, one in (("pressure_1", "psi", 6894.757293), ("angle", "deg", math.radians(1.0))):
        assert shown[name].displayUnit == unit
        kind = factors[shown[name].unit]
        assert (kind.name, float(kind.factor) * one) == (unit, pytest.approx(1.0, rel=1e-9))
    ranges = {"command": (-1.0, 1.0)}
    if which == "moved":
        stops = math.radians(20.0), math.radians(130.0)
        fastest = (10.0 - stops[1]) * 128.0
        ranges |= {"angle": stops, "angular_velocity": (-fastest, fastest)}
    else:
        ranges["external_torque"] = (-1e4, 1e4)
    found = {item.name: (float(item.min), float(item.max)) for item in shown.values() if item.causality == "input"}
    assert found == {name: pytest.approx(limits, rel=1e-9) for name, limits in ranges.items()}


def test_an_ankle_that_is_led_point_by_point_follows_the_path_between_them(moved: str) -> None:
    recording = simulate(*MOVED).recording
    assert np.ptp(recording["angle"]) > 0.1
    inputs = ("command", "angle", "angular_velocity")
    instance = Instance(moved, {name: float(recording[name][0]) for name in inputs})
    (torque,) = driven(instance, recording, inputs, ("torque",))
    assert 0.0 < torque < 1e-4
    instance.close()


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


@pytest.mark.parametrize("name", ["free", "moved"])
def test_a_restored_state_goes_on_with_the_same_bits(name: str, request: pytest.FixtureRequest) -> None:
    unit = request.getfixturevalue(name)
    one, other = Instance(unit, {"command": 0.7}), Instance(unit)
    one.go_to(0.05)
    kept = one.kept()
    first = one.course(0.05, 0.1)
    other.drop(other.restored(kept))
    assert other.get("command") == 0.7
    assert other.course(0.05, 0.1) == first
    one.close()
    other.close()


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


def test_a_first_sample_that_was_refused_does_not_let_the_unit_begin(
    free: str, capfd: pytest.CaptureFixture[str]
) -> None:
    instance = Instance(free)
    instance.slave.reset()
    begin(instance.slave)
    instance.set("command", float("inf"))
    with pytest.raises(Exception, match="GetReal"):
        instance.get("torque")
    with pytest.raises(Exception, match="ExitInitializationMode"):
        instance.slave.exitInitializationMode()
    instance.set("command", 0.5)
    instance.slave.exitInitializationMode()
    assert "an input is no finite number" in capfd.readouterr().out
    with pytest.raises(Exception, match="SetFMUstate"):
        instance.slave.setFMUstate(ctypes.c_void_p(None))
    instance.close()


def test_an_angle_at_the_start_that_cannot_be_is_refused_as_an_input(
    moved: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(Exception, match="ExitInitializationMode"):
        Instance(moved, {"angle": 50.0})
    assert "an input is out of range" in capfd.readouterr().out


def test_a_parameter_changes_while_the_ankle_moves_fast(moved: str) -> None:
    instance = Instance(moved, {"angle": 1.9, "angular_velocity": 5.0})
    instance.go_to(0.001)
    instance.set("supply.pressure", 500_000.0)
    for name, value in (("angle", 1.905), ("angular_velocity", -60.0), ("command", 1.0)):
        instance.set(name, value)
    instance.go_to(0.002)
    assert math.isfinite(instance.get("torque"))
    instance.close()


def test_a_tunable_parameter_is_taken_at_the_next_step(free: str) -> None:
    gains = []
    for area in (None, 1.0e-12):
        instance = Instance(free, {"command": 1.0})
        instance.go_to(0.005)
        before = instance.get("supplied_mass")
        if area is not None:
            instance.set("valve.area", area)
        instance.go_to(0.006)
        gains.append(instance.get("supplied_mass") - before)
        instance.close()
    assert gains[0] > 1e-7
    assert 0.0 <= gains[1] < 1e-5 * gains[0]
