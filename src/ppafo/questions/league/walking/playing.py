"""What the engine makes of an optimal stride: the openings as recorded commands, from the heel strike on."""

from dataclasses import dataclass, replace

import numpy as np

from ppafo.engine.lanes import Batch, Floats
from ppafo.engine.replay import StepInputs, replay
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import Run, batch_of
from ppafo.model.chambers import chamber_mass
from ppafo.model.command import VENT
from ppafo.model.plant import chamber_volumes
from ppafo.parameters.device import Valve
from ppafo.questions.league.walking.measures import course_of, measures, toes_of
from ppafo.questions.league.walking.programme import MODES
from ppafo.questions.league.walking.solver import StrideOptimum
from ppafo.questions.league.walking.task import WalkingTask
from ppafo.simulation.scenario import Scenario
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import plan_walk
from ppafo.walking.varying import with_duration

STEP = 1.0e-4
"""Step [s] of a played stride: short enough for an interval to be shared out between the ways of the valve."""


@dataclass(frozen=True, slots=True)
class PlayedStride:
    """A played stride: RMS torque error [N m], gas [kg], lowest toes in mid-swing over the ground [m]."""

    rms_error: float
    gas: float
    height: float


def ideal_plan(task: WalkingTask, configuration: Scenario) -> Scenario:
    """The plan of a walk with a valve that follows at once and constant supply pressures: what the bound is for."""
    plan = with_duration(configuration, task.seconds)
    valve = plan.device.valve
    ideal = Valve(valve.kind, valve.orifice, dict.fromkeys(valve.settings, 0.0))
    return replace(plan, device=replace(plan.device, valve=ideal), supply_lines=None)


def play_stride(task: WalkingTask, valve: str, optimum: StrideOptimum) -> PlayedStride:
    """What the engine makes of an optimal stride that begins at its heel strike."""
    configuration = task.configuration("off", valve)
    plan = ideal_plan(task, configuration)
    walked = walk_of(plan)
    period, control = walked.gait.stride_time, replace(plan.control, period=STEP)
    run = plan_walk(replace(plan, control=control, duration=period + STEP, time_step=STEP, output_interval=STEP))
    run = replace(run, program=replace(run.program, controller=None), controller=())
    assert run.walk is not None, "a stride is walked"
    timing = run.walk.timing
    start = (1.0 - timing.toe_off) * period
    command = stride_command(optimum, valve, run.step, run.step_count, start)
    record = replay(_from_strike(run, optimum), StepInputs(command, {})).record[:, :, 0]
    rows = row_numbers(run.program.state_rows())
    channels = {name: record[:, row] for name, row in rows.items()}
    course = course_of(channels, run.plant, timing, toes_of(walked.gait, walked.wearer))
    found = measures(course, task.profile, timing, [slice(0, round(period / run.step))])
    return PlayedStride(found["torque_error"], found["gas"], found["toe_height"])


def stride_command(optimum: StrideOptimum, valve: str, step: float, step_count: int, start: float) -> Floats:
    """Command of every step [s] of a stride that begins ``start`` [s] after its toe-off.

    What a way of the valve has had too little of is carried on, and the way with the most comes next: a valve that
    switches between its ways at every step.
    """
    period = optimum.period
    times = (step * (np.arange(step_count) + 0.5) + start) % period
    fractions = optimum.openings[np.searchsorted(optimum.times, times, side="right") - 1]
    owed, command = np.zeros(MODES), np.empty(step_count)
    turn = _solenoid_turn if valve == "solenoid" else _proportional_turn
    for place, fraction in enumerate(fractions):
        command[place], owed = turn(owed + fraction)
    return command


def _proportional_turn(owed: Floats) -> tuple[float, Floats]:
    """Command of one step, and what is owed then: the dump valve is open or not, the spool as far as is owed."""
    towards_1, towards_2, vents = owed.tolist()
    if vents >= 0.5:
        return VENT, np.array([towards_1, towards_2, vents - 1.0])
    up = min(1.0, towards_1) if towards_1 >= towards_2 else 0.0
    down = min(1.0, towards_2) if towards_1 < towards_2 else 0.0
    return up - down, np.array([towards_1 - up, towards_2 - down, vents])


def _solenoid_turn(owed: Floats) -> tuple[float, Floats]:
    """Command of one step, and what is owed then: one of the chambers is fed in full, or none."""
    way = int(np.argmax(owed[:2]))
    if owed[way] < 0.5:
        return VENT, owed
    return (1.0, -1.0)[way], owed - np.eye(MODES)[way]


def _from_strike(run: Run, optimum: StrideOptimum) -> Batch:
    batch, rows, strike = batch_of(run), row_numbers(run.program.state_rows()), optimum.strike
    volumes = chamber_volumes(run.plant, strike.angle)
    pressures = (strike.pressure_1, strike.pressure_2)
    masses = [chamber_mass(*pair, run.plant.gas_product) for pair in zip(pressures, volumes, strict=True)]
    begin = (strike.angle, strike.angular_velocity, *masses)
    for name, value in zip(("angle", "angular_velocity", "mass_1", "mass_2"), begin, strict=True):
        batch.states[rows[f"state.{name}"]] = value
    return batch
