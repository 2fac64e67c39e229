"""Find, compare, sweep, tune and linear models take a loop of an angle or a pressure as they take one of a torque."""

from typing import Any

import pytest

import ppafo
from ppafo.units import from_si

SERVO, SHORT = "cylinder-servo", ["run.duration=0.5 s"]


@pytest.mark.parametrize(
    ("scenario", "vary", "such_that", "low", "high"),
    [
        ("swing-foot-angle", "supply.pressure=20..60 psi_g", "rms_angle_error <= 0.9 deg", 20.5, 55.0),
        ("pressure-loop", "supply.pressure=35..70 psi_g", "final_pressure_1_error <= 0.5 psi_d", 35.0, 50.0),
    ],
)
def test_the_lowest_supply_that_holds_an_angle_or_a_pressure(
    scenario: str, vary: str, such_that: str, low: float, high: float
) -> None:
    outcome = ppafo.find(scenario, vary=vary, such_that=such_that, grid=8)
    assert low <= from_si(outcome.found.value, "psi_g", "Pa_a") <= high
    assert "torque error" not in str(outcome)


def test_a_stiffness_is_tuned_for_the_error_of_an_angle() -> None:
    tuning: dict[str, Any] = {
        "schema_version": 1,
        "name": "servo",
        "scenario": SERVO,
        "overrides": SHORT,
        "search": [{"path": "controller.angle_stiffness", "minimum": "5 N m/rad", "maximum": "60 N m/rad"}],
        "objective": [{"metric": "rms_angle_error"}],
        "effort": {"starts": 1, "generations": 3, "candidates_per_gain": 4, "seed": 1},
    }
    tuned = ppafo.tune(tuning).found
    before, after = (case.result.metrics["rms_angle_error"].value for case in (tuned.before, tuned.after))
    assert after <= before
    assert not tuned.after.result.tracking.fails


@pytest.mark.parametrize("scenario", [SERVO, "pressure-loop"])
def test_a_plant_is_linear_near_a_moment_of_a_run_of_an_angle_or_a_pressure(scenario: str) -> None:
    if scenario == SERVO:
        with pytest.raises(ppafo.ScenarioError, match="give a time of the run, such as at='1 s'"):
            ppafo.linearise(scenario)
    model = ppafo.linearise(scenario, at="0.2 s").found
    assert model.A.shape[0] == len(model.states)
