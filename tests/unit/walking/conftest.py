"""A walk of the built-in gait with any controller."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from numpy.typing import NDArray

from ppafo.engine.lanes import run_batch
from ppafo.engine.run import Run, batch_of, state_row_numbers
from ppafo.gait import load_gait
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from ppafo.walking import load_walk
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.wearer import paper_subject


class Walked:
    """The record of a walk, by name."""

    def __init__(self, run: Run) -> None:
        self.run = run
        self.outcome = run_batch(batch_of(run))
        self.rows = state_row_numbers(run)
        self.time = np.arange(self.outcome.record.shape[0]) * run.step * run.record_every

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return self.outcome.record[:, self.rows[name], 0]


def make_plan(name: str, seconds: float = 8.0) -> Scenario:
    valve = "proportional" if name == "event_proportional" else "solenoid"
    plain = load_walk(valve, [f"controller.kind={name}"])
    walker = replace(walk_of(plain), gait=load_gait("falisse2019-subject1"), wearer=paper_subject())
    return with_duration(replace(plain, motion=walker), seconds)


@pytest.fixture(scope="session")
def walk_plan() -> Callable[[str], Scenario]:
    return make_plan


@pytest.fixture(scope="session")
def walked() -> Callable[[str], Walked]:
    return lru_cache(lambda name: Walked(plan_run(make_plan(name))))
