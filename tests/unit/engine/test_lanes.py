"""Lanes: the same numbers alone, in any place of any block, on any number of threads."""

import dataclasses

import numpy as np
import pytest

from ppafo.engine.lanes import Batch, run_batch
from ppafo.engine.run import Run, batch_of, run_together
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run

NAMES = ("step-response", "torque-task-proportional", "torque-task-solenoid", "torque-task-slow-valve")


def different_runs(name: str, count: int) -> list[Run]:
    """Runs of one scenario with different supply pressures and inertias."""
    run = plan_run(dataclasses.replace(load_scenario(name), duration=0.25))
    return [
        dataclasses.replace(
            run,
            plant=run.plant._replace(
                supply_pressure=run.plant.supply_pressure * (1.0 + 0.001 * index),
                inertia=run.plant.inertia * (1.0 + 0.01 * index),
            ),
        )
        for index in range(count)
    ]


@pytest.mark.parametrize("name", NAMES)
def test_run_is_bit_identical_alone_and_anywhere_in_a_block(name: str) -> None:
    runs = different_runs(name, 70)
    together = run_together(runs, threads=1)
    backwards = run_together(runs[::-1], threads=1)[::-1]
    for index in (0, 7, 31, 32, 63, 69):
        alone = run_batch(batch_of(runs[index]))
        for other in (together[index], backwards[index]):
            assert np.array_equal(alone.record, other.record)
            assert np.array_equal(alone.states, other.states)


@pytest.mark.parametrize("threads", [2, 3, 8])
def test_number_of_threads_changes_no_bit(threads: int) -> None:
    runs = different_runs("torque-task-proportional", 200)
    one = run_together(runs, threads=1)
    many = run_together(runs, threads=threads)
    assert all(np.array_equal(a.record, b.record) for a, b in zip(one, many, strict=True))


def test_recording_changes_no_bit_of_the_final_state() -> None:
    run = different_runs("torque-task-proportional", 1)[0]
    silent = dataclasses.replace(run, record_every=0)
    assert np.array_equal(run_batch(batch_of(run)).states, run_batch(batch_of(silent)).states)


def test_last_record_is_the_final_state_and_the_first_is_the_initial_one() -> None:
    run = different_runs("step-response", 1)[0]
    batch = batch_of(run)
    result = run_batch(batch)
    assert np.array_equal(result.record[-1], result.states)
    assert result.record[0, 2, 0] == run.initial.angle


def test_runs_of_different_programs_and_clocks_can_be_asked_for_together() -> None:
    runs = [different_runs(name, 2)[1] for name in NAMES]
    together = run_together(runs)
    for run, result in zip(runs, together, strict=True):
        assert np.array_equal(result.record, run_batch(batch_of(run)).record)


def test_lane_that_fails_does_not_disturb_its_neighbours() -> None:
    runs = different_runs("step-response", 3)
    broken = dataclasses.replace(runs[1], initial=runs[1].initial._replace(mass_1=-1e-5))
    results = run_together([runs[0], broken, runs[2]])
    assert results[1].states[1, 0] < 1.0, "the broken run reports the time of its failure"
    assert np.array_equal(results[2].record, run_batch(batch_of(runs[2])).record)


def test_batch_is_plain_data_of_rows_and_runs() -> None:
    run = different_runs("torque-task-solenoid", 1)[0]
    batch = batch_of(run)
    assert isinstance(batch, Batch)
    assert batch.parameters.shape[1] == batch.states.shape[1] == 1


def test_noise_depends_on_the_seed_and_not_on_the_place() -> None:
    scenario = load_scenario("torque-task-slow-valve")
    runs = [plan_run(dataclasses.replace(scenario, duration=0.1)) for _ in range(40)]
    results = run_together(runs)
    assert np.array_equal(results[0].record, results[39].record)
    other = dataclasses.replace(runs[0], sensors=runs[0].sensors._replace(seed=99.0))
    assert not np.array_equal(results[0].record, run_together([other])[0].record)
