"""Runs a controller that is any Python object, sample by sample, on the same lanes."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ppafo.control.kind import PythonController
from ppafo.engine.lane_control import SIGNALS
from ppafo.engine.lanes import Batch, BatchResult, LaneBlock, load_program
from ppafo.engine.metering import group_of
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import Run
from ppafo.errors import SimulationError
from ppafo.model.plant import chamber_pressures
from ppafo.model.sensors import Measurement, measure
from ppafo.model.vane import actuator_torque


def run_sampled(batch: Batch, controller: PythonController) -> BatchResult:
    """Run a batch of one with a Python controller; SimulationError where it returns no finite number."""
    program, clock = batch.program, batch.clock
    block = LaneBlock(load_program(program), clock, batch.parameters, batch.states, len(program.traced))
    reference, step = _group(batch, "reference"), _group(batch, "timing").step
    see = _measurement_source(batch, block)
    command_row = row_numbers(program.state_rows())["result.command"]
    controller.reset()
    for sample in range(math.ceil(clock.step_count / clock.steps_per_sample)):
        first_step = sample * clock.steps_per_sample
        time = first_step * step
        requested = program.reference.value(reference, time)[0]
        command = controller.update(time, requested, see(sample))
        block.states[command_row] = _clip_command(command, controller, time)
        block.advance(min(clock.steps_per_sample, clock.step_count - first_step))
    return block.result()


def run_in_turn(batch: Batch, controller: PythonController, take: Callable[[slice, BatchResult], None]) -> None:
    """Run the runs of a batch one after the other, and give each result away as ``run_blocks`` does: some 30 ms each.

    An object has one state, so that it cannot be in charge of two runs at a time.
    """
    for run in range(batch.states.shape[1]):
        one = slice(run, run + 1)
        alone = Batch(batch.program, batch.clock, batch.parameters[:, one], batch.states[:, one])
        take(one, run_sampled(alone, controller))


def state_row_numbers(run: Run) -> dict[str, int]:
    """Row of each number of the state, by its path such as ``state.angle``."""
    return row_numbers(run.program.state_rows())


def _group(batch: Batch, name: str) -> Any:
    """The NamedTuple of a group of parameters of the one run, with floats."""
    values: Any = batch.parameters[:, 0].tolist()
    return group_of(name, batch.program.parameter_rows(), values)


def _clip_command(command: object, controller: PythonController, time: float) -> float:
    """The command within -1 to 1."""
    name = type(controller).__name__
    if isinstance(command, bool) or not isinstance(command, int | float | np.floating) or not math.isfinite(command):
        raise SimulationError(f"{name}.update returned {command!r} at t = {time:.6g} s; it must return a finite number")
    return max(-1.0, min(1.0, float(command)))


def _measurement_source(batch: Batch, block: LaneBlock) -> Callable[[int], Measurement]:
    """What the controller measures at a sample: the present state, or an earlier one where sensors are late."""
    program, per_sample = batch.program, batch.clock.steps_per_sample
    rows = row_numbers(program.state_rows())
    plant, sensors = _group(batch, "plant"), _group(batch, "sensors")

    def see(sample: int) -> Measurement:
        state = block.states[:, 0]
        if program.late_signals and sample > 0:
            angle, pressure_1, pressure_2 = block.late_signals(sample * per_sample)[:, 0]
        elif program.slow_sensors:
            angle, pressure_1, pressure_2 = (float(state[rows[f"sensor_state.{name}"]]) for name in SIGNALS)
        else:
            angle = float(state[rows["state.angle"]])
            masses = float(state[rows["state.mass_1"]]), float(state[rows["state.mass_2"]])
            pressure_1, pressure_2 = chamber_pressures(plant, angle, *masses)
        if program.ideal_sensors:
            return Measurement(
                angle=angle,
                pressure_1=pressure_1,
                pressure_2=pressure_2,
                torque=actuator_torque(pressure_1, pressure_2, plant.torque_constant),
            )
        return measure(sensors, angle, pressure_1, pressure_2, plant.torque_constant, sample)

    return see
