"""Carries out a sizing study: problem in, every valve with pressure, bottle, margins and limit out."""

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ppafo.answers.display_units import quantity_text
from ppafo.parameters.chamber_volumes import ChamberVolumes, other_readings
from ppafo.parameters.device import Actuator
from ppafo.parameters.parts import Part
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.size.answer import Margins, OtherChambers, SizedValve, Sizing
from ppafo.questions.size.problem import SizingProblem, load_sizing
from ppafo.questions.size.search import (
    Pressures,
    Trials,
    ceiling,
    flow_margin,
    highest_pressure,
    limit_of,
    try_pressures,
)
from ppafo.signals import Recording
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.simulate import simulate


def with_other_chambers(
    problem: SizingProblem, valve: Part, pressure: float, threads: int | None
) -> tuple[OtherChambers, ...]:
    """Return a valve at a supply pressure [Pa absolute] with each other reading; none for chambers of its own."""
    return tuple(
        _tried(problem, valve, pressure, chambers, threads) for chambers in other_readings(_actuator_of(problem))
    )


def _actuator_of(problem: SizingProblem) -> Actuator:
    """Return the actuator that was sized: that of the scenario with the figures of the part."""
    own = problem.scenario.device.actuator
    if problem.actuator is None:
        return own
    values = problem.actuator.values
    return replace(own, torque_constant=values["torque_constant"], volume_per_angle=values["volume_per_angle"])


def _tried(
    problem: SizingProblem, valve: Part, pressure: float, chambers: ChamberVolumes, threads: int | None
) -> OtherChambers:
    scenario = replace(problem.scenario, device=chambers.of(problem.scenario.device))
    # Without the part, whose printed volume per angle would stand in for that of the reading.
    trial = Trials(replace(problem, scenario=scenario, actuator=None), threads).best(valve, np.array([pressure]))
    error, gas = float(trial.error[0]), float(trial.gas[0])
    keeps = error <= problem.largest_error
    return OtherChambers(chambers.name, keeps, error, gas, gas * problem.repetitions * (1.0 + problem.reserve))


def size(problem: SizingProblem | str | Path, threads: int | None = None, progress: Report | None = None) -> Sizing:
    """Return for each valve the lowest pressure that keeps the error limit and the smallest bottle that lasts.

    ``problem`` may be the name or path of a sizing file. StudyError or ParameterError for bad input, and where every
    run with a valve fails.
    """
    chosen = problem if isinstance(problem, SizingProblem) else load_sizing(problem)
    report = progress or report_nothing
    begun = time.perf_counter()
    trials = Trials(chosen, threads)
    sized = []
    for place, valve in enumerate(chosen.valves):
        report(Progress(f"trying {valve.name}", place, len(chosen.valves), 0, 0, time.perf_counter() - begun, "valves"))
        sized.append(_size_valve(trials, valve))
    good = [place for place, item in enumerate(sized) if item.works and item.mass is not None]
    suggested = min(good, key=lambda place: (sized[place].mass, sized[place].pressure), default=None)
    choice = None if suggested is None else sized[suggested]
    recording = None if choice is None else _recording(trials, choice)
    others = () if choice is None else with_other_chambers(chosen, choice.valve, choice.pressure, threads)
    return Sizing(
        problem=chosen,
        valves=tuple(sized),
        suggested=suggested,
        recording=recording,
        runs=trials.runs,
        failures=dict(trials.failures),
        seconds=time.perf_counter() - begun,
        others=others,
        streams=trials.seeds.size,
    )


def smallest_bottle(bottles: Sequence[Part], gas: float) -> Part | None:
    """Return the lightest full bottle that holds an amount of gas [kg]; None where none does."""
    enough = [bottle for bottle in bottles if bottle.values["content"] >= gas]
    return min(enough, key=lambda bottle: bottle.full_mass, default=None)


def _size_valve(trials: Trials, valve: Part) -> SizedValve:
    problem = trials.problem
    tried = try_pressures(trials, valve)
    place = _place_in(problem, tried)
    pressure, error, gas = (float(series[place]) for series in (tried.pressure, tried.trial.error, tried.trial.gas))
    gains = int(tried.trial.gains[place])
    works = tried.first is not None
    bottle = _bottle(problem, gas) if works else None
    said = []
    if tried.fails_above is not None:
        said.append(f"at {quantity_text(tried.fails_above, 'pressure')} the error limit is exceeded again")
    if highest_pressure(problem, valve) < problem.highest_pressure and tried.first is None:
        highest = quantity_text(highest_pressure(problem, valve), "pressure")
        said.append(f"not tried above {highest}, the rated pressure of its parts")
    if tried.first is not None and bottle is None:
        largest = max(problem.bottles, key=lambda item: item.values["content"])
        lasts = largest.values["content"] / _gas_in_all(problem, gas)
        said.append(f"no bottle is large enough: {largest.name} lasts for {100 * lasts:.0f} % of the use")
    return SizedValve(
        valve=valve,
        works=works,
        pressure=pressure,
        lowest_pressure=None if tried.first is None else float(tried.pressure[tried.first]),
        gains=trials.gain_numbers(gains),
        error=error,
        gas=gas,
        gas_in_all=_gas_in_all(problem, gas),
        bottle=bottle,
        mass=None if bottle is None else _mass(problem, valve, bottle),
        margins=_margins(trials, valve, pressure, (error, gas), bottle) if works else None,
        limit=limit_of(trials, valve, tried),
        remark="; ".join(said),
        curve=(tried.pressure, tried.trial.error, tried.trial.gas),
    )


def _place_in(problem: SizingProblem, tried: Pressures) -> int:
    """Return the place of the pressure to choose: that with the lightest bottle, of these the lowest.

    Without a bottle the lowest pressure that works; where none works, the one with the minimum error.
    """
    if tried.first is None:
        return int(np.argmin(np.where(np.isnan(tried.trial.error), np.inf, tried.trial.error)))
    masses = np.full(tried.pressure.size, np.inf)
    for place in np.flatnonzero(tried.works).tolist():
        bottle = _bottle(problem, float(tried.trial.gas[place]))
        masses[place] = np.inf if bottle is None else bottle.full_mass
    return int(np.argmin(masses)) if np.isfinite(masses).any() else tried.first


def _gas_in_all(problem: SizingProblem, gas: float) -> float:
    return gas * problem.repetitions * (1.0 + problem.reserve)


def _bottle(problem: SizingProblem, gas: float) -> Part | None:
    return smallest_bottle(problem.bottles, _gas_in_all(problem, gas))


def _mass(problem: SizingProblem, valve: Part, bottle: Part) -> float:
    parts = [valve, bottle, *problem.regulators, *([] if problem.actuator is None else [problem.actuator])]
    return sum(part.full_mass for part in parts)


def _margins(
    trials: Trials, valve: Part, pressure: float, outcome: tuple[float, float], bottle: Part | None
) -> Margins:
    """Return the margins at a pressure at which an error and a gas per repetition came out."""
    problem, (error, gas) = trials.problem, outcome
    used = gas * problem.repetitions
    return Margins(
        error=1.0 - error / problem.largest_error,
        torque=ceiling(problem, pressure) / problem.profile.largest - 1.0,
        flow=flow_margin(trials, valve, pressure),
        gas=None if bottle is None or used <= 0.0 else bottle.values["content"] / used - 1.0,
    )


def _recording(trials: Trials, sized: SizedValve) -> Recording:
    """Return the recording of a sized valve on the profile."""
    columns = trials.columns(sized.valve, np.array([sized.pressure]), np.array([0]), np.ones(1))
    numbers = {path: float(values[0]) for path, values in columns.items()} | dict(sized.gains)
    return simulate(with_numbers(trials.problem.scenario, numbers)).recording
