"""Runs a controller that is any Python object, sample by sample, on the same lanes."""

import math

import numpy as np

from ppafo.control.kind import PythonController
from ppafo.engine.lanes import BatchResult, Floats, LaneBlock, load_program
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import Run, batch_of, whole_and_rest
from ppafo.errors import SimulationError
from ppafo.model.plant import chamber_pressures
from ppafo.model.sensors import Measurement, measure
from ppafo.model.vane import actuator_torque

MOST_STEPS = 5_000_000


def run_sampled(run: Run, controller: PythonController) -> BatchResult:
    """Run with a Python controller; SimulationError where it returns no finite number."""
    if run.step_count > MOST_STEPS:
        raise SimulationError(
            f"a Python controller needs every step in memory: {run.step_count} steps are more than {MOST_STEPS}; "
            "shorten run.duration, or write the controller as a catalogue entry (docs/how-to/add-a-controller.md)"
        )
    batch = batch_of(run)
    block = LaneBlock(load_program(run.program), batch.clock, batch.parameters, batch.states)
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
    """What the controller sees: the present or the past, between two steps by straight lines."""
    whole, lag = whole_and_rest(run.signal_delay, run.step)
    step = sample * run.steps_per_sample - whole
    signals = _signals(run, block.past(step)[:, 0], rows)
    if lag > 0.0:
        earlier = _signals(run, block.past(step - 1)[:, 0], rows)
        signals = tuple(new + lag * (old - new) for new, old in zip(signals, earlier, strict=True))
    angle, pressure_1, pressure_2 = signals
    if run.program.ideal_sensors:
        torque = actuator_torque(pressure_1, pressure_2, run.plant.torque_constant)
        return Measurement(angle, pressure_1, pressure_2, torque)
    return measure(run.sensors, angle, pressure_1, pressure_2, run.plant.torque_constant, sample)


def _signals(run: Run, state: Floats, rows: dict[str, int]) -> tuple[float, ...]:
    if run.program.slow_sensors:
        return tuple(float(state[rows[f"sensor_state.{name}"]]) for name in ("angle", "pressure_1", "pressure_2"))
    angle = float(state[rows["state.angle"]])
    masses = float(state[rows["state.mass_1"]]), float(state[rows["state.mass_2"]])
    return angle, *chamber_pressures(run.plant, angle, *masses)
