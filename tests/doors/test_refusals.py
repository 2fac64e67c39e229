"""What cannot be run or exported is refused by every door, by the same name."""

import ctypes
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import PpafoError
from ppafo.exports.c_library import c_library, library_of
from ppafo.exports.c_library.library import c_identifier
from ppafo.exports.fmu.interface import closed_loop
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.loading import load_scenario
from ppafo.simulation.ensemble import REFUSED as REFUSED_RUN
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.numbers import declared_numbers
from scripts.instances import Instance
from tests.built_once import shared_library
from tests.doors.table import NOT_EXPORTED, REFUSED, VANE_BASE

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
refused = pytest.mark.parametrize(("path", "value", "named"), REFUSED, ids=[path for path, _, _ in REFUSED])


@refused
def test_a_file_and_an_ensemble_refuse_a_run_by_the_same_name(path: str, value: float, named: str) -> None:
    unit = declared_numbers(load_scenario(VANE_BASE))[path].unit
    name = re.escape(named).replace("valve", r"(valve|valves\.proportional)")
    with pytest.raises(PpafoError, match=rf"^[^\n]*{name} ?=[^\n]*$"):
        load_scenario(VANE_BASE, [f"{path}={value!r} {unit}"])
    found = run_ensemble(load_scenario(VANE_BASE), {path: np.array([value])}, ["peak_torque"])
    assert found.status.tolist() == [REFUSED_RUN]
    assert re.search(rf"{re.escape(named)} ?=", found.reasons[0])


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The library in C."""
    folder = tmp_path_factory.mktemp("library")
    for name, content in c_library(load_scenario(VANE_BASE)).items():
        (folder / name).write_bytes(content)
    return ctypes.CDLL(str(shared_library(folder / f"{c_identifier(VANE_BASE)}.c", "-O0", "-ffp-contract=off")))


@needs_gcc
@refused
def test_a_library_names_the_setting_that_python_names(
    library: ctypes.CDLL, path: str, value: float, named: str
) -> None:
    own = c_identifier(VANE_BASE)
    names = [setting.path for setting in library_of(load_scenario(VANE_BASE)).settings]
    settings = (ctypes.c_double * len(names))()
    library[f"{own}_defaults"](settings)
    settings[names.index(path)] = value
    bad = library[f"{own}_bad_setting"]
    bad.restype = ctypes.c_char_p
    assert bad(settings).decode() == c_identifier(named)


@pytest.fixture(scope="module")
def unit(quick_units: None, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The unit of FMI 2."""
    ((name, content),) = functional_unit(closed_loop(load_scenario(VANE_BASE)), 2, ["linux64"]).items()
    file = tmp_path_factory.mktemp("unit") / name
    file.write_bytes(content)
    return str(file)


@pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone")
@refused
def test_a_unit_names_the_parameter_that_python_names(
    unit: str, path: str, value: float, named: str, capfd: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("fmpy", reason="FMPy is not installed (pip install -e .[dev])")
    with pytest.raises(Exception, match="ExitInitializationMode"):
        Instance(unit, {path: value})
    refusal = capfd.readouterr().out
    assert named in refusal
    assert re.search(r"= .+ (is out of range: (at least|at most|above) .|contradicts another parameter)", refusal)


@pytest.mark.parametrize("what", NOT_EXPORTED)
def test_what_does_not_leave_python_is_refused_by_every_export_in_the_same_words(what: str, tmp_path: Path) -> None:
    scenario = NOT_EXPORTED[what].load()
    said = set()
    for door in (c_library, closed_loop):
        with pytest.raises(PpafoError) as refusal:
            door(scenario)
        said.add(str(refusal.value))
    (line,) = said
    assert line.startswith(f"{scenario.name}: ")
    assert "\n" not in line
