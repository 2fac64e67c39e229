"""How far a linear model holds: steps of the command from the steady state, on the runs and of the model."""

from dataclasses import dataclass, replace

import numpy as np

from ppafo.analyses.linearise.model import LinearModel
from ppafo.engine.lanes import Floats
from ppafo.engine.replay import StepInputs, replay
from ppafo.engine.run import batch_of, state_row_numbers
from ppafo.engine.scheme.actuators import pressures_of, torque_of
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, Initial

DURATION, INTERVAL = 1.0, 1.0e-3
"""Length of the run after a step of the command, and the time between two of its samples [s]."""
SHARES = tuple(np.geomspace(3.0e-4, 0.3, 13).tolist())
"""Steps of the command over the command of the steady state [-]: three decades."""
_LARGEST_COMMAND = 0.7
"""Command [-] of the steady state from which on the largest step comes too near to full opening, which is 1."""


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """Torque [N m] after steps of the command, less the steady one: (steps, times) on the runs and linear.

    ``amplitudes`` (steps,) of the command [-], ``times`` [s] after the step.
    """

    amplitudes: Floats
    times: Floats
    runs: Floats
    linear: Floats

    @property
    def errors(self) -> Floats:
        """Largest difference of the torque of each step [N m]."""
        return np.asarray(np.max(np.abs(self.runs - self.linear), axis=1))

    @property
    def sizes(self) -> Floats:
        """Largest change of the torque in each step [N m]."""
        return np.asarray(np.max(np.abs(self.runs), axis=1))


def can_step(model: LinearModel) -> bool:
    """True where runs can begin at the point: gas in steady state, a locked ankle, a valve that is at its command.

    The command is one that the largest step, 0.3 of it, still leaves below full opening.
    """
    is_locked = model.scenario.motion.locked_angle is not None
    has_gas_alone = all(variable.name.startswith("pressure") for variable in model.states)
    if not (model.is_steady and is_locked and has_gas_alone):
        return False
    return 0.0 < abs(_value_at_point(model, "command")) < _LARGEST_COMMAND


def steps_of(model: LinearModel, shares: tuple[float, ...] = SHARES) -> Steps:
    """Torque after steps of the command by shares of its steady value [-]; the model is one that ``can_step``."""
    command = _value_at_point(model, "command")
    times: Floats = INTERVAL * np.arange(round(DURATION / INTERVAL) + 1, dtype=np.float64)
    still, *runs = (_torque(model, command * (1.0 + share)) for share in (0.0, *shares))
    amplitudes: Floats = command * np.array(shares, dtype=np.float64)
    from scipy.signal import StateSpace, step

    column = [variable.name for variable in model.inputs].index("command")
    row = [variable.name for variable in model.outputs].index("torque")
    system = StateSpace(model.a, model.b[:, [column]], model.c[[row]], model.d[[row]][:, [column]])
    linear = amplitudes[:, None] * step(system, T=times)[1]
    return Steps(amplitudes, times, np.array(runs) - still, linear)


def _value_at_point(model: LinearModel, name: str) -> float:
    """Value of a state or an input at the point, in its SI unit."""
    return next(variable.value for variable in (*model.states, *model.inputs) if variable.name == name)


def _torque(model: LinearModel, command: float) -> Floats:
    """Torque [N m] (times,) of a run that begins in the steady state, under another constant command [-]."""
    scenario = replace(
        model.scenario,
        controller=Control(PYTHON_CONTROLLER, {}, INTERVAL),
        run=replace(model.scenario.run, duration=DURATION, step=INTERVAL, output_interval=INTERVAL),
        initial=Initial(_value_at_point(model, "pressure_1"), _value_at_point(model, "pressure_2")),
    )
    run = plan_run(scenario)
    record = replay(batch_of(run), StepInputs(np.full(run.step_count, command), {})).record[:, :, 0]
    rows = state_row_numbers(run)
    angle, *masses = (record[:, rows[f"state.{name}"]] for name in ("angle", "mass_1", "mass_2"))
    actuator = run.program.actuator
    pressures = pressures_of(actuator, run.plant, angle, *masses)
    # The record has every step of the engine, of which a sample may take several.
    return np.asarray(torque_of(actuator, run.plant, angle, *pressures))[:: max(1, run.steps_per_sample)]
