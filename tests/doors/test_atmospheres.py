"""A gauge pressure counts from the atmosphere of its run in every door, whichever number it is."""

import ctypes
import shutil
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest

from ppafo.engine.run import batch_of
from ppafo.exports.c_library import c_library, library_of
from ppafo.exports.c_library.library import c_identifier
from ppafo.exports.fmu.interface import closed_loop
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.loading import load_scenario, reloaded
from ppafo.running import simulate
from ppafo.simulation.ensemble.planning import check_columns, plan_ensemble
from ppafo.simulation.numbers import declared_numbers, number_at
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.studies.loading import load_study
from ppafo.study.blocks import drawn_values, varied_columns
from scripts.instances import Instance
from tests.built_once import shared_library
from tests.doors.of_python import Floats

ATMOSPHERE = "supply.atmospheric_pressure"
ROOM = "93 kPa_a"
SAMPLES = 30
BASES = {
    "regulators": (
        "cylinder-servo",
        ("device.valve=pressure_regulator", "initial.pressure_1=0.6 bar_g", "initial.pressure_2=0.3 bar_g"),
    ),
    "beliefs": (
        "torque-task-proportional",
        ("controller.kind=feedback_linearisation", "supply.dorsiflexion_pressure=40 psi_g"),
    ),
    "reference": ("pressure-loop", ("reference.start_level=0.2 bar_g",)),
}
pytestmark = [
    pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine"),
    pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone"),
    pytest.mark.usefixtures("quick_units"),
]


@dataclass(frozen=True)
class Varied:
    """A scenario whose atmosphere changes, and with it one of its pressures or none: its texts by path."""

    name: str
    texts: tuple[str, ...]
    given: dict[str, str]

    @cached_property
    def base(self) -> Scenario:
        """The scenario without the changes."""
        return load_scenario(self.name, self.texts)

    @cached_property
    def single(self) -> Scenario:
        """The scenario with the changes."""
        return reloaded(self.base, [f"{path}={text}" for path, text in self.given.items()])

    @cached_property
    def columns(self) -> dict[str, Floats]:
        """Numbers [SI] of the only row of a study that varies the same."""
        vary = [{"path": path, "kind": "list", "values": [text]} for path, text in self.given.items()]
        kept = [text for text in self.texts if text.partition("=")[0] not in self.given]
        configuration = {"name": "one", "scenario": self.name, "overrides": kept}
        document = {"schema_version": 1, "name": "rooms", "configurations": [configuration], "vary": vary}
        study = load_study({**document, "outputs": {"metrics": ["gas_supplied"]}})
        columns = varied_columns(study, study.configurations[0], drawn_values(study, np.arange(1)))
        found = check_columns(self.base, columns, study.gauge).values
        assert set(self.given) <= set(found)
        return dict(found)


def each_of(name: str) -> list[Varied]:
    """The atmosphere alone, then with each absolute pressure of a base, given as gauge pressure."""
    file, texts = BASES[name]
    base = load_scenario(file, texts)
    room = number_at(base, ATMOSPHERE)
    paths = [path for path, item in declared_numbers(base).items() if item.unit == "Pa_a" and path != ATMOSPHERE]
    levels = {path: f"{(number_at(base, path) - room) * 0.97e-5 + 0.013:.4f} bar_g" for path in paths}
    assert {path.partition(".")[0] for path in paths} >= {"supply", "initial"}
    return [Varied(file, texts, {ATMOSPHERE: ROOM, **more}) for more in ({}, *({path: levels[path]} for path in paths))]


@pytest.mark.parametrize("name", BASES)
def test_a_row_has_the_numbers_of_the_single_run(name: str) -> None:
    for varied in each_of(name):
        plan = plan_ensemble(check_columns(varied.base, varied.columns))
        assert not plan.reasons, (varied.given, plan.reasons)
        ((_, row),) = plan.batches
        alone = batch_of(plan_run(varied.single))
        np.testing.assert_array_equal(row.parameters, alone.parameters, err_msg=str(varied.given))
        np.testing.assert_array_equal(row.states, alone.states, err_msg=str(varied.given))


@pytest.mark.parametrize("name", BASES)
def test_a_library_and_a_unit_have_the_bits_of_the_single_run(name: str, tmp_path: Path) -> None:
    first, *_ = each = each_of(name)
    for file, content in c_library(first.base).items():
        (tmp_path / file).write_bytes(content)
    own = c_identifier(first.base.name)
    exported = library_of(first.base)
    library = ctypes.CDLL(str(shared_library(tmp_path / f"{own}.c", "-O0", "-ffp-contract=off")))
    library[f"{own}_size"].restype = ctypes.c_size_t
    ((file, content),) = functional_unit(closed_loop(first.base), 2, ["linux64"]).items()
    (tmp_path / file).write_bytes(content)
    for varied in each:
        recording = simulate(varied.single).recording
        given = {path: float(varied.columns[path][0]) for path in varied.given}
        settings = (ctypes.c_double * len(exported.settings))()
        library[f"{own}_defaults"](settings)
        for place, setting in enumerate(exported.settings):
            settings[place] = given.get(setting.path, settings[place])
        memory = (ctypes.c_double * (library[f"{own}_size"](settings) // 8 + 1))()
        library[f"{own}_initialise"](memory, settings)
        unit = Instance(str(tmp_path / file), given)
        outputs = np.zeros(1 + len(exported.program.outputs))
        for sample in range(1, SAMPLES):
            library[f"{own}_step"](memory)
            unit.go_to(float(recording.time[sample]))
        library[f"{own}_step"](memory)
        library[f"{own}_read_outputs"](memory, ctypes.c_void_p(outputs.ctypes.data))
        expected = [recording[channel][SAMPLES - 1] for channel in exported.program.outputs]
        assert outputs[1:].tolist() == expected, varied.given
        assert [unit.get(channel) for channel in exported.program.outputs] == expected, varied.given
        unit.close()
