"""Sizing for a torque profile: lowest pressure and smallest bottle of each valve."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ppafo.analyses.design.answer import PRESSURE, TORQUE, SizedValve, Sizing, SizingMargins
from ppafo.analyses.design.problem import CandidateValve, SizingProblem
from ppafo.analyses.design.search import (
    LAGS,
    Trials,
    ceiling,
    first_of,
    flow_margin,
    limit_of,
    try_pressures,
    works_in,
)
from ppafo.analyses.endurance.discharge import TIME_IS_UP
from ppafo.analyses.endurance.gas_demand import demand_of_numbers
from ppafo.analyses.endurance.solve import follow_bottle
from ppafo.errors import ParameterError
from ppafo.model.catalog import VALVES
from ppafo.parameters.bottles.bottle import Bottle
from ppafo.progress import Progress, Report, report_nothing
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.simulate import simulate
from ppafo.units.shown import in_units, written_text
from ppafo.walking.bottle.coupling import Schedule

_LONG_PERIOD = 5.0
"""Period of a controller that is named among the delays of a loop that does not follow [ms]."""


def size_for_profile(problem: SizingProblem, threads: int | None = None, report: Report = report_nothing) -> Sizing:
    """Return the lowest pressure and smallest bottle of each valve for a torque profile.

    Raises StudyError if all runs fail.
    """
    started = time.perf_counter()
    trials = Trials(problem, threads)
    sized = []
    for count, valve in enumerate(problem.valves):
        elapsed = time.perf_counter() - started
        report(Progress(f"trying {valve.name}", count, len(problem.valves), 0, 0, elapsed, "valves"))
        sized.append(_size_valve(trials, valve))
    working = {row: valve.bottle.mass for row, valve in enumerate(sized) if valve.works and valve.bottle is not None}
    # Of valves with the same bottle the one that uses least gas.
    suggested = min(working, key=lambda row: (working[row], sized[row].gas), default=None)
    recording = None
    if suggested is not None:
        choice = sized[suggested]
        columns = trials.columns(choice.valve, np.array([choice.pressure]), np.array([0]), np.ones(1))
        numbers = {path: float(values[0]) for path, values in columns.items()} | dict(choice.gains)
        recording = simulate(with_numbers(problem.scenario, numbers)).recording
    seconds, failures = time.perf_counter() - started, dict(trials.failures)
    return Sizing(problem, tuple(sized), suggested, recording, trials.runs, failures, seconds, trials.seeds.size)


def smallest_bottle(bottles: Sequence[Bottle], gas: float) -> Bottle | None:
    """Return the smallest bottle that contains a mass of gas [kg]; None if there is none."""
    return min((bottle for bottle in bottles if bottle.mass >= gas), key=lambda bottle: bottle.mass, default=None)


@in_units(lambda trials, _valve: trials.problem.scenario.device.shown)
def _size_valve(trials: Trials, valve: CandidateValve) -> SizedValve:
    """Return a valve sized at the pressure with the smallest bottle, or at the smallest error if no pressure works."""
    problem = trials.problem
    tried = try_pressures(trials, valve)
    works = works_in(problem, tried)
    lowest = first_of(works)
    in_all = tried["gas"] * problem.repetitions * (1.0 + problem.reserve)
    bottles = [smallest_bottle(problem.bottles, gas) for gas in in_all.tolist()]
    if lowest is None:
        # The smallest error; argmin would take a failed run, whose error is nan.
        chosen = int(np.argmin(np.where(np.isnan(tried["error"]), np.inf, tried["error"])))
    else:
        # The smallest bottle at the lowest pressure; without any bottle, the lowest pressure that works.
        full = [np.inf if bottle is None else bottle.mass for bottle in bottles]
        masses = np.where(works, full, np.inf)
        chosen = int(np.argmin(masses)) if np.isfinite(masses).any() else lowest
    pressure, error, gas, gains = tried[chosen].tolist()
    gas_in_all = float(in_all[chosen])
    bottle, is_cold, remarks = None, False, []
    if lowest is not None:
        bottle, is_cold = _lasting_bottle(problem, gas, gas_in_all, pressure)
        if (failing := np.flatnonzero(~works[lowest:])).size:
            text = PRESSURE.text(float(tried["pressure"][lowest + failing[0]]))
            remarks.append(f"at {text} the error limit is exceeded again")
    if is_cold:
        remarks.append(f"a{' smaller' * (bottle is not None)} bottle has enough gas, but gets too cold before the end")
    if lowest is not None and bottles[chosen] is None:
        largest = problem.bottles[-1]
        share = largest.mass / gas_in_all
        duration = f"lasts for {100.0 * share:.0f} % of the use, {share * problem.repetitions:.0f} repetitions"
        remarks.append(f"no bottle is large enough: {largest.name} {duration}")
    gas_used = gas * problem.repetitions
    margins = None
    if lowest is not None:
        margins = SizingMargins(
            error=1.0 - error / problem.largest_error,
            torque=ceiling(problem, pressure) / problem.profile.largest - 1.0,
            flow=flow_margin(trials, valve, pressure, gains),
            gas=None if bottle is None or gas_used <= 0.0 else bottle.mass / gas_used - 1.0,
        )
    columns = trials.columns(valve, np.array([pressure]), np.array([gains]), np.ones(1))
    limit = limit_of(trials, valve, tried)
    if lowest is None and limit == "control":
        quantities = {f"valve.{item.name}": item for item in VALVES[problem.scenario.device.valve.kind].quantities}
        lags = [
            f"{quantities[path].name.replace('_', ' ')} {written_text(number, quantities[path].unit)}"
            for path, number in valve.numbers.items()
            if path in LAGS and number > 0.0
        ]
        period = 1.0e3 * problem.scenario.controller.period
        slow = [f"the valve has {', '.join(lags)}"] if lags else []
        slow += [f"the controller decides every {period:.3g} ms (controller.rate)"] if period > _LONG_PERIOD else []
        slowed = f"; {' and '.join(slow)}" if slow else ""
        said = "no gains were found with which the torque loop follows" if problem.gains else "the loop does not follow"
        remarks.append(
            f"{said}: RMS error {TORQUE.text(error)} at best, limit {TORQUE.text(problem.largest_error)}{slowed}"
        )
    return SizedValve(
        valve=valve,
        works=lowest is not None,
        pressure=pressure,
        lowest_pressure=None if lowest is None else float(tried["pressure"][lowest]),
        gains={path: float(columns[path][0]) for path in problem.gains},
        error=error,
        gas=gas,
        gas_in_all=gas_in_all,
        bottle=bottle,
        margins=margins,
        limit=limit,
        remark="; ".join(remarks),
        curve=(tried["pressure"], tried["error"], tried["gas"]),
    )


def _lasting_bottle(problem: SizingProblem, gas: float, in_all: float, pressure: float) -> tuple[Bottle | None, bool]:
    """Return the smallest bottle that lasts, and whether a smaller bottle with enough gas gets too cold.

    The profile is repeated without a pause and takes ``gas`` [kg] per repetition, ``in_all`` [kg] in total with the
    reserve, downstream of a regulator set to ``pressure`` [Pa absolute].
    """
    if gas <= 0.0:
        return smallest_bottle(problem.bottles, in_all), False
    enough = [bottle for bottle in problem.bottles if bottle.mass >= in_all]
    period = problem.profile.period
    duration = problem.repetitions * period
    # A second more than the use, so that a bottle that lasts is one whose time is up.
    schedule = Schedule(duration + 1.0, 0.0, max(duration, 1.0))
    for number, bottle in enumerate(enough):
        full = replace(bottle, regulator=bottle.regulator._replace(set_pressure=pressure))
        try:
            ended = follow_bottle(full, demand_of_numbers(gas, period, None), schedule).discharge.ending.kind
        except ParameterError:
            # Its regulator does not pass the flow even when it is full.
            continue
        if ended == TIME_IS_UP:
            return bottle, number > 0
    return None, bool(enough)
