"""A scenario as a library in C: built by its own make file, it prints the bits of Python, and keeps its promises.

From settings in SI units to the numbers of a run, the C of a library gives the bits of the plan in Python.
"""

import ctypes
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.engine.run import batches_of
from ppafo.exports.c_library import c_library, library_of
from ppafo.exports.c_library.files import library_files
from ppafo.exports.c_library.library import c_identifier
from ppafo.exports.c_library.plant import plant_library
from ppafo.processor.firmware import firmware
from ppafo.running import simulate
from ppafo.simulation.clock import TIMES
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.scenario import Scenario
from tests.built_once import shared_library

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "export.md"
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")


def written(folder: Path, name: str, *overrides: str) -> str:
    """Write the library of a scenario; its name in C."""
    contents = c_library(load_scenario(name, overrides))
    for file, content in contents.items():
        (folder / file).write_bytes(content)
    return name.replace("-", "_")


def test_make_check_finds_the_bits_of_python_and_the_page_shows_what_the_example_prints(tmp_path: Path) -> None:
    name = written(tmp_path, "torque-task-proportional")
    command = ["make", "-s", "-C", str(tmp_path), f"CFLAGS=-std=c99 -O2 {' '.join(WARNINGS)}", "check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    printed = (tmp_path / f"{name}.csv").read_text(encoding="utf-8").splitlines()
    shown = re.findall(r"^    (# .*)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(shown) == 2
    assert set(shown) <= set(printed)
    assert len(printed) > 3000


def test_make_check_says_which_number_is_not_that_of_python(tmp_path: Path) -> None:
    name = written(tmp_path, "step-response", "run.duration=0.05 s")
    table, head = tmp_path / "expected.csv", ["make", "-s", "-C", str(tmp_path), "CFLAGS=-std=c99 -O0"]
    subprocess.run([*head, f"{name}_check"], check=True)
    text = table.read_text(encoding="utf-8")
    row = text.splitlines()[20].split(",")
    place = text.splitlines()[0].split(",").index("pressure_1")
    other = repr(float(np.nextafter(float(row[place]), 9e9)))
    cases = {
        f"at {float(row[0]):.9g} s pressure_1 is": text.replace(row[place], other),
        "metric gas_vented is": re.sub(r"(?<=# gas_vented = ).*", "1.0", text),
        "the run ended before 9 s": text.replace("# gas_supplied", f"9,{','.join(row[1:])}\n# gas_supplied", 1),
        "no table of Python's numbers": text.replace("angle", "angel", 1),
    }
    for said, changed in cases.items():
        assert changed != text
        table.write_text(changed, encoding="utf-8")
        done = subprocess.run([tmp_path / f"{name}_check", table], capture_output=True, text=True, check=False)
        assert done.returncode > 0
        assert said in done.stderr


@pytest.mark.parametrize("interface", [c_library, plant_library])
def test_the_comparison_with_python_is_clean_c_and_cpp(interface: Any, tmp_path: Path) -> None:
    for file, content in interface(load_scenario("torque-task-slow-valve", ["run.duration=0.2 s"])).items():
        (tmp_path / file).write_bytes(content)
    for line in (["gcc", "-std=c99", *WARNINGS, "-Wshadow"], ["g++", "-x", "c++", "-Wall", "-Wextra", "-Werror"]):
        done = subprocess.run([*line, "-fsyntax-only", "check.c"], cwd=tmp_path, capture_output=True, check=False)
        assert (done.returncode, done.stderr) == (0, b"")


class Loaded:
    """The library of a scenario, built and loaded."""

    def __init__(self, scenario: str, folder: Path, overrides: tuple[str, ...] = ()) -> None:
        self.name = written(folder, scenario, *overrides)
        self.exported = library_of(load_scenario(scenario, overrides))
        self.settings = [item.name for item in self.exported.settings]
        library = shared_library(folder / f"{self.name}.c", "-O1", "-ffp-contract=off")
        self.library = ctypes.CDLL(str(library))

    def call(self, function: str, *given: Any, returns: Any = ctypes.c_int) -> Any:
        """What a function of the library returns."""
        found = self.library[f"{self.name}_{function}"]
        found.restype = returns
        return found(*given)


@pytest.fixture(scope="module")
def step(tmp_path_factory: pytest.TempPathFactory) -> Loaded:
    """The library of the step response."""
    return Loaded("step-response", tmp_path_factory.mktemp("step"))


GOING_ON, FINISHED, BAD_SETTING, OTHER_PROGRAM = 0, 1, 4, 5


class Run:
    """One run in C; ``outputs`` are those of the sample that it has reached, time first."""

    def __init__(self, library: Loaded, **changes: float) -> None:
        self.library = library
        self.settings = (ctypes.c_double * len(library.settings))()
        library.call("defaults", self.settings)
        for name, value in changes.items():
            self.settings[library.settings.index(name)] = value
        self.size = library.call("size", self.settings, returns=ctypes.c_size_t)
        self.memory = (ctypes.c_double * (self.size // 8 + 1))()
        self.status = library.call("initialise", self.memory, self.settings)
        self.outputs = np.zeros(1 + len(library.exported.program.outputs))

    def advance(self) -> bool:
        """Go on to the next sample, if there is one."""
        self.status = self.library.call("step", self.memory)
        self.library.call("read_outputs", self.memory, ctypes.c_void_p(self.outputs.ctypes.data))
        return bool(self.status == GOING_ON)

    def course(self, samples: int = 1_000_000) -> list[bytes]:
        """Outputs of the next samples."""
        found: list[bytes] = []
        while len(found) < samples and self.advance():
            found.append(self.outputs.tobytes())
        return found


def test_settings_that_are_changed_in_c_give_what_overrides_give_in_python(step: Loaded) -> None:
    overrides = ["valve.area=9 mm^2", "friction.static_torque=0.9 N m", "run.step=0.5 ms", "gas.temperature=310 K"]
    recording = simulate("step-response", overrides).recording
    changes = {"valve_area": 9.0e-6, "friction_static_torque": 0.9, "run_step": 0.5e-3, "gas_temperature": 310.0}
    columns = [recording.time, *(recording[name] for name in step.exported.program.outputs)]
    assert Run(step, **changes).course() == [np.array(row).tobytes() for row in zip(*columns, strict=True)]


def test_runs_do_not_know_of_each_other_and_a_copy_goes_on_as_the_first_would(step: Loaded) -> None:
    alone = Run(step).course()
    one, other = Run(step), Run(step, valve_area=9.0e-6)
    turns = [(one.course(1), other.course(1)) for _ in range(200)]
    copied = Run(step)
    step.call("copy", copied.memory, one.memory)
    rest = one.course()
    assert [mine for mine, _ in turns] == [[sample] for sample in alone[:200]]
    assert turns[-1][0] != turns[-1][1]
    assert rest == alone[200:] == copied.course()
    assert (one.status, one.advance()) == (FINISHED, False)


@pytest.mark.parametrize(
    ("setting", "value", "named"),
    [
        ("valve_area", -1.0, "valve_area"),
        ("gas_temperature", np.nan, "gas_temperature"),
        ("run_output_interval", 1.0e-4, "run_step"),
        ("friction_dynamic_torque", 1.0e3, "friction_dynamic_torque"),
        ("run_output_interval", 7.0e-3, "run_output_interval"),
    ],
)
def test_a_setting_that_no_file_could_have_is_refused_by_name(
    step: Loaded, setting: str, value: float, named: str
) -> None:
    run = Run(step, **{setting: value})
    assert (run.size, run.status) == (0, BAD_SETTING)
    assert step.call("bad_setting", run.settings, returns=ctypes.c_char_p) == named.encode()


@pytest.mark.parametrize(
    ("setting", "value"),
    # With suction, and where samples lie between steps, Python runs other functions.
    [("valve_delay", 0.01), ("sensors_angle_noise", 0.01), ("supply_pressure", 7.0e4), ("controller_period", 1.2e-3)],
)
def test_settings_that_need_other_functions_are_refused(step: Loaded, setting: str, value: float) -> None:
    run = Run(step, **{setting: value})
    assert (run.size, run.status) == (0, OTHER_PROGRAM)
    assert step.call("bad_setting", run.settings, returns=ctypes.c_char_p) == setting.encode()
    assert Run(step, valve_dead_band=0.1).status == GOING_ON


TABLE_OF_ANGLES = (
    *("reference.kind=tabulated", "reference.period=0.3 s", "reference.value_01=0 deg"),
    *("reference.time_02=0.15 s", "reference.value_02=-10 deg"),
)


@pytest.mark.parametrize(
    ("name", "law", "change"),
    [
        ("cylinder-servo", (), ("foot_plate.inertia", 12.0e-3)),
        ("pressure-loop", (), ("supply.pressure", 5.0e5)),
        ("torque-task-slow-valve", (), ("valve.dead_band", 0.2)),
        ("cylinder-servo", TABLE_OF_ANGLES, ("reference.level", 1.4)),
    ],
)
def test_a_library_has_the_bits_of_python_and_gains_that_follow_what_is_changed(
    name: str, law: tuple[str, ...], change: tuple[str, float], tmp_path: Path
) -> None:
    path, number = change
    unit = {"foot_plate.inertia": "kg m^2", "supply.pressure": "Pa_a", "valve.dead_band": ""}.get(path, "rad")
    overrides = (*law, "run.duration=0.2 s", f"{path}={number!r} {unit}".rstrip())
    library = Loaded(name, tmp_path, law)
    recording = simulate(name, overrides).recording
    columns = [recording.time, *(recording[channel] for channel in library.exported.program.outputs)]
    found = Run(library, run_duration=0.2, **{path.replace(".", "_"): number}).course()
    assert found == [np.array(row).tobytes() for row in zip(*columns, strict=True)]


@pytest.mark.parametrize("taken", ["main", "check", "install"])
def test_a_scenario_with_the_name_of_another_file_or_target_is_called_otherwise(taken: str) -> None:
    contents = library_files(library_of(replace(load_scenario("step-response"), name=taken)))
    assert {f"run_{taken}.c", f"run_{taken}.h", "main.c"} <= set(contents)
    assert f"check: run_{taken}\n" in contents["Makefile"].decode()


def test_what_a_scenario_says_is_plain_words_in_every_page_and_comment() -> None:
    """Neither HTML, nor a heading, a link, or a mark that turns the direction of what follows in a source file."""
    hostile = "</p><script>alert(1)</script> `a` [x](javascript:b) ``` \\ \u202e \x1b[31m\n# Heading */"
    described = replace(load_scenario("torque-task-proportional"), description=hostile)
    fixed = load_scenario("torque-task-proportional", ("controller.kind=pid_fixed_point",))
    texts = {
        **library_files(library_of(described)),
        **{f"plant/{name}": text for name, text in plant_library(described).items()},
        **{f"firmware/{name}": text for name, text in firmware(replace(fixed, description=hostile)).items()},
    }
    said = [text.decode() for name, text in texts.items() if name.endswith("README.md")]
    assert len(said) == 3
    for page in said:
        (line,) = [line for line in page.splitlines() if "alert" in line]
        assert re.search(r"(?<!\\)[<`\[\]]", line.split("Controller `pid_fixed_point`")[0]) is None
        assert "Heading" in line
    for text in texts.values():
        assert not any(mark in text.decode() for mark in "\u202e\x1b")


@pytest.mark.skipif(shutil.which("cmake") is None, reason="no cmake on this machine")
def test_cmake_builds_the_example_and_runs_it(tmp_path: Path) -> None:
    written(tmp_path, "step-response")
    build = tmp_path / "build"
    subprocess.run(["cmake", "-S", str(tmp_path), "-B", str(build)], check=True, capture_output=True)
    subprocess.run(["cmake", "--build", str(build)], check=True, capture_output=True)
    done = subprocess.run(["ctest", "--test-dir", str(build)], check=False, capture_output=True, text=True)
    assert "100% tests passed" in done.stdout


RUNS = 100
SPREAD = (0.7, 1.4)
"""Smallest and largest factor on a setting of a draw; one that is 0 stays 0, as another program would be needed."""
VARIED: dict[str, tuple[str, ...]] = {
    "step-response": (),
    "swing-foot": (),
    "torque-task-anti-windup": (),
    "torque-task-moving-ankle": ("valve.sonic_conductance=9e-10 m^3/(s Pa)", "valve.critical_ratio=0.3"),
    "torque-task-proportional": (),
    "torque-task-slow-valve": ("controller.kind=feedback_linearisation",),
    "torque-task-solenoid": (
        "sensors.delay=2.3 ms",
        "sensors.pressure_noise=0.1 psi_d",
        "sensors.pressure_bandwidth=80 Hz",
        "reference.kind=sine",
        "reference.amplitude=2 N m",
    ),
}
"""Every shipped scenario, some with more settings."""
THERMAL = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
    "gas_model.wall_area_per_volume=100 1/m",
    "supply_line.plantarflexion.droop=3e6 Pa s/kg",
)


def built(scenario: Scenario, folder: Path) -> ctypes.CDLL:
    """The library of a scenario, with the function from settings to numbers to be called from outside."""
    for name, content in library_files(library_of(scenario)).items():
        (folder / name).write_bytes(content)
    source = folder / f"{c_identifier(scenario.name)}.c"
    return ctypes.CDLL(str(shared_library(source, "-O0", "-ffp-contract=off", "-Dstatic=", "-Wl,-Bsymbolic", "-w")))


def handed(values: Any) -> Any:
    """Numbers where C has a struct of them."""
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def drawn(scenario: Scenario) -> tuple[dict[str, Any], Scenario]:
    """Settings of many runs by path, and the scenario that stands for all of them."""
    draw = np.random.default_rng(15)
    settings = library_of(scenario).settings
    columns = {
        item.path: np.clip(item.value * draw.uniform(*SPREAD, RUNS), item.quantity.minimum, item.quantity.maximum)
        for item in settings
    }
    # Many steps to a sample, and whole numbers of them that are whole by rounding only.
    columns["run.step"][::2] *= draw.uniform(0.005, 0.1, RUNS // 2)
    columns["run.output_interval"][: RUNS // 2] = 3.0 * columns["run.step"][: RUNS // 2]
    columns["controller.period"][: RUNS // 2] = 2.0 * columns["run.step"][: RUNS // 2]
    varied = with_numbers(scenario, {path: column for path, column in columns.items() if path not in TIMES})
    return columns, replace(
        varied,
        run=replace(
            varied.run,
            duration=columns["run.duration"],
            step=columns["run.step"],
            output_interval=columns["run.output_interval"],
        ),
        controller=replace(varied.controller, period=columns["controller.period"]),
    )


@pytest.mark.parametrize(("name", "overrides"), [*VARIED.items(), ("step-response", THERMAL)])
def test_c_makes_the_numbers_of_a_run_that_python_makes(name: str, overrides: tuple[str, ...], tmp_path: Path) -> None:
    scenario = load_scenario(name, overrides)
    library = built(scenario, tmp_path)
    columns, varied = drawn(scenario)
    run, _ = varied.motion.motion_kind.plan(varied)
    compared = 0
    for members, batch in batches_of(run, RUNS):
        clock = batch.clock
        delays = clock.signal_delay, clock.command_delay
        expected = clock.record_every, clock.step_count, clock.steps_per_sample, *delays, batch.program.is_adaptive
        for place, member in enumerate(members):
            settings = np.array([column[member] for column in columns.values()])
            parameters, counts = np.zeros(len(batch.parameters)), np.zeros(len(expected))
            states = np.zeros(len(batch.states))
            library.prepare(*map(handed, (settings, parameters, states, counts)))
            assert parameters.tobytes() == batch.parameters[:, place].tobytes()
            assert states.tobytes() == batch.states[:, place].tobytes()
            assert counts.tolist() == list(map(float, expected))
            compared += 1
    assert compared == RUNS
