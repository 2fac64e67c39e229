"""How far a linear model holds: steps of the command beside the lanes, from small to large."""

from dataclasses import dataclass, replace

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.replay import StepInputs, replay
from ppafo.engine.run import batch_of
from ppafo.model.plant import chamber_pressures
from ppafo.questions.linearise.solve import LinearModel
from ppafo.simulation.plan import plan_run
from ppafo.simulation.sampled import state_row_numbers
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, PrescribedMotion

DURATION = 1.0
INTERVAL = 1.0e-3
SHARES = tuple(np.geomspace(3.0e-4, 0.3, 13).tolist())
"""Steps of the command over the command of the steady state [-]: three decades."""


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """Torque [N m] after steps of the command, less that of the steady state: (steps, times) on the lanes and linear.

    ``amplitudes`` (steps,) of the command [-], ``times`` [s] after the step.
    """

    amplitudes: Floats
    times: Floats
    lanes: Floats
    linear: Floats

    @property
    def errors(self) -> Floats:
        """Largest difference of the torque of each step [N m]."""
        return np.asarray(np.max(np.abs(self.lanes - self.linear), axis=1))

    @property
    def sizes(self) -> Floats:
        """Largest change of the torque in each step [N m]."""
        return np.asarray(np.max(np.abs(self.lanes), axis=1))


def can_be_stepped(model: LinearModel) -> bool:
    """True for a steady state of a held ankle whose valve follows at once and is open: the lanes can begin there."""
    motion = model.scenario.motion
    is_held = isinstance(motion, PrescribedMotion) and motion.profile.kind == "constant"
    is_gas_alone = all(item.name.startswith("pressure") for item in model.states)
    return model.is_steady and is_held and is_gas_alone and 0.0 < abs(_value(model, "command")) < 0.7


def steps_of(model: LinearModel, shares: tuple[float, ...] = SHARES) -> Steps:
    """Steps of the command by some shares of the command of the steady state."""
    command = _value(model, "command")
    times: Floats = INTERVAL * np.arange(round(DURATION / INTERVAL) + 1, dtype=np.float64)
    still, *lanes = (_torque(model, command * (1.0 + share)) for share in (0.0, *shares))
    amplitudes: Floats = command * np.array(shares, dtype=np.float64)
    linear = amplitudes[:, None] * _unit_step(model, times)
    return Steps(amplitudes, times, np.array(lanes) - still, linear)


def _value(model: LinearModel, name: str) -> float:
    return next(item.value for item in (*model.states, *model.inputs) if item.name == name)


def _torque(model: LinearModel, command: float) -> Floats:
    """Torque [N m] on the lanes, from the steady state on, with another command."""
    scenario = replace(
        model.scenario,
        control=Control(PYTHON_CONTROLLER, {}, INTERVAL),
        duration=DURATION,
        time_step=INTERVAL,
        output_interval=INTERVAL,
        initial_pressure_1=_value(model, "pressure_1"),
        initial_pressure_2=_value(model, "pressure_2"),
    )
    run = plan_run(scenario)
    record = replay(batch_of(run), StepInputs(np.full(run.step_count, command), {})).record[:, :, 0]
    rows = state_row_numbers(run)
    angle, *masses = (record[:, rows[f"state.{name}"]] for name in ("angle", "mass_1", "mass_2"))
    pressure_1, pressure_2 = chamber_pressures(run.plant, angle, *masses)
    every = max(1, run.steps_per_sample)
    return np.asarray(run.plant.torque_constant * np.subtract(pressure_1, pressure_2))[::every]


def _unit_step(model: LinearModel, times: Floats) -> Floats:
    """Torque [N m] of the linear model after a step of the command by 1: exact, sample by sample."""
    from scipy.linalg import expm

    states = len(model.states)
    column = [item.name for item in model.inputs].index("command")
    row = [item.name for item in model.outputs].index("torque")
    both = np.zeros((states + 1, states + 1))
    both[:states, :states], both[:states, states] = model.a, model.b[:, column]
    onward = expm(both * (times[1] - times[0]))
    state, found = np.append(np.zeros(states), 1.0), []
    for _ in times:
        found.append(model.c[row] @ state[:states] + model.d[row, column])
        state = onward @ state
    return np.array(found)
