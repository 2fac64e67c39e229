"""The law alone, in C and as a functional mock-up unit: from what the sensors show it gives the commands of the run."""

import ctypes
import importlib
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.walking.catalog import walking_controllers
from ppafo.errors import ProgramError
from ppafo.exports.c_library.law import law_library
from ppafo.exports.fmu.interface import law_alone
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.loading import load_scenario
from ppafo.running import simulate

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
BARE = ("gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-ffreestanding", "-ffp-contract=off", "-O1")
FLOAT_LAWS = [name for name, kind in CONTROLLERS.items() if kind.plan is None]
SHORT = ("run.output_interval=1 ms", "controller.period=1 ms", "run.duration=0.3 s")
FLAWS = (
    *("sensors.angle_noise=0.05 deg", "sensors.pressure_noise=500 Pa_d", "sensors.pressure_resolution=400 Pa_d"),
    *("sensors.delay=2 ms", "sensors.pressure_bandwidth=80 Hz"),
)
MEASURED = ("angle", "pressure_1", "pressure_2", "torque")


def scenario_of(law: str) -> tuple[str, tuple[str, ...]]:
    """A scenario that the law controls, and its overrides."""
    if law == "cascade":
        return "swing-foot-angle", SHORT
    return "torque-task-proportional", (f"controller.kind={law}", *SHORT)


def written(folder: Path, name: str, overrides: tuple[str, ...]) -> str:
    """Write the law of a scenario; its name in C."""
    for file, content in law_library(load_scenario(name, overrides)).items():
        (folder / file).write_bytes(content)
    return f"{name.replace('-', '_')}_law"


class Law:
    """A law in C, compiled as for a board without a C library."""

    def __init__(self, folder: Path, name: str, overrides: tuple[str, ...]) -> None:
        own = written(folder, name, overrides)
        subprocess.run([*BARE, "-shared", "-fPIC", f"{own}.c", "-o", "law.so", "-lm"], cwd=folder, check=True)
        self.library, self.own = ctypes.CDLL(str(folder / "law.so")), own
        header = (folder / f"{own}.h").read_text(encoding="utf-8")
        structs = re.findall(r"typedef struct \{\n(.*?)\} \w+?_law_(\w+);", header, re.DOTALL)
        self.names = {name: re.findall(r"double (\w+);", members) for members, name in structs}
        self.settings, self.measurement, self.state = (
            (ctypes.c_double * len(self.names[name]))() for name in ("settings", "measurement", "state")
        )
        self.call("defaults")(self.settings)
        self.call("reset")(self.state)
        self.sample = self.call("update")
        self.sample.restype = ctypes.c_double
        self.sample.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p]

    def call(self, name: str) -> ctypes._CFuncPtr:
        """One of its functions."""
        return getattr(self.library, f"{self.own}_{name}")

    def update(self, reference: float, measured: tuple[float, ...]) -> float:
        """The command of the next sample."""
        self.measurement[:] = measured
        return float(self.sample(self.settings, self.state, reference, self.measurement))


@pytest.mark.parametrize("law", FLOAT_LAWS)
def test_every_law_fed_with_the_samples_of_a_run_gives_its_commands_to_the_bit(law: str, tmp_path: Path) -> None:
    name, overrides = scenario_of(law)
    recording = simulate(load_scenario(name, overrides)).recording
    alone = Law(tmp_path, name, overrides)
    wanted = next((name for name in ("reference", "reference_angle") if name in recording.names), None)
    references = np.zeros(len(recording)) if wanted is None else recording[wanted]
    measured = zip(*(recording[name].tolist() for name in MEASURED), strict=True)
    commands = [alone.update(*row) for row in zip(references.tolist(), measured, strict=True)]
    # The last sample is recorded, but a run that ends there decides nothing.
    assert commands[:-1] == recording["command"].tolist()[:-1]
    assert len(commands) == 301
    if law != "constant":
        assert len(set(commands)) > 1


@pytest.mark.long
@pytest.mark.parametrize("law", sorted(walking_controllers()))
def test_every_law_of_walking_gives_the_commands_of_a_walk_to_the_bit(law: str, tmp_path: Path) -> None:
    kind = walking_controllers()[law]
    written(tmp_path, "solenoid" if kind.only_switches else "proportional", (f"controller.kind={law}",))
    done = subprocess.run(["make", "-s", "-C", tmp_path, "check"], capture_output=True, text=True, check=False)
    assert done.stderr == "equal to ppafo: 3000 commands to the bit\n"
    commands = {line.rpartition(",")[2] for line in (tmp_path / "expected.csv").read_text().splitlines()}
    # All of them vent at first; "off" does nothing else.
    assert len(commands) > (1 if law == "off" else 2)


@pytest.mark.parametrize("name", ["torque-task-proportional", "pressure-loop"])
def test_noise_delay_lag_and_a_regulating_valve_are_in_the_samples_that_the_check_compares(
    name: str, tmp_path: Path
) -> None:
    own = written(tmp_path, name, (*FLAWS, "run.duration=0.3 s"))
    command = ["make", "-s", "-C", str(tmp_path), "check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert re.fullmatch(r"equal to ppafo: [1-9]\d+ commands to the bit\n", done.stderr)
    table = tmp_path / "expected.csv"
    head, first, *rows = table.read_text(encoding="utf-8").splitlines()
    reference, rest = first.split(",", 2)[1:]
    table.write_text("\n".join([head, f"0,{float(reference) + 1.0e-3!r},{rest}", *rows]), encoding="utf-8")
    done = subprocess.run([tmp_path / f"{own}_check", table], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "the run has" in done.stderr


def test_a_law_has_neither_memory_nor_files_and_its_header_is_one_for_c_plus_plus(tmp_path: Path) -> None:
    alone = Law(tmp_path, "torque-task-proportional", ())
    source = (tmp_path / f"{alone.own}.c").read_text(encoding="utf-8")
    assert not re.search(r"\b(malloc|calloc|free|fopen|printf|memcpy)\b", source)
    subprocess.run([*BARE, "-Wvla", "-Wconversion", "-c", f"{alone.own}.c"], cwd=tmp_path, check=True)
    symbols = subprocess.run(["nm", f"{alone.own}.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    # Nothing in it changes: no variables, set to 0 (b, B) or not (D), but the constant table of the settings.
    assert not re.search(r" [bBDCGSs] ", symbols)
    line = ["g++", "-std=c++11", "-Wall", "-Wextra", "-Werror", "-x", "c++", "-fsyntax-only", f"{alone.own}.h"]
    subprocess.run(line, cwd=tmp_path, check=True)


def test_an_input_that_is_no_number_and_a_setting_out_of_range_are_refused(tmp_path: Path) -> None:
    alone = Law(tmp_path, "torque-task-proportional", ())
    command = alone.update(1.0, (1.5, 2.0e5, 1.0e5, 0.5))
    before = bytes(alone.state)
    for row in ((float("nan"), (1.5, 2.0e5, 1.0e5, 0.5)), (1.0, (1.5, float("inf"), 1.0e5, 0.5))):
        assert alone.update(*row) == command
        assert bytes(alone.state) == before
    bad = alone.call("bad_setting")
    bad.restype = ctypes.c_char_p
    assert bad(alone.settings) is None
    alone.settings[alone.names["settings"].index("controller_dead_band")] = 1.0
    assert bad(alone.settings) == b"controller_dead_band"


def test_a_state_that_is_reset_begins_anew_and_a_gain_acts_as_in_simulate(tmp_path: Path) -> None:
    alone = Law(tmp_path, "torque-task-proportional", ())
    rows = [(1.0, (1.5, 1.5e5 + 1.0e3 * number, 1.0e5, 0.01 * number)) for number in range(20)]
    first = [alone.update(*row) for row in rows]
    alone.call("reset")(alone.state)
    assert [alone.update(*row) for row in rows] == first
    alone.settings[alone.names["settings"].index("controller_proportional_gain")] = 0.2
    alone.call("reset")(alone.state)
    folder = tmp_path / "stiff"
    folder.mkdir()
    stiff = Law(folder, "torque-task-proportional", ("controller.proportional_gain=0.2 1/(N m)",))
    assert [alone.update(*row) for row in rows] == [stiff.update(*row) for row in rows] != first


def test_the_torque_that_a_law_observes_is_that_of_the_recording(tmp_path: Path) -> None:
    recording = simulate(load_scenario("cylinder-servo", ("run.duration=0.2 s",))).recording
    alone = Law(tmp_path, "cylinder-servo", ())
    for row in list(zip(*(recording[name].tolist() for name in MEASURED), strict=True))[::20]:
        alone.measurement[:] = (*row[:3], 0.0)
        alone.call("observe")(alone.measurement)
        assert alone.measurement[3] == row[3]


@pytest.mark.parametrize(("name", "fmi"), [("torque-task-proportional", 2), ("swing-foot-angle", 3)])
@pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone")
def test_the_unit_of_a_law_gives_in_fmpy_the_commands_of_the_run(name: str, fmi: int, tmp_path: Path) -> None:
    fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (pip install -e .[dev])")
    scenario = load_scenario(name, SHORT)
    ((file, content),) = functional_unit(law_alone(scenario), fmi, ["linux64"]).items()
    (tmp_path / file).write_bytes(content)
    assert importlib.import_module("fmpy.validation").validate_fmu(str(tmp_path / file)) == []
    recording = simulate(scenario).recording
    wanted = "reference" if "reference" in recording.names else "reference_angle"
    given = np.zeros(len(recording), [("time", float), ("reference", float), *((name, float) for name in MEASURED)])
    given["time"], given["reference"] = recording.time, recording[wanted]
    for channel in MEASURED:
        given[channel] = recording[channel]
    shown = fmpy.simulate_fmu(
        str(tmp_path / file), input=given, output=["command"], stop_time=0.3, output_interval=1.0e-3
    )
    # A step shows the command of the sample at its beginning.
    assert shown["command"][1:].tolist() == recording["command"].tolist()[: len(shown) - 1]
    assert len(shown) == 301


def test_the_commands_write_both_and_what_has_no_law_of_its_own_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "c", "step-response", "--interface", "controller", "--out", str(tmp_path / "law")]) == 0
    assert (tmp_path / "law" / "step_response_law.h").is_file()
    line = ["export", "fmu", "step-response", "--interface", "controller", "--out", str(tmp_path / "law.fmu")]
    assert main(line) == 0
    assert (tmp_path / "law.fmu").is_file()
    capsys.readouterr()
    with pytest.raises(ProgramError, match="use 'ppafo export firmware'"):
        law_library(load_scenario("torque-task-proportional", ["controller.kind=pid_fixed_point"]))
