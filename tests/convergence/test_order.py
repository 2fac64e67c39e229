"""Order of the scheme, and what happens to mass and to the numbers themselves in ten thousand random devices."""

import dataclasses
import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.run import NEVER_FAILED, Run, batch_of, run_together, state_row_numbers
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from tests.convergence.draws import random_scenario
from tests.reference.reference_solver import Agreement, measure_agreement, solve_reference

MANY = 10_000
ANY_ERROR = 1.0e9
"""Allowed error with which no part is refused or shortened: steps are as long as they are given, but at stops."""


def at_step(run: Run, parts: int) -> Run:
    """The same run with steps of 1 ms divided into ``parts``, recorded every millisecond."""
    duration = run.step * run.step_count
    return dataclasses.replace(
        run,
        step=1e-3 / parts,
        step_count=round(duration * 1e3) * parts,
        steps_per_sample=round(run.period * 1e3) * parts,
        record_every=parts,
    )


def errors_by_step(run: Run, parts: tuple[int, ...]) -> list[Agreement]:
    """Differences from the reference for steps of 1 ms divided into ``parts``."""
    reference = solve_reference(at_step(run, 1))
    return [
        measure_agreement(at_step(run, count), run_batch(batch_of(at_step(run, count))), reference) for count in parts
    ]


def mean_order(errors: list[float], parts: tuple[int, ...]) -> float:
    """Mean order of convergence between the coarsest and the finest step."""
    return math.log(errors[0] / errors[-1]) / math.log(parts[-1] / parts[0])


def test_step_response_converges_with_second_order_in_fixed_steps() -> None:
    overrides = ("actuator.dead_volume_1=8cm^3", "actuator.dead_volume_2=8cm^3")
    parts = (2, 4, 8, 16)
    fixed = dataclasses.replace(plan_run(load_scenario("step-response", overrides)), tolerance=ANY_ERROR)
    errors = errors_by_step(fixed, parts)
    for values in ([error.angle_rms for error in errors], [error.pressure_1_rms for error in errors]):
        assert mean_order(values, parts) > 1.9, values
        assert all(fine < 0.5 * coarse for coarse, fine in itertools.pairwise(values)), values


@pytest.mark.parametrize("dead_volume", ["8cm^3", "1cm^3"])
def test_a_hundredth_of_the_allowed_error_leaves_less_than_a_tenth_of_the_error(dead_volume: str) -> None:
    overrides = tuple(f"actuator.dead_volume_{chamber}={dead_volume}" for chamber in (1, 2))
    run = plan_run(load_scenario("step-response", overrides))
    reference = solve_reference(run)
    runs = [dataclasses.replace(run, tolerance=tolerance) for tolerance in (1.0, 0.01)]
    usual, finer = [measure_agreement(one, run_batch(batch_of(one)), reference) for one in runs]
    assert finer.angle_rms < 0.1 * usual.angle_rms
    assert finer.pressure_1_rms < 0.1 * usual.pressure_1_rms


def test_flow_into_a_held_chamber_converges_with_second_order(
    torque_task: Callable[[str], Scenario], shorter: Callable[[Scenario, float], Scenario]
) -> None:
    parts = (1, 2, 4, 8)
    errors = errors_by_step(plan_run(shorter(torque_task("solenoid"), 0.4)), parts)
    values = [error.pressure_1_rms for error in errors]
    assert mean_order(values, parts) > 1.7, values


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
    reference = solve_reference(run).states[-1]
    assert state["supplied_mass"] == pytest.approx(reference[4], rel=2e-4)
    assert state["vented_mass"] == pytest.approx(reference[5], rel=2e-4)
    assert state["leaked_mass"] == pytest.approx(reference[6], rel=2e-4)


def test_ten_thousand_random_devices_give_numbers_and_none_fails() -> None:
    runs = [
        dataclasses.replace(
            plan_run(dataclasses.replace(scenario, run=dataclasses.replace(scenario.run, duration=0.3))), record_every=0
        )
        for scenario in map(random_scenario, range(MANY))
    ]
    rows = [state_row_numbers(run) for run in runs]
    for seed, (run, row, result) in enumerate(zip(runs, rows, run_together(runs), strict=True)):
        states = result.states[:, 0]
        assert np.isfinite(states).all(), seed
        assert states[row["result.failure_time"]] == NEVER_FAILED, seed
        assert run.plant.angle_min <= states[row["state.angle"]] <= run.plant.angle_max, seed
