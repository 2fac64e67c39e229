"""Solves the programme of the lower bound with IPOPT, warm from one point of the trade-off curve to the next."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.errors import SimulationError
from ppafo.questions.league.bound_problem import Programme, programme
from ppafo.simulation.plan import profile_values
from ppafo.simulation.scenario import Control, Scenario
from ppafo.simulation.simulate import simulate

GUESSED_BY = "feedback_linearisation"
"""The controller whose run the optimiser starts from; any start will do that is near the task."""
GUESS_PERIOD = 1.0e-3
NEARLY_CONVEX = 2.0e-3
"""Fraction by which a point may lie above the line between its neighbours."""
AS_GOOD = 1.0001
"""Errors that differ by this factor count as equal."""
MEASURABLE = 1.0e-3
"""An error below this fraction of the largest reference counts as none: nobody could measure the difference."""
TIE_BREAK = 1.0e-6
"""Weight of the gas [1/g] beside the mean square error [N^2 m^2]: of equal errors the thrifty one is taken."""
OPTIONS: dict[str, Any] = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 300,
    "ipopt.tol": 1.0e-7,
    "ipopt.acceptable_tol": 1.0e-6,
}
STRATEGIES = ({"ipopt.mu_strategy": "adaptive"}, {"ipopt.mu_strategy": "monotone"})
"""The first is mostly quicker; where it fails, the second is tried."""


@dataclass(frozen=True, slots=True)
class Optimum:
    """One optimal control: RMS error [N m], gas [kg], and the openings both ways, held from each of the times [s] on.

    Where both openings ``towards_1`` and ``towards_2`` [-] are above 0, the valve switches between the two.
    """

    rms_error: float
    gas: float
    times: Floats
    towards_1: Floats
    towards_2: Floats

    @property
    def overlap(self) -> float:
        """Largest opening of the lesser way [-]: 0 where a valve can do just this."""
        return float(np.max(np.minimum(self.towards_1, self.towards_2)))


@final
class BoundSolver:
    """Optimal controls of one scenario on one grid; an error below ``unmeasurable`` [N m] counts as none.

    ``idle_error`` [N m] is the RMS error of no torque at all.
    """

    def __init__(self, scenario: Scenario, intervals: int) -> None:
        import casadi

        self._programme = programme(scenario, intervals)
        built = self._programme
        weights = casadi.SX.sym("weights", 2)
        problem = {
            "x": built.unknowns,
            "p": weights,
            "f": weights[0] * built.mean_square + weights[1] * built.gas,
            "g": casadi.vertcat(built.equal_to_zero, built.openings_sum, built.mean_square),
        }
        self._solvers = [casadi.nlpsol("bound", "ipopt", problem, OPTIONS | strategy) for strategy in STRATEGIES]
        self._measures = casadi.Function("measures", [built.unknowns], [built.mean_square, built.gas])
        self._name = scenario.name
        self._first: Any = _guess(scenario, built)
        self._near = self._first
        reference = profile_values(scenario.reference, built.grid.times)[0]
        self.unmeasurable = MEASURABLE * float(np.max(np.abs(reference)))
        self.idle_error = float(np.sqrt(np.mean(reference**2)))

    def least_error(self) -> Optimum:
        """The control with the minimum RMS error, and of all with that error the thriftiest."""
        least = self._solve((1.0, TIE_BREAK), np.inf)
        return self.least_gas(max(AS_GOOD * least.rms_error, self.unmeasurable))

    def least_gas(self, rms_error: float) -> Optimum:
        """The control with the minimum gas of all whose RMS error [N m] is at most this."""
        return self._solve((TIE_BREAK, 1.0), rms_error * rms_error)

    def trade_off(self, errors: Sequence[float]) -> list[Optimum]:
        """The minimum gas at growing errors [N m], each from the one before.

        A point that lies above the line between its neighbours is a local optimum only; it is tried again from the
        next one, and the better of both is kept.
        """
        found, states = [], []
        for error in errors:
            found.append(self.least_gas(error))
            states.append(self._near)
        for place in range(len(found) - 2, 0, -1):
            before, here, after = found[place - 1 : place + 2]
            span = (here.rms_error - before.rms_error) / (after.rms_error - before.rms_error)
            if here.gas > (1.0 + NEARLY_CONVEX) * (before.gas + span * (after.gas - before.gas)):
                self._near = states[place + 1]
                again = self.least_gas(errors[place])
                found[place] = min(here, again, key=lambda optimum: optimum.gas)
        return found

    def _solve(self, weights: tuple[float, float], maximum_square: float) -> Optimum:
        built = self._programme
        zeros, sums = built.equal_to_zero.numel(), built.openings_sum.numel()
        limits: dict[str, Any] = {
            "lbx": built.lowest,
            "ubx": built.highest,
            "lbg": [0.0] * zeros + [-np.inf] * (sums + 1),
            "ubg": [0.0] * zeros + [1.0] * sums + [maximum_square],
        }
        ended = ""
        for start in (self._near, self._first):
            for solver in self._solvers:
                found = solver(x0=start, p=weights, **limits)
                if solver.stats()["success"]:
                    self._near = found["x"]
                    return self._optimum(found["x"])
                ended = solver.stats()["return_status"]
        raise SimulationError(
            f"{self._name}: the optimiser of the lower bound ended with '{ended}' from every starting point; try a "
            "shorter task, or another initial pressure"
        )

    def _optimum(self, solution: Any) -> Optimum:
        grid = self._programme.grid
        square, gas = (float(item) for item in self._measures(solution))
        towards = np.array(solution)[2 * grid.times.size :].reshape(-1, 2)
        return Optimum(
            rms_error=float(np.sqrt(max(square, 0.0))),
            gas=1.0e-3 * gas,
            times=grid.starts,
            towards_1=towards[:, 0],
            towards_2=towards[:, 1],
        )


def _guess(scenario: Scenario, built: Programme) -> Floats:
    """Pressures and openings of a controlled run at the points, as the unknowns have them."""
    from ppafo.control.catalog import CONTROLLERS

    settings = {item.name: float(item.default or 0.0) for item in CONTROLLERS[GUESSED_BY].quantities}
    run = simulate(replace(scenario, control=Control(GUESSED_BY, settings, GUESS_PERIOD))).recording
    grid = built.grid
    first, second = (np.interp(grid.times, run.time, run[name]) for name in ("pressure_1", "pressure_2"))
    command = np.interp(grid.starts + 0.5 * grid.starts[1], run.time, run["command"])
    pressures = np.array([first, second]).T.ravel() / built.scale
    openings = np.array([np.maximum(command, 0.0), np.maximum(-command, 0.0)]).T.ravel()
    guess: Floats = np.clip(np.concatenate([pressures, openings]), built.lowest, built.highest)
    return guess
