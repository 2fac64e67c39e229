"""Looks for the best strides of a valve: solvers for any landing and lag, and the landing that is best."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

from ppafo.engine.run import Run
from ppafo.errors import SimulationError
from ppafo.studies.league.walking.course import Toes, toes_of
from ppafo.studies.league.walking.guess import Guess, walked_guess
from ppafo.studies.league.walking.playing import ideal_plan
from ppafo.studies.league.walking.solver import StrideOptimum, StrideSolver
from ppafo.studies.league.walking.stride import stride_of
from ppafo.studies.league.walking.task import WalkingTask
from ppafo.walking.planning import plan_walk

CLEAR = 0.0
"""Height [m] of the toes over the ground in mid-swing that the curve asks for."""
MIDDLE = 0.2
"""Share of the error of no torque at all, at which landings are compared."""


@dataclass(frozen=True, slots=True)
class SearchGrid:
    """How thoroughly a bound is looked for.

    ``coarse`` intervals of a stride while landings are tried, ``fine`` ones for what is reported. ``landings`` are
    phases at which the foot may land flat, ``refinements`` steps about the best one, all as shares of the time until
    the heel rises. ``points`` of the curve beside the least error.
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
        self._toes: Toes = toes_of(configuration.gait, configuration.wearer)
        self._near: Guess = walked_guess(task)

    def solver(self, landing: float, intervals: int, lag: float = 0.0) -> StrideSolver:
        """A solver that starts from the last good stride, for the wanted torque late by a lag [s]."""
        assert self._run.walk is not None, "a league walks"
        stride = stride_of(self._run.walk, self._task.profile, landing, intervals, lag)
        return StrideSolver(self._run, self._valve, stride, self._toes.path, self._near)

    def best_landing(self) -> StrideOptimum:
        """The thriftiest stride at the middle error on a coarse grid: landings far apart first, then about the best."""
        assert self._run.walk is not None, "a league walks"
        rise = self._run.walk.timing.heel_off
        grid = self.grid
        found = [self.at_landing(share * rise, grid.coarse) for share in grid.landings]
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
                f"{self._valve}: the optimiser found no stride for any landing; is the torque or the toes' height "
                "within reach of the supply?"
            )
        best = min(good, key=lambda optimum: optimum.gas)
        self._near = best.guess
        return best
