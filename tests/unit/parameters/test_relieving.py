"""The key ``supply.relieving``: in files, overrides and scenarios, and the walls that it meets."""

from pathlib import Path

import pytest

import ppafo
from ppafo.errors import PpafoError
from ppafo.parameters import apply_overrides, build_device, load_parameter_set
from ppafo.parameters.loading import parameter_set_toml, parse_parameter_set
from ppafo.simulation.plan import plan_run

RELIEVING = "supply.relieving=true"


def test_supplies_let_gas_in_only_unless_the_set_says_otherwise() -> None:
    parameter_set = load_parameter_set("ppafo2011")
    assert not build_device(parameter_set).supply.relieving
    assert build_device(apply_overrides(parameter_set, [RELIEVING])).supply.relieving
    assert plan_run(ppafo.load_scenario("step-response")).plant.relieving == 0.0
    assert plan_run(ppafo.load_scenario("step-response", [RELIEVING])).plant.relieving == 1.0


def test_a_set_keeps_the_key_with_its_provenance_when_it_is_written_and_read() -> None:
    changed = apply_overrides(load_parameter_set("ppafo2011"), [RELIEVING])
    text = parameter_set_toml(changed)
    assert "[supply.relieving]\nvalue = true\norigin" in text
    again = parse_parameter_set(text.encode(), "again.toml")
    assert again.entries() == changed.entries()
    assert again.texts["supply.relieving"].note == "the set has no value"


@pytest.mark.parametrize("text", ["1", "yes", "True", "0.5 psi_g"])
def test_anything_but_true_or_false_is_refused(text: str) -> None:
    with pytest.raises(PpafoError, match=f"override 'supply.relieving={text}': must be true or false"):
        ppafo.load_scenario("step-response", [f"supply.relieving={text}"])


EMPTY = ("supply.pressure=0 psi_g", "supply.dorsiflexion_pressure=0 psi_g")


@pytest.mark.parametrize("name", ["torque-task-proportional", "torque-task-solenoid", "step-response"])
def test_an_empty_bottle_runs_and_gives_nothing(name: str) -> None:
    result = ppafo.simulate(name, [*EMPTY, "run.duration=0.5 s"])
    assert result.status.kind == "completed"
    assert result.metrics["gas_supplied"].value == pytest.approx(0.0, abs=1.0e-12)
    assert abs(result.recording["torque"]).max() < 1.0e-6
    result.plot()


def test_a_leaking_step_with_an_empty_bottle_agrees_with_the_reference_solver() -> None:
    pytest.importorskip("sksundae", reason="the reference solver needs scikit-sundae")
    from tests.reference.reference_solver import compare_with_reference

    filled = ("initial.pressure_1=30 psi_g", "run.duration=0.3 s")
    agreement = compare_with_reference(plan_run(ppafo.load_scenario("step-response", [*EMPTY, *filled])))
    assert agreement.worst_pressure < 1.0e-3
    assert agreement.angle < 2.0e-4


def test_an_empty_bottle_has_no_full_range_to_validate_against(tmp_path: Path) -> None:
    ppafo.simulate("step-response", [*EMPTY, "motion.ankle_torque=5 N m"]).save(tmp_path / "bench")
    with pytest.raises(PpafoError, match="must be above atmospheric pressure, because"):
        ppafo.validate("ppafo2011", [tmp_path / "bench"], overrides=EMPTY)
