"""The kernel that takes all environments of a program a step further in one compiled call.

Commands go in; physics, sensors, observations and rewards come out. The lane loop of every other run steps them;
sensors, observations and rewards around it are written from the same components.
"""

from functools import lru_cache
from typing import Any

from ppafo.engine.entries import ARRAY, ARRAY_2D, ARRAY_3D, FLOAT, HEADER, INLINE, INT, entry_text, indent
from ppafo.engine.generator import StepText
from ppafo.engine.lane_rows import ARGUMENTS, COMPILED
from ppafo.engine.lanes import SIGNAL_ROWS
from ppafo.engine.loop_rows import Call, RowsOfLanes
from ppafo.engine.loop_text import lane_loop
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths
from ppafo.engine.scheme.pneumatics import HeldChambers
from ppafo.engine.source_text import SourceCollector
from ppafo.engine.step.lane import Now
from ppafo.engine.step.phases import hold_chambers
from ppafo.engine.step.sample import fill_signals, remember_readings, sense
from ppafo.gym.tasks import (
    Goal,
    Memory,
    Outcome,
    Requested,
    Task,
    finite,
    reward_of,
    within,
)
from ppafo.model.plant import chamber_pressures, joint_torque

OWN = {"goal": Goal, "memory": Memory}
"""Rows of an environment beside the rows of its run."""
OWN_PATHS = [path for name, row in OWN.items() for path in leaf_paths(row, name)]
"""Paths of the numbers in these rows, in their order."""

_PARAMETERS = {
    **dict.fromkeys(("all_states", "all_parameters"), ARRAY_2D),
    **{"all_signals": ARRAY_3D, "all_commands": ARRAY_2D, "record": ARRAY_3D, "trace": ARRAY_3D, "all_own": ARRAY_2D},
    **{"actions": ARRAY_2D, "bounds": ARRAY_2D, "chosen": ARRAY, "observations": ARRAY_2D, "outcomes": ARRAY_2D},
    **dict.fromkeys(("error_weight", "gas_weight"), FLOAT),
    **dict.fromkeys(("moment", "steps", "steps_in_all", "steps_per_sample", "signal_delay", "command_delay"), INT),
}
"""Parameters of ``go_on``, the kernel; a name that begins with ``all`` holds the rows of all blocks, block by block."""


def observe(
    parts: Program,
    lane: Any,
    task: Task,
    now: Now,
    error_weight: float,
    gas_weight: float,
    steps_in_all: int,
) -> None:
    """Sense, observe and judge one environment, and say whether its episode ends."""
    sense(parts, lane, now)
    time = now.step * lane.timing.step
    torque_wanted, rate, _ = parts.reference.value(lane.reference, time)
    wanted = Requested(torque_wanted, rate)
    pressure_1, pressure_2 = chamber_pressures(lane.plant, lane.state.angle, lane.state.mass_1, lane.state.mass_2)
    torque = joint_torque(lane.plant, lane.state.angle, pressure_1, pressure_2)
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


@lru_cache(maxsize=16)
def kernel_source(program: Program, task: Task) -> str:
    """Return the source text of the module whose ``go_on`` takes all environments of a program a step further."""
    collector = SourceCollector(INLINE)
    step = StepText(program, collector, further={**OWN, "view": task.view, "outcome": Outcome})
    loop = lane_loop(step, COMPILED, "advance", ARGUMENTS)
    lines = _lines_of_blocks(step, task)
    return "\n\n\n".join([HEADER, collector.text(), loop, entry_text("go_on", _PARAMETERS, lines)])


def _lines_of_blocks(step: StepText, task: Task) -> list[str]:
    """Return the lines of ``go_on``: block by block the commands, the lane loop, and what is observed at its end."""
    rows = _rows_between_calls(step, task)
    # How many rows of each array belong to a block.
    heights = {
        "states": str(len(rows.state_at)),
        "parameters": str(len(rows.parameter_at)),
        "own": str(len(OWN_PATHS)),
        "signal_history": str(SIGNAL_ROWS),
        "command_history": "(command_delay + 2)",
    }
    whole = {"signal_history": "all_signals", "command_history": "all_commands"}
    block = [
        *(
            f"{name} = {whole.get(name, f'all_{name}')}[block * {height}:(block + 1) * {height}]"
            for name, height in heights.items()
        ),
        "first = block * states.shape[1]",
        "width = min(states.shape[1], actions.shape[0] - first)",
        "slots = signal_history.shape[1]",
        # A call with 0 steps senses and observes alone: this is how episodes begin.
        "if steps > 0:",
        *indent(_lines_of_steps(step, rows, task)),
        "late = (moment - signal_delay) % slots",
        "for lane in range(width):",
        *indent(_lines_of_observing(step, rows, task)),
    ]
    return [f"for block in range(all_states.shape[0] // {heights['states']}):", *indent(block)]


def _rows_between_calls(step: StepText, task: Task) -> RowsOfLanes:
    """Return where each number lies between two calls of the lane loop: in the arrays, by block and lane.

    What a step hands on is gone then.
    """
    rows = RowsOfLanes(step)
    count = len(rows.state_at)
    rows.cells = {path: cell for path, cell in rows.cells.items() if path not in rows.step_at}
    rows.cells |= {path: path.replace(".", "_") for path in leaf_paths(HeldChambers, "held")}
    rows.cells |= {path: f"states[{row}, lane]" for path, row in rows.state_at.items()}
    rows.cells |= {path: f"parameters[{row - count}, lane]" for path, row in rows.parameter_at.items()}
    rows.cells |= {path: f"own[{row}, lane]" for row, path in enumerate(OWN_PATHS)}
    rows.cells |= {f"outcome.{name}": f"outcomes[{row}, first + lane]" for row, name in enumerate(Outcome._fields)}
    rows.cells |= {path: f"observations[first + lane, {row}]" for row, path in enumerate(task.observed_paths)}
    return rows


def _lines_of_steps(step: StepText, rows: RowsOfLanes, task: Task) -> list[str]:
    """Return the lines that set the commands of a block from the actions and run its steps."""
    command = step.collector.add(task.command)
    return [
        "for lane in range(states.shape[1]):",
        # Lanes without an environment take the action of the last one.
        "    place = min(first + lane, actions.shape[0] - 1)",
        f"    {rows.cells['result.command']} = {command}(actions[place, 0], actions[place, actions.shape[1] - 1])",
        "advance(states, parameters, signal_history, command_history, record, trace, moment - steps, steps, -1, "
        "steps_per_sample, 1.0, -1, 0, 0, signal_delay, command_delay)",
    ]


def _lines_of_observing(step: StepText, rows: RowsOfLanes, task: Task) -> list[str]:
    """Return the lines that sense, observe and judge the environment of a lane, where it is a chosen one."""
    add, parts = step.collector.add, step.parts
    names = {name: name for name in ("now", "error_weight", "gas_weight", "steps_in_all")}
    filled = rows.for_lane(Call(step.phase(fill_signals), {"slot": "slot"})) if parts.late_signals else ["pass"]
    held = rows.for_lane(Call(step.phase(hold_chambers), {})) if parts.hands_chambers_on else []
    readings = rows.for_lane(Call(step.phase(remember_readings), names)) if parts.late_readings else []
    within_bounds = [
        f"{rows.cells[path]} = {add(within)}({rows.cells[path]}, bounds[0, {row}], bounds[1, {row}])"
        for row, path in enumerate(task.observed_paths)
    ]
    return [
        "if chosen[first + lane] == 0.0:",
        "    continue",
        rows.load("start"),
        "step = moment - int(start.step)",
        "sample = step // steps_per_sample",
        *held,
        "if step == 0:",
        "    for slot in range(signal_history.shape[1]):",
        # Late signals of an episode begin with the readings at its start.
        *indent(indent(filled)),
        f"now = {add(Now)}(step, sample, 1.0, 0, 0, late, 0, sample % slots, slots)",
        *readings,
        *rows.for_lane(Call(step.phase(observe, {"task": task}), names)),
        *within_bounds,
    ]
