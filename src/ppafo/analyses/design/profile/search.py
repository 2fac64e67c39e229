"""Search for the feasible supply pressures of a valve, their gas demand, and the limiting quantity.

Each pressure is tried with many gains, and some openings, of one valve at once. Nothing is taken for
granted about how the error depends on the pressure.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal, final

import numpy as np
from numpy.typing import NDArray

from ppafo.analyses.design.profile.problem import SizingProblem
from ppafo.analyses.design.trials import STREAMS, run_trials
from ppafo.constants import PASCALS_PER_PSI
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.torque_loop import PROPORTIONAL_GAIN
from ppafo.errors import StudyError
from ppafo.parameters.parts import Part, rated_pressure
from ppafo.signals.recording import Floats
from ppafo.simulation.law_signals import IN_SCENARIO
from ppafo.simulation.numbers import number_at
from ppafo.simulation.torque_loop import loop_terms
from ppafo.studies.draws import seeds_of_noise

Limit = Literal["torque", "flow", "control", "pressure"]
LIMITS: dict[Limit, str] = {
    "torque": "the torque ceiling: torque constant times pressure",
    "flow": "the flow: a larger opening would suffice",
    "control": "the control: neither more pressure nor a larger opening would suffice",
    "pressure": "nothing: the lowest requested pressure suffices",
}
"""Quantity that keeps a valve from working at a lower pressure, or at any pressure, in words."""
ERROR, GAS = "rms_error", "gas_supplied"
_OPENINGS = ("valve.area", "valve.sonic_conductance")

_SEED = 1
"""Seed of the sensor noise: every pressure that is tried has the same."""
GRID = 17
"""Pressures of a grid."""
FINENESS = 0.1 * PASCALS_PER_PSI
"""Pressure [Pa] to which the lowest one is found."""
WIDER = (2.0, 4.0, 16.0)
"""Factors by which the opening is enlarged to test whether the flow is the limit [-]."""
NEAR_CEILING = 1.2
"""A lowest gauge pressure of at most this many times the one that the torque ceiling alone demands is owed to it."""
LEAST_PEAK = 0.7
"""Share of the peak that a pressure has to hold: an RMS error over a stride that is mostly zero lets half of it go."""
MORE_PRESSURE = 1.1
"""Times the gauge pressure at which the margin of the flow is looked for."""
OPENINGS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05)
"""Fractions of a valve's opening that are tried, one after the other, for that margin."""


@dataclass(frozen=True, slots=True, eq=False)
class ProfileTrials:
    """RMS error [N m], gas per repetition [kg] and number of the set of gains of trials; all (trials,).

    Error and gas are nan where a run failed.
    """

    error: Floats
    gas: Floats
    gains: NDArray[np.intp]

    def at(self, members: NDArray[np.intp]) -> "ProfileTrials":
        """Return some of the trials."""
        return ProfileTrials(self.error[members], self.gas[members], self.gains[members])


@dataclass(frozen=True, slots=True, eq=False)
class Pressures:
    """Pressures [Pa absolute] (pressures,) that were tried, growing, with the best trial of each.

    ``works`` tells which keep the error limit.
    """

    pressure: Floats
    trial: ProfileTrials
    works: NDArray[np.bool_]

    @property
    def first(self) -> int | None:
        """Place of the lowest pressure that works, None where none does."""
        return int(self.works.argmax()) if self.works.any() else None

    @property
    def fails_above(self) -> float | None:
        """A pressure above the lowest that works at which the limit is missed again; None where there is none."""
        failing = np.flatnonzero(~self.works[self.first :]) if self.first is not None else np.empty(0, dtype=int)
        return float(self.pressure[(self.first or 0) + failing[0]]) if failing.size else None


@final
class Trials:
    """Runs trials of a problem and counts the runs and their failures.

    ``gain_sets`` (sets, gains) has every combination of the gain factors, one for each gain. ``seeds`` name the streams
    of noise that every trial meets, its error being the largest and its gas the mean; none where there is no noise.
    """

    def __init__(self, problem: SizingProblem, threads: int | None = None) -> None:
        self.problem = problem
        self.gain_sets: Floats = np.array(list(product(problem.gain_factors, repeat=len(problem.gains))))
        self.runs = 0
        self.failures: dict[str, int] = {}
        # The scenario's own seed plays no part, so that two scenarios are judged in the same noise.
        self.seeds = seeds_of_noise([problem.scenario], (), 0, STREAMS, _SEED)
        self._threads = threads

    def run(self, valve: Part, pressure: Floats, gains: NDArray[np.intp], opening: Floats) -> ProfileTrials:
        """Return what came of a valve at pressures [Pa absolute], with sets of gains and factors on its opening."""
        columns = self.columns(valve, pressure, gains, opening)
        outcome = run_trials(self.problem.scenario, columns, (ERROR, GAS), self.seeds, self._threads)
        self.runs += outcome.runs
        for reason in outcome.reasons:
            self.failures[reason] = self.failures.get(reason, 0) + 1
        error, gas = outcome.metrics[ERROR].max(axis=0), outcome.metrics[GAS].mean(axis=0)
        return ProfileTrials(error, gas / self.problem.simulated, gains)

    def best(self, valve: Part, pressure: Floats, opening: float = 1.0) -> ProfileTrials:
        """Return for each pressure the trial with the best set of gains.

        Of those that keep the error limit the one that uses least gas; where none does, the one with the minimum error.
        """
        sets = self.gain_sets.shape[0]
        pressures, gains = np.repeat(pressure, sets), np.tile(np.arange(sets), pressure.size)
        trial = self.run(valve, pressures, gains, np.full(pressures.size, opening))
        shape = (pressure.size, sets)
        # Infinite for failed runs: argmin would take nan for the smallest.
        error = np.where(np.isnan(trial.error), np.inf, trial.error).reshape(shape)
        works = error <= self.problem.largest_error
        gas = np.where(works, trial.gas.reshape(shape), np.inf)
        chosen = np.where(works.any(axis=1), gas.argmin(axis=1), error.argmin(axis=1))
        return trial.at(np.arange(pressure.size) * sets + chosen)

    def gain_numbers(self, valve: Part, pressure: float, number: int) -> dict[str, float]:
        """Return the gains of a set in SI, by path, with a valve at a pressure [Pa absolute]."""
        columns = self.columns(valve, np.array([pressure]), np.array([number]), np.ones(1))
        return {path: float(columns[path][0]) for path in self.problem.gains}

    def columns(self, valve: Part, pressure: Floats, gains: NDArray[np.intp], opening: Floats) -> dict[str, Floats]:
        """Return the columns of trials in SI: figures of the parts, both supply pressures, gains.

        The scenario's gains are those of its own device: with other parts, and at another pressure, they are the same
        multiple of what the rules of ``control.torque_loop`` ask for.
        """
        problem, count = self.problem, pressure.size
        columns = {path: np.full(count, number) for path, number in valve.model_numbers.items()}
        columns |= {path: columns[path] * opening for path in _OPENINGS if path in columns}
        if problem.actuator is not None:
            for name in ("torque_constant", "displacement_per_radian"):
                columns[f"actuator.{name}"] = np.full(count, problem.actuator.values[name])
        columns |= {"supply.pressure": pressure, "supply.dorsiflexion_pressure": pressure}
        settings = problem.scenario.controller.settings
        follows = self.right_gain(columns) / self.right_gain({}) if problem.gains else 1.0
        for index, path in enumerate(problem.gains):
            columns[path] = self.gain_sets[gains, index] * settings[path.rpartition(".")[2]] * follows
        return columns

    def right_gain(self, columns: Mapping[str, Floats]) -> Any:
        """Return the proportional gain [1/(N m)] that the rules ask for, with some numbers in place of the device's."""
        scenario = self.problem.scenario
        term = loop_terms(scenario.device, CONTROLLERS[scenario.controller.kind], IN_SCENARIO)[PROPORTIONAL_GAIN]
        return term.number(lambda path: columns[path] if path in columns else number_at(scenario, path))


def highest_pressure(problem: SizingProblem, valve: Part) -> float:
    """Return the highest pressure [Pa absolute] to try: the file's, or what the parts are made for."""
    return min(problem.highest_pressure, rated_pressure(valve, *problem.carried))


def try_pressures(trials: Trials, valve: Part) -> Pressures:
    """Return the pressures that were tried with a valve, the lowest that works to within a tenth of a psi."""
    problem = trials.problem
    pressure = np.linspace(problem.lowest_pressure, highest_pressure(problem, valve), GRID)
    tried = _pressures(trials, valve, pressure)
    if np.isnan(tried.trial.error).all():
        reason = next(iter(trials.failures), "no reason was given")
        raise StudyError(f"{problem.file}: every run with '{valve.name}' failed; the first: {reason}")
    while tried.first and tried.pressure[tried.first] - tried.pressure[tried.first - 1] > FINENESS:
        lower, upper = tried.pressure[tried.first - 1], tried.pressure[tried.first]
        # Without both ends, which were tried before.
        finer = _pressures(trials, valve, np.linspace(lower, upper, GRID)[1:-1])
        both = (tried, finer)
        pressure = np.concatenate([part.pressure for part in both])
        trial = ProfileTrials(
            np.concatenate([part.trial.error for part in both]),
            np.concatenate([part.trial.gas for part in both]),
            np.concatenate([part.trial.gains for part in both]),
        )
        order = np.argsort(pressure, kind="stable")
        tried = Pressures(pressure[order], trial.at(order), np.concatenate([part.works for part in both])[order])
    return tried


def _pressures(trials: Trials, valve: Part, pressure: Floats) -> Pressures:
    trial = trials.best(valve, pressure)
    problem = trials.problem
    works = (trial.error <= problem.largest_error) & (pressure >= peak_pressure(problem))
    return Pressures(pressure, trial, works)


def limit_of(trials: Trials, valve: Part, tried: Pressures) -> Limit:
    """Return what keeps a valve from a lower pressure, or from working at all.

    The torque ceiling where the lowest pressure is near the one that it alone demands. Else larger openings are tried,
    half way between the two (between that one and the highest where none works): where one works, the flow limits.
    """
    problem = trials.problem
    # The lowest of all that were tried.
    if tried.first == 0:
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
    least = peak_pressure(problem)
    # No root is there to be found where the limit is kept without any torque: brentq needs a change of sign.
    if cut_error(problem, atmosphere) <= problem.largest_error:
        return least
    cut = float(brentq(lambda pressure: cut_error(problem, pressure) - problem.largest_error, atmosphere, whole))
    return max(cut, least)


def peak_pressure(problem: SizingProblem) -> float:
    """Return the pressure [Pa absolute] that holds the least share of the peak; equation (2)."""
    atmosphere = problem.scenario.device.supply.atmospheric_pressure
    return atmosphere + LEAST_PEAK * problem.profile.largest / problem.torque_constant


def cut_error(problem: SizingProblem, pressure: float) -> float:
    """Return the RMS error [N m] that is left if only the torque ceiling at a pressure [Pa] cuts the profile."""
    # The end of a period is its start again and must count once.
    # Two thousand points: the crest of a push-off, a tenth of a stride, still has two hundred.
    time = np.linspace(0.0, problem.profile.period, 2001)[:-1]
    wanted = problem.profile.at(time)
    most = ceiling(problem, pressure)
    return float(np.sqrt(np.mean((wanted - np.clip(wanted, -most, most)) ** 2)))


def ceiling(problem: SizingProblem, pressure: float) -> float:
    """Return the largest torque [N m] that a pressure [Pa absolute] can hold; equation (2) of the paper."""
    return problem.torque_constant * (pressure - problem.scenario.device.supply.atmospheric_pressure)


def flow_margin(trials: Trials, valve: Part, pressure: float) -> float:
    """Return by what fraction the opening might be smaller at a tenth more gauge pressure, with the best gains.

    At the lowest pressure itself nothing might be smaller: that is what makes it the lowest.
    """
    atmosphere = trials.problem.scenario.device.supply.atmospheric_pressure
    higher = np.array([atmosphere + MORE_PRESSURE * (pressure - atmosphere)])
    smallest = 1.0
    for opening in OPENINGS:
        # Negated, so that a failed run, whose error is nan, ends the search too.
        if not trials.best(valve, higher, opening).error[0] <= trials.problem.largest_error:
            break
        smallest = opening
    return 1.0 - smallest
