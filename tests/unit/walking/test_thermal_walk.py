"""Walks whose gas has an energy balance, with and without lines: balances, the isothermal limit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import ScenarioError
from ppafo.metrics import evaluate
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import GasModel
from ppafo.walking import load_walk, walk
from ppafo.walking.motion import with_duration

WALLS = ("gas_model.kind=thermal", "gas_model.wall_area_per_volume=100 1/m")
WARM = (*WALLS, "gas_model.heat_transfer_coefficient=50 W/(m^2 K)")
RIGID = (*WALLS, "gas_model.heat_transfer_coefficient=1e7 W/(m^2 K)")
"""Walls so good that the gas keeps their temperature."""


def test_a_walk_file_takes_the_gas_model_of_a_scenario(tmp_path: Path) -> None:
    path = tmp_path / "warm.toml"
    head = 'schema_version = 1\nname = "warm"\n[device]\nset = "ppafo2011"\nvalve = "solenoid"\n'
    gas = 'kind = "thermal"\nheat_transfer_coefficient = "50 W/(m^2 K)"\nwall_area_per_volume = "100 1/m"\n'
    path.write_text(f'{head}[controller]\nkind = "off"\n[gas_model]\n{gas}')
    assert load_walk(path).gas_model == GasModel(50.0, 100.0)
    assert load_walk(path, ["gas_model.kind=isothermal"]).gas_model is None
    assert load_walk("solenoid").gas_model is None
    with pytest.raises(ScenarioError, match="heat_transfer_coefficient"):
        load_walk("solenoid", WALLS)


def test_warm_gas_has_steps_that_follow_the_faster_chambers() -> None:
    plain, warm = (plan_run(with_duration(load_walk("solenoid", given), 6.0)) for given in ((), WARM))
    assert warm.program.is_thermal
    assert not plain.program.is_thermal
    assert plain.step / warm.step >= 1.0
    assert warm.program == replace(plain.program, is_thermal=True)


@pytest.mark.parametrize("name", ["solenoid", "solenoid-regulators"])
def test_a_walk_with_warm_gas_keeps_mass_to_rounding_and_energy_and_comes_to_the_isothermal_walk(name: str) -> None:
    warm, rigid, plain = (walk(load_walk(name, given), minutes=0.1) for given in (WARM, RIGID, ()))
    for result in (warm, rigid):
        assert result.status.is_completed
        supplied = float(np.ptp(result.recording["supplied_mass"]))
        assert abs(evaluate(result.recording)["gas_imbalance"].value) < 1e-12 * supplied
        taken = float(result.recording["supplied_enthalpy"][-1])
        assert abs(evaluate(result.recording)["energy_imbalance"].value) < 3e-5 * taken
    assert np.ptp(warm.recording["temperature_1"]) > 20.0
    assert np.ptp(rigid.recording["temperature_1"]) < 0.1
    assert warm.metrics["gas"].value < 0.99 * plain.metrics["gas"].value, "warm gas fills a chamber with less mass"
    for metric in ("gas", "net_push_off_work"):
        assert rigid.metrics[metric].value == pytest.approx(plain.metrics[metric].value, rel=1e-3)
    if "regulated_mass" in warm.recording:
        assert (np.diff(warm.recording["regulated_mass"]) >= 0.0).all()
