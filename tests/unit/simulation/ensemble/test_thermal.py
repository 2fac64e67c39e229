"""Gas with an energy balance in an ensemble."""

import numpy as np
import pytest

from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.simulate import simulate

THERMAL = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=80 W/(m^2 K)",
    "gas_model.wall_area_per_volume=300 1/m",
)
METRICS = ("rms_error", "gas_supplied", "gas_imbalance")


def test_each_run_gives_what_it_gives_alone() -> None:
    base = load_scenario("torque-task-proportional", THERMAL)
    coefficients = np.array([0.0, 40.0, 4.0e3])
    found = run_ensemble(base, {"gas_model.heat_transfer_coefficient": coefficients}, METRICS)
    for index, coefficient in enumerate(coefficients):
        override = f"gas_model.heat_transfer_coefficient={coefficient} W/(m^2 K)"
        alone = simulate("torque-task-proportional", [*THERMAL, override]).metrics
        assert found.metrics["rms_error"][index] == pytest.approx(alone["rms_error"].value, rel=1e-11)
        assert found.metrics["gas_supplied"][index] == pytest.approx(alone["gas_supplied"].value, rel=1e-11)
        assert abs(found.metrics["gas_imbalance"][index]) < 1e-15
