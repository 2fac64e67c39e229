"""Gas with an energy balance in an ensemble."""

import numpy as np
import pytest

from ppafo.errors import ScenarioError
from ppafo.parameters.overrides import over
from ppafo.running import simulate
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario

THERMAL = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=80 W/(m^2 K)",
    "gas_model.wall_area_per_volume=300 1/m",
)
METRICS = ("rms_error", "gas_supplied", "gas_imbalance", "lowest_temperature")


def test_temperatures_are_traced_where_there_is_an_energy_balance_and_refused_elsewhere() -> None:
    columns = {"gas_model.heat_transfer_coefficient": np.array([0.0, 40.0])}
    traced = run_ensemble(load_scenario("torque-task-proportional", THERMAL), columns, METRICS, ("temperature_1",), 0.1)
    alone = simulate("torque-task-proportional", over(THERMAL, ["gas_model.heat_transfer_coefficient=40 W/(m^2 K)"]))
    assert traced.traces["temperature_1"][:, 1] == pytest.approx(alone.recording["temperature_1"][::100], rel=1e-11)
    isothermal = load_scenario("torque-task-proportional")
    with pytest.raises(ScenarioError, match="'temperature_1' needs an energy balance"):
        run_ensemble(isothermal, {"supply.pressure": np.array([5e5])}, ("rms_error",), ("temperature_1",))
