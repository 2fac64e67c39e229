"""The pressures at which one valve keeps the error limit: a grid, then ever finer ones below the first that works.

Nothing is taken for granted about how the error depends on the pressure.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.constants import PASCALS_PER_PSI
from ppafo.errors import StudyError
from ppafo.parameters.parts import Part
from ppafo.studies.sizing.problem import SizingProblem
from ppafo.studies.sizing.result import Limit
from ppafo.studies.sizing.trials import Trial, Trials

Floats = NDArray[np.float64]

GRID = 17
"""Pressures of a grid."""
FINENESS = 0.1 * PASCALS_PER_PSI
"""Pressure [Pa] to which the lowest one is found."""
WIDER = (2.0, 4.0, 16.0)
"""How much larger openings are tried to see whether the flow limits."""
NEAR_CEILING = 1.2
"""A lowest gauge pressure of at most this many times the one that the torque ceiling alone demands is owed to it."""
MORE_PRESSURE = 1.1
"""Times the gauge pressure at which the margin of the flow is looked for."""
OPENINGS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05)
"""Shares of a valve's opening that are tried, one after the other, for that margin."""


@dataclass(frozen=True, slots=True, eq=False)
class Pressures:
    """Pressures [Pa absolute] (pressures,) that were tried, growing, with the best trial of each.

    ``works`` tells which keep the error limit.
    """

    pressure: Floats
    trial: Trial
    works: NDArray[np.bool_]

    @property
    def first(self) -> int | None:
        """Place of the lowest pressure that works, None where none does."""
        return int(self.works.argmax()) if self.works.any() else None

    @property
    def below(self) -> float | None:
        """The highest pressure below the lowest that works; None where none works or none below was tried."""
        return float(self.pressure[self.first - 1]) if self.first else None

    @property
    def fails_above(self) -> float | None:
        """A pressure above the lowest that works at which the limit is missed again; None where there is none."""
        failing = np.flatnonzero(~self.works[self.first :]) if self.first is not None else np.empty(0, dtype=int)
        return float(self.pressure[(self.first or 0) + failing[0]]) if failing.size else None


def highest_pressure(problem: SizingProblem, valve: Part) -> float:
    """Return the highest pressure [Pa absolute] to try: that of the file, or what the parts are made for."""
    parts = [valve, *problem.regulators, *([] if problem.actuator is None else [problem.actuator])]
    return min([problem.highest_pressure, *(part.values.get("largest_pressure", np.inf) for part in parts)])


def tried_pressures(trials: Trials, valve: Part) -> Pressures:
    """Return the pressures that were tried with a valve, the lowest that works to within a tenth of a psi."""
    problem = trials.problem
    pressure = np.linspace(problem.lowest_pressure, highest_pressure(problem, valve), GRID)
    found = _pressures(trials, valve, pressure)
    if np.isnan(found.trial.error).all():
        reason = next(iter(trials.failures), "no reason was given")
        raise StudyError(f"{problem.file}: every run with '{valve.name}' failed; the first: {reason}")
    while found.first and found.pressure[found.first] - found.pressure[found.first - 1] > FINENESS:
        lower, upper = found.pressure[found.first - 1], found.pressure[found.first]
        finer = _pressures(trials, valve, np.linspace(lower, upper, GRID)[1:-1])
        found = _merged(found, finer)
    return found


def _pressures(trials: Trials, valve: Part, pressure: Floats) -> Pressures:
    trial = trials.best(valve, pressure)
    works = trial.error <= trials.problem.largest_error
    return Pressures(pressure, trial, works)


def _merged(first: Pressures, second: Pressures) -> Pressures:
    """Return the pressures of both in order."""
    pressure = np.concatenate([first.pressure, second.pressure])
    order = np.argsort(pressure, kind="stable")
    trial = Trial(
        np.concatenate([first.trial.error, second.trial.error]),
        np.concatenate([first.trial.gas, second.trial.gas]),
        np.concatenate([first.trial.gains, second.trial.gains]),
    )
    return Pressures(pressure[order], trial.at(order), np.concatenate([first.works, second.works])[order])


def limit_of(trials: Trials, valve: Part, tried: Pressures) -> Limit:
    """Return what keeps a valve from a lower pressure, or from working at all.

    The torque ceiling where the lowest pressure is near the one that it alone demands. Else larger openings are tried,
    half way between the two (between that one and the highest where none works): where one works, the flow limits.
    """
    problem = trials.problem
    if tried.first is not None and tried.below is None:
        return "pressure"
    atmosphere, alone = problem.scenario.device.supply.atmospheric_pressure, ceiling_pressure(problem)
    reached = float(tried.pressure[-1 if tried.first is None else tried.first])
    if reached - atmosphere <= NEAR_CEILING * (alone - atmosphere):
        return "torque"
    pressure = np.array([0.5 * (reached + alone)])
    would_do = any(trials.best(valve, pressure, wider).error[0] <= problem.largest_error for wider in WIDER)
    return "flow" if would_do else "control"


def ceiling_pressure(problem: SizingProblem) -> float:
    """Return the pressure [Pa absolute] below which the cut crest alone breaks the error limit; equation (2)."""
    from scipy.optimize import brentq

    atmosphere = problem.scenario.device.supply.atmospheric_pressure
    whole = atmosphere + problem.profile.largest / problem.torque_constant
    if cut_error(problem, atmosphere) <= problem.largest_error:
        return atmosphere
    return float(brentq(lambda pressure: cut_error(problem, pressure) - problem.largest_error, atmosphere, whole))


def cut_error(problem: SizingProblem, pressure: float) -> float:
    """Return the RMS error [N m] that is left if only the torque ceiling at a pressure [Pa] cuts the profile."""
    time = np.linspace(0.0, problem.profile.period, 2001)[:-1]
    wanted = problem.profile.at(time)
    most = ceiling(problem, pressure)
    return float(np.sqrt(np.mean((wanted - np.clip(wanted, -most, most)) ** 2)))


def ceiling(problem: SizingProblem, pressure: float) -> float:
    """Return the largest torque [N m] that a pressure [Pa absolute] can hold; equation (2)."""
    return problem.torque_constant * (pressure - problem.scenario.device.supply.atmospheric_pressure)


def flow_margin(trials: Trials, valve: Part, pressure: float) -> float:
    """Return by what share the opening might be smaller if the gauge pressure were a tenth higher, with the best gains.

    At the lowest pressure itself nothing might be smaller: that is what makes it the lowest.
    """
    atmosphere = trials.problem.scenario.device.supply.atmospheric_pressure
    higher = np.array([atmosphere + MORE_PRESSURE * (pressure - atmosphere)])
    smallest = 1.0
    for opening in OPENINGS:
        if not trials.best(valve, higher, opening).error[0] <= trials.problem.largest_error:
            break
        smallest = opening
    return 1.0 - smallest
