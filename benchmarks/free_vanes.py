"""Ensembles of free vanes on one thread: alike, with a large dead volume, and different from each other."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.report import Line, Target, has_avx512
from benchmarks.timing import time_in_turn
from ppafo.engine.lanes import Batch, run_batch
from ppafo.simulation.ensemble.planning import check_columns, plan_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.numbers import number_at

GROUP = "Free vanes as ensembles, one thread"
SCENARIO = "step-response"
SEED = 20110301
SPREAD = 0.2
SPREAD_PATHS = (
    "valve.area",
    "actuator.dead_volume_1",
    "actuator.dead_volume_2",
    "foot_plate.inertia",
    "friction.static_torque",
)
DEAD_VOLUMES = ("actuator.dead_volume_1", "actuator.dead_volume_2")
LEAST_DEAD_VOLUME, MOST_DEAD_VOLUME = 0.2e-6, 15.0e-6
TARGETS = {"alike": 30_000.0, "large": 40_000.0, "spread": 15_000.0, "mixed": 10_000.0}
WHAT = {
    "alike": "figure 7, all alike",
    "large": "figure 7 with dead volumes of 8 cm^3",
    "spread": "figure 7, devices spread by 20 %",
    "mixed": "figure 7, dead volumes of 0.2 to 15 cm^3 mixed",
}


def measure_free_vanes(runs: int, repetitions: int, say: Callable[[str], None]) -> list[Line]:
    """Lines about ``runs`` step responses of each kind; nothing is recorded."""
    say(f"{runs} step responses of free vanes, four kinds")
    batches = free_vanes(runs)
    simulated = runs * load_scenario(SCENARIO).run.duration
    contenders = {name: partial(_run_all, group) for name, group in batches.items()}
    for contender in contenders.values():
        contender()
    timings = time_in_turn(contenders, repetitions)
    return [
        Line(
            f"free_vanes_{name}",
            GROUP,
            WHAT[name],
            simulated / timing.best,
            "x real time",
            Target(TARGETS[name], at_least=True) if has_avx512() else None,
            (simulated / timing.worst, simulated / timing.best),
        )
        for name, timing in timings.items()
    ]


def free_vanes(runs: int) -> dict[str, list[Batch]]:
    """Batches of each kind, without records."""
    draw = np.random.default_rng(SEED)
    base = load_scenario(SCENARIO)
    large = load_scenario(SCENARIO, tuple(f"{path}=8cm^3" for path in DEAD_VOLUMES))
    same = {"friction.dynamic_torque": np.full(runs, number_at(base, "friction.dynamic_torque"))}
    spread = {path: number_at(base, path) * draw.uniform(1.0 - SPREAD, 1.0 + SPREAD, runs) for path in SPREAD_PATHS}
    ends = np.log(LEAST_DEAD_VOLUME), np.log(MOST_DEAD_VOLUME)
    mixed = {path: np.exp(draw.uniform(*ends, runs)) for path in DEAD_VOLUMES}
    kinds = {"alike": (base, same), "large": (large, same), "spread": (base, spread), "mixed": (base, mixed)}
    return {
        name: [_silent(batch) for _, batch in plan_ensemble(check_columns(scenario, columns)).batches]
        for name, (scenario, columns) in kinds.items()
    }


def _silent(batch: Batch) -> Batch:
    return replace(batch, clock=replace(batch.clock, record_every=0))


def _run_all(batches: list[Batch]) -> None:
    for batch in batches:
        run_batch(batch, threads=1)
