"""The closed loop as others run it: a program in C under the sanitizers, and units of FMI 2 and 3 in FMPy."""

import functools
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import library_files
from ppafo.exports.fmu import unit
from ppafo.exports.fmu.interface import closed_loop
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from scripts.instances import Instance
from tests.doors.of_python import (
    Floats,
    assert_near_metrics,
    assert_same_channels,
    environment,
    parameter,
    parameters,
    python_answer,
    scenario_of,
)
from tests.doors.table import EXPORTED, Case

pytest.importorskip("fmpy", reason="FMPy is not installed (pip install -e .[dev])")
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
# Without optimisation gcc is quickest, and strict arithmetic has the same bits.
BUILT = ("gcc", "-std=c99", "-O0", "-ffp-contract=off", *WARNINGS, *SANITIZED)


@functools.cache
def files_of(case: Case) -> dict[str, bytes]:
    """The files of the library of a case, which its units hold too."""
    return library_files(library_of(scenario_of(case)))


@pytest.fixture
def _of_one_text(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let units hold the text that was written for the library."""
    monkeypatch.setattr(unit, "library_files", lambda _library: files_of(case))


def printed(folder: Path, files: dict[str, bytes]) -> tuple[dict[str, Floats], dict[str, float]]:
    """Channels and metrics that the example of a library prints, built with every warning and sanitizer."""
    for name, content in files.items():
        (folder / name).write_bytes(content)
    # The comparison with Python's numbers that comes along is a program of its own.
    sources = [str(folder / name) for name in files if name.endswith(".c") and name != "check.c"]
    program = folder / "example"
    built = subprocess.run([*BUILT, *sources, "-o", str(program), "-lm"], capture_output=True, text=True, check=False)
    assert (built.returncode, built.stderr) == (0, "")
    done = subprocess.run([str(program)], capture_output=True, text=True, check=False, env=environment())
    assert (done.returncode, done.stderr) == (0, "")
    head, *lines = (line for line in done.stdout.splitlines() if not line.startswith("#"))
    columns = np.array([line.split(",") for line in lines], dtype=np.float64).T
    metrics = dict(re.findall(r"^# (\w+)(?: = (\S+)|: none here)", done.stdout, re.MULTILINE))
    channels = dict(zip(head.split(","), columns, strict=True))
    return channels, {name: float(value or "nan") for name, value in metrics.items()}


@pytest.mark.short
@needs_gcc
@pytest.mark.parametrize("case", parameters(EXPORTED))
def test_a_program_in_c_has_the_bits_of_python(case: Case, tmp_path: Path) -> None:
    answer = python_answer(case)
    channels, metrics = printed(tmp_path, files_of(case))
    assert channels["time"].tobytes() == answer.time.tobytes()
    assert_same_channels(channels, answer)
    assert_near_metrics(metrics, answer)


def stepped(file: str, samples: Floats) -> tuple[dict[str, Floats], dict[str, float]]:
    """Outputs of a unit in FMPy at the times of samples, and its metrics at the last of them."""
    instance = Instance(file)
    variables = [item for item in instance.description.modelVariables if item.type != "Clock"]
    metrics = [item.name for item in variables if item.name.startswith("metrics.")]
    names = [item.name for item in variables if item.causality == "output" and item.name not in metrics]

    def read(wanted: list[str]) -> list[float]:
        numbers = [instance.numbers[name] for name in wanted]
        return list((instance.slave.getFloat64 if instance.is_of_fmi_3 else instance.slave.getReal)(numbers))

    rows = []
    for number, time in enumerate(samples.tolist()):
        if number:
            instance.go_to(time)
        rows.append(read(names))
    of_run = dict(zip([name.removeprefix("metrics.") for name in metrics], read(metrics), strict=True))
    instance.close()
    return dict(zip(names, np.array(rows).T, strict=True)), of_run


def of_a_version() -> list[Any]:
    """Every case with one version of FMI, in turn."""
    return [parameter(case, 2 + number % 2) for number, case in enumerate(EXPORTED)]


@pytest.mark.short
@needs_gcc
@pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone")
@pytest.mark.usefixtures("quick_units", "_of_one_text")
@pytest.mark.parametrize(("case", "fmi"), of_a_version())
def test_a_unit_has_the_bits_of_python(case: Case, fmi: int, tmp_path: Path) -> None:
    answer = python_answer(case)
    ((name, content),) = functional_unit(closed_loop(scenario_of(case)), fmi, ["linux64"]).items()
    (tmp_path / name).write_bytes(content)
    channels, metrics = stepped(str(tmp_path / name), answer.time)
    assert_same_channels(channels, answer)
    assert_near_metrics(metrics, answer)
