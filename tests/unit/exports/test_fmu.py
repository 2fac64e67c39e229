"""A scenario as a functional mock-up unit: it has the bits of the lanes in FMPy, and keeps the promises of FMI."""

import importlib
import importlib.util
import io
import re
import subprocess
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ppafo.cli
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import library_files
from ppafo.exports.fmu.interface import FIXED_NAMES, closed_loop
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from scripts.instances import Instance, growth_of

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (pip install -e .[dev])")
pytestmark = pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone")
SHORT = ("run.duration=0.3 s", "reference.ramp_time=0.1 s")


def written(folder: Path, name: str, overrides: tuple[str, ...] = SHORT, fmi: int = 2) -> str:
    """Write a unit; its path."""
    ((file, content),) = functional_unit(closed_loop(load_scenario(name, overrides)), fmi, ["linux64"]).items()
    (folder / file).write_bytes(content)
    return str(folder / file)


@pytest.fixture(scope="module", params=[2, 3])
def unit(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> str:
    """The torque task, of both versions of FMI."""
    return written(tmp_path_factory.mktemp("unit"), "torque-task-proportional", fmi=request.param)


@pytest.fixture
def instance(unit: str) -> Iterator[Instance]:
    """The torque task at its start."""
    made = Instance(unit)
    yield made
    made.close()


def outputs_of(unit: str) -> list[str]:
    """Names of the outputs."""
    variables = fmpy.read_model_description(unit).modelVariables
    return [item.name for item in variables if item.causality == "output" and item.type != "Clock"]


def largest_difference(unit: str, name: str, overrides: tuple[str, ...]) -> dict[str, float]:
    """Largest difference of each output in FMPy from the lanes, at all samples."""
    scenario = load_scenario(name, overrides)
    recording = simulate(scenario).recording
    given = {"stop_time": scenario.run.duration, "step_size": scenario.run.output_interval}
    names = outputs_of(unit)
    found = fmpy.simulate_fmu(unit, output=names, output_interval=scenario.run.output_interval, **given)
    assert len(found) == len(recording)
    assert np.ptp(found["torque"]) > 1.0
    return {item: float(np.abs(found[item] - recording[item]).max()) for item in names}


def test_fmpy_finds_no_fault_and_every_output_is_that_of_the_lanes_to_the_last_bit(unit: str) -> None:
    assert importlib.import_module("fmpy.validation").validate_fmu(unit) == []
    assert set(largest_difference(unit, "torque-task-proportional", SHORT).values()) == {0.0}


@pytest.mark.parametrize(
    "texts",
    [
        ("supply.pressure=430000 Pa_a",),
        ("supply.atmospheric_pressure=90000 Pa_a",),
        ("supply.atmospheric_pressure=90000 Pa_a", "supply.dorsiflexion_pressure=410000 Pa_a"),
    ],
)
def test_a_parameter_of_a_unit_moves_what_follows_it_as_set_does(unit: str, texts: tuple[str, ...]) -> None:
    recording = simulate(load_scenario("torque-task-proportional", (*SHORT, *texts))).recording
    given = {path: float(text.split()[0]) for path, text in (text.split("=") for text in texts)}
    names = outputs_of(unit)
    found = fmpy.simulate_fmu(
        unit, output=names, output_interval=0.001, stop_time=0.3, step_size=0.001, start_values=given
    )
    assert {item: float(np.abs(found[item] - recording[item]).max()) for item in names} == dict.fromkeys(names, 0.0)


def test_gains_that_nobody_gives_follow_the_parameters_of_a_unit(tmp_path: Path) -> None:
    plain = tmp_path / "plain.toml"
    plain.write_text((Path(ppafo.cli.__file__).parent / "templates" / "scenario.toml").read_text(encoding="utf-8"))
    own = {"actuator.torque_constant": 2.5e-5, "valve.area": 1.2e-5, "actuator.dead_volume_1": 2.0e-5}
    texts = [f"{path}={value!r} {unit}" for (path, value), unit in zip(own.items(), ("m^3", "m^2", "m^3"), strict=True)]
    scenario = load_scenario(str(plain), [*SHORT, *texts])
    shipped = load_scenario(str(plain), SHORT)
    assert scenario.controller.proportional_gain != pytest.approx(shipped.controller.proportional_gain, rel=0.1)
    unit = written(tmp_path, str(plain))
    names = outputs_of(unit)
    found = fmpy.simulate_fmu(
        unit, output=names, output_interval=0.001, stop_time=0.3, step_size=0.001, start_values=own
    )
    recording = simulate(scenario).recording
    assert {item: float(np.abs(found[item] - recording[item]).max()) for item in names} == dict.fromkeys(names, 0.0)


def test_every_setting_is_a_parameter_with_its_unit_and_metrics_can_be_read(unit: str, instance: Instance) -> None:
    described = fmpy.read_model_description(unit)
    found = {item.name: item for item in described.modelVariables}
    area = found["valve.area"]
    assert (area.causality, area.variability, area.unit) == ("parameter", "tunable", "m^2")
    assert float(area.start) == load_scenario("torque-task-proportional").device.valve.area
    assert {found[name].variability for name in ("gas.temperature", "run.step", "motion.angle")} == {"fixed"}
    assert all(found[name].variability == "fixed" for name in found if name.split(".")[-1] in FIXED_NAMES)
    units = {item.name: item.baseUnit for item in described.unitDefinitions}
    assert (units["N m s/rad"].kg, units["N m s/rad"].m, units["N m s/rad"].s, units["N m s/rad"].rad) == (1, 2, -1, -1)
    expected = simulate("torque-task-proportional", SHORT).metrics
    instance.go_to(0.3)
    read = {name: instance.get(f"metrics.{name}") for name in ("rms_error_hold", "gas_supplied", "largest_pressure")}
    assert read == pytest.approx({name: expected[name].value for name in read}, rel=1e-12)


def test_a_state_that_is_restored_goes_on_with_the_same_bits(instance: Instance, unit: str) -> None:
    instance.go_to(0.1)
    kept = instance.kept()
    first = instance.course(0.1, 0.2)
    later = Instance(unit)
    for other in (instance, later):
        state = other.restored(kept)
        assert other.course(0.1, 0.2) == first
        other.drop(state)
    later.close()


def test_a_state_of_something_else_is_refused_and_changes_nothing(instance: Instance, unit: str) -> None:
    instance.go_to(0.1)
    given = instance.kept()
    damaged = bytearray(given)
    damaged[-20] ^= 1  # a number of the run, which is still one
    for wrong in (given[:100], given[:-8], bytes(len(given)), given[:40] + b"\xff" * 8 + given[48:], bytes(damaged)):
        with pytest.raises(Exception, match=r"De[sS]erializeFMU[sS]tate"):
            instance.restored(wrong)
    other = Instance(unit)
    other.go_to(0.1)
    assert other.course(0.1, 0.2) == instance.course(0.1, 0.2)
    other.close()


def test_the_clock_of_fmi_3_ticks_when_the_controller_decides(tmp_path: Path) -> None:
    slow = (*SHORT, "controller.period=5 ms")
    unit = written(tmp_path, "torque-task-proportional", slow, fmi=3)
    recording = simulate("torque-task-proportional", slow).recording
    command, reference = recording["command"], recording["reference"]
    instance = Instance(unit, events=True)
    slave, clock = instance.slave, [instance.numbers["controller.clock"]]
    ticks, time, before, seen = [], 0.0, [], [instance.get("command")]
    assert slave.getClock(clock) == [True]
    slave.updateDiscreteStates()
    assert slave.getClock(clock) == [False]
    slave.enterStepMode()
    for end in (0.012, 0.03, 0.1):
        while time < end:
            needs_event, _, is_early, time = slave.doStep(time, end - time)
            assert is_early == (time < end)
            if needs_event:
                ticks.append(round(time, 9))
                before.append((instance.get("command"), instance.get("reference")))
                slave.enterEventMode()
                seen.append(instance.get("command"))
                assert slave.getClock(clock) == [True]
                slave.updateDiscreteStates()
                slave.enterStepMode()
    assert ticks == [round(0.005 * number, 9) for number in range(1, 21)]
    assert seen == list(command[:101:5])
    # Between two events a discrete output is what it was in the first of them.
    assert before == list(zip(command[:96:5], reference[:96:5], strict=True))
    assert np.ptp(reference[:100]) > 0.0
    plain = Instance(unit)
    plain.go_to(0.052)
    instance.drop(instance.restored(plain.kept()))
    assert instance.get("command") == command[52] != 0.0
    plain.close()
    instance.close()


def test_steps_of_any_length_show_the_last_sample_that_is_due(instance: Instance) -> None:
    torque = simulate("torque-task-proportional", SHORT).recording["torque"]
    for time in (0.0004, 0.0017, 0.1, 0.12345, 0.2999):
        instance.go_to(time)
        assert instance.get("torque") == torque[int(time * 1000 + 1e-6)]


def test_a_tunable_parameter_changes_the_run_from_there_on_and_a_fixed_one_is_refused(
    instance: Instance, unit: str
) -> None:
    plain = Instance(unit)
    plain.go_to(0.1)
    instance.go_to(0.1)
    instance.set("reference.level", 1.0)
    assert instance.get("torque") == plain.get("torque")
    instance.go_to(0.3)
    plain.go_to(0.3)
    assert instance.get("reference") == 1.0
    assert plain.get("reference") == 6.0
    assert 1.0 < instance.get("torque") < 0.5 * plain.get("torque")
    with pytest.raises(Exception, match=r"fmi2SetReal|fmi3SetFloat64"):
        instance.set("gas.temperature", 310.0)
    plain.close()


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("valve.area", -1.0, "valve.area"),
        ("valve.delay", 0.01, "valve.delay needs other functions"),
        ("run.duration", 0.3005, "run.output_interval"),
        ("gas.temperature", float("nan"), "gas.temperature"),
    ],
)
def test_parameters_that_cannot_be_are_refused_by_name(
    unit: str, name: str, value: float, said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(Exception, match="ExitInitializationMode"):
        Instance(unit, {name: value})
    assert said in capfd.readouterr().out


def test_instances_are_freed_without_growth(unit: str) -> None:
    assert growth_of(unit, 1000, warm=200) < 100_000


def test_the_unit_holds_sources_that_build_it_without_a_warning(unit: str, tmp_path: Path) -> None:
    with zipfile.ZipFile(unit) as archive:
        archive.extractall(tmp_path)
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-fsyntax-only"]
    subprocess.run(["gcc", *flags, *map(str, (tmp_path / "sources").glob("fmi?.c"))], check=True)
    page = (tmp_path / "documentation" / "index.html").read_text()
    assert "<td>linux64</td><td>run in the tests</td>" in page
    assert "@" not in page


def test_no_name_of_a_scenario_meets_another_name_of_its_unit(tmp_path: Path) -> None:
    """A name is taken where one of its own, as ``NAME_run``, is something else in the C of a library or a unit."""
    scenario = replace(load_scenario("step-response"), name="zzz")
    loop = closed_loop(scenario)
    ((_, content),) = functional_unit(loop, 3, ["linux64"]).items()
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        code = {
            Path(name).name: archive.read(name).decode() for name in archive.namelist() if name.endswith((".c", ".h"))
        }
    code["main.c"] = library_files(library_of(scenario))["main.c"].decode()
    found = set(re.findall(r"[A-Za-z]\w*", "\n".join(code.values())))
    ends = {name[3:] for name in found if name.lower().startswith("zzz_")}
    fronts = {name.removesuffix(end).lower() for name in found for end in ends if name.endswith(end)} - {"zzz"}
    assert {"prepare", "prepared", "is"} <= fronts
    for front in sorted(fronts):
        name = replace(loop.library, title=front).name
        for file, text in code.items():
            renamed = text.replace("zzz", name).replace("ZZZ", name.upper())
            (tmp_path / file.replace("zzz", name)).write_text(renamed, encoding="utf-8")
        for file in (f"{name}.c", "main.c", "fmi3.c"):
            words = ["gcc", "-std=c99", "-fsyntax-only", file]
            done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
            assert done.returncode == 0, (front, done.stderr)
