"""Runs a walk whose controller is any Python object, sample by sample, on the same lanes."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

from ppafo.engine.lanes import Batch, BatchResult, LaneBlock, begin_block
from ppafo.engine.metering import group_of
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import Run, batch_of
from ppafo.errors import ScenarioError
from ppafo.model.gait_sensors import NOTHING_SEEN, GaitMeasurement, measure_gait
from ppafo.model.plant import chamber_pressures
from ppafo.model.vane import actuator_torque


class GaitController(Protocol):
    """Any Python object can control a walk: it is asked sample by sample."""

    def reset(self) -> None:
        """Forget everything; called once before the walk."""

    def update(self, measurement: GaitMeasurement) -> float:
        """Return the command for a measurement: -1 to 1, or ``model.command.VENT``."""


def run_sampled_walk(run: Run, controller: GaitController) -> BatchResult:
    """Run a walk with a Python controller in the place of its own.

    ScenarioError for sensors that are late and for gas that warms, of which the lanes know more than this.
    """
    if run.program.late_readings or run.program.is_thermal:
        raise ScenarioError("a walk with a late sensor or with gas that warms has no controller outside the lanes")
    alone = replace(run, program=replace(run.program, controller=None), controller=())
    batch = batch_of(alone)
    clock = batch.clock
    block = begin_block(batch)
    see = _measurements(batch, block, float(run.step))
    command_row = row_numbers(batch.program.state_rows())["result.command"]
    controller.reset()
    for sample in range(math.ceil(clock.step_count / clock.steps_per_sample)):
        first_step = sample * clock.steps_per_sample
        block.states[command_row] = controller.update(see(sample))
        block.advance(min(clock.steps_per_sample, clock.step_count - first_step))
    return block.result()


def _measurements(batch: Batch, block: LaneBlock, step: float) -> Callable[[int], GaitMeasurement]:
    """What the controller sees at a sample, of the present state."""
    program, rows = batch.program, row_numbers(batch.program.state_rows())
    values: Any = batch.parameters[:, 0].tolist()
    plant, sensors, gait_sensors = (
        group_of(name, program.parameter_rows(), values) for name in ("plant", "sensors", "gait_sensors")
    )
    last = NOTHING_SEEN

    def see(sample: int) -> GaitMeasurement:
        nonlocal last
        state = block.states[:, 0]
        angle, mass_1, mass_2, heel, toe = (
            float(state[rows[path]])
            for path in ("state.angle", "state.mass_1", "state.mass_2", "walk.heel_force", "walk.toe_force")
        )
        pressures = chamber_pressures(plant, angle, mass_1, mass_2)
        if program.ideal_sensors:
            torque = actuator_torque(*pressures, plant.torque_constant)
            return GaitMeasurement(
                angle=angle,
                pressure_1=pressures[0],
                pressure_2=pressures[1],
                torque=torque,
                heel_force=heel,
                toe_force=toe,
            )
        time = sample * batch.clock.steps_per_sample * step
        seen, last = measure_gait(
            sensors, gait_sensors, last, angle, *pressures, heel, toe, plant.torque_constant, time, sample
        )
        return seen

    return see
