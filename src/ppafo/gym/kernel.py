"""Kernel that advances all environments of a program, in three compiled calls per block of environments.

Commands go in; physics, sensors, observations and rewards come out. The steps are made by the same lane loop as in
every other run; the functions before and after it work on the same arrays, which persist between calls.
"""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

from ppafo.engine.entries import HEADER, INLINE
from ppafo.engine.generator import StepText
from ppafo.engine.interpreter import Floats, PythonProgram, run_lanes
from ppafo.engine.lane_rows import ARGUMENTS, COMPILED
from ppafo.engine.loop_text import lane_entry, lane_loop
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths
from ppafo.engine.source_text import SourceCollector
from ppafo.engine.step.lane import Now
from ppafo.engine.step.phases import hold_chambers
from ppafo.engine.step.sample import fill_signals, remember_readings, sense
from ppafo.gym.tasks import Goal, Memory, Outcome, Requested, Task, finite, reward_of


class Action(NamedTuple):
    """Numbers of an action [-]; tasks with a single number ignore ``other``."""

    first: float
    other: float


class _ObservationFlag(NamedTuple):
    """Flag of an environment: 1 for evaluation of sensors, reward and end in this call, else 0."""

    is_observed: float


OWN = {"goal": Goal, "memory": Memory}
"""Rows of an environment besides the rows of its run."""
OWN_PATHS = [path for name, row in OWN.items() for path in leaf_paths(row, name)]
"""Paths of the numbers in ``OWN``, in order."""


def command(parts: Program, lanes: Any, task: Task) -> None:
    """Set the command of every environment from its action."""
    for lane in lanes:
        take_action(parts, lane, task)


def take_action(parts: Program, lane: Any, task: Task) -> None:  # noqa: ARG001 - a phase
    """Set the command of an environment from its action."""
    lane.result = lane.result._replace(command=task.command(lane.action.first, lane.action.other))


def judge(
    parts: Program,
    lanes: Any,
    task: Task,
    error_weight: float,
    gas_weight: float,
    moment: int,
    steps_in_all: int,
    steps_per_sample: int,
    signal_delay: int,
) -> None:
    """Evaluate sensors, observation and reward of the flagged environments, each at the step of its episode."""
    slots = lanes.signal_history.shape[1]
    for lane in lanes:
        if lane.asked.is_observed == 0.0:
            continue
        step = moment - int(lane.start.step)
        sample = step // steps_per_sample
        if parts.hands_chambers_on:
            hold_chambers(parts, lane)
        # Late signals of an episode begin with the readings at its start.
        if parts.late_signals and step == 0:
            for slot in range(slots):
                fill_signals(parts, lane, slot)
        now = Now(
            step=step,
            sample=sample,
            goal=1.0,
            early_command=0,
            late_command=0,
            late_signal=(moment - signal_delay) % slots,
            next_signal=0,
            reading=sample % slots,
            readings=slots,
        )
        if parts.late_readings:
            remember_readings(parts, lane, now)
        observe(parts, lane, task, now, error_weight, gas_weight, steps_in_all)


def observe(
    parts: Program,
    lane: Any,
    task: Task,
    now: Now,
    error_weight: float,
    gas_weight: float,
    steps_in_all: int,
) -> None:
    """Evaluate sensors, observation and reward of an environment, and set whether its episode ends."""
    sense(parts, lane, now)
    time = now.step * lane.timing.step
    torque_wanted, rate, _ = parts.reference.value(lane.reference, time)
    wanted = Requested(torque_wanted, rate)
    pressure_1, pressure_2 = parts.actuator.pressures(
        lane.plant, lane.state.angle, lane.state.mass_1, lane.state.mass_2
    )
    torque = parts.actuator.torque(lane.plant, lane.state.angle, pressure_1, pressure_2)
    gas = lane.state.supplied_mass - lane.memory.supplied_mass
    lane.memory = task.kept(lane.memory, lane.state.supplied_mass, lane.seen, time)
    lane.view = task.observed(lane.seen, lane.goal, lane.memory, wanted, lane.result.command, time)
    phase = lane.walk.now.phase if parts.leg is not None else 0.0
    error = task.error(lane.goal, wanted, lane.state.angle, phase, torque)
    lane.outcome = Outcome(
        reward=finite(reward_of(error, gas, error_weight, gas_weight, lane.timing.period)),
        error=finite(error),
        supplied=finite(lane.state.supplied_mass),
        failed=1.0 if lane.result.failure_time <= time else 0.0,
        through=1.0 if now.step >= steps_in_all else 0.0,
    )


def tables_judged(program: Program, task: Task) -> dict[str, Mapping[str, Any]]:
    """Rows in each array argument of ``judge``, by array name."""
    return {
        "states": program.state_rows(),
        "parameters": program.parameter_rows(),
        "own": OWN,
        "chosen": {"asked": _ObservationFlag},
        "observations": {"view": task.view},
        "outcomes": {"outcome": Outcome},
    }


class PythonKernel:
    """Pure-Python kernel with the interface of a compiled kernel: ``command``, ``advance`` and ``judge``."""

    def __init__(self, program: Program, task: Task) -> None:
        self._program, self._task = program, task
        self.advance = PythonProgram(program).advance

    def command(self, states: Floats, actions: Floats, signals: Floats) -> None:
        """Set the command of every environment from its action."""
        tables = (self._program.state_rows(), states), ({"action": Action}, actions)
        run_lanes(self._program, command, tables, (signals,), (self._task,))

    def judge(self, *arrays_and_numbers: Any) -> None:
        """Evaluate sensors, observation and reward of the flagged environments."""
        groups = tables_judged(self._program, self._task).values()
        tables, rest = list(zip(groups, arrays_and_numbers, strict=False)), arrays_and_numbers[len(groups) :]
        run_lanes(self._program, judge, tables, rest[:1], (self._task, *rest[1:]))


@lru_cache(maxsize=16)
def kernel_source(program: Program, task: Task) -> str:
    """Return the source of a kernel module: ``command``, ``advance`` and ``judge`` for a block of environments."""
    collector = SourceCollector(INLINE)
    further = {**OWN, "action": Action, "asked": _ObservationFlag, "view": task.view, "outcome": Outcome}
    step = StepText(program, collector, further=further)
    loop = lane_loop(step, COMPILED, "advance", ARGUMENTS)
    begin = lane_entry(step, command, {"states": step.states, "actions": {"action": Action}}, {"task": task})
    end = lane_entry(step, judge, tables_judged(program, task), {"task": task})
    return "\n\n\n".join([HEADER, collector.text(), loop, begin, end])
