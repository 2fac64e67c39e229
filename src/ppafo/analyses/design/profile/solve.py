"""The lowest pressure and the smallest bottle of each valve for a torque profile."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ppafo.analyses.design.profile.answer import SizedValve, Sizing, SizingMargins, SizingRemarks
from ppafo.analyses.design.profile.problem import SizingProblem
from ppafo.analyses.design.profile.search import Trials, ceiling, flow_margin, highest_pressure, limit_of, try_pressures
from ppafo.analyses.endurance.discharge import TIME_IS_UP
from ppafo.analyses.endurance.gas_demand import demand_of_numbers
from ppafo.analyses.endurance.solve import follow_bottle
from ppafo.errors import ParameterError
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, load_bottle, scaled_entries
from ppafo.parameters.parts import Part
from ppafo.progress import Progress, Report, report_nothing
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.simulate import simulate
from ppafo.walking.bottle.coupling import Schedule


def size_for_profile(problem: SizingProblem, threads: int | None = None, report: Report = report_nothing) -> Sizing:
    """Return the lowest pressure and smallest bottle of each valve for a profile; StudyError where all runs fail."""
    begun = time.perf_counter()
    trials = Trials(problem, threads)
    sized = []
    for count, part in enumerate(problem.valves):
        passed = time.perf_counter() - begun
        report(Progress(f"trying {part.name}", count, len(problem.valves), 0, 0, passed, "valves"))
        sized.append(_size_valve(trials, part))
    good = [row for row, valve in enumerate(sized) if valve.works and valve.mass is not None]
    # Of valves with the same bottle and mass the one at the lowest pressure.
    suggested = min(good, key=lambda row: (sized[row].mass, sized[row].pressure), default=None)
    recording = None
    if suggested is not None:
        choice = sized[suggested]
        columns = trials.columns(choice.valve, np.array([choice.pressure]), np.array([0]), np.ones(1))
        numbers = {path: float(values[0]) for path, values in columns.items()} | dict(choice.gains)
        recording = simulate(with_numbers(problem.scenario, numbers)).recording
    return Sizing(
        problem=problem,
        valves=tuple(sized),
        suggested=suggested,
        recording=recording,
        runs=trials.runs,
        failures=dict(trials.failures),
        seconds=time.perf_counter() - begun,
        streams=trials.seeds.size,
    )


def smallest_bottle(bottles: Sequence[Part], gas: float) -> Part | None:
    """Return the lightest full bottle that holds an amount of gas [kg]; None where none does."""
    enough = [bottle for bottle in bottles if bottle.values["content"] >= gas]
    return min(enough, key=lambda bottle: bottle.full_mass, default=None)


def _size_valve(trials: Trials, valve: Part) -> SizedValve:
    """Return a valve at the pressure that needs the lightest bottle, or at which it comes nearest to the limit."""
    problem = trials.problem
    tried = try_pressures(trials, valve)
    in_all = tried.trial.gas * problem.repetitions * (1.0 + problem.reserve)
    bottles = [smallest_bottle(problem.bottles, gas) for gas in in_all.tolist()]
    # The pressure with the lightest bottle, of these the lowest. Without a bottle it is the lowest that works; where
    # none works, the one with the smallest error, which is infinite for failed runs: argmin would take nan for it.
    if tried.first is None:
        least = int(np.argmin(np.where(np.isnan(tried.trial.error), np.inf, tried.trial.error)))
    else:
        full = [np.inf if bottle is None else bottle.full_mass for bottle in bottles]
        masses = np.where(tried.works, full, np.inf)
        least = int(np.argmin(masses)) if np.isfinite(masses).any() else tried.first
    pressure, error, gas = (float(series[least]) for series in (tried.pressure, tried.trial.error, tried.trial.gas))
    gas_in_all, works = float(in_all[least]), tried.first is not None
    bottle, is_cold = _lasting_bottle(problem, gas, gas_in_all, pressure) if works else (None, False)
    rated = highest_pressure(problem, valve)
    notes = SizingRemarks(
        fails_above=tried.fails_above,
        rated=rated if rated < problem.highest_pressure and not works else None,
        is_cold=is_cold,
    )
    if works and bottles[least] is None:
        largest = max(problem.bottles, key=lambda part: part.values["content"])
        notes = replace(notes, largest_bottle=largest, share=largest.values["content"] / gas_in_all)
    used = gas * problem.repetitions
    margins = None
    if works:
        margins = SizingMargins(
            error=1.0 - error / problem.largest_error,
            torque=ceiling(problem, pressure) / problem.profile.largest - 1.0,
            flow=flow_margin(trials, valve, pressure),
            gas=None if bottle is None or used <= 0.0 else bottle.values["content"] / used - 1.0,
        )
    return SizedValve(
        valve=valve,
        works=works,
        pressure=pressure,
        lowest_pressure=None if tried.first is None else float(tried.pressure[tried.first]),
        gains=trials.gain_numbers(valve, pressure, int(tried.trial.gains[least])),
        error=error,
        gas=gas,
        gas_in_all=gas_in_all,
        bottle=bottle,
        mass=None if bottle is None else sum(part.full_mass for part in (valve, bottle, *problem.carried)),
        margins=margins,
        limit=limit_of(trials, valve, tried),
        notes=notes,
        curve=(tried.pressure, tried.trial.error, tried.trial.gas),
    )


def _lasting_bottle(problem: SizingProblem, gas: float, in_all: float, pressure: float) -> tuple[Part | None, bool]:
    """Return the lightest bottle that lasts, mass and heat together, and whether a lighter one only has the gas.

    The profile is repeated without a rest, ``gas`` [kg] each time and ``in_all`` [kg] with the reserve, behind a
    regulator set to the ``pressure`` [Pa].
    """
    if gas <= 0.0:
        return smallest_bottle(problem.bottles, in_all), False
    enough = [bottle for bottle in problem.bottles if bottle.values["content"] >= in_all]
    period, paper = problem.profile.period, load_bottle(PAPER_BOTTLE)
    needed = problem.repetitions * period
    # A second more than the use, so that a bottle that lasts is one whose time is up.
    schedule = Schedule(needed + 1.0, 0.0, max(needed, 1.0))
    for number, part in enumerate(sorted(enough, key=lambda bottle: bottle.full_mass)):
        changes = [
            f"{path}={entry.value} {entry.unit}"
            for path, entry in scaled_entries(part, paper.entries).items()
            if entry != paper.entries.get(path)
        ]
        full = load_bottle(PAPER_BOTTLE, [*changes, f"regulator.set_pressure={pressure} SI"])
        try:
            ended = follow_bottle(full, demand_of_numbers(gas, period, None), schedule).discharge.ending.kind
        except ParameterError:
            # Its regulator does not pass the flow even when it is full.
            continue
        if ended == TIME_IS_UP:
            return part, number > 0
    return None, bool(enough)
