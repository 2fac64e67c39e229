"""The errors that a run promises at the default tolerance, over random tasks; more by scripts/kept_errors.py."""

import numpy as np
import pytest

from ppafo import load_scenario, simulate
from ppafo.simulation.loading import scenario_from_dict
from tests.convergence.kept_errors import kept
from tests.convergence.tasks import TASKS, task

SEED = 1
DRAWS = 8


@pytest.mark.long
@pytest.mark.parametrize("family", TASKS)
def test_determined_tasks_keep_to_the_promised_errors(family: str) -> None:
    cases = {number: kept(scenario_from_dict(task(family, SEED, number))) for number in range(DRAWS)}
    determined = {number: case for number, case in cases.items() if case.is_determined}
    assert 2 * len(determined) > DRAWS, "the family must say something"
    assert {number: case for number, case in determined.items() if not case.worst <= 1.0} == {}


def test_a_chamber_that_gas_flushes_within_a_step_is_as_warm_as_with_a_small_tolerance() -> None:
    drawn = task("small warm chambers", SEED, 39)
    usual, fine = (
        simulate(scenario_from_dict(drawn | {"run": drawn["run"] | {"tolerance": tolerance}}))
        for tolerance in (1.0e-3, 1.0e-6)
    )
    for name in ("temperature_1", "temperature_2"):
        assert np.ptp(usual[name]) == pytest.approx(np.ptp(fine[name]), rel=0.02)
    assert usual.error().temperature == pytest.approx(
        1.5 * max(np.abs(usual[name] - fine[name]).max() for name in ("temperature_1", "temperature_2")), rel=1.0
    )


def test_the_printed_error_covers_temperatures_and_metrics() -> None:
    warm = ["gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=50 W/(m^2 K)"]
    error = simulate("step-response", overrides=[*warm, "gas_model.wall_area_per_volume=100 1/m"]).error()
    assert error.temperature is not None
    assert f"and {error.temperature:.1e} K over time; at most {error.share:.1e} of a metric's value" in error.sentence
    assert error.largest in error.metrics
    plain = simulate(load_scenario("step-response")).error()
    assert plain.temperature is None
    assert " K " not in plain.sentence
