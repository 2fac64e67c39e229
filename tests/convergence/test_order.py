"""Order of the scheme, and what happens to mass and to the numbers themselves in ten thousand random devices."""

import dataclasses
import math
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.reference.agreement import measure_agreement
from ppafo.engine.reference.solver import solve_reference
from ppafo.engine.run import NEVER_FAILED, Run, batch_of, run_together
from ppafo.simulation.plan import plan_run
from ppafo.simulation.sampled import state_row_numbers
from ppafo.simulation.scenario import Scenario

MANY = 10_000


def with_steps(run: Run, factor: int) -> Run:
    """The same run with a step ``factor`` times as short, recorded at the same times."""
    return dataclasses.replace(
        run,
        step=run.step / factor,
        step_count=run.step_count * factor,
        steps_per_sample=run.steps_per_sample * factor,
        record_every=run.record_every * factor,
    )


def observed_orders(run: Run, factors: tuple[int, ...]) -> tuple[list[float], list[float]]:
    """Orders seen in the root-mean-square errors of angle and pressure between successive step sizes."""
    reference = solve_reference(run)
    errors = [
        measure_agreement(with_steps(run, factor), run_batch(batch_of(with_steps(run, factor))), reference)
        for factor in factors
    ]
    ratios = [math.log2(b / a) for a, b in zip(factors, factors[1:], strict=False)]
    angle = [math.log2(a.angle_rms / b.angle_rms) / r for a, b, r in zip(errors, errors[1:], ratios, strict=False)]
    pressure = [
        math.log2(a.pressure_1_rms / b.pressure_1_rms) / r for a, b, r in zip(errors, errors[1:], ratios, strict=False)
    ]
    return angle, pressure


def test_step_response_converges_with_second_order(step_response: Scenario) -> None:
    angle, pressure = observed_orders(plan_run(step_response), (1, 4, 16))
    assert sum(angle) / len(angle) > 1.7, angle
    assert sum(pressure) / len(pressure) > 1.7, pressure


def test_smooth_flow_into_a_led_chamber_converges_with_second_order(
    torque_task: Callable[[str], Scenario], shorter: Callable[[Scenario, float], Scenario]
) -> None:
    scenario = shorter(torque_task("solenoid"), 0.05)
    reference = solve_reference(plan_run(scenario))
    coarse = plan_run(scenario)
    errors = []
    for factor in (1, 2, 4, 8):
        run = with_steps(coarse, factor)
        errors.append(measure_agreement(run, run_batch(batch_of(run)), reference).pressure_2_rms)
    assert errors[0] > errors[1] > errors[2]
    assert math.log2(errors[0] / errors[2]) / 2.0 > 1.7, errors


@pytest.mark.parametrize("name", ["step", "proportional", "solenoid"])
def test_mass_balance_closes_to_rounding_and_agrees_with_the_reference(
    name: str, step_response: Scenario, torque_task: Callable[[str], Scenario]
) -> None:
    run = plan_run(step_response if name == "step" else torque_task(name))
    rows = state_row_numbers(run)
    final = run_batch(batch_of(run)).states[:, 0]
    state = {key.removeprefix("state."): final[row] for key, row in rows.items() if key.startswith("state.")}
    stored = state["mass_1"] + state["mass_2"] - run.initial.mass_1 - run.initial.mass_2
    balance = state["supplied_mass"] - state["vented_mass"] - stored
    assert abs(balance) <= 1e-10 * state["supplied_mass"]
    judge = solve_reference(run).states[-1]
    assert state["supplied_mass"] == pytest.approx(judge[4], rel=2e-4)
    assert state["vented_mass"] == pytest.approx(judge[5], rel=2e-4)
    assert state["leaked_mass"] == pytest.approx(judge[6], rel=2e-4)


def test_ten_thousand_random_devices_give_numbers_and_none_fails(draws: ModuleType) -> None:
    runs = [
        dataclasses.replace(plan_run(dataclasses.replace(draws.random_scenario(seed), duration=0.3)), record_every=0)
        for seed in range(MANY)
    ]
    rows = [state_row_numbers(run) for run in runs]
    for seed, (run, row, result) in enumerate(zip(runs, rows, run_together(runs), strict=True)):
        states = result.states[:, 0]
        assert np.isfinite(states).all(), seed
        assert states[row["result.failure_time"]] == NEVER_FAILED, seed
        assert run.plant.angle_min <= states[row["state.angle"]] <= run.plant.angle_max, seed
