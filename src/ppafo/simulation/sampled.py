"""Runs with a Python object as controller, sample by sample, on the compiled model of all other runs."""

import logging
import math
import traceback
from collections.abc import Callable
from typing import Any, final
from weakref import WeakSet

import numpy as np

from ppafo.control.kind import PythonController
from ppafo.engine.in_python import in_program
from ppafo.engine.lanes import Batch, BatchResult, LaneBlock, RunnableProgram, effort_for, load_program, samples_in
from ppafo.engine.rows import group_of, row_numbers
from ppafo.errors import ScenarioError, SimulationError
from ppafo.model.ports import shown_signals
from ppafo.model.sensors import NOTHING_SEEN, GaitMeasurement, Measurement, measure, measure_gait
from ppafo.model.valves.kind import VENT, VENTS_ABOVE
from ppafo.wording import nearest_name

logger = logging.getLogger("ppafo")

_SAID: "WeakSet[type]" = WeakSet()
"""Controller classes whose limited commands have been reported."""


@final
class SampledRun:
    """Single run in progress whose command [-] the caller sets at each sample."""

    def __init__(self, batch: Batch, module: RunnableProgram | None = None) -> None:
        program, clock = batch.program, batch.clock
        self.samples = math.ceil(clock.step_count / clock.steps_per_sample)
        self.taken = 0
        self._batch = batch
        self._block = LaneBlock(
            load_program(program, effort_for(batch)) if module is None else module,
            program,
            clock,
            batch.parameters,
            batch.states,
        )
        self._reference, self._step = _group(batch, "reference"), _group(batch, "timing").step
        self._see = (_gait_measurements if program.walks else _measurement_source)(batch, self._block)
        self._command_row = row_numbers(program.state_rows())["result.command"]

    @property
    def time(self) -> float:
        """Time of the current sample [s]."""
        time: float = self.taken * self._batch.clock.steps_per_sample * self._step
        return time

    @property
    def requested(self) -> float:
        """Reference at the current sample [N m]."""
        requested: float = self._batch.program.reference.value(self._reference, self.time)[0]
        return requested

    def measurement(self) -> Any:
        """Sensor readings at the current sample: a ``Measurement``, or in a walk a ``GaitMeasurement``."""
        return self._see(self.taken)

    def go_on(self, command: float) -> None:
        """Advance to the next sample with a command."""
        clock = self._batch.clock
        done = self.taken * clock.steps_per_sample
        self._block.states[self._command_row] = command
        # The last sample of a run may have fewer steps.
        self._block.advance(min(clock.steps_per_sample, clock.step_count - done))
        self.taken += 1

    def result(self) -> BatchResult:
        """States and record so far, including the sample reached by the last command."""
        clock, outcome = self._batch.clock, self._block.result()
        steps = min(self.taken * clock.steps_per_sample, clock.step_count)
        kept = samples_in(steps, clock.record_every) if clock.record_every else None
        # The record at the end of a step is taken when the next one begins, but for the last of the run.
        late = 1 if kept is not None and steps < clock.step_count and (kept - 1) * clock.record_every >= steps else 0
        return BatchResult(outcome.states, outcome.record[: None if kept is None else kept - late])


def run_sampled(batch: Batch, controller: PythonController) -> BatchResult:
    """Run a batch of one with a Python controller.

    A command beyond the valve's range is limited; a warning is logged once for each class of controllers. Raises
    SimulationError for a command that is no finite number, and for a programming error in the controller.
    """
    run = SampledRun(batch)
    # What an earlier run left behind in the object must not steer this one.
    try:
        controller.reset()
    except (NameError, AttributeError, TypeError) as error:
        raise _slip(controller, error) from error
    for _ in range(run.samples):
        now = (run.time, run.requested, run.measurement())
        try:
            command = controller.update(*now)
        except (NameError, AttributeError, TypeError) as error:
            raise _slip(controller, error) from error
        # A comparison that was meant to be a command is a bool, which Python takes for a whole number.
        is_number = isinstance(command, int | float | np.floating) and not isinstance(command, bool)
        if not is_number or not math.isfinite(command):
            raise SimulationError(
                f"{type(controller).__name__}.update returned {command!r} at t = {run.time:.6g} s; it must return a "
                f"finite number"
            )
        # Above what opens the valve fully there is one more command, of a walk: both chambers are vented.
        is_vent = batch.program.walks and command > VENTS_ABOVE
        taken = VENT if is_vent else max(-1.0, min(1.0, float(command)))
        if taken != command:
            allowed = f"-1 to 1, or {VENT:g} to vent both chambers" if batch.program.walks else "-1 to 1"
            if type(controller) not in _SAID:
                _SAID.add(type(controller))
                logger.warning(
                    "ppafo: %s.update returned %g at t = %.6g s; commands are %s: those beyond are limited",
                    type(controller).__name__,
                    command,
                    run.time,
                    allowed,
                )
        run.go_on(taken)
    return run.result()


def _slip(controller: PythonController, error: NameError | AttributeError | TypeError) -> SimulationError:
    """Return the error for a programming error in a controller: file, line, message and nearest name."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    if frame.filename == __file__:
        # Its own body has not begun: the call itself does not fit.
        allowed = "write reset(self) and update(self, time, reference, measurement)"
        return SimulationError(f"{type(controller).__name__}: {error}; {allowed}")
    walked = next(reversed(list(traceback.walk_tb(error.__traceback__))))[0]
    name, hint = getattr(error, "name", None), ""
    if name is not None and isinstance(error, AttributeError):
        hint = nearest_name(name, [known for known in dir(error.obj) if not known.startswith("_")])
    elif name is not None:
        hint = nearest_name(name, [*walked.f_locals, *walked.f_globals])
    return SimulationError(f"{frame.filename}, line {frame.lineno}: {type(controller).__name__}: {error}{hint}")


def _group(batch: Batch, name: str) -> Any:
    """NamedTuple of a group of parameters of the single run, as floats."""
    values: Any = batch.parameters[:, 0].tolist()
    return group_of(name, batch.program.parameter_rows(), values)


def _measurement_source(batch: Batch, block: LaneBlock) -> Callable[[int], Measurement]:
    """Function that returns the measurement at a sample: of the present state, or earlier for delayed sensors."""
    program, per_sample = batch.program, batch.clock.steps_per_sample
    rows = row_numbers(program.state_rows())
    plant, sensors, actuator = _group(batch, "plant"), _group(batch, "sensors"), program.actuator
    groups = program.state_rows()
    show = in_program(shown_signals, program, [_group(batch, effect.name) for effect in program.effects])

    def see(sample: int) -> Measurement:
        state = block.states[:, 0]
        if program.late_signals and sample > 0:
            angle, pressure_1, pressure_2 = block.late_signals(sample * per_sample)[:, 0]
        else:
            angle = float(state[rows["state.angle"]])
            masses = float(state[rows["state.mass_1"]]), float(state[rows["state.mass_2"]])
            pressure_1, pressure_2 = actuator.pressures(plant, angle, *masses)
            values = state.tolist()
            states = {name: group_of(name, groups, values) for name in program.effect_states}
            angle, pressure_1, pressure_2 = show(states, angle, pressure_1, pressure_2)
        if program.ideal_sensors:
            return Measurement(
                angle=angle,
                pressure_1=pressure_1,
                pressure_2=pressure_2,
                torque=actuator.torque(plant, angle, pressure_1, pressure_2),
            )
        return measure(sensors, angle, pressure_1, pressure_2, plant, sample, parts=program.functions)

    return see


def _gait_measurements(batch: Batch, block: LaneBlock) -> Callable[[int], GaitMeasurement]:
    """Function that returns the measurement of a walking controller at a sample, of the present state.

    Raises ScenarioError for delayed sensors and for gas with an energy balance, which are only available to compiled
    controllers.
    """
    program, actuator, rows = batch.program, batch.program.actuator, row_numbers(batch.program.state_rows())
    if program.late_readings or program.is_thermal:
        raise ScenarioError(
            "a Python controller cannot run a walk with delayed sensors or a thermal gas model; use a controller kind"
        )
    plant, sensors, gait_sensors = (_group(batch, name) for name in ("plant", "sensors", "gait_sensors"))
    period, last = batch.clock.steps_per_sample * _group(batch, "timing").step, NOTHING_SEEN

    def see(sample: int) -> GaitMeasurement:
        nonlocal last
        state = block.states[:, 0]
        angle, mass_1, mass_2, heel, toe = (
            float(state[rows[path]])
            for path in ("state.angle", "state.mass_1", "state.mass_2", "walk.heel_force", "walk.toe_force")
        )
        pressures = actuator.pressures(plant, angle, mass_1, mass_2)
        if program.ideal_sensors:
            return GaitMeasurement(
                angle=angle,
                pressure_1=pressures[0],
                pressure_2=pressures[1],
                torque=actuator.torque(plant, angle, *pressures),
                heel_force=heel,
                toe_force=toe,
            )
        time, functions = sample * period, program.functions
        seen, last = measure_gait(
            sensors, gait_sensors, last, angle, *pressures, heel, toe, plant, time, sample, parts=functions
        )
        return seen

    return see
