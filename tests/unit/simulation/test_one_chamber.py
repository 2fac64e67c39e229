"""An actuator with one chamber: nothing of a second one is asked for, supplied, measured or shown."""

from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.errors import PpafoError, ScenarioError
from ppafo.signals.recording import OF_SECOND_CHAMBER
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.ensemble.planning import check_columns, plan_ensemble
from ppafo.simulation.scenario import Scenario

BLADDER = Path(__file__).parents[2] / "actuators" / "measured-bladder.toml"


@pytest.fixture(scope="module")
def bladder() -> Scenario:
    return ppafo.load_scenario("torque-task-proportional", [f"device.set={BLADDER}", "run.duration=0.2 s"])


def test_a_single_chamber_has_no_second_pressure_and_gas(bladder: Scenario) -> None:
    result = ppafo.simulate(bladder)
    assert OF_SECOND_CHAMBER.isdisjoint(result.recording.names)
    assert not {"gas_leaked", "gas_imbalance"} & set(result.metrics)
    assert result.metrics["largest_pressure"].value == result.recording["pressure_1"].max()
    assert "largest chamber pressure" in str(result)
    names = [line.get_label() for axes in result.plot().axes for line in axes.lines]
    assert not [name for name in names if "chamber" in str(name)]
    assert result.check().is_determined


def test_many_runs_of_a_single_chamber_find_what_one_finds(bladder: Scenario) -> None:
    alone = ppafo.simulate(bladder).metrics["largest_pressure"].value
    columns = {"supply.pressure": np.array([bladder.device.supply.pressure])}
    many = run_ensemble(bladder, columns, ("largest_pressure", "gas_leaked"))
    assert many.metrics["largest_pressure"].tolist() == [alone]
    assert np.isnan(many.metrics["gas_leaked"]).all()
    with pytest.raises(ScenarioError, match="'pressure_2' cannot be traced: measured-bladder has only one chamber"):
        run_ensemble(bladder, columns, (), ("pressure_2",))


def test_a_single_chamber_takes_no_reference_of_the_other() -> None:
    with pytest.raises(ScenarioError, match=r"has only one chamber"):
        ppafo.load_scenario("pressure-loop", [f"device.set={BLADDER}", "reference.of=pressure_2"])


def test_its_recording_without_the_second_pressure_is_replayed(bladder: Scenario) -> None:
    validated = ppafo.validate(str(BLADDER), [ppafo.simulate(bladder).recording], motion="locked")
    assert validated.found.passes


@pytest.mark.parametrize(
    "path", ["actuator.dead_volume_2=3 cm^3", "actuator.leak.area=0.5 mm^2", "supply.dorsiflexion_pressure=20 psi_g"]
)
def test_numbers_of_a_second_chamber_are_refused(path: str) -> None:
    with pytest.raises(PpafoError, match="the actuator has one chamber"):
        ppafo.load_device(BLADDER, overrides=[path])


def test_a_second_chamber_takes_no_pressure_at_the_start() -> None:
    for text in ("20 psi_g", "supply"):
        with pytest.raises(ScenarioError, match=r"one chamber.*omit this key"):
            ppafo.load_scenario("torque-task-proportional", [f"device.set={BLADDER}", f"initial.pressure_2={text}"])


def test_a_command_towards_the_second_chamber_takes_no_gas() -> None:
    away = ("reference.start_level=-5 N m", "reference.level=-30 N m", "run.duration=0.2 s")
    result = ppafo.simulate(ppafo.load_scenario("torque-task-proportional", [f"device.set={BLADDER}", *away]))
    assert result.recording["command"].min() < -0.1
    assert result.metrics["gas_supplied"].value == 0.0


def test_the_second_port_stays_at_the_atmosphere_where_this_varies(bladder: Scenario) -> None:
    columns = check_columns(bladder, {"supply.atmospheric_pressure": np.array([1.012e5, 1.016e5])})
    assert columns.values["supply.dorsiflexion_pressure"].tolist() == [1.012e5, 1.016e5]
    assert len(plan_ensemble(columns).batches) == 1
    with pytest.raises(ScenarioError, match="cannot vary: the actuator has one chamber"):
        check_columns(bladder, {"actuator.dead_volume_2": np.array([1.0e-6])})
