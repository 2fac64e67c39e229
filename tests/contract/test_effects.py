"""An effect of another package is one file and one entry point: every door knows it by that."""

import ctypes
import importlib.util
import shutil
import sys
from collections.abc import Iterator, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.analyses.linearise.question import linearise
from ppafo.cli.main import main
from ppafo.engine.lanes import LaneBlock
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import batch_of
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.exported import COUNTS
from ppafo.exports.c_library.files import library_files
from ppafo.exports.c_library.library import c_identifier
from ppafo.exports.fmu.interface import closed_loop
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.identification.trajectory.numbers import declaration_of
from ppafo.identification.trajectory.numbers import with_numbers as with_fitted
from ppafo.model.catalog import EFFECTS
from ppafo.page.wasm import module_of
from ppafo.parameters.building import build_device
from ppafo.parameters.loading import json_schema, parse_parameter_set
from ppafo.report.setting_names import setting_names
from ppafo.running import simulate
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.walking import load_walk
from ppafo.walking.planning import plan_walk
from ppafo.walking.walk import walk
from tests.built_once import shared_library
from tests.modules_under_node import compared, drawn
from tests.page_code import block_with, write_package
from tests.reference.reference_solver import compare_with_reference

AREA = "effects.mesh.area"
NARROW = f"{AREA}=4 mm^2"
NAME, SHORT = "step-response", ("run.duration=0.3 s",)
BOTTLE = "bottle.name=paper-co2-9oz"
ICE = ("effects.ice.blockage_per_gas=3e4 1/kg", "effects.ice.melting_time=30 ms")
REAL = "effects.second_virial.share=1"
PAGE = "how-to/extend.md"


@pytest.fixture(autouse=True)
def _forgotten() -> Iterator[None]:
    known, modules = set(EFFECTS), set(sys.modules)
    yield
    for name in set(EFFECTS) - known:
        del EFFECTS[name]
    for name in set(sys.modules) - modules:
        if name.split(".")[0] == "my_effects":
            del sys.modules[name]


@pytest.fixture(autouse=True)
def _installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The package of the page, as an installer leaves it."""
    module, entry_points = block_with(PAGE, "EFFECT = Effect"), block_with(PAGE, "ppafo.effects")
    write_package(tmp_path / "site", "my_effects.mesh", module, entry_points)
    monkeypatch.syspath_prepend(tmp_path / "site")


def slower(with_mesh: Any, without: Any) -> bool:
    """Whether chamber 2 keeps its pressure for longer than without."""
    return bool(np.abs(with_mesh.recording["pressure_2"] - without.recording["pressure_2"]).max() > 1.0e3)


def test_it_is_set_as_any_number_is_and_found_only_then() -> None:
    without = simulate(load_scenario(NAME, SHORT))
    assert "mesh" not in tuple(EFFECTS)
    scenario = load_scenario(NAME, (*SHORT, NARROW))
    assert scenario.device.effects["mesh"] == {"area": pytest.approx(4e-6), "discharge_coefficient": 0.6}
    assert slower(simulate(scenario), without)


def test_switched_off_it_leaves_every_bit_and_the_program_as_they_were() -> None:
    without = load_scenario(NAME, SHORT)
    off = load_scenario(NAME, (*SHORT, f"{AREA}=0 mm^2"))
    assert batch_of(plan_run(off)).program == batch_of(plan_run(without)).program
    np.testing.assert_array_equal(simulate(off).recording["torque"], simulate(without).recording["torque"])


def test_a_wrong_setting_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    for text, said in (
        (
            f"{AREA}=-1 mm^2",
            "effects.mesh.area = -1 mm^2: must be at least 0 mm^2 and at most 10000 mm^2 (open area of the mesh, 0 for "
            "none)",
        ),
        ("effects.mesh.aera=1 mm^2", "did you mean 'effects.mesh.area'?"),
        ("effects.mash.area=1 mm^2", "no effect 'mash', did you mean 'mesh'?"),
        ("effects.meshes:EFFECT.area=1 mm^2", "an effect is found by its entry point 'ppafo.effects' alone"),
        (f"{AREA}=1 mm", "unit 'mm' does not fit"),
    ):
        assert main(["simulate", "torque-task-solenoid", "--set", text]) == 2
        assert said in capsys.readouterr().err


def test_a_column_of_it_has_the_bits_of_the_single_runs_and_splits_where_it_is_off() -> None:
    areas = np.array([0.0, 4e-6, 0.0, 9e-6])
    base = load_scenario(NAME, SHORT)
    found = run_ensemble(base, {AREA: areas}, ["gas_vented"])
    for area, gas in zip(areas, found.metrics["gas_vented"], strict=True):
        alone = simulate(load_scenario(NAME, (*SHORT, f"{AREA}={float(area)!r} m^2")))
        assert gas == alone.metrics["gas_vented"].value
    assert len(set(found.metrics["gas_vented"])) == 3


def test_the_schema_has_it_and_a_set_file_may_give_it() -> None:
    assert "open area of the mesh, 0 for none" in str(json_schema())
    shipped = (files("ppafo.parameters") / "sets" / "ppafo2011.toml").read_text(encoding="utf-8")
    given = '[effects.mesh.area]\nvalue = 3.0\nunit = "mm^2"\norigin = "datasheet"\nsource = "catalogue"\n'
    device = build_device(parse_parameter_set(f"{shipped}\n{given}".encode(), "mine.toml"))
    assert device.effects["mesh"]["area"] == pytest.approx(3e-6)


def test_it_can_be_fitted() -> None:
    scenario = load_scenario(NAME, (*SHORT, NARROW))
    assert declaration_of(AREA, scenario).unit == "m^2"
    *_, row = plan_run(with_fitted(scenario, {AREA: 8e-6})).effects
    assert row.resistance == pytest.approx(plan_run(scenario).effects[-1].resistance / 4.0)


def test_the_reference_solver_has_the_same_law() -> None:
    for name, motion in (("torque-task-solenoid", "motion.kind=free"), ("step-response", "valve.area=12 mm^2")):
        agreement = compare_with_reference(plan_run(load_scenario(name, ("run.duration=0.3 s", motion, NARROW))))
        assert agreement.angle < 2e-4
        assert agreement.worst_pressure < 1e-3


def test_a_linear_model_has_it_as_a_difference_of_two_runs_has() -> None:
    venting = ("controller.kind=constant", "controller.command=-0.4", "run.duration=0.3 s")
    rates = [
        linearise("torque-task-proportional", at=0.2, overrides=(*venting, text)).found.rates
        for text in (f"{AREA}=0 mm^2", NARROW)
    ]
    step = ("run.step=0.01 ms", "run.output_interval=0.01 ms")
    found = simulate(load_scenario("torque-task-proportional", (*venting, NARROW, *step))).recording
    here = int(np.searchsorted(found.time, 0.2 - 1e-9))
    slope = (found["pressure_1"][here + 20] - found["pressure_1"][here - 20]) / (40 * 1e-5)
    assert rates[1][0] == pytest.approx(slope, rel=1e-3)
    assert rates[0][0] != pytest.approx(slope, rel=0.1)


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
@pytest.mark.parametrize("name", [NAME, "proportional"])
def test_an_exported_library_makes_the_numbers_of_a_run_that_python_makes(name: str, tmp_path: Path) -> None:
    is_walk = name == "proportional"
    walked: Any = (
        load_walk("proportional", [NARROW, *ICE, REAL])
        if is_walk
        else load_scenario(name, (*SHORT, NARROW, *ICE, REAL))
    )
    library = library_of(walked)
    places = {item.path: place for place, item in enumerate(library.settings)}
    assert {AREA, "effects.mesh.discharge_coefficient"} <= set(places)
    assert not any(path.startswith("effects.silencer.") for path in places)
    for file, content in library_files(library).items():
        (tmp_path / file).write_bytes(content)
    source = tmp_path / f"{c_identifier(walked.name)}.c"
    built = ctypes.CDLL(str(shared_library(source, "-O0", "-ffp-contract=off", "-Dstatic=", "-Wl,-Bsymbolic", "-w")))
    batch = batch_of(plan_walk(walked) if is_walk else plan_run(walked))
    settings = np.array([item.value for item in library.settings])
    # An exported walk has the states of a meter too, which a run in Python does without.
    found, states = np.zeros(len(batch.parameters)), np.zeros(2 * len(batch.states))
    counts = np.zeros(len(COUNTS))
    built.prepare(*map(handed, (settings, found, states, counts)))
    assert found.tobytes() == batch.parameters[:, 0].tobytes()
    rows = row_numbers(batch.program.state_rows())
    for path in ("masses.mass_1", "masses.mass_2"):
        assert batch.states[rows[path], 0] in states


def handed(values: Any) -> Any:
    """Numbers where C has a struct of them."""
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


@pytest.mark.skipif(
    importlib.util.find_spec("fmpy") is None or host_platform() != "linux64", reason="needs FMPy on linux64"
)
def test_a_unit_has_its_settings_and_the_bits_of_python(tmp_path: Path) -> None:
    fmpy = importlib.import_module("fmpy")
    scenario = load_scenario(NAME, (*SHORT, NARROW, REAL))
    ((file, content),) = functional_unit(closed_loop(scenario), 2, ["linux64"]).items()
    (tmp_path / file).write_bytes(content)
    moved = simulate(load_scenario(NAME, (*SHORT, f"{AREA}=7e-06 m^2", REAL)))
    given = {
        "stop_time": scenario.run.duration,
        "step_size": scenario.run.output_interval,
        "start_values": {AREA: 7e-6},
    }
    found = fmpy.simulate_fmu(
        str(tmp_path / file), output=["torque", "mass_1"], output_interval=scenario.run.output_interval, **given
    )
    for name in ("torque", "mass_1"):
        np.testing.assert_array_equal(found[name], moved.recording[name])


@pytest.mark.skipif(shutil.which("node") is None, reason="no node on this machine")
def test_the_page_has_its_words_and_the_bits_of_python() -> None:
    module = module_of(load_scenario(NAME, (*SHORT, NARROW, *ICE, REAL)))
    (entry,) = [item for item in module.description["settings"] if item["key"] == AREA]
    assert entry["description"] == "open area of the mesh, 0 for none"
    assert AREA not in setting_names(), "a page needs no words of its own for it"
    assert compared(NAME, module, drawn(module, 3))


def test_it_walks() -> None:
    texts = ((), (NARROW,), (NARROW, *ICE), (NARROW, *ICE, REAL))
    without, narrow, iced, real = (walk(load_walk("proportional", given), minutes=0.1) for given in texts)
    for one, other in ((narrow, without), (iced, narrow), (real, iced)):
        assert one.status.is_completed
        assert slower(one, other)


def test_it_walks_on_a_bottle_and_follows_the_temperature_of_its_gas(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[dict[str, float]] = []
    names = list(row_numbers(plan_walk(load_walk("proportional", [NARROW, BOTTLE])).program.parameter_rows()))
    passed_on = LaneBlock.set_parameters

    def watched(self: LaneBlock, rows: Sequence[int], values: Any) -> None:
        given.append(dict(zip([names[row] for row in rows], values, strict=True)))
        passed_on(self, rows, values)

    monkeypatch.setattr(LaneBlock, "set_parameters", watched)
    with_mesh = walk(load_walk("proportional", [NARROW, BOTTLE]), minutes=0.1)
    assert with_mesh.status.is_completed
    assert with_mesh.supply is not None
    warmth = with_mesh.supply.values["gas_temperature"]
    assert warmth.min() < 0.995 * warmth[0]
    resistances = np.array([row["mesh.resistance"] for row in given])
    np.testing.assert_allclose(resistances / resistances[0], warmth[: len(given)] / warmth[0], rtol=1e-12)
    assert slower(with_mesh, walk(load_walk("proportional", [BOTTLE]), minutes=0.1))
