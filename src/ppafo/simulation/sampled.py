"""Runs a controller that is any Python object, sample by sample, on the same lanes."""

import math

import numpy as np

from ppafo.control.kind import PythonController
from ppafo.engine.lane_control import SIGNALS
from ppafo.engine.lanes import BatchResult, LaneBlock, load_program
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import Run, batch_of
from ppafo.errors import SimulationError
from ppafo.model.plant import chamber_pressures
from ppafo.model.sensors import Measurement, measure
from ppafo.model.vane import actuator_torque


def run_sampled(run: Run, controller: PythonController) -> BatchResult:
    """Run with a Python controller; SimulationError where it returns no finite number."""
    batch = batch_of(run)
    block = LaneBlock(load_program(batch.program), batch.clock, batch.parameters, batch.states)
    rows = state_row_numbers(run)
    controller.reset()
    for sample in range(math.ceil(run.step_count / run.steps_per_sample)):
        first_step = sample * run.steps_per_sample
        time = first_step * run.step
        wanted = run.program.reference.value(run.reference, time)[0]
        command = controller.update(time, wanted, _seen(run, block, rows, sample))
        block.states[rows["result.command"]] = _checked(command, controller, time)
        block.advance(min(run.steps_per_sample, run.step_count - first_step))
    return block.result()


def state_row_numbers(run: Run) -> dict[str, int]:
    """Row of each number of the state, by its path such as ``state.angle``."""
    return row_numbers(run.program.state_rows())


def _checked(command: object, controller: PythonController, time: float) -> float:
    """The command within -1 to 1."""
    name = type(controller).__name__
    if isinstance(command, bool) or not isinstance(command, int | float | np.floating) or not math.isfinite(command):
        raise SimulationError(f"{name}.update returned {command!r} at t = {time:.6g} s; it must return a finite number")
    return max(-1.0, min(1.0, float(command)))


def _seen(run: Run, block: LaneBlock, rows: dict[str, int], sample: int) -> Measurement:
    """What the controller sees: the present, or what late sensors looked at."""
    if run.program.late_signals and sample > 0:
        angle, pressure_1, pressure_2 = block.late_signals(sample * run.steps_per_sample)[:, 0]
    elif run.program.slow_sensors:
        shown = block.states[:, 0]
        angle, pressure_1, pressure_2 = (float(shown[rows[f"sensor_state.{name}"]]) for name in SIGNALS)
    else:
        state = block.states[:, 0]
        angle = float(state[rows["state.angle"]])
        masses = float(state[rows["state.mass_1"]]), float(state[rows["state.mass_2"]])
        pressure_1, pressure_2 = chamber_pressures(run.plant, angle, *masses)
    if run.program.ideal_sensors:
        torque = actuator_torque(pressure_1, pressure_2, run.plant.torque_constant)
        return Measurement(angle, pressure_1, pressure_2, torque)
    return measure(run.sensors, angle, pressure_1, pressure_2, run.plant.torque_constant, sample)
