"""A walk of the built-in gait with any controller."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from numpy.typing import NDArray

from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.engine.lanes import run_batch
from ppafo.engine.run import Run, batch_of
from ppafo.gait import load_gait
from ppafo.model.gait_sensors import Fault, GaitSensors
from ppafo.model.sensors import SensorParameters
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.sampled import state_row_numbers
from ppafo.walking.planning import WalkPlan, plan_walk
from ppafo.walking.wearer import paper_subject

NO_FAULT = Fault(1.0e9, 0.0, 0.0)
IDEAL = GaitSensors(
    follow_rate=200.0,
    force_noise=0.0,
    force_quantum=0.0,
    lost_share=0.0,
    angle_memory=0.0,
    pressure_memory=0.0,
    angle_lost_share=0.0,
    pressure_lost_share=0.0,
    heel_fault=NO_FAULT,
    toe_fault=NO_FAULT,
    angle_fault=NO_FAULT,
    pressure_1_fault=NO_FAULT,
    pressure_2_fault=NO_FAULT,
)
QUIET = SensorParameters(0.0, 0.0, 0.0, 0.0, 1.0)


class Walked:
    """The record of a walk, by name."""

    def __init__(self, run: Run) -> None:
        self.run = run
        self.outcome = run_batch(batch_of(run))
        self.rows = state_row_numbers(run)
        self.time = np.arange(self.outcome.record.shape[0]) * run.step * run.record_every

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return self.outcome.record[:, self.rows[name], 0]


def make_plan(name: str, seconds: float = 8.0) -> WalkPlan:
    valve = "proportional" if name == "event_proportional" else "solenoid"
    kind = WALKING_CONTROLLERS[name]
    return WalkPlan(
        device=load_scenario(f"torque-task-{valve}").device,
        wearer=paper_subject(),
        gait=load_gait("falisse2019-subject1"),
        controller=kind,
        settings={item.name: float(item.default or 0.0) for item in kind.quantities},
        sensors=QUIET,
        gait_sensors=IDEAL,
        has_ideal_sensors=True,
        duration=seconds,
    )


@pytest.fixture(scope="session")
def walk_plan() -> Callable[[str], WalkPlan]:
    return make_plan


@pytest.fixture(scope="session")
def walked() -> Callable[[str], Walked]:
    return lru_cache(lambda name: Walked(plan_walk(make_plan(name))))


@pytest.fixture(scope="session")
def walked_with_fault() -> Callable[[str, str, Fault], Walked]:
    def walk(name: str, sensor: str, fault: Fault) -> Walked:
        plan = make_plan(name)
        sensors = IDEAL._replace(**{f"{sensor}_fault": fault}, force_noise=1.0)
        noisy = QUIET._replace(angle_noise=1.0e-4)
        return Walked(plan_walk(replace(plan, gait_sensors=sensors, sensors=noisy, has_ideal_sensors=False)))

    return walk
