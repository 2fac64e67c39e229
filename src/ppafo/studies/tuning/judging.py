"""From the runs of candidates to one number each, by which they are compared.

A candidate that keeps all constraints is always better than one that does not; among those that do not, less
violation is better; a candidate with a run that fails is worse than all (Deb's rules, 2000).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.simulation.plan import profile_bounds
from ppafo.simulation.scenario import Scenario
from ppafo.studies.sweep.sampling.distributions import Floats
from ppafo.studies.tuning.problem import Constraint, Goal, Problem, Spread

INFEASIBLE = 1.0e6
"""Where the costs of candidates begin that break a constraint."""
FAILED = 1.0e12
"""Where the costs of candidates begin of which a run fails; the share of such runs is added."""


@dataclass(frozen=True, slots=True)
class Runs:
    """Metrics by name and failures of candidates, each (candidates, draws); one draw without uncertainty."""

    metrics: Mapping[str, Floats]
    failed: NDArray[np.bool_]

    @property
    def without_value(self) -> Floats:
        """Share of the runs of each candidate that failed or lack a metric (candidates,)."""
        lacking = self.failed | np.any([~np.isfinite(values) for values in self.metrics.values()], axis=0)
        return np.asarray(np.mean(lacking, axis=1))


@dataclass(frozen=True, slots=True)
class Judged:
    """Objective, violation and what both are made of, each (candidates,): metric at its bad end by name [SI]."""

    objective: Floats
    violation: Floats
    without_value: Floats

    @property
    def cost(self) -> Floats:
        """One number by which candidates are compared."""
        usual = np.where(self.violation > 0.0, INFEASIBLE + self.violation, self.objective)
        return np.where(self.without_value > 0.0, FAILED * (1.0 + self.without_value), usual)

    @property
    def is_feasible(self) -> NDArray[np.bool_]:
        """Which candidates keep all constraints and never fail."""
        return np.asarray((self.violation == 0.0) & (self.without_value == 0.0))


def keeps(item: Constraint, value: float) -> bool:
    """Tell whether a value [SI] keeps a constraint."""
    return value <= item.limit if item.is_most else value >= item.limit


def shortfall(scenario: Scenario) -> Floats:
    """Return what the supply lacks of the largest reference [N m] in each run (runs,); 0 for nothing.

    With one chamber at its supply and the other at the atmosphere the vane holds at most the torque constant times the
    difference of the two (equation (2)), whatever the controller does.
    """
    supply, constant = scenario.device.supply, scenario.device.actuator.torque_constant
    lowest, highest = profile_bounds(scenario.reference)
    above = highest - constant * (supply.pressure - supply.atmospheric_pressure)
    below = -lowest - constant * (supply.dorsiflexion_pressure - supply.atmospheric_pressure)
    return np.atleast_1d(np.maximum(0.0, np.maximum(above, below)))


def bad_ends(values: Floats, spread: Spread | None, is_high: bool) -> Floats:
    """Return the value of a metric by which candidates are judged (candidates,) from (candidates, draws) [SI]."""
    return values[:, 0] if spread is None else spread.bad_end(values, is_high)


def judge(runs: Runs, problem: Problem, scales: Mapping[str, float]) -> Judged:
    """Return objective and violation of candidates; ``scales`` are the sizes of the goals by metric [SI]."""
    failing = runs.without_value
    known = {name: np.where(failing[:, None] > 0.0, 0.0, values) for name, values in runs.metrics.items()}
    objective = sum((_term(goal, known, problem.spread, scales) for goal in problem.goals), np.zeros(failing.size))
    violation = sum((_excess(item, known, problem.spread) for item in problem.constraints), np.zeros(failing.size))
    return Judged(np.asarray(objective), np.asarray(violation), failing)


def _term(goal: Goal, values: Mapping[str, Floats], spread: Spread | None, scales: Mapping[str, float]) -> Floats:
    return goal.weight * bad_ends(values[goal.metric], spread, goal.weight > 0.0) / scales[goal.metric]


def _excess(item: Constraint, values: Mapping[str, Floats], spread: Spread | None) -> Floats:
    """Return by how much a constraint is broken, as a share of its limit (candidates,); 0 where it is kept."""
    reached = bad_ends(values[item.metric], spread, item.is_most)
    beyond = reached - item.limit if item.is_most else item.limit - reached
    return np.maximum(0.0, beyond) / (abs(item.limit) or 1.0)
