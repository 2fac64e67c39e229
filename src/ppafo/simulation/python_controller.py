"""Runs with a Python object as controller, sample by sample, on the compiled model of all other runs."""

import logging
import math
import traceback
from typing import Any, final
from weakref import WeakSet

import numpy as np

from ppafo.control.kind import PythonController, reads_gait
from ppafo.control.walking.assistance import acts, same_task
from ppafo.control.walking.outside import OUTSIDE
from ppafo.engine.in_python import in_program
from ppafo.engine.lanes import Batch, BatchResult, LaneBlock, effort_for, load_program, samples_in
from ppafo.engine.rows import group_of, row_numbers
from ppafo.engine.run import NEVER_FAILED
from ppafo.errors import ScenarioError, SimulationError
from ppafo.model.ports import shown_signals
from ppafo.model.sensors import NOTHING_SEEN, GaitMeasurement, Measurement, measure, measure_gait
from ppafo.model.valves.kind import VENT, VENTS_ABOVE
from ppafo.wording import nearest_name


@final
class SampledRun:
    """Single run in progress whose command [-] the caller sets at each sample.

    ``samples`` is the number of samples of the whole run, ``sample`` the index of the current one.
    """

    def __init__(self, batch: Batch) -> None:
        program = batch.program
        clock = batch.clock
        self.samples = math.ceil(clock.step_count / clock.steps_per_sample)
        self.sample = 0
        self._batch = batch
        self._block = LaneBlock(
            load_program(program, effort_for(batch)), program, clock, batch.parameters, batch.states
        )
        self._reference = parameter_group(batch, "reference")
        self._step = parameter_group(batch, "timing").step
        self._rows = row_numbers(program.state_rows())
        self._plant, self._sensors = (parameter_group(batch, name) for name in ("plant", "sensors"))
        self.requests_torque = program.controller is OUTSIDE
        self._command_row = self._rows["controller_state.command" if self.requests_torque else "result.command"]
        self._law = parameter_group(batch, "controller") if self.requests_torque else None
        self._before = self._requested = OUTSIDE.initial
        if program.walks:
            self._last_measurement = NOTHING_SEEN
            # Gas temperatures of a walk are kept inside the compiled program alone.
            if program.is_thermal:
                raise ScenarioError("a Python controller cannot run a walk with a thermal gas model")
            self._gait_sensors = parameter_group(batch, "gait_sensors")
        else:
            effects = [parameter_group(batch, effect.name) for effect in program.effects]
            self._shown_signals = in_program(shown_signals, program, effects)

    @property
    def time(self) -> float:
        """Time of the current sample [s]."""
        time: float = self.sample * self._batch.clock.steps_per_sample * self._step
        return time

    @property
    def reference(self) -> float:
        """Reference at the current sample [N m]; in a walk the torque requested for the last measurement."""
        if self.requests_torque:
            requested: float = self._requested.request.torque
            return requested
        reference: float = self._batch.program.reference.value(self._reference, self.time)[0]
        return reference

    @property
    def state(self) -> Any:
        """True state at the current sample [SI]: angle, masses of gas and others, as a NamedTuple."""
        return group_of("state", self._batch.program.state_rows(), self._block.states[:, 0].tolist())

    @property
    def has_diverged(self) -> bool:
        """True if the numerical solution has failed."""
        return bool(self._block.states[self._rows["result.failure_time"], 0] < NEVER_FAILED)

    def measurement(self) -> Any:
        """Sensor readings at the current sample: a ``Measurement``, or in a walk a ``GaitMeasurement``.

        Walking sensors have memory: their measurement is taken once a sample.
        """
        program = self._batch.program
        clock = self._batch.clock
        if program.walks:
            seen = self._walk_measurement()
            if self.requests_torque:
                self._before = self._requested
                period = clock.steps_per_sample * self._step
                self._requested = OUTSIDE.update(self._law, self._before, 0.0, seen, period)[1]
            return seen
        # Delayed sensors show an earlier state.
        if program.late_signals and self.sample > 0:
            signals = self._block.late_signals(self.sample * clock.steps_per_sample)
            angle, pressure_1, pressure_2 = signals[:, 0]
        else:
            groups = program.state_rows()
            state = self._block.states[:, 0].tolist()
            effect_states = {name: group_of(name, groups, state) for name in program.effect_states}
            angle, *masses = (state[self._rows[f"state.{name}"]] for name in ("angle", "mass_1", "mass_2"))
            pressures = program.actuator.pressures(self._plant, angle, *masses)
            angle, pressure_1, pressure_2 = self._shown_signals(effect_states, angle, *pressures)
        if program.ideal_sensors:
            torque = program.actuator.torque(self._plant, angle, pressure_1, pressure_2)
            return Measurement(angle, pressure_1, pressure_2, torque)
        return measure(self._sensors, angle, pressure_1, pressure_2, self._plant, self.sample, parts=program.functions)

    @property
    def continues_task(self) -> bool:
        """True if the gait has the same task as at the sample before."""
        return same_task(self._before.phase.phase, self._requested.phase.phase)

    def vents(self, measurement: GaitMeasurement) -> bool:
        """Return whether a torque law is not in command of the valve at the last measurement, and the chambers vent."""
        return not acts(self._requested.phase, measurement.torque)

    def advance(self, command: float) -> None:
        """Advance to the next sample with a command."""
        clock = self._batch.clock
        step = self.sample * clock.steps_per_sample
        self._block.states[self._command_row] = command
        # The last sample of a run may have fewer steps.
        self._block.advance(min(clock.steps_per_sample, clock.step_count - step))
        self.sample += 1

    def result(self) -> BatchResult:
        """States and record so far, including the sample reached by the last command."""
        clock = self._batch.clock
        result = self._block.result()
        if not clock.record_every:
            return result
        steps = min(self.sample * clock.steps_per_sample, clock.step_count)
        rows = samples_in(steps, clock.record_every)
        # A step records the state at its end when the next step begins, and only the last of a run does so at once.
        last_recorded_step = steps if steps == clock.step_count else steps - 1
        if (rows - 1) * clock.record_every > last_recorded_step:
            rows -= 1
        return BatchResult(result.states, result.record[:rows])

    def _walk_measurement(self) -> GaitMeasurement:
        """Measurement of a walking controller, of the present state."""
        program = self._batch.program
        plant = self._plant
        state = self._block.states[:, 0].tolist()
        paths = "state.angle", "state.mass_1", "state.mass_2", "walk.heel_force", "walk.toe_force"
        angle, mass_1, mass_2, heel, toe = (state[self._rows[path]] for path in paths)
        pressures = program.actuator.pressures(plant, angle, mass_1, mass_2)
        if program.ideal_sensors:
            return GaitMeasurement(angle, *pressures, program.actuator.torque(plant, angle, *pressures), heel, toe)
        sensors = (self._sensors, self._gait_sensors, self._last_measurement)
        sample = self.sample
        found, self._last_measurement = measure_gait(
            *sensors, angle, *pressures, heel, toe, plant, sample, parts=program.functions
        )
        return found


def parameter_group(batch: Batch, name: str) -> Any:
    """Return the NamedTuple of a group of parameters of a single run, as floats."""
    values: Any = batch.parameters[:, 0].tolist()
    return group_of(name, batch.program.parameter_rows(), values)


logger = logging.getLogger("ppafo")

_REPORTED_CLASSES: "WeakSet[type]" = WeakSet()
"""Controller classes whose limited commands have been reported."""


def run_sampled(batch: Batch, controller: PythonController) -> BatchResult:
    """Run a batch that holds a single run, with a Python controller.

    A command beyond the valve's range is limited; a warning is logged once for each class of controllers. Raises
    SimulationError for a command that is no finite number, and for a programming error in the controller.
    """
    run = SampledRun(batch)
    name = type(controller).__name__
    walks = batch.program.walks
    is_framed = run.requests_torque and not reads_gait(controller.update)
    # The object's memory of an earlier run must not steer this one.
    try:
        controller.reset()
    except (NameError, AttributeError, TypeError) as error:
        raise _programming_error(controller, error) from error
    for _ in range(run.samples):
        measurement = run.measurement()
        try:
            if is_framed and not run.continues_task:
                controller.reset()
            command = controller.update(run.time, run.reference, measurement)
        except (NameError, AttributeError, TypeError) as error:
            raise _programming_error(controller, error) from error
        # A comparison that was meant to be a command is a bool, which Python takes for a whole number.
        is_number = isinstance(command, int | float | np.floating) and not isinstance(command, bool)
        if not is_number or not math.isfinite(command):
            raise SimulationError(f"{name}.update returned {command!r} at t = {run.time:.6g} s, not a finite number")
        limited = VENT if walks and command > VENTS_ABOVE else max(-1.0, min(1.0, float(command)))
        if limited != command and type(controller) not in _REPORTED_CLASSES:
            _REPORTED_CLASSES.add(type(controller))
            logger.warning(
                "ppafo: %s.update returned %g at t = %.6g s; commands must be %s and are limited to this range",
                name,
                command,
                run.time,
                f"-1 to 1, or {VENT:g} to vent both chambers" if walks else "-1 to 1",
            )
        run.advance(VENT if is_framed and run.vents(measurement) else limited)
    return run.result()


def _programming_error(controller: PythonController, error: NameError | AttributeError | TypeError) -> SimulationError:
    """Return the error for a programming error in a controller: file, line, message and nearest name."""
    # The innermost frame is that of the mistake.
    frame, line = list(traceback.walk_tb(error.__traceback__))[-1]
    if frame.f_code.co_filename == __file__:
        # The method's own body has not begun: its arguments do not fit.
        signatures = "reset(self) and update(self, time, reference, measurement)"
        return SimulationError(f"{type(controller).__name__}: {error}; define {signatures}")
    name = getattr(error, "name", None)
    hint = ""
    if name is not None and isinstance(error, AttributeError):
        hint = nearest_name(name, [known for known in dir(error.obj) if not known.startswith("_")])
    elif name is not None:
        hint = nearest_name(name, [*frame.f_locals, *frame.f_globals])
    file = frame.f_code.co_filename
    return SimulationError(f"{file}, line {line}: {type(controller).__name__}: {error}{hint}")
