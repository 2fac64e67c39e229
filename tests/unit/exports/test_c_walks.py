"""A walk as a library in C: from settings to the numbers of a run, with the bits of Python."""

import ctypes
import functools
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.engine.lanes import Batch
from ppafo.engine.run import batch_of
from ppafo.errors import ParameterError, ScenarioError
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import library_files
from ppafo.exports.c_library.library import ExportParameter, Library
from ppafo.simulation.plan import plan_run
from ppafo.walking import list_walks, load_walk
from tests.built_once import shared_library

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")

WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
DRAWS = 5
SPREAD = (0.9, 1.1)
"""Smallest and largest factor on a setting of a draw; one that is 0 stays 0, as another program would be needed."""
Values = dict[str, float]
Samples = np.ndarray[Any, np.dtype[np.float64]]
SEEN = ("sensors.force_noise=5 N", "sensors.angle_bandwidth=40 Hz", "sensors.pressure_noise=0.1 psi_d")
THERMAL = (
    *("gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=50 W/(m^2 K)"),
    "gas_model.wall_area_per_volume=100 1/m",
)
SLOW = ("valve.spool_frequency=30 Hz", "valve.slew_limit=20 1/s")
EVERYTHING = (*SEEN, *THERMAL, *SLOW, "controller.rate=330 Hz", "run.step=0.4 ms")
ACTUATORS = Path(__file__).parents[2] / "actuators"
OF_ANOTHER_KIND = (
    ("device.set=cylinder-lever", *THERMAL),
    (f"device.set={ACTUATORS / 'measured-bladder.toml'}", *SEEN),
)
"""A cylinder, whose chambers no pressure widens, with gas that warms, and a bladder, with noise."""
VARIED: tuple[tuple[str, tuple[str, ...]], ...] = (
    *((name, ()) for name in list_walks()),
    ("proportional-regulators", EVERYTHING),
    *(("proportional", of_kind) for of_kind in OF_ANOTHER_KIND),
)
"""Every shipped walk, one with all further features (noisy sensors, thermal gas, slow valve), and
other actuators."""


@functools.cache
def exported(name: str, overrides: tuple[str, ...] = ()) -> tuple[Library, dict[str, bytes]]:
    """The library of a walk, and its files, composed once for all tests."""
    item = library_of(load_walk(name, overrides))
    return item, library_files(item)


def written(name: str, overrides: tuple[str, ...], folder: Path) -> str:
    """Write the library of a walk; its name in C."""
    item, files = exported(name, overrides)
    for file, content in files.items():
        (folder / file).write_bytes(content)
    return item.name


def built(name: str, overrides: tuple[str, ...], folder: Path) -> ctypes.CDLL:
    """The library of a walk, with the function from settings to numbers to be called from outside.

    Its own calls stay inside of it: other libraries have functions of these names too.
    """
    source = folder / f"{written(name, overrides, folder)}.c"
    flags = ("-O0", "-ffp-contract=off", "-Dstatic=", "-Wl,-Bsymbolic", "-w")
    return ctypes.CDLL(str(shared_library(source, *flags)))


def handed(values: Any) -> Any:
    """Numbers where C has a struct of them."""
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def drawn(settings: tuple[ExportParameter, ...], draw: np.random.Generator) -> Values:
    """Settings of one draw, by path."""
    values = {
        item.path: float(np.clip(item.value * draw.uniform(*SPREAD), item.quantity.minimum, item.quantity.maximum))
        for item in settings
    }
    values["sensors.seed"] = float(draw.integers(1, 1000))
    values["run.duration"] = float(draw.uniform(0.5, 2.0))
    values["run.output_interval"] = float(draw.choice([0.1, 1.0, 2.6]) * values["run.output_interval"])
    longest = next(item.quantity.maximum for item in settings if item.path == "run.step")
    values["run.step"] = float(np.clip(draw.choice([0.3, 1.0, 1.4]) * values["run.step"], 1e-6, min(longest, 0.01)))
    return values


def as_overrides(settings: tuple[ExportParameter, ...], values: Values) -> list[str]:
    """The same as overrides of a walk file; what a walk file has no word for is left out."""
    unwritten = {"run.duration", "run.output_interval"}
    given = {item.path: (item.quantity.unit, values[item.path]) for item in settings if item.path not in unwritten}
    return [
        f"{path}={int(value) if path == 'sensors.seed' else repr(value)} {unit}".strip()
        for path, (unit, value) in given.items()
    ]


def numbers_in_c(library: ctypes.CDLL, values: Values, rows: tuple[int, int]) -> tuple[Any, Any, Any]:
    """Parameters, states and counts that the library makes of settings."""
    settings = np.array(list(values.values()))
    parameters, states, counts = np.zeros(rows[0]), np.zeros(rows[1]), np.zeros(6)
    library.prepare(*map(handed, (settings, parameters, states, counts)))
    return parameters, states, counts


@functools.cache
def batches(name: str, overrides: tuple[str, ...]) -> list[tuple[Values, Batch]]:
    """Settings as they are, then drawn ones, each with what Python plans of them."""
    settings = exported(name, overrides)[0].settings
    draw = np.random.default_rng(15)
    kinds = [text for text in overrides if "kind=" in text or text.startswith("device.set")]
    values = {item.path: item.value for item in settings}
    found: list[tuple[Values, Batch]] = []
    while len(found) < DRAWS:
        try:
            walked = load_walk(name, [*kinds, *as_overrides(settings, values)])
        except (ScenarioError, ParameterError):
            pass  # settings that contradict each other
        else:
            plan = replace(
                walked,
                run=replace(walked.run, duration=values["run.duration"], output_interval=values["run.output_interval"]),
            )
            found.append((values, batch_of(plan_run(plan))))
        values = drawn(settings, draw)
    return found


@pytest.mark.parametrize(("name", "overrides"), VARIED)
def test_c_makes_the_numbers_of_a_walk_that_python_makes(name: str, overrides: tuple[str, ...], tmp_path: Path) -> None:
    library = built(name, overrides, tmp_path)
    for values, batch in batches(name, overrides):
        parameters, states, counts = numbers_in_c(library, values, (len(batch.parameters), len(batch.states)))
        assert parameters.tobytes() == batch.parameters[:, 0].tobytes()
        assert states.tobytes() == batch.states[:, 0].tobytes()
        clock = batch.clock
        delays = clock.signal_delay, clock.command_delay
        assert counts.tolist() == [clock.record_every, clock.step_count, clock.steps_per_sample, *delays, 0.0]


def shown(folder: Path, name: str, *command: str) -> tuple[list[str], Samples, dict[str, float]]:
    """Names, samples and metrics that the example prints, built by a compiler with flags."""
    target = folder / "example"
    sources = [str(folder / f"{name}.c"), str(folder / "main.c")]
    subprocess.run([*command, *WARNINGS, "-ffp-contract=off", *sources, "-o", str(target), "-lm"], check=True)
    done = subprocess.run([str(target)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    found = dict(re.findall(r"^# (\w+)(?: = (\S+)|: none here)", done.stdout, re.MULTILINE))
    samples = np.array([list(map(float, line.split(","))) for line in lines[1:] if not line.startswith("#")])
    return lines[0].split(","), samples, {key: float(value or "nan") for key, value in found.items()}


def shortened(walk_name: str, overrides: tuple[str, ...], folder: Path, seconds: float) -> str:
    """Write the library of a walk with an example that lasts some seconds; its name in C."""
    name = written(walk_name, overrides, folder)
    main = folder / "main.c"
    text, changes = re.subn(
        r"(_defaults\(&settings\);\n)", rf"\1    settings.run_duration = {seconds!r};\n", main.read_text()
    )
    assert changes == 1
    main.write_text(text)
    return name


def test_a_walk_of_every_feature_is_clean_under_the_sanitizers_and_the_same_in_c_plus_plus(tmp_path: Path) -> None:
    name = shortened("proportional-regulators", EVERYTHING, tmp_path, 1.0)
    checked = ("gcc", "-std=c99", "-O0", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
    first = shown(tmp_path, name, *checked)
    assert len(first[1]) > 300
    if shutil.which("g++"):
        again = shown(tmp_path, name, "g++", "-O0")
        assert (again[0], again[1].tobytes()) == (first[0], first[1].tobytes())


CONTRADICTING = {"wearer_body_mass": 1.0, "controller_unload_threshold": 70.0, "controller_peak_time": 0.39}


@pytest.mark.parametrize(
    ("overrides", "refused"),
    [
        ((), {**CONTRADICTING, "sensors_force_noise": 5.0}),
        (OF_ANOTHER_KIND[0], {"actuator_rod_diameter": 0.5}),
        (OF_ANOTHER_KIND[1], {"actuator_angle_max": 2.5, "supply_pressure": 2.0e5}),
    ],
)
def test_a_setting_that_contradicts_another_is_refused_by_name_and_a_flaw_needs_other_functions(
    overrides: tuple[str, ...], refused: dict[str, float], tmp_path: Path
) -> None:
    library = built("proportional", overrides, tmp_path)
    names = [item.name for item in exported("proportional", overrides)[0].settings]
    settings = (ctypes.c_double * len(names))()
    library.proportional_defaults(settings)
    library.proportional_bad_setting.restype = ctypes.c_char_p
    library.proportional_size.restype = ctypes.c_size_t
    assert library.proportional_size(settings) > 0
    for name, value in refused.items():
        changed = (ctypes.c_double * len(names))(*settings)
        changed[names.index(name)] = value
        assert library.proportional_bad_setting(changed) == name.encode()
        assert library.proportional_size(changed) == 0
