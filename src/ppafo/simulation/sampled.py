"""Runs a controller that is any Python object, sample by sample, on the same lanes."""

import math
from collections import deque
from typing import final

import numpy as np

from ppafo.control.kind import PythonController
from ppafo.engine.lanes import BatchResult, LaneBlock, load_program
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import Run, batch_of, whole_and_rest
from ppafo.errors import SimulationError
from ppafo.model.plant import chamber_pressures
from ppafo.model.sensors import Measurement, measure
from ppafo.model.vane import actuator_torque

def run_sampled(run: Run, controller: PythonController) -> BatchResult:
    """Run with a Python controller; SimulationError where it returns no finite number."""
    batch = batch_of(run)
    block = LaneBlock(load_program(batch.program), batch.clock, batch.parameters, batch.states)
    rows = state_row_numbers(run)
    past = Past(run, block, rows)
    controller.reset()
    for sample in range(math.ceil(run.step_count / run.steps_per_sample)):
        first_step = sample * run.steps_per_sample
        time = first_step * run.step
        wanted = run.program.reference.value(run.reference, time)[0]
        command = controller.update(time, wanted, past.seen(sample))
        block.states[rows["result.command"]] = _checked(command, controller, time)
        past.advance(min(run.steps_per_sample, run.step_count - first_step))
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


@final
class Past:
    """What the sensors of a run in progress showed at each step, as far back as their delay asks."""

    def __init__(self, run: Run, block: LaneBlock, rows: dict[str, int]) -> None:
        self._run, self._block, self._rows = run, block, rows
        self._whole, self._lag = whole_and_rest(run.signal_delay, run.step)
        self._shown = deque([self._now()] * (self._whole + 2), maxlen=self._whole + 2)

    def advance(self, steps: int) -> None:
        """Go some steps on."""
        if self._run.signal_delay <= 0.0:
            self._block.advance(steps)
            return
        for _ in range(steps):
            self._block.advance(1)
            self._shown.append(self._now())

    def seen(self, sample: int) -> Measurement:
        """What the controller sees: the present or the past, between two steps by straight lines."""
        run = self._run
        new, old = (self._shown[-1 - self._whole], self._shown[-2 - self._whole])
        if run.signal_delay <= 0.0:
            new = old = self._now()
        angle, pressure_1, pressure_2 = (late + self._lag * (later - late) for late, later in zip(new, old, strict=True))
        if run.program.ideal_sensors:
            torque = actuator_torque(pressure_1, pressure_2, run.plant.torque_constant)
            return Measurement(angle, pressure_1, pressure_2, torque)
        return measure(run.sensors, angle, pressure_1, pressure_2, run.plant.torque_constant, sample)

    def _now(self) -> tuple[float, ...]:
        state = self._block.states[:, 0]
        angle = float(state[self._rows["state.angle"]])
        masses = float(state[self._rows["state.mass_1"]]), float(state[self._rows["state.mass_2"]])
        return angle, *chamber_pressures(self._run.plant, angle, *masses)
