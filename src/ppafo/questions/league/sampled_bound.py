"""The lower bound of a pair of solenoid valves that decides at its sample rate, with all of the task known beforehand.

A bound over means of the valve lets it switch infinitely often. Here it decides as its controller may: once a sample,
between chamber 1 fed, both chambers vented and chamber 2 fed. The engine itself takes every step of the search, coils,
leak and delays included, so that the decisions that are found are a run, and nothing is relaxed but the future being
known.

A first search keeps the best of the states that lie close together and finds a control: no bound is above its error. A
second one keeps boxes of states instead of states. At a fixed angle more gas in a chamber never leads to less gas in
either later, whatever the decisions: flows into a chamber fall with its own pressure and, through the leak, grow with
that of the other. So whatever starts between two corners of a box stays between them, and the least error that any
state of the box could have is one that no control beats.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import Batch, Floats, run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import Run, batch_of
from ppafo.errors import SimulationError
from ppafo.model.plant import actuator_torque, pressures_per_mass
from ppafo.progress import Progress, Report, report_nothing
from ppafo.simulation.plan import plan_run, profile_values
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, PrescribedMotion, Scenario

Places = NDArray[np.intp]

VENT_BOTH = 0.0
COMMANDS = (1.0, VENT_BOTH, -1.0)
"""What a pair can be told [-]: valve A on, neither, valve B on."""
CELL = 300.0
"""Width [Pa] of the cells in either pressure; of the states in one the best is kept, boxes in one become one box."""
MOST_STATES, MOST_BOXES = 2000, 6000
"""States and boxes that are kept from sample to sample; where there are more boxes, the cells of that sample grow."""
GROWTH = 1.3
BARELY_MORE = 1.0 + 1.0e-6
"""Factor on the error that was found, below which a box may still hold something better."""
SAME_TIME = 1.0e-9
LONG_AGO = -1.0e8


@dataclass(frozen=True, slots=True)
class SampledBound:
    """RMS error [N m] of the best ``commands`` that were found, one a sample, and one that no commands are below."""

    found: float
    certified: float
    commands: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _Task:
    """What both searches need: the batch of the run, the reference [N m] at its samples, and rows by their place."""

    batch: Batch
    run: Run
    commands: Sequence[float]
    reference: Floats
    weights: Floats
    masses: tuple[int, int]
    command_row: int
    times: list[int]
    coils: list[int]
    per_mass: tuple[float, float]

    @property
    def steps(self) -> int:
        """Steps of a sample."""
        return self.batch.clock.steps_per_sample

    def pressures(self, states: Floats) -> Floats:
        """Both pressures [Pa absolute] (2, ...) in states or records, whose rows come first."""
        return np.stack([states[row] * per_mass for row, per_mass in zip(self.masses, self.per_mass, strict=True)])

    def torque(self, pressure_1: Any, pressure_2: Any) -> Floats:
        """Torque [N m]. Equation (2)."""
        return np.asarray(actuator_torque(pressure_1, pressure_2, self.run.plant.torque_constant))

    def after(self, states: Floats) -> tuple[Floats, Floats]:
        """States a sample later under every command, and both pressures [Pa] (2, steps, states) on the way there."""
        states = np.repeat(states, len(self.commands), axis=1)
        states[self.command_row] = np.tile(self.commands, states.shape[1] // len(self.commands))
        parameters = np.repeat(self.batch.parameters, states.shape[1], axis=1)
        clock = replace(self.batch.clock, step_count=self.steps, record_every=1)
        done = run_batch(Batch(self.batch.program, clock, parameters, states))
        # The next sample begins at time 0 again: coils count from there.
        period = self.steps * self.run.step
        for row in self.times:
            done.states[row] -= np.where(done.states[row] > LONG_AGO, period, 0.0)
        return done.states, self.pressures(done.record[1:].transpose(1, 0, 2))


def sampled_problem(scenario: Scenario) -> str:
    """Return why the sampled bound cannot be computed for a scenario; empty where it can."""
    if scenario.device.valve.kind != "solenoid":
        return f"the valve '{scenario.device.valve.kind}' has no few commands to choose from; a solenoid pair has"
    if not isinstance(scenario.motion, PrescribedMotion) or scenario.motion.profile.kind != "constant":
        return "the ankle must be fixed"
    if "reference" not in scenario.origin.content:
        return "there is no [reference]"
    if scenario.thermal is not None:
        return "the gas must be isothermal"
    samples = scenario.duration / scenario.control.period
    return "" if abs(samples - round(samples)) < SAME_TIME else "run.duration ends in a sample"


def sampled_bound(
    scenario: Scenario, commands: Sequence[float] = COMMANDS, progress: Report = report_nothing
) -> SampledBound:
    """The least RMS error of any control of a pair of solenoid valves at the scenario's sample rate, at a fixed ankle.

    ``commands`` are those that a control may choose from. SimulationError for a scenario that it cannot do.
    """
    task = _task(scenario, commands)
    progress(Progress("bound of the sampled pair: best decisions"))
    found, decisions = _best_decisions(task)
    progress(Progress("bound of the sampled pair: certificate"))
    return SampledBound(found, _certified(task, found), decisions)


def best_decisions(
    scenario: Scenario, commands: Sequence[float] = COMMANDS, most_states: int = MOST_STATES
) -> tuple[float, tuple[float, ...]]:
    """The RMS error [N m] and commands of the best run that was found, without the certificate, which takes as long.

    ``most_states`` is how many states the search keeps from sample to sample: its time grows with them.
    """
    return _best_decisions(_task(scenario, commands), most_states)


def _task(scenario: Scenario, commands: Sequence[float]) -> _Task:
    problem = sampled_problem(scenario)
    if problem:
        raise SimulationError(f"{scenario.name}: no bound for a sampled pair of valves: {problem}")
    scenario = replace(scenario, control=Control(PYTHON_CONTROLLER, {}, scenario.control.period))
    run = plan_run(scenario)
    batch = batch_of(run)
    count, rows = batch.clock.step_count, row_numbers(batch.program.state_rows())
    assert isinstance(scenario.motion, PrescribedMotion), "a fixed ankle, which was checked"
    angle = float(profile_values(scenario.motion.profile, np.zeros(1))[0][0])
    weights = np.full(count + 1, 1.0 / count)
    weights[[0, -1]] *= 0.5
    coils = [row for path, row in rows.items() if path.startswith("valve_state.")]
    return _Task(
        batch=batch,
        run=run,
        commands=tuple(commands),
        reference=np.asarray(profile_values(scenario.reference, run.step * np.arange(count + 1, dtype=np.float64))[0]),
        weights=weights,
        masses=(rows["state.mass_1"], rows["state.mass_2"]),
        command_row=rows["result.command"],
        times=[row for path, row in rows.items() if path.startswith("valve_state.") and path.endswith("_time")],
        coils=coils,
        per_mass=pressures_per_mass(run.plant, angle),
    )


def _cells(task: _Task, pressures: Floats, states: Floats, width: float) -> tuple[Places, Places]:
    """First place in each cell of pressures [Pa] (2, states) and coils, and the number of the cell of each state."""
    settled = np.round(states[task.coils] / SAME_TIME)
    keys = np.vstack([np.floor(pressures / width), settled])
    _, first, inverse = np.unique(keys, axis=1, return_index=True, return_inverse=True)
    return first, inverse.ravel()


def _best_decisions(task: _Task, most_states: int = MOST_STATES) -> tuple[float, tuple[float, ...]]:
    """RMS error [N m] and commands of the best run among those through the best state of each cell."""
    states = task.batch.states.copy()
    square = task.weights[0] * (task.reference[0] - task.torque(*task.pressures(states))) ** 2
    ways: list[tuple[Places, Places]] = []
    for first in range(0, task.reference.size - 1, task.steps):
        after, pressures = task.after(states)
        part = slice(first + 1, first + 1 + task.steps)
        error = task.reference[part, None] - task.torque(*pressures)
        square = np.repeat(square, len(task.commands)) + task.weights[part] @ error**2
        order = np.argsort(square, kind="stable")
        places, _ = _cells(task, pressures[:, -1, order], after[:, order], CELL)
        kept = order[np.sort(places)][:most_states]
        ways.append(np.divmod(kept, len(task.commands)))
        states, square = after[:, kept], square[kept]
    place, decisions = int(np.argmin(square)), []
    found = float(np.sqrt(square[place]))
    for before, command in reversed(ways):
        decisions.append(task.commands[command[place]])
        place = before[place]
    return found, tuple(reversed(decisions))


def _certified(task: _Task, found: float) -> float:
    """RMS error [N m] that no commands are below: the least over boxes that hold all states of better runs."""
    low = high = task.batch.states.copy()
    square = task.weights[0] * (task.reference[0] - task.torque(*task.pressures(low))) ** 2
    for first in range(0, task.reference.size - 1, task.steps):
        (low, lowest), (high, highest) = task.after(low), task.after(high)
        part = slice(first + 1, first + 1 + task.steps)
        reference = task.reference[part, None]
        too_much = task.torque(lowest[0], highest[1]) - reference
        too_little = reference - task.torque(highest[0], lowest[1])
        error = np.maximum(0.0, np.maximum(too_much, too_little))
        square = np.repeat(square, len(task.commands)) + task.weights[part] @ error**2
        kept = np.flatnonzero(np.sqrt(square) <= found * BARELY_MORE)
        low, high, square, middle = low[:, kept], high[:, kept], square[kept], 0.5 * (lowest + highest)[:, -1, kept]
        width = CELL
        places, inverse = _cells(task, middle, low, width)
        while places.size > MOST_BOXES:
            width *= GROWTH
            places, inverse = _cells(task, middle, low, width)
        lower, upper, least = low[:, places], high[:, places], np.full(places.size, np.inf)
        for row in task.masses:
            np.minimum.at(lower[row], inverse, low[row])
            np.maximum.at(upper[row], inverse, high[row])
        np.minimum.at(least, inverse, square)
        low, high, square = lower, upper, least
    return min(found, float(np.sqrt(square.min()))) if square.size else found
