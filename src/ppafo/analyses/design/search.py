"""Search for the feasible supply pressures of a valve, their gas demand, and the limiting quantity.

Each pressure is tried in one batch with many gains, and with some openings, of one valve. The error is not assumed to
be monotonic in the pressure.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Any, Literal, final

import numpy as np
from numpy.typing import NDArray

from ppafo.analyses.design.problem import CandidateValve, SizingProblem
from ppafo.constants import PASCALS_PER_PSI
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.torque_loop import PROPORTIONAL_GAIN
from ppafo.errors import StudyError
from ppafo.signals.recording import Floats
from ppafo.simulation.default_gains import default_gain_terms
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.law_signals import IN_SCENARIO
from ppafo.simulation.numbers import NOISE_SEED, number_at
from ppafo.simulation.tracking import REVERSALS
from ppafo.studies.draws import seeds_of_noise
from ppafo.study.runs import oscillating

Limit = Literal["torque", "flow", "control", "pressure"]
LIMITS: dict[Limit, str] = {
    "torque": "the torque ceiling: torque constant times pressure",
    "flow": "the flow: a larger opening would suffice",
    "control": "the torque loop: no gains were found with which it follows",
    "pressure": "pressure.lowest: no lower pressure was tried",
}
"""Quantities that limit a valve, each with its description in words."""
ERROR, GAS = "rms_error", "gas_supplied"
OSCILLATES = "the torque loop oscillates"
_OPENINGS = ("valve.area", "valve.sonic_conductance")

STREAMS = 16
"""Number of noise streams of each trial if sensors are noisy; the streams are the same for all trials."""
SCALES = (1.0, 8.0, 64.0, 0.125, 0.015625)
"""Common factors [-] on the combinations of gain factors, tried in turn: a slow valve needs other gains for a task."""
_SEED = 1
"""Random seed of the noise streams, the same for every pressure."""
_AT_ONCE = 16_384
"""Number of runs of a batch: enough to occupy all threads with little memory."""
GRID = 17
"""Number of supply pressures that are tried in each round of the search."""
FINENESS = 0.1 * PASCALS_PER_PSI
"""Tolerance [Pa] of the lowest feasible supply pressure."""
WIDER = (2.0, 4.0, 16.0)
"""Factors [-] on the valve opening that show whether the flow is the limit."""
NEAR_CEILING = 1.2
"""Ratio [-] of lowest gauge pressure to ceiling gauge pressure up to which the torque counts as the limit."""
_LAGS = ("delay", "spool_frequency", "slew_limit", "opening_delay", "closing_delay", "switching_interval")
LAGS = {f"valve.{name}" for name in _LAGS}
"""Numbers of a valve that moves late or slowly; at 0 it moves at once."""
LEAST_PEAK = 0.7
"""Required share of the peak torque [-]: the RMS error over a mostly zero stride alone would accept half the peak."""
MORE_PRESSURE = 1.1
"""Factor on the gauge pressure for the flow margin [-]."""
OPENINGS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05)
"""Fractions of a valve's opening tried in turn for the flow margin."""


Trial = NDArray[np.void]
"""Structured array of trials, with the fields of ``TRIAL``."""
TRIAL = np.dtype([("pressure", np.float64), ("error", np.float64), ("gas", np.float64), ("gains", np.intp)])
"""Row of a trial: supply pressure [Pa absolute], RMS error [N m], gas per repetition [kg], index of the gain set.

Error and gas are nan if a run failed or oscillated.
"""


@final
class Trials:
    """Runner of the trials of a sizing problem, which counts runs and failures.

    ``gain_sets`` (sets, gains): every combination of the gain factors, ``combinations`` of them at each of ``SCALES``
    ``seeds``: noise streams of every trial, the same for all; empty without noise

    The error of a trial is the largest over the streams, its gas the mean.
    """

    def __init__(self, problem: SizingProblem, threads: int | None = None) -> None:
        self.problem = problem
        factors = np.array(list(product(problem.gain_factors, repeat=len(problem.gains))))
        self.combinations = len(factors)
        scales = SCALES if problem.gains else SCALES[:1]
        self.gain_sets: Floats = np.concatenate([scale * factors for scale in scales])
        self.runs = 0
        self.failures: Counter[str] = Counter()
        # The scenario's own seed plays no part, so that two scenarios are judged in the same noise.
        self.seeds = seeds_of_noise([problem.scenario], (), STREAMS, _SEED)
        self._threads = threads

    def run(self, valve: CandidateValve, pressure: Floats, gains: NDArray[np.intp], opening: Floats) -> Trial:
        """Run trials of a valve at supply pressures [Pa absolute].

        Each trial has an index of a gain set in ``gains`` and a factor on the valve opening in ``opening`` [-].
        """
        scenario, streams, count = self.problem.scenario, max(1, self.seeds.size), pressure.size
        columns = self.columns(valve, pressure, gains, opening)
        error, gas = np.empty((2, streams, count))
        chunk = max(1, _AT_ONCE // streams)
        for start in range(0, count, chunk):
            rows = slice(start, start + chunk)
            tiled = {path: np.tile(values[rows], streams) for path, values in columns.items()}
            if self.seeds.size:
                tiled[NOISE_SEED] = np.repeat(self.seeds, pressure[rows].size)
            # The error limit of the design judges the tracking: no other tracking metric is needed.
            result = run_ensemble(scenario, tiled, (ERROR, GAS, REVERSALS), threads=self._threads)
            # A loop that oscillates is no design, whatever its error is.
            oscillates = oscillating(result.metrics, scenario)
            error[:, rows] = np.where(oscillates, np.nan, result.metrics[ERROR]).reshape(streams, -1)
            gas[:, rows] = np.where(oscillates, np.nan, result.metrics[GAS]).reshape(streams, -1)
            self.runs += oscillates.size
            self.failures.update(result.reasons.values())
            self.failures += Counter({OSCILLATES: int(np.count_nonzero(oscillates))})
        trial = np.empty(count, TRIAL)
        trial["pressure"], trial["gains"] = pressure, gains
        trial["error"], trial["gas"] = error.max(axis=0), gas.mean(axis=0) / self.problem.simulated
        return trial

    def best(self, valve: CandidateValve, pressure: Floats, opening: float = 1.0, like: int = 0) -> Trial:
        """Return for each pressure the trial with the best set of gains at the scale of the gain set ``like``.

        The best set uses the least gas of all sets that keep the error limit; if no set keeps the limit, it has the
        smallest error.
        """
        sets, first = self.combinations, like - like % self.combinations
        pressures, gains = np.repeat(pressure, sets), np.tile(first + np.arange(sets), pressure.size)
        trial = self.run(valve, pressures, gains, np.full(pressures.size, opening)).reshape(pressure.size, sets)
        # Infinite for failed runs: argmin would take nan for the smallest.
        error = np.where(np.isnan(trial["error"]), np.inf, trial["error"])
        works = error <= self.problem.largest_error
        gas = np.where(works, trial["gas"], np.inf)
        chosen = np.where(works.any(axis=1), gas.argmin(axis=1), error.argmin(axis=1))
        return np.asarray(trial[np.arange(pressure.size), chosen])

    def columns(
        self, valve: CandidateValve, pressure: Floats, gains: NDArray[np.intp], opening: Floats
    ) -> dict[str, Floats]:
        """Return the columns of trials in SI: numbers of the valve, both supply pressures, gains.

        The gains of the scenario fit its own device. For other valves and pressures they are scaled, so that the ratio
        to the gains of the rules in ``control.torque_loop`` stays the same.
        """
        problem, count = self.problem, pressure.size
        columns = {path: np.full(count, number) for path, number in valve.numbers.items()}
        columns |= {path: columns[path] * opening for path in _OPENINGS if path in columns}
        columns |= {"supply.pressure": pressure, "supply.dorsiflexion_pressure": pressure}
        settings = problem.scenario.controller.settings
        gain_ratio = self.rule_gain(columns) / self.rule_gain({}) if problem.gains else 1.0
        for index, path in enumerate(problem.gains):
            columns[path] = self.gain_sets[gains, index] * settings[path.rpartition(".")[2]] * gain_ratio
        return columns

    def rule_gain(self, columns: Mapping[str, Floats]) -> Any:
        """Return the proportional gain [1/(N m)] of the tuning rules.

        ``columns`` replace numbers of the device by path.
        """
        scenario = self.problem.scenario
        term = default_gain_terms(scenario.device, CONTROLLERS[scenario.controller.kind], IN_SCENARIO)[
            PROPORTIONAL_GAIN
        ]
        return term.number(lambda path: columns[path] if path in columns else number_at(scenario, path))


def try_pressures(trials: Trials, valve: CandidateValve) -> Trial:
    """Search the lowest feasible pressure of a valve to 0.1 psi; returns the best trial at each pressure tried.

    Gains of the next scale are tried unless the torque or the requested range limits the valve.
    """
    problem, best, reached = trials.problem, None, (np.inf, np.inf)
    pressures = np.linspace(problem.lowest_pressure, problem.highest_pressure, GRID)
    for first in range(0, len(trials.gain_sets), trials.combinations):
        tried = trials.best(valve, pressures, like=first)
        while lowest := first_of(works_in(problem, tried)):
            lower, upper = tried["pressure"][lowest - 1 : lowest + 1]
            if upper - lower <= FINENESS:
                break
            # Without both ends, which were tried before.
            between = trials.best(valve, np.linspace(lower, upper, GRID)[1:-1], like=first)
            tried = np.sort(np.concatenate([tried, between]), order="pressure", kind="stable")
        feasible = float(np.min(tried["pressure"][works_in(problem, tried)], initial=np.inf))
        rank = feasible, float(np.nan_to_num(tried["error"], nan=np.inf).min())
        if best is None or rank < reached:
            best, reached = tried, rank
        if _limit_of_pressure(problem, tried) is not None:
            break
    if best is None or np.isnan(best["error"]).all():
        reason = next(iter(trials.failures), "no reason was given")
        raise StudyError(f"{problem.file}: every run with valve '{valve.name}' failed; the first failure: {reason}")
    return best


def works_in(problem: SizingProblem, tried: Trial) -> NDArray[np.bool_]:
    """Return a mask of the trials that keep the error limit and provide the required share of the peak torque."""
    return np.asarray((tried["error"] <= problem.largest_error) & (tried["pressure"] >= peak_pressure(problem)))


def first_of(members: NDArray[np.bool_]) -> int | None:
    """Return the index of the first true element; None if all are false."""
    return int(members.argmax()) if members.any() else None


def limit_of(trials: Trials, valve: CandidateValve, tried: Trial) -> Limit:
    """Return the quantity that limits a valve at lower pressures, or at every pressure if no pressure is feasible.

    The limit is the torque if the lowest feasible pressure is near ``ceiling_pressure``. Otherwise a valve without lag,
    and then larger openings, are tried halfway between these two pressures (or between ``ceiling_pressure`` and the
    highest pressure if none is feasible): the limit is the flow if only a larger opening works, else the control.
    """
    problem = trials.problem
    if (known := _limit_of_pressure(problem, tried)) is not None:
        return known
    first = first_of(works_in(problem, tried))
    pressure = np.array([0.5 * (float(tried["pressure"][-1 if first is None else first]) + ceiling_pressure(problem))])
    at_once = replace(valve, numbers={**valve.numbers, **dict.fromkeys(LAGS & valve.numbers.keys(), 0.0)})
    is_slow = at_once.numbers != valve.numbers
    for part, opening in [(at_once, 1.0)] * is_slow + [(valve, wider) for wider in WIDER]:
        for first in range(0, len(trials.gain_sets), trials.combinations):
            if trials.best(part, pressure, opening, first)["error"][0] <= problem.largest_error:
                return "flow" if part is valve else "control"
    return "control"


def _limit_of_pressure(problem: SizingProblem, tried: Trial) -> Limit | None:
    """Return the limit of a valve that follows from its lowest feasible pressure; None if it needs further trials.

    There is no limit if the lowest requested pressure works ('pressure').
    """
    first = first_of(works_in(problem, tried))
    if first == 0:
        return "pressure"
    gauge = float(tried["pressure"][-1 if first is None else first]) - problem.atmosphere
    return "torque" if gauge <= NEAR_CEILING * (ceiling_pressure(problem) - problem.atmosphere) else None


def ceiling_pressure(problem: SizingProblem) -> float:
    """Return the pressure [Pa absolute] below which the clipped peak alone exceeds the error limit; equation (2)."""
    from scipy.optimize import brentq

    atmosphere = problem.atmosphere
    uncut = atmosphere + problem.profile.largest / problem.torque_constant
    for_peak = peak_pressure(problem)
    # A limit that is kept without any torque has no root: brentq needs a change of sign.
    if cut_error(problem, atmosphere) <= problem.largest_error:
        return for_peak
    root = float(brentq(lambda pressure: cut_error(problem, pressure) - problem.largest_error, atmosphere, uncut))
    return max(root, for_peak)


def peak_pressure(problem: SizingProblem) -> float:
    """Return the pressure [Pa absolute] for the required share of the peak torque; equation (2)."""
    return problem.atmosphere + LEAST_PEAK * problem.profile.largest / problem.torque_constant


def cut_error(problem: SizingProblem, pressure: float) -> float:
    """Return the RMS error [N m] of the profile clipped at the largest torque for a pressure [Pa absolute]."""
    # The end of a period is its start again and must count once.
    # Two thousand points: the crest of a push-off, a tenth of a stride, still has two hundred.
    time = np.linspace(0.0, problem.profile.period, 2001)[:-1]
    torque, largest = problem.profile.at(time), ceiling(problem, pressure)
    return float(np.sqrt(np.mean((torque - np.clip(torque, -largest, largest)) ** 2)))


def ceiling(problem: SizingProblem, pressure: float) -> float:
    """Return the largest static torque [N m] at a supply pressure [Pa absolute]; equation (2) of the paper."""
    return problem.torque_constant * (pressure - problem.atmosphere)


def flow_margin(trials: Trials, valve: CandidateValve, pressure: float, like: int) -> float:
    """Return the possible reduction of the opening [-] at a gauge pressure one tenth higher, with the best gains.

    Gains have the scale of the gain set ``like``. At the lowest feasible pressure itself no reduction is possible.
    """
    atmosphere = trials.problem.atmosphere
    higher = np.array([atmosphere + MORE_PRESSURE * (pressure - atmosphere)])
    smallest = 1.0
    for opening in OPENINGS:
        # Negated, so that a failed run, whose error is nan, ends the search too.
        if not trials.best(valve, higher, opening, like)["error"][0] <= trials.problem.largest_error:
            break
        smallest = opening
    return 1.0 - smallest
