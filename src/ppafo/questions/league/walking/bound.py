"""Minimum error and gas of any control of a valve on the walking task, by optimal control of one stride.

Isothermal gas, the gait, wearer and device of the task, a periodic stride. On the ground the ankle is prescribed as in
the engine; from toe-off until the foot is flat it moves by the engine's own torques. The phase in which the foot lands
is tried out. Sampling, sensors, dead band, delays, spool and recognition of phases are left out: each can only make the
task harder. What the optimiser finds is a local optimum; that nothing is better is checked only by every controller
staying above it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import NamedTuple, final

import numpy as np

from ppafo.engine.lanes import Batch, Floats, StepInputs, replay
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import Run, batch_of
from ppafo.errors import SimulationError
from ppafo.model.plant import chamber_mass, chamber_volumes
from ppafo.model.valves.kind import VENT
from ppafo.parameters.device import Valve
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.league.bound import BOUNDED_VALVES, MISSING_EXTRA, NEARLY
from ppafo.questions.league.walking.measures import Toes, course_of, measures, stride_of, toes_of
from ppafo.questions.league.walking.solver import FREE, MODES, Guess, StrideOptimum, StrideSolver, guess_from_walk
from ppafo.questions.league.walking.task import WalkingTask
from ppafo.simulation.scenario import Scenario
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.planning import plan_walk

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


CLEAR = 0.0
"""Height [m] of the toes over the ground in mid-swing that the curve asks for."""
MIDDLE = 0.2
"""Fraction of the error of no torque at all, at which landings are compared."""
FIRST_POINT = 1.5
"""First point of the curve over the minimum error; the last one asks for no torque."""
SAME = 1.001
"""Errors that differ by this factor count as equal."""


@dataclass(frozen=True, slots=True)
class SearchGrid:
    """How thoroughly a bound is looked for.

    ``coarse`` intervals of a stride while landings are tried, ``fine`` ones for what is reported. ``landings`` are
    phases at which the foot may land flat, ``refinements`` steps about the best one, all as fractions of the time until
    the heel rises. ``points`` of the curve beside the minimum error.
    """

    coarse: int = 60
    fine: int = 120
    landings: tuple[float, ...] = (0.1, 0.14, 0.18, 0.22)
    refinements: tuple[float, ...] = (0.02, 0.01, 0.005)
    points: int = 9


THOROUGH = SearchGrid()


@final
class BoundSearch:
    """The strides of a task with one valve, which follows at once; ``grid`` says how thoroughly they are looked for."""

    def __init__(self, task: WalkingTask, valve: str, grid: SearchGrid) -> None:
        configuration = task.configuration("off", valve)
        self._task, self._valve, self.grid = task, valve, grid
        self._run: Run = plan_walk(ideal_plan(task, configuration))
        self._toes: Toes = toes_of(walk_of(configuration).gait, walk_of(configuration).wearer)
        self._near: Guess = guess_from_walk(task)

    def solver(self, landing: float, intervals: int, lag: float = 0.0) -> StrideSolver:
        """A solver that starts from the last good stride, for the desired torque late by a lag [s]."""
        assert self._run.walk is not None, "a league walks"
        stride = stride_of(self._run.walk, self._task.profile, landing, intervals, lag)
        return StrideSolver(self._run, stride, self._toes.path, self._near)

    def best_landing(self) -> StrideOptimum:
        """The thriftiest stride at the middle error on a coarse grid: landings far apart first, then about the best."""
        assert self._run.walk is not None, "a league walks"
        rise = self._run.walk.timing.heel_off
        grid = self.grid
        found = [self.at_landing(fraction * rise, grid.coarse) for fraction in grid.landings]
        for step in grid.refinements:
            about = self._thriftiest(found).landing
            found += [self.at_landing(about + way * step * rise, grid.coarse) for way in (-1.0, 1.0)]
        return self._thriftiest(found)

    def at_landing(self, landing: float, intervals: int) -> StrideOptimum | None:
        """The thriftiest stride at the middle error for one landing; None where the optimiser finds none."""
        solver = self.solver(landing, intervals)
        optimum = solver.least_gas(MIDDLE * solver.idle_error, CLEAR)
        self._near = self._near if optimum is None else optimum.guess
        return optimum

    def _thriftiest(self, found: Sequence[StrideOptimum | None]) -> StrideOptimum:
        good = [optimum for optimum in found if optimum is not None]
        if not good:
            raise SimulationError(
                f"{self._valve}: the optimiser found no stride for any landing; check that the supply can provide "
                "the torque and the toe clearance"
            )
        best = min(good, key=lambda optimum: optimum.gas)
        self._near = best.guess
        return best


class Reached(NamedTuple):
    """What a controller reached: RMS torque error [N m], height of its toes in mid-swing [m], and its lag [s].

    The error is that from the desired torque as late as the lag says. ``resistance`` [N m] is the RMS torque in
    mid-stance.
    """

    rms_error: float
    height: float
    lag: float = 0.0
    resistance: float = FREE


@dataclass(frozen=True, slots=True)
class WalkingBound:
    """The bound of a valve: the minimum error with toes that just clear the ground, and minimum gas at growing errors.

    ``own`` has, by name, the minimum gas for a torque as late as an entrant's, with at most its error and toes at least
    as high; None where the optimiser found no such stride. ``moved`` is the fraction by which the finer grid moved the
    gas at the middle error, ``landing`` the phase at which the foot is best flat.
    """

    least_error: StrideOptimum
    curve: tuple[StrideOptimum, ...]
    own: Mapping[str, StrideOptimum | None]
    landing: float
    intervals: int
    moved: float
    unmeasurable: float
    idle_error: float

    @property
    def is_attainable(self) -> bool:
        """True where some stride follows the desired torque so well that the error counts as none."""
        return self.least_error.rms_error <= NEARLY * self.unmeasurable


def check_bounded(valve: str) -> None:
    """Refuse a valve that the bound cannot be computed for, with the reason; SimulationError."""
    if find_spec("casadi") is None:
        raise SimulationError(MISSING_EXTRA)
    if valve not in BOUNDED_VALVES:
        raise SimulationError(f"no lower bound for valve '{valve}', only {', '.join(BOUNDED_VALVES)}")


def walking_bound(
    task: WalkingTask,
    valve: str,
    reached: Mapping[str, Reached],
    progress: Report = report_nothing,
    grid: SearchGrid = THOROUGH,
) -> WalkingBound:
    """The bound of a valve, with the minimum gas for what each entrant ``reached``.

    SimulationError where there is none.
    """
    check_bounded(valve)
    search = BoundSearch(task, valve, grid)
    progress(Progress(f"lower bound, {valve}: finding the best landing of the foot"))
    coarse = search.best_landing()
    progress(Progress(f"lower bound, {valve}: minimum gas at {grid.points + len(reached)} errors"))
    fine = search.at_landing(coarse.landing, grid.fine)
    solver = search.solver(coarse.landing, grid.fine)
    least = solver.least_error(CLEAR)
    if least is None or fine is None:
        raise SimulationError(
            f"{valve}: the optimiser found no stride with the minimum error and toes above the ground"
        )
    errors = np.geomspace(FIRST_POINT * least.rms_error, solver.idle_error, grid.points)
    goals = [Reached(error, CLEAR) for error in errors.tolist()]
    found = [least, fine, *_trade_off(solver, goals)]
    return WalkingBound(
        least_error=least,
        curve=tuple(best for goal in goals if (best := thriftiest(found, goal)) is not None),
        own=_own(search, found, reached),
        landing=fine.landing,
        intervals=grid.fine,
        moved=abs(fine.gas / coarse.gas - 1.0),
        unmeasurable=solver.unmeasurable,
        idle_error=solver.idle_error,
    )


def thriftiest(found: Sequence[StrideOptimum], goal: Reached) -> StrideOptimum | None:
    """Of some strides the one with the minimum gas that is at least as good as a goal; None where none is."""
    good = [item for item in found if item.rms_error <= SAME * goal.rms_error and item.height >= goal.height]
    return min(good, key=lambda item: item.gas, default=None)


def _trade_off(solver: StrideSolver, goals: Sequence[Reached]) -> list[StrideOptimum]:
    """Strides at growing errors and back again, each from the one before: two ways to each."""
    found = [solver.least_gas(goal.rms_error, goal.height) for goal in (*goals, *reversed(goals))]
    return [optimum for optimum in found if optimum is not None]


def _own(
    search: BoundSearch, found: Sequence[StrideOptimum], reached: Mapping[str, Reached]
) -> dict[str, StrideOptimum | None]:
    """The minimum gas for what each entrant reached, from the stride of the curve whose error is nearest."""
    own: dict[str, StrideOptimum | None] = {}
    for lag in sorted({goal.lag for goal in reached.values()}):
        solver = search.solver(found[0].landing, search.grid.fine, lag)
        for name, goal in reached.items():
            if goal.lag == lag:
                near = min(found, key=lambda item: abs(item.rms_error - goal.rms_error))
                solver.start_from(near.guess)
                own[name] = solver.least_gas(goal.rms_error, goal.height, max(goal.resistance, FREE))
    return own
