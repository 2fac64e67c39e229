"""Runs with a Python object as controller, on the compiled model of all other runs."""

import logging
import math
import traceback
from weakref import WeakSet

import numpy as np

from ppafo.control.kind import PythonController, reads_gait
from ppafo.engine.lanes import Batch, BatchResult
from ppafo.errors import SimulationError
from ppafo.model.valves.kind import VENT, VENTS_ABOVE
from ppafo.simulation.sampled import SampledRun
from ppafo.wording import nearest_name

logger = logging.getLogger("ppafo")

_REPORTED_CLASSES: "WeakSet[type]" = WeakSet()
"""Controller classes whose limited commands have been reported."""


def run_sampled(batch: Batch, controller: PythonController) -> BatchResult:
    """Run a batch that holds a single run, with a Python controller.

    A command beyond the valve's range is limited; a warning is logged once for each class of controllers. Raises
    SimulationError for a command that is no finite number, and for a programming error in the controller.
    """
    run = SampledRun(batch)
    name, walks = type(controller).__name__, batch.program.walks
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
    name, hint = getattr(error, "name", None), ""
    if name is not None and isinstance(error, AttributeError):
        hint = nearest_name(name, [known for known in dir(error.obj) if not known.startswith("_")])
    elif name is not None:
        hint = nearest_name(name, [*frame.f_locals, *frame.f_globals])
    file = frame.f_code.co_filename
    return SimulationError(f"{file}, line {line}: {type(controller).__name__}: {error}{hint}")
