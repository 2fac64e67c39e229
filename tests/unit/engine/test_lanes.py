"""Lanes: the same numbers alone, in any place of any block, on any number of threads."""

import dataclasses

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.run import NEVER_FAILED, Run, batch_of, run_together, state_row_numbers
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run

NAMES = ("step-response", "torque-task-proportional", "torque-task-solenoid", "torque-task-slow-valve")


SAMPLED_INSIDE = (
    ("step-response", ("actuator.dead_volume_1=0.1 cm^3", "valve.spool_frequency=80 Hz", "valve.delay=1.7 ms")),
    ("torque-task-solenoid", ("valve.opening_delay=3.3 ms", "valve.closing_delay=2.2 ms")),
)


def different_runs(name: str, count: int) -> list[Run]:
    """Runs of one scenario with different supply pressures and inertias."""
    loaded = load_scenario(name)
    run = plan_run(dataclasses.replace(loaded, run=dataclasses.replace(loaded.run, duration=0.25)))
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


def runs_of_mixed_stiffness(count: int) -> list[Run]:
    """Step responses from the lower stop whose chambers there hold 0.05 to 50 cm^3, in no order of size."""
    run = plan_run(load_scenario("step-response", ("run.duration=0.3 s",)))
    volumes = [5.0e-8 * 1000.0 ** (index * 11 % count / count) for index in range(count)]
    runs = []
    for volume in volumes:
        plant = run.plant._replace(dead_volume_1=volume)
        mass = run.initial.mass_1 * volume / run.plant.dead_volume_1
        runs.append(dataclasses.replace(run, plant=plant, initial=run.initial._replace(mass_1=mass)))
    return runs


@pytest.mark.parametrize("threads", [1, 2])
def test_runs_that_need_parts_of_very_different_length_are_bit_identical_in_any_block(threads: int) -> None:
    runs = runs_of_mixed_stiffness(70)
    order = np.random.default_rng(1).permutation(len(runs))
    together = run_together(runs, threads)
    shuffled = run_together([runs[index] for index in order], threads)
    for place, index in enumerate(order):
        assert np.array_equal(together[index].record, shuffled[place].record)
        assert np.array_equal(together[index].states, shuffled[place].states)
    paths = [together[index].record[:, :, 0] for index in range(len(runs))]
    assert len({path.tobytes() for path in paths}) == len(runs), "no two of these devices do the same"
    for index in (0, 1, 31, 32, 69):
        assert np.array_equal(run_batch(batch_of(runs[index])).record, together[index].record)


@pytest.mark.parametrize("broken", [-1e-5, 1e4, float("nan")])
def test_a_device_that_fails_among_stiff_ones_neither_disturbs_nor_hangs_them(broken: float) -> None:
    runs = runs_of_mixed_stiffness(16)
    ill = dataclasses.replace(runs[5], initial=runs[5].initial._replace(mass_1=broken))
    results = run_together([*runs[:5], ill, *runs[6:]], threads=1)
    rows = state_row_numbers(runs[0])
    assert results[5].states[rows["result.failure_time"], 0] < 2e-3
    for index in (0, 4, 6, 15):
        assert np.array_equal(results[index].record, run_batch(batch_of(runs[index])).record)
        assert results[index].states[rows["result.failure_time"], 0] == NEVER_FAILED


@pytest.mark.parametrize(("name", "overrides"), SAMPLED_INSIDE)
def test_samples_inside_steps_show_the_run_that_aligned_ones_show(name: str, overrides: tuple[str, ...]) -> None:
    run = plan_run(load_scenario(name, ("run.duration=0.4 s", *overrides)))
    inside = dataclasses.replace(run, record_every=2.5)
    aligned = dataclasses.replace(run, record_every=5)
    rows = state_row_numbers(run)
    seen, expected = run_batch(batch_of(inside)).record[::2, :, 0], run_batch(batch_of(aligned)).record[:, :, 0]
    range_of = {"angle": run.plant.angle_max - run.plant.angle_min, "mass_1": expected[:, rows["state.mass_1"]].max()}
    assert seen.shape == expected.shape
    assert not np.array_equal(seen, expected) or not batch_of(aligned).program.is_adaptive
    for path, largest in range_of.items():
        moved = np.abs(seen - expected)[:, rows[f"state.{path}"]].max()
        assert moved <= 2e-4 * largest, (path, moved / largest)


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


def test_runs_of_different_programs_and_clocks_can_be_asked_for_together() -> None:
    runs = [different_runs(name, 2)[1] for name in NAMES]
    together = run_together(runs)
    for run, result in zip(runs, together, strict=True):
        assert np.array_equal(result.record, run_batch(batch_of(run)).record)


def test_noise_depends_on_the_seed_and_not_on_the_place() -> None:
    scenario = load_scenario("torque-task-slow-valve")
    runs = [
        plan_run(dataclasses.replace(scenario, run=dataclasses.replace(scenario.run, duration=0.1))) for _ in range(40)
    ]
    results = run_together(runs)
    assert np.array_equal(results[0].record, results[39].record)
    other = dataclasses.replace(runs[0], sensors=runs[0].sensors._replace(seed=99.0))
    assert not np.array_equal(results[0].record, run_together([other])[0].record)
