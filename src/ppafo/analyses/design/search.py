"""Search for the lowest supply pressure and the smallest bottle of each valve, what limits it, and the report.

Each pressure is tried in one batch with many gains, and with some openings, of one valve. The error is not assumed to
be monotonic in the pressure.
"""

import contextlib
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import cycle, product
from operator import methodcaller
from typing import Any, Literal, final

import numpy as np
from numpy.typing import NDArray

from ppafo.analyses.design.problem import SizingProblem
from ppafo.analyses.endurance.discharge import TIME_IS_UP, discharge
from ppafo.constants import PASCALS_PER_PSI
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.torque_loop import proportional_gain
from ppafo.control.walking.catalog import walking_controllers
from ppafo.documents.json_text import fields_of
from ppafo.documents.toml_text import table_lines
from ppafo.errors import ParameterError, StudyError
from ppafo.loading import load_scenario, reloaded, usage_text
from ppafo.model.plant import pressure_for_torque
from ppafo.parameters.bottles.bottle import Bottle
from ppafo.progress import Progress, Report
from ppafo.report.finding import Finding, Section, columns_of
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, COLOURS, REFERENCE
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.motion_kind import LawSignals
from ppafo.simulation.numbers import NOISE_SEED, declared_numbers, number_at, with_numbers
from ppafo.simulation.simulate import simulate
from ppafo.simulation.torque_loop import LoopLink, LoopParts
from ppafo.simulation.tracking import REVERSALS, most_reversals
from ppafo.simulation.tracking.rule import command_turning
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.studies.draws import seeds_of_noise
from ppafo.units import split_quantity
from ppafo.units.shown import in_units, written_text
from ppafo.version import __version__
from ppafo.walking.bottle.coupling import Schedule

Limit = Literal["torque", "flow", "control", "pressure"]
"""Limit of a valve's pressure, which falls with more torque, a larger opening, a loop that follows, pressure.lowest."""
PRESSURE = Kind("Supply pressure", "Pa_a", "pressure", ".3g")
TORQUE = Kind("Torque", "N m", "torque", ".3g")
ERROR = "rms_error"
GAS = "gas_supplied"
OSCILLATES = "the torque loop oscillates"
_OPENINGS = ("valve.area", "valve.sonic_conductance")

Numbers = Mapping[str, float]
"""Numbers of a valve by path [SI]."""
# Noise streams of each trial if sensors are noisy, and their seed: the same for all trials and pressures.
STREAMS = 16
_SEED = 1
SCALES = (1.0, 8.0, 64.0, 0.125, 0.015625)
"""Common factors [-] on the combinations of gain factors, tried in turn: a slow valve needs other gains for a task."""
_AT_ONCE = 16_384
"""Number of runs of a batch: enough to occupy all threads with little memory."""
# Supply pressures that are tried in each round of the search, and tolerance [Pa] of the lowest feasible one.
GRID = 17
FINENESS = 0.1 * PASCALS_PER_PSI
WIDER = (2.0, 4.0, 16.0)
"""Factors [-] on the valve opening that show whether the flow is the limit."""
NEAR_CEILING = 1.2
"""Ratio [-] of lowest gauge pressure to ceiling gauge pressure up to which the torque counts as the limit."""
_MOVES_LATE = ("delay", "spool_frequency", "slew_limit", "opening_delay", "closing_delay", "switching_interval")
LAGS = {f"valve.{name}" for name in _MOVES_LATE}
"""Numbers of a valve that moves late or slowly; at 0 it moves at once."""
LEAST_PEAK = 0.7
"""Required share of the peak torque [-]: the RMS error over a mostly zero stride alone would accept half the peak."""
# Factor on the gauge pressure for the flow margin, and fractions of the opening tried in turn [-].
MORE_PRESSURE = 1.1
OPENINGS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05)
REACHED = 0.95
"""Fraction of a peak torque from which it counts as reached [-]."""
_WHOLE_PEAK = 0.005
"""Largest fraction of the peak torque that may be cut off without a word [-]: half of the last digit of a pressure."""
_MAXIMUM_OF_LIMIT = 4.0
"""Upper end of the error axis divided by the error limit; larger errors are not plotted."""
_ORIGINS = {
    "typed": "typed, not measured",
    "gait": "a share of the ankle moment of a gait",
    "measured": "recorded",
    "simulated": "simulated, not measured",
    "synthetic": "synthetic, not measured",
}
_WALK = "proportional"
"""Walk in which a suggestion is used."""
_IN_SET = "\n# in a parameter set; origin and source of what a data sheet has are yours to give"
_READING = (
    "The chosen pressure is the lowest that holds the whole peak with the smallest bottle, if one lasts, else the "
    "lowest with which the smallest bottle suffices; the table also has the lowest pressure that keeps the error "
    "limit.",
    "Error margin: RMS error below its limit. Torque margin: torque at this pressure above the largest torque of the "
    "profile; below 0 the peak is cut off, as far as the error limit allows. "
    "Flow margin: possible reduction of the opening at a gauge pressure 10 % higher. Gas margin: usable gas in the "
    "bottle above the gas used, reserve included.",
    "Error and gas cover all repetitions that were simulated, including the first filling of the chambers. What the "
    "file does not say of a valve, friction, leak, dead volumes and sensors are the scenario's.",
)
Trial = NDArray[np.void]
"""Structured array of trials, with the fields of ``TRIAL``."""
TRIAL = np.dtype(
    [(name, np.float64) for name in ("pressure", "error", "gas")] + [("gains", np.intp), ("works", np.bool_)]
)
"""Row of a trial: supply pressure [Pa absolute], RMS error [N m], gas per repetition [kg], index of the gain set.

Error and gas are nan if a run failed or oscillated. A trial ``works`` that keeps the error limit and provides the
required share of the peak torque.
"""


@dataclass(frozen=True, slots=True, eq=False)
class SizedValve:
    """Sizing result of a valve in SI, at the supply pressure that keeps the error limit with the smallest bottle.

    ``pressure``: chosen supply pressure [Pa absolute]; if none works, the pressure with the smallest error
    ``lowest_pressure``: lowest pressure that works [Pa absolute]; None if no pressure works
    ``gains``: gains of the controller by path
    ``error``: RMS torque error [N m]
    ``gas``, ``gas_in_all``: gas per repetition and total gas with the reserve [kg]
    ``bottle``: smallest bottle that lasts; None if none does
    ``margins``: reserves to the limits [-], empty if none works: ``error``, of the RMS error to its limit; ``torque``,
        of the largest possible torque over the peak of the profile, below 0 if the peak is cut off; ``flow``, possible
        reduction of the opening at a gauge pressure one tenth higher; ``gas``, of the gas in the bottle over the gas
        used, None without a bottle
    ``limit``: quantity that limits the lowest pressure
    ``remark``: note for the reader; empty if there is none
    ``tried``: trial with the best gains at each pressure, in the order of the pressures
    """

    name: str
    pressure: float
    lowest_pressure: float | None
    gains: Mapping[str, float]
    error: float
    gas: float
    gas_in_all: float
    bottle: Bottle | None
    margins: Mapping[str, float | None]
    limit: Limit
    remark: str
    tried: Trial

    @property
    def works(self) -> bool:
        """True if a pressure keeps the error limit."""
        return self.lowest_pressure is not None


@dataclass(frozen=True, slots=True, eq=False)
class Sizing:
    """Result of a sizing study: every valve, and the suggested one, which has the smallest bottle.

    ``choice``, ``recording``: suggested valve, and its run on the profile; None without a suggestion
    ``failures``: number of failed runs by reason
    ``streams``: number of noise streams of every trial, whose error is the largest over the streams; 0 without noise
    """

    problem: SizingProblem
    valves: tuple[SizedValve, ...]
    choice: SizedValve | None
    recording: Recording | None
    runs: int
    failures: Mapping[str, int]
    streams: int = 0

    @property
    def summary(self) -> str:
        """Suggestion in a sentence, or why there is none."""
        choice = self.choice
        recording = self.recording
        profile = self.problem.profile
        if choice is None or recording is None:
            working = [sized for sized in self.valves if sized.works]
            near = min(self.valves, key=lambda sized: np.nan_to_num(sized.error, nan=np.inf))
            nearest = f"{TORQUE.text(near.error)} with {near.name} at {PRESSURE.text(near.pressure)}"
            reasons = (
                ["valves keep the error limit, but no bottle lasts for the requested use"]
                if working
                else [f"no valve keeps the error limit; the smallest error is {nearest}"]
            )
            reasons += [
                f"{each.name}{cut}"
                for each in working or self.valves
                if each.error == each.error and (cut := cut_peak(self.problem, each.pressure))
            ]
            return f"no suggestion: {'; '.join(reasons)}"
        bottle = "" if choice.bottle is None else f" and {choice.bottle.name}"
        short = [
            f"{TORQUE.number(sign * reached)} of {TORQUE.text(sign * peak)}"
            for sign in (1.0, -1.0)
            if (peak := np.max(sign * profile.knot_values)) > _WHOLE_PEAK * profile.largest
            and (reached := np.max(sign * recording["torque"])) < REACHED * peak
        ]
        reaches = f"; reaches {' and '.join(short)} in the simulated run" if short else ""
        suggested = f"suggested: {choice.name} at {PRESSURE.text(choice.pressure)}{bottle}, the smallest that lasts and"
        return f"{suggested} keeps the error limit{cut_peak(self.problem, choice.pressure)}{reaches}"

    def json_document(self) -> dict[str, Any]:
        """Return the sized valves and the suggestion as plain data in SI."""
        problem = self.problem
        found = ("works", "pressure", "lowest_pressure", "error", "gas", "gas_in_all", "gains", "limit", "remark")
        return {
            "format": "ppafo sizing",
            "schema_version": 2,
            **fields_of(problem, "name", "description", "file", "repetitions", "hours", "reserve", "largest_error"),
            "units": "SI; pressures absolute, errors in N m, gas and mass in kg, margins as fractions",
            "scenario": problem.scenario.name,
            "profile": {
                **fields_of(problem.profile, "kind", "period", "largest", "table_error"),
                "times": problem.profile.knot_times.tolist(),
                "torques": problem.profile.knot_values.tolist(),
            },
            "suggested": None if self.choice is None else self.choice.name,
            "valves": [
                {"valve": sized.name, **fields_of(sized, *found), "margins": sized.margins or None}
                | {"bottle": None if sized.bottle is None else sized.bottle.name}
                for sized in self.valves
            ],
            **fields_of(self, "summary", "streams", "runs", "failures"),
            "ppafo": __version__,
        }


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

    def run(self, valve: Numbers, pressure: Floats, gains: NDArray[np.intp], opening: float = 1.0) -> Trial:
        """Run trials of a valve at supply pressures [Pa absolute], each with an index of a gain set in ``gains``.

        ``opening`` is a factor on the valve opening [-].
        """
        problem = self.problem
        scenario = self.problem.scenario
        streams = max(1, self.seeds.size)
        count = pressure.size
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
            oscillates = command_turning(scenario, result.metrics, most_reversals(scenario)) > 1.0
            for found, name in ((error, ERROR), (gas, GAS)):
                found[:, rows] = np.where(oscillates, np.nan, result.metrics[name]).reshape(streams, -1)
            self.runs += oscillates.size
            self.failures.update(result.reasons.values())
            self.failures += Counter({OSCILLATES: int(np.count_nonzero(oscillates))})
        trial = np.empty(count, TRIAL)
        trial["pressure"] = pressure
        trial["gains"] = gains
        trial["error"] = error.max(axis=0)
        trial["gas"] = gas.mean(axis=0) / problem.simulated
        trial["works"] = (trial["error"] <= problem.largest_error) & (pressure >= torque_pressure(problem))
        return trial

    def best(self, valve: Numbers, pressure: Floats, opening: float = 1.0, like: int = 0) -> Trial:
        """Return for each pressure the trial with the best set of gains at the scale of the gain set ``like``.

        The best set uses the least gas of all sets that keep the error limit; if no set keeps the limit, it has the
        smallest error.
        """
        sets = self.combinations
        first = like - like % self.combinations
        pressures = np.repeat(pressure, sets)
        gains = np.tile(first + np.arange(sets), pressure.size)
        trial = self.run(valve, pressures, gains, opening).reshape(pressure.size, sets)
        # Infinite for failed runs: argmin would take nan for the smallest.
        error = np.where(np.isnan(trial["error"]), np.inf, trial["error"])
        keeps = error <= self.problem.largest_error
        gas = np.where(keeps, trial["gas"], np.inf)
        chosen = np.where(keeps.any(axis=1), gas.argmin(axis=1), error.argmin(axis=1))
        return np.asarray(trial[np.arange(pressure.size), chosen])

    def columns(
        self, valve: Numbers, pressure: Floats, gains: NDArray[np.intp], opening: float = 1.0
    ) -> dict[str, Floats]:
        """Return the columns of trials in SI: numbers of the valve, both supply pressures, gains.

        The gains of the scenario fit its own device. For other valves and pressures they are scaled, so that the ratio
        to the gains of the rules in ``control.torque_loop`` stays the same.
        """
        problem = self.problem
        scenario = self.problem.scenario
        columns = {
            path: np.full(pressure.size, number * (opening if path in _OPENINGS else 1.0))
            for path, number in valve.items()
        }
        columns |= {"supply.pressure": pressure, "supply.dorsiflexion_pressure": pressure}
        parts = LoopParts(scenario.device, LawSignals())
        link = LoopLink((), proportional_gain, groups=("loop",), parts=parts)

        def rule_gain(changed: Mapping[str, Floats]) -> Any:
            return link.number(lambda path: changed[path] if path in changed else number_at(scenario, path))

        gain_ratio = rule_gain(columns) / rule_gain({}) if problem.gains else 1.0
        for index, path in enumerate(problem.gains):
            setting = scenario.controller.settings[path.rpartition(".")[2]]
            columns[path] = self.gain_sets[gains, index] * setting * gain_ratio
        return columns


def size_for_profile(problem: SizingProblem, threads: int | None, report: Report) -> Sizing:
    """Return the lowest pressure and smallest bottle of each valve for a torque profile.

    Raises StudyError if all runs fail.
    """
    started = time.perf_counter()
    trials = Trials(problem, threads)
    valves = list[SizedValve]()
    for name in problem.valves:
        elapsed = time.perf_counter() - started
        report(Progress(f"trying {name}", len(valves), len(problem.valves), 0, 0, elapsed, "valves"))
        valves.append(_size_valve(trials, name))
    lasting = [
        (bool(cut_peak(problem, each.pressure)), each.bottle.mass, each.gas, row)
        for row, each in enumerate(valves)
        if each.bottle
    ]
    # What is not cut off comes first; of valves with the same bottle the one that uses least gas.
    choice = valves[min(lasting)[-1]] if lasting else None
    recording = None
    if choice is not None:
        columns = trials.columns(problem.valves[choice.name], np.array([choice.pressure]), np.array([0]))
        numbers = {path: float(values[0]) for path, values in columns.items()} | dict(choice.gains)
        recording = simulate(with_numbers(problem.scenario, numbers)).recording
    return Sizing(problem, tuple(valves), choice, recording, trials.runs, dict(trials.failures), trials.seeds.size)


@in_units(lambda trials, _name: trials.problem.scenario.device.shown)
def _size_valve(trials: Trials, name: str) -> SizedValve:
    """Return a valve sized at the pressure with the smallest bottle, or at the smallest error if no pressure works."""
    problem = trials.problem
    valve = trials.problem.valves[name]
    tried = try_pressures(trials, name)
    works = tried["works"]
    in_all = tried["gas"] * problem.repetitions * (1.0 + problem.reserve)
    bottles = [smallest_bottle(problem.bottles, gas) for gas in in_all.tolist()]
    # The smallest error, where a failed run has none; or, of pressures that work, one that cuts nothing off, with the
    # smallest bottle, and of these the lowest.
    errors = np.nan_to_num(tried["error"], nan=np.inf)
    masses = np.array([np.inf if bottle is None else bottle.mass for bottle in bottles])
    is_cut = np.array([bool(cut_peak(problem, pressure)) for pressure in tried["pressure"].tolist()])
    order = np.lexsort((masses, is_cut, np.isinf(masses), ~works)) if works.any() else np.argsort(errors, kind="stable")
    chosen = int(order[0])
    pressure, error, gas, gains, _ = tried[chosen].tolist()
    lowest = None
    bottle = None
    remarks = list[str]()
    margins = dict[str, float | None]()
    if works.any():
        lowest = float(tried["pressure"][works][0])
        bottle, is_cold = lasting_bottle(problem, gas, float(in_all[chosen]), pressure)
        if (failing := tried["pressure"][~works & (tried["pressure"] > lowest)]).size:
            remarks.append(f"at {PRESSURE.text(float(failing[0]))} the error limit is exceeded again")
        if is_cold:
            smaller = " smaller" if bottle is not None else ""
            remarks.append(f"a{smaller} bottle has enough gas, but gets too cold before the end")
        if bottles[chosen] is None:
            largest = problem.bottles[-1].name
            share = problem.bottles[-1].mass / float(in_all[chosen])
            duration = f"{100.0 * share:.0f} % of the use, {share * problem.repetitions:.0f} repetitions"
            remarks.append(f"no bottle is large enough: {largest} lasts for {duration}")
        used = gas * problem.repetitions
        margins = {
            "error": 1.0 - error / problem.largest_error,
            "torque": problem.ceiling(pressure) / problem.profile.largest - 1.0,
            "flow": flow_margin(trials, valve, pressure, gains),
            "gas": None if bottle is None or used <= 0.0 else bottle.mass / used - 1.0,
        }
    columns = trials.columns(valve, np.array([pressure]), np.array([gains]))
    return SizedValve(
        name=name,
        pressure=pressure,
        lowest_pressure=lowest,
        gains={path: float(columns[path][0]) for path in problem.gains},
        error=error,
        gas=gas,
        gas_in_all=float(in_all[chosen]),
        bottle=bottle,
        margins=margins,
        limit=limit_of(trials, valve, tried),
        remark="; ".join(remarks),
        tried=tried,
    )


def smallest_bottle(bottles: Sequence[Bottle], gas: float) -> Bottle | None:
    """Return the smallest bottle that contains a mass of gas [kg]; None if there is none."""
    return min((bottle for bottle in bottles if bottle.mass >= gas), key=lambda bottle: bottle.mass, default=None)


def lasting_bottle(problem: SizingProblem, gas: float, in_all: float, pressure: float) -> tuple[Bottle | None, bool]:
    """Return the smallest bottle that lasts, and whether a smaller bottle with enough gas gets too cold.

    The profile is repeated without a pause and takes ``gas`` [kg] per repetition, ``in_all`` [kg] in total with the
    reserve, downstream of a regulator set to ``pressure`` [Pa absolute].
    """
    if gas <= 0.0:
        return smallest_bottle(problem.bottles, in_all), False
    enough = [bottle for bottle in problem.bottles if bottle.mass >= in_all]
    period = problem.profile.period
    # A second more than the use, so that a bottle that lasts is one whose time is up.
    schedule = Schedule(problem.repetitions * period + 1.0, 0.0, max(problem.repetitions * period, 1.0))
    for number, bottle in enumerate(enough):
        full = replace(bottle, regulator=bottle.regulator._replace(set_pressure=pressure))
        # A regulator may not pass the flow even when its bottle is full.
        with contextlib.suppress(ParameterError):
            if discharge(full, gas, period, gas / period, schedule).ending == TIME_IS_UP:
                return bottle, number > 0
    return None, bool(enough)


def try_pressures(trials: Trials, name: str) -> Trial:
    """Search the lowest feasible pressure of a valve to 0.1 psi; returns the best trial at each pressure tried.

    Gains of the next scale are tried unless the torque or the requested range limits the valve.
    """
    problem = trials.problem
    valve = trials.problem.valves[name]
    found = list[tuple[float, float, int, Trial]]()
    pressures = np.linspace(problem.lowest_pressure, problem.highest_pressure, GRID)
    if problem.lowest_pressure < (whole := torque_pressure(problem, 1.0)) < problem.highest_pressure:
        # The lowest pressure that cuts nothing off, which a suggestion has if it can.
        pressures = np.union1d(pressures, whole)
    for first in range(0, len(trials.gain_sets), trials.combinations):
        tried = trials.best(valve, pressures, like=first)
        while lowest := int(tried["works"].argmax()):
            lower, upper = tried["pressure"][lowest - 1 : lowest + 1]
            if upper - lower <= FINENESS:
                break
            # Without both ends, which were tried before.
            between = trials.best(valve, np.linspace(lower, upper, GRID)[1:-1], like=first)
            tried = np.sort(np.concatenate([tried, between]), order="pressure", kind="stable")
        feasible = float(np.min(tried["pressure"][tried["works"]], initial=np.inf))
        found.append((feasible, float(np.nan_to_num(tried["error"], nan=np.inf).min()), first, tried))
        if _limit_of_pressure(problem, tried) is not None:
            break
    best = min(found, key=lambda each: each[:3])[3]
    if np.isnan(best["error"]).all():
        reason = next(iter(trials.failures), "no reason was given")
        raise StudyError(f"{problem.file}: every run with valve '{name}' failed; the first failure: {reason}")
    return best


def limit_of(trials: Trials, valve: Numbers, tried: Trial) -> Limit:
    """Return the quantity that limits a valve at lower pressures, or at every pressure if no pressure is feasible.

    The limit is the torque if the lowest feasible pressure is near ``ceiling_pressure``. Otherwise a valve without lag,
    and then larger openings, are tried halfway between these two pressures (or between ``ceiling_pressure`` and the
    highest pressure if none is feasible): the limit is the flow if only a larger opening works, else the control.
    """
    problem = trials.problem
    if (known := _limit_of_pressure(problem, tried)) is not None:
        return known
    pressure = np.array([0.5 * (_lowest_or_highest(tried) + ceiling_pressure(problem))])
    at_once = {path: 0.0 if path in LAGS else number for path, number in valve.items()}
    changes: list[tuple[Limit, Numbers, float]] = [("control", at_once, 1.0)] if at_once != valve else []
    changes += [("flow", valve, wider) for wider in WIDER]
    for limit, part, opening in changes:
        for first in range(0, len(trials.gain_sets), trials.combinations):
            if trials.best(part, pressure, opening, first)["error"][0] <= problem.largest_error:
                return limit
    return "control"


def _limit_of_pressure(problem: SizingProblem, tried: Trial) -> Limit | None:
    """Return the limit of a valve that follows from its lowest feasible pressure; None if it needs further trials.

    There is no limit if the lowest requested pressure works ('pressure').
    """
    if tried["works"][0]:
        return "pressure"
    gauge = _lowest_or_highest(tried) - problem.atmosphere
    return "torque" if gauge <= NEAR_CEILING * (ceiling_pressure(problem) - problem.atmosphere) else None


def _lowest_or_highest(tried: Trial) -> float:
    """Return the lowest pressure that works, or the highest if none does [Pa absolute]."""
    return float(tried["pressure"][tried["works"].argmax() if tried["works"].any() else -1])


def ceiling_pressure(problem: SizingProblem) -> float:
    """Return the pressure [Pa absolute] below which the clipped peak alone exceeds the error limit; equation (2)."""
    from scipy.optimize import brentq

    atmosphere = problem.atmosphere
    for_peak = torque_pressure(problem)
    # A limit that is kept without any torque has no root: brentq needs a change of sign.
    if cut_error(problem, atmosphere) <= problem.largest_error:
        return for_peak
    constant = problem.scenario.device.actuator.torque_constant
    uncut = atmosphere + pressure_for_torque(problem.profile.largest, constant)
    root = float(brentq(lambda pressure: cut_error(problem, pressure) - problem.largest_error, atmosphere, uncut))
    return max(root, for_peak)


def torque_pressure(problem: SizingProblem, share: float = LEAST_PEAK) -> float:
    """Return the pressure [Pa absolute] for a share of the peak torque, unless given the required one; equation (2)."""
    torque_constant = problem.scenario.device.actuator.torque_constant
    return problem.atmosphere + pressure_for_torque(share * problem.profile.largest, torque_constant)


def cut_peak(problem: SizingProblem, pressure: float) -> str:
    """Return the fraction of the peak torque that a pressure [Pa absolute] cuts off; "" for a whole peak."""
    largest = problem.profile.largest
    most = problem.ceiling(pressure)
    if (cut := 1.0 - most / largest) <= _WHOLE_PEAK:
        return ""
    return f", with {100.0 * cut:.0f} % of the peak cut off (at most {TORQUE.text(most)} of {TORQUE.text(largest)})"


def cut_error(problem: SizingProblem, pressure: float) -> float:
    """Return the RMS error [N m] of the profile clipped at the largest torque for a pressure [Pa absolute]."""
    # The end of a period is its start again and must count once.
    # Two thousand points: the crest of a push-off, a tenth of a stride, still has two hundred.
    time = np.linspace(0.0, problem.profile.period, 2001)[:-1]
    torque = problem.profile.at(time)
    largest = problem.ceiling(pressure)
    return float(np.sqrt(np.mean((torque - np.clip(torque, -largest, largest)) ** 2)))


def flow_margin(trials: Trials, valve: Numbers, pressure: float, like: int) -> float:
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


# Report of a sizing.


@in_units(lambda sizing: sizing.problem.scenario.device.shown)
def finding_of(sizing: Sizing) -> Finding[Sizing]:
    """Return a sizing study as a finding; not passed if there is no suggestion."""
    problem = sizing.problem
    profile = sizing.problem.profile
    knots = f", {profile.knot_times.size} knots, to {TORQUE.text(profile.table_error)}" if profile.table_error else ""
    requirements = (
        f"profile of {TIME.text(profile.period, '.3g')} with up to {TORQUE.text(profile.largest)} "
        f"({_ORIGINS[profile.kind]}{knots}); {problem.repetitions:.0f} repetitions ({problem.hours:.2g} h), RMS error "
        f"at most {TORQUE.text(problem.largest_error)}, {100 * problem.reserve:.0f} % of the gas as reserve"
    )
    remarks = [f"{sized.name}: {sized.remark}" for sized in sizing.valves if sized.remark]
    colours = dict(zip(problem.valves, cycle(COLOURS), strict=False))
    return Finding(
        name="design",
        kicker="Sizing study",
        title=problem.name,
        said=[*([problem.description] if problem.description else []), requirements],
        parts=(
            *_tables(sizing),
            Section(remarks=(sizing.summary, *remarks)),
            Section(
                "Error and gas over pressure",
                panels=partial(_pressure_panels, sizing, colours),
                name="profile",
                caption="Every valve over supply pressure; each dot has the gains that use least gas within the error "
                "limit. Rings mark the chosen pressures.",
                across=2,
                size=(3.0, 2.7),
                is_detail=True,
            ),
            Section(
                "The torque",
                panels=partial(_torque_panels, sizing, colours),
                name="torque",
                caption="The prescribed torque and the suggestion's.",
                size=(5.8, 2.5),
                is_detail=True,
            ),
            Section("To use it" if sizing.choice else "", code=usage_of(sizing)),
            Section("How to read it", said=_READING, is_detail=True),
        ),
        found=sizing,
        passed=sizing.choice is not None,
        files={} if sizing.recording is None else {"suggested.csv": partial(marked_csv_bytes, sizing.recording)},
    )


def usage_of(sizing: Sizing) -> str:
    """Return the command to walk with the suggestion, and its valve as tables of a parameter set; "" without one.

    A law that does not walk leaves its kind and gains to the walk, a device of another set has the tables alone.
    """
    if sizing.choice is None:
        return ""
    scenario = sizing.problem.scenario
    kind = scenario.controller.kind
    declared = declared_numbers(scenario)
    valve = sizing.problem.valves[sizing.choice.name]
    law = sizing.choice.gains if kind in walking_controllers() else {}
    numbers = {**valve, "supply.pressure": sizing.choice.pressure, **law}
    texts = {path: written_text(number, declared[path].unit) for path, number in numbers.items()}
    overrides = [f"{path}={text}" for path, text in texts.items()] + ([f"controller.kind={kind}"] if law else [])
    table: dict[str, Any] = {"kind": scenario.device.valve.kind}
    for path in (path for path, number in valve.items() if number != declared[path].default):
        value, unit = split_quantity(texts[path])
        table[path.rpartition(".")[2]] = {"value": value, "unit": unit, "origin": "assumed", "source": "design"}
    walk = load_scenario(_WALK)
    # Another device has other walks, or none.
    is_of_walk = (walk.origin.parameter_set, walk.device.valve.kind) == (scenario.origin.parameter_set, table["kind"])
    used = [usage_text(reloaded(walk, overrides)), _IN_SET] if is_of_walk else []
    return "\n".join([*used, *table_lines(f"valves.{sizing.choice.name}", table)])


def _tables(sizing: Sizing) -> tuple[Section, Section]:
    """Return the table of all valves, and the table of margins and gains of the valves that work."""
    gas = Kind("", "kg", "gas mass", ".3g")
    fraction = Kind(quantity="fraction", form=".0f")
    quantities = CONTROLLERS[sizing.problem.scenario.controller.kind].quantities
    units = {f"controller.{quantity.name}": quantity.unit for quantity in quantities}
    rows = list[Any]()
    margins = list[Any]()
    working = [sized for sized in sizing.valves if sized.works]
    for sized in sizing.valves:
        if not sized.works:
            rows.append((sized.name, None, None, f"{TORQUE.number(sized.error)} at best", *(None,) * 3, sized.limit))
            continue
        bottle = "none" if sized.bottle is None else sized.bottle.name
        found = (sized.pressure, sized.lowest_pressure, sized.error, sized.gas, sized.gas_in_all)
        rows.append((sized.name, *found, bottle, sized.limit))
        gains = (
            f"{path.rpartition('.')[2].replace('_', ' ')} {gain:.3g} {units[path]}"
            for path, gain in sized.gains.items()
        )
        margins.append((sized.name, *sized.margins.values(), ", ".join(gains) or "none to choose"))
    pressures = (("pressure", PRESSURE), ("lowest", PRESSURE))
    gases = (("gas per repetition", gas), ("total gas", gas))
    head = ("valve", *pressures, ("RMS error", TORQUE), *gases, "bottle", "limited by")
    fractions = [(f"{name} margin", fraction) for name in ("error", "torque", "flow", "gas")]
    chosen, kept = ([row for row, each in enumerate(of) if each is sizing.choice] for of in (sizing.valves, working))
    return (
        Section("Valves", columns_of(head, rows), marked=chosen),
        Section("Margins" if margins else "", columns_of(("valve", *fractions, "gains"), margins), marked=kept),
    )


def _pressure_panels(sizing: Sizing, colours: Mapping[str, str]) -> list[Panel]:
    """Return panels of error and gas over supply pressure, with a ring at the pressure chosen for each valve."""
    limit = sizing.problem.largest_error
    dotted = {"marker": ".", "markersize": 4}
    ringed = {"linestyle": "", "marker": "o", "markersize": 9, "markerfacecolor": "none", "markeredgewidth": 1.4}
    errors = [Mark("level", (), limit, colour=BLACK, style={"linewidth": 1.0, "linestyle": "--"})]
    gases = list[Mark]()
    rings = list[Mark]()
    for sized in sizing.valves:
        pressure, error, gas = (sized.tried[name] for name in ("pressure", "error", "gas"))
        colour = colours[sized.name]
        keeps = error <= limit
        errors.append(Mark("line", pressure, error, (), sized.name, colour, dotted))
        if keeps.any():
            gases.append(Mark("line", pressure[keeps], gas[keeps], colour=colour, style=dotted))
        if sized.works:
            label = "" if rings else "chosen pressure"
            rings.append(Mark("line", [sized.pressure], [sized.error], (), label, colour, ringed))
            gases.append(Mark("line", [sized.pressure], [sized.gas], colour=colour, style=ringed))
    error_kind = replace(TORQUE, words="RMS error")
    gas_kind = Kind("Gas per repetition", "kg", "gas mass", ".3g")
    highest = float(error_kind.values(_MAXIMUM_OF_LIMIT * limit))
    return [
        Panel(
            PRESSURE,
            error_kind,
            errors + rings,
            "RMS error, limit dashed",
            legend="figure",
            then=methodcaller("set_ylim", 0.0, highest),
        ),
        # Valves differ by some per cent: an axis from 0 would lay their curves on each other.
        Panel(PRESSURE, gas_kind, gases, "Gas, within the limit", then=methodcaller("margins", y=0.15)),
    ]


def _torque_panels(sizing: Sizing, colours: Mapping[str, str]) -> list[Panel]:
    """Return the panel of the prescribed torque and of the suggestion's over time."""
    times = np.linspace(0.0, sizing.problem.scenario.run.duration, 3001)
    choice = sizing.choice
    prescribed = {"linestyle": REFERENCE.line, "linewidth": 1.2}
    marks = [Mark("line", times, sizing.problem.profile.at(times), (), "prescribed", REFERENCE.colour, prescribed)]
    if choice is not None and sizing.recording is not None:
        label = f"{choice.name} at {PRESSURE.number(choice.pressure, '.3g')} {PRESSURE.axis_unit}"
        marks.append(
            Mark("line", sizing.recording.time, sizing.recording["torque"], label=label, colour=colours[choice.name])
        )
    return [Panel(TIME, TORQUE, marks, then=lambda axes: axes.margins(x=0.0))]
