"""The least error and the least gas of any control of a valve on the walking task, by optimal control of one stride.

Isothermal gas, the gait, wearer and device of the task, a periodic stride. On the ground the ankle is led as in the
engine; from toe-off until the foot is flat it moves by the engine's own torques. When the foot lands is a phase that is
tried out. Sampling, sensors, dead band, delays, spool and recognition of phases are left out: each can only make the
task harder. What the optimiser finds is a local optimum; that nothing is better is checked only by every controller
staying above it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import NamedTuple

import numpy as np

from ppafo.errors import SimulationError
from ppafo.studies.league.lower_bound import MISSING_EXTRA
from ppafo.studies.league.walking.openings import OPENINGS
from ppafo.studies.league.walking.search import CLEAR, THOROUGH, BoundSearch, SearchGrid
from ppafo.studies.league.walking.solver import FREE, StrideOptimum, StrideSolver
from ppafo.studies.league.walking.task import WalkingTask

FIRST_POINT = 1.5
"""First point of the curve over the least error; the last one asks for no torque."""
SAME = 1.001
"""Errors that differ by this factor count as equal."""


class Reached(NamedTuple):
    """What a controller reached: RMS torque error [N m], height of its toes in mid-swing [m], and its lag [s].

    The error is that from the wanted torque as late as the lag says. ``resistance`` [N m] is the RMS torque in
    mid-stance.
    """

    rms_error: float
    height: float
    lag: float = 0.0
    resistance: float = FREE


@dataclass(frozen=True, slots=True)
class WalkingBound:
    """The bound of a valve: the least error with toes that just clear the ground, and the least gas at growing errors.

    ``own`` has, by name, the least gas for a torque as late as an entrant's, with at most its error and toes at least
    as high; None where the optimiser found no such stride. ``moved`` is the share by which the finer grid moved the
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


def check_bounded(valve: str) -> None:
    """Refuse a valve that the bound cannot be computed for, and say why; SimulationError."""
    if find_spec("casadi") is None:
        raise SimulationError(MISSING_EXTRA)
    if valve not in OPENINGS:
        raise SimulationError(f"no lower bound for valve '{valve}', only {', '.join(OPENINGS)}")


def walking_bound(
    task: WalkingTask,
    valve: str,
    reached: Mapping[str, Reached],
    say: Callable[[str], None] = lambda _: None,
    grid: SearchGrid = THOROUGH,
) -> WalkingBound:
    """The bound of a valve, with the least gas for what each entrant ``reached``.

    SimulationError where there is none.
    """
    check_bounded(valve)
    search = BoundSearch(task, valve, grid)
    say(f"lower bound, {valve}: when the foot lands best")
    coarse = search.best_landing()
    say(f"lower bound, {valve}: the least gas at {grid.points + len(reached)} errors")
    fine = search.at_landing(coarse.landing, grid.fine)
    solver = search.solver(coarse.landing, grid.fine)
    least = solver.least_error(CLEAR)
    if least is None or fine is None:
        raise SimulationError(f"{valve}: the optimiser found no stride with the least error and toes above the ground")
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
    """Of some strides the one with the least gas that is at least as good as a goal; None where none is."""
    good = [item for item in found if item.rms_error <= SAME * goal.rms_error and item.height >= goal.height]
    return min(good, key=lambda item: item.gas, default=None)


def _trade_off(solver: StrideSolver, goals: Sequence[Reached]) -> list[StrideOptimum]:
    """Strides at growing errors and back again, each from the one before: two ways to each."""
    found = [solver.least_gas(goal.rms_error, goal.height) for goal in (*goals, *reversed(goals))]
    return [optimum for optimum in found if optimum is not None]


def _own(
    search: BoundSearch, found: Sequence[StrideOptimum], reached: Mapping[str, Reached]
) -> dict[str, StrideOptimum | None]:
    """The least gas for what each entrant reached, from the stride of the curve whose error is nearest."""
    own: dict[str, StrideOptimum | None] = {}
    for lag in sorted({goal.lag for goal in reached.values()}):
        solver = search.solver(found[0].landing, search.grid.fine, lag)
        for name, goal in reached.items():
            if goal.lag == lag:
                near = min(found, key=lambda item: abs(item.rms_error - goal.rms_error))
                solver.start_from(near.guess)
                own[name] = solver.least_gas(goal.rms_error, goal.height, max(goal.resistance, FREE))
    return own
