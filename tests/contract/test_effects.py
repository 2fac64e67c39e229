"""The effect of the page, one file of another package and one entry point: every door knows it by that."""

import ctypes
import importlib.util
import shutil
from collections.abc import Iterator, Mapping, Sequence
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
from ppafo.errors import SimulationError
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.files import library_files
from ppafo.exports.c_library.library import COUNTS, c_identifier
from ppafo.exports.fmu.interface import closed_loop
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.identification.trajectory.experiment import declaration_of
from ppafo.identification.trajectory.experiment import with_numbers as with_fitted
from ppafo.model.catalog import EFFECTS
from ppafo.parameters.building import build_device
from ppafo.parameters.loading import json_schema, parse_parameter_set
from ppafo.running import simulate
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.walking import load_walk
from ppafo.walking.walk import walk
from tests.built_once import shared_library
from tests.page_code import with_the_effect_of_the_page
from tests.reference.reference_solver import compare_with_reference

GROWTH = "effects.ice.blockage_per_gas"
ICE = (f"{GROWTH}=3e4 1/kg", "effects.ice.melting_time=30 ms")
NAME, SHORT = "step-response", ("run.duration=0.3 s",)
BOTTLE = "bottle.name=paper-co2-9oz"
LINE = "effects.line_resistance.area=4 mm^2"
MEANING = "blockage per gas that leaves, 0 for none"


@pytest.fixture(autouse=True)
def _installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The package of the page, as an installer leaves it."""
    yield from with_the_effect_of_the_page(tmp_path / "site", monkeypatch)


BEFORE: Mapping[tuple[str, tuple[str, ...]], Mapping[str, str]] = {
    (NAME, SHORT): {
        "angle": "0x1.6d8e32c9b3a63p+8",
        "pressure_1": "0x1.f9cb29e2d43e9p+26",
        "pressure_2": "0x1.6ec98c81c808ap+26",
        "vented_mass": "0x1.2f81f29c8ea8ap-4",
    },
    ("torque-task-solenoid", ("motion.kind=free", "run.duration=0.5 s")): {
        "angle": "0x1.eeba0507dc7b2p+9",
        "pressure_1": "0x1.1788a4dc01e3ep+27",
        "pressure_2": "0x1.c52be3b7a47c4p+26",
        "vented_mass": "0x1.0703c8419858dp-4",
    },
}
"""Sums over recordings of runs with ice [SI], from the version of the package that had this effect built in."""


@pytest.mark.parametrize(("name", "texts"), BEFORE)
def test_the_file_of_the_page_has_the_numbers_of_the_effect_that_the_package_had(
    name: str, texts: tuple[str, ...]
) -> None:
    found = simulate(load_scenario(name, (*texts, *ICE))).recording
    assert {channel: float(found[channel].sum()).hex() for channel in BEFORE[name, texts]} == BEFORE[name, texts]


def slower(iced: Any, without: Any) -> bool:
    """Whether chamber 2 keeps its pressure for longer than without."""
    return bool(np.abs(iced.recording["pressure_2"] - without.recording["pressure_2"]).max() > 1.0e3)


def test_it_is_set_as_any_number_is_and_found_only_then() -> None:
    without = simulate(load_scenario(NAME, SHORT))
    assert "ice" not in tuple(EFFECTS)
    scenario = load_scenario(NAME, (*SHORT, *ICE))
    assert scenario.device.effects["ice"] == {"blockage_per_gas": pytest.approx(3e4), "melting_time": 0.03}
    assert slower(simulate(scenario), without)


def test_switched_off_it_leaves_every_bit_and_the_program_as_they_were() -> None:
    without = load_scenario(NAME, SHORT)
    off = load_scenario(NAME, (*SHORT, f"{GROWTH}=0 1/kg"))
    assert batch_of(plan_run(off)).program == batch_of(plan_run(without)).program
    np.testing.assert_array_equal(simulate(off).recording["torque"], simulate(without).recording["torque"])


def test_a_wrong_setting_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    for text, said in (
        (f"{GROWTH}=-1 1/kg", f"must be at least 0 1/kg and at most 1e+06 1/kg ({MEANING})"),
        ("effects.ice.blockage=1 1/kg", f"did you mean '{GROWTH}'?"),
        ("effects.icy.blockage_per_gas=1 1/kg", "no effect 'icy', did you mean 'ice'?"),
        ("effects.ices:EFFECT.melting_time=1 s", "an effect is found by its entry point 'ppafo.effects' alone"),
        (f"{GROWTH}=1 mm", "unit 'mm' does not fit"),
    ):
        assert main(["simulate", "torque-task-solenoid", "--set", text]) == 2
        assert said in capsys.readouterr().err


def test_a_column_of_it_has_the_bits_of_the_single_runs_and_splits_where_it_is_off() -> None:
    rates = np.array([0.0, 1e4, 0.0, 3e4])
    base = load_scenario(NAME, (*SHORT, ICE[1]))
    found = run_ensemble(base, {GROWTH: rates}, ["gas_vented"])
    for rate, gas in zip(rates, found.metrics["gas_vented"], strict=True):
        alone = simulate(load_scenario(NAME, (*SHORT, ICE[1], f"{GROWTH}={float(rate)!r} 1/kg")))
        assert gas == alone.metrics["gas_vented"].value
    assert len(set(found.metrics["gas_vented"])) == 3


def test_the_schema_has_it_and_a_set_file_may_give_it() -> None:
    assert MEANING in str(json_schema())
    shipped = (files("ppafo.parameters") / "sets" / "ppafo2011.toml").read_text(encoding="utf-8")
    given = f'[{GROWTH}]\nvalue = 0.3\nunit = "1/g"\norigin = "assumed"\nsource = "a trial"\n'
    device = build_device(parse_parameter_set(f"{shipped}\n{given}".encode(), "mine.toml"))
    assert device.effects["ice"]["blockage_per_gas"] == pytest.approx(300.0)


def test_it_can_be_fitted() -> None:
    scenario = load_scenario(NAME, (*SHORT, *ICE))
    assert declaration_of(GROWTH, scenario).unit == "1/kg"
    *_, row = plan_run(with_fitted(scenario, {GROWTH: 6e4})).effects
    assert row.blockage_per_gas == pytest.approx(2.0 * plan_run(scenario).effects[-1].blockage_per_gas)


def test_the_reference_solver_has_the_same_law() -> None:
    for name, motion in (("torque-task-solenoid", "motion.kind=free"), ("step-response", "valve.area=12 mm^2")):
        agreement = compare_with_reference(plan_run(load_scenario(name, ("run.duration=0.3 s", motion, *ICE))))
        assert agreement.angle < 2e-4
        assert agreement.worst_pressure < 1e-3


def test_a_linear_model_refuses_an_effect_with_a_state_in_one_line() -> None:
    with pytest.raises(SimulationError, match=r"effect 'ice' has state variables, .*switch the effect off"):
        linearise("torque-task-proportional", at=0.2, overrides=("run.duration=0.3 s", *ICE))


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
@pytest.mark.parametrize("name", [NAME, "proportional"])
def test_an_exported_library_makes_the_numbers_of_a_run_that_python_makes(name: str, tmp_path: Path) -> None:
    is_walk = name == "proportional"
    walked: Any = load_walk("proportional", list(ICE)) if is_walk else load_scenario(name, (*SHORT, *ICE))
    library = library_of(walked)
    places = {item.path: place for place, item in enumerate(library.settings)}
    assert {GROWTH, "effects.ice.melting_time"} <= set(places)
    assert not any(path.startswith("effects.stribeck.") for path in places)
    for file, content in library_files(library).items():
        (tmp_path / file).write_bytes(content)
    source = tmp_path / f"{c_identifier(walked.name)}.c"
    built = ctypes.CDLL(str(shared_library(source, "-O0", "-ffp-contract=off", "-Dstatic=", "-Wl,-Bsymbolic", "-w")))
    batch = batch_of(plan_run(walked))
    settings = np.array([item.value for item in library.settings])
    # An exported walk has the states of a meter too, which a run in Python does without.
    found, states = np.zeros(len(batch.parameters)), np.zeros(2 * len(batch.states))
    counts = np.zeros(len(COUNTS))
    built.prepare(*map(handed, (settings, found, states, counts)))
    assert found.tobytes() == batch.parameters[:, 0].tobytes()


def handed(values: Any) -> Any:
    """Numbers where C has a struct of them."""
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


@pytest.mark.skipif(
    importlib.util.find_spec("fmpy") is None or host_platform() != "linux64", reason="needs FMPy on linux64"
)
def test_a_unit_has_its_settings_and_the_bits_of_python(tmp_path: Path) -> None:
    fmpy = importlib.import_module("fmpy")
    scenario = load_scenario(NAME, (*SHORT, *ICE))
    ((file, content),) = functional_unit(closed_loop(scenario), 2, ["linux64"]).items()
    (tmp_path / file).write_bytes(content)
    moved = simulate(load_scenario(NAME, (*SHORT, f"{GROWTH}=10000.0 1/kg", ICE[1])))
    given = {
        "stop_time": scenario.run.duration,
        "step_size": scenario.run.output_interval,
        "start_values": {GROWTH: 1e4},
    }
    found = fmpy.simulate_fmu(
        str(tmp_path / file), output=["torque", "mass_1"], output_interval=scenario.run.output_interval, **given
    )
    for name in ("torque", "mass_1"):
        np.testing.assert_array_equal(found[name], moved.recording[name])


def test_it_walks() -> None:
    without, iced = (walk(load_walk("proportional", texts), minutes=0.1) for texts in ((), ICE))
    assert iced.status.is_completed
    assert slower(iced, without)


def test_an_effect_walks_on_a_bottle_and_follows_the_temperature_of_its_gas(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[dict[str, float]] = []
    names = list(row_numbers(plan_run(load_walk("proportional", [LINE, BOTTLE])).program.parameter_rows()))
    passed_on = LaneBlock.set_parameters

    def watched(self: LaneBlock, rows: Sequence[int], values: Any) -> None:
        given.append(dict(zip([names[row] for row in rows], values, strict=True)))
        passed_on(self, rows, values)

    monkeypatch.setattr(LaneBlock, "set_parameters", watched)
    narrow = walk(load_walk("proportional", [LINE, BOTTLE]), minutes=0.1)
    assert narrow.status.is_completed
    assert narrow.supply is not None
    warmth = narrow.supply.values["gas_temperature"]
    assert warmth.min() < 0.995 * warmth[0]
    resistances = np.array([row["line_resistance.resistance"] for row in given])
    np.testing.assert_allclose(resistances / resistances[0], warmth[: len(given)] / warmth[0], rtol=1e-12)
    assert slower(narrow, walk(load_walk("proportional", [BOTTLE]), minutes=0.1))
