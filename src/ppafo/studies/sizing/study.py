"""Carries out a sizing study: problem in, every valve with pressure, bottle, margins and limit out."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ppafo.parameters.parts import Part
from ppafo.signals import Recording
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.simulate import simulate
from ppafo.studies.sizing.problem import SizingProblem, load_sizing
from ppafo.studies.sizing.result import Margins, SizedValve, Sizing
from ppafo.studies.sizing.search import (
    Pressures,
    ceiling,
    flow_margin,
    highest_pressure,
    limit_of,
    tried_pressures,
)
from ppafo.studies.sizing.trials import Trials
from ppafo.units import from_si

Watch = Callable[[str], None]


def run_sizing(problem: SizingProblem | str | Path, threads: int | None = None, watch: Watch | None = None) -> Sizing:
    """Return for each valve the lowest pressure that keeps the error limit and the smallest bottle that lasts.

    ``problem`` may be a sizing file. ``watch`` is told which valve is being tried.
    """
    chosen = problem if isinstance(problem, SizingProblem) else load_sizing(problem)
    begun = time.perf_counter()
    trials = Trials(chosen, threads)
    sized = []
    for valve in chosen.valves:
        if watch is not None:
            watch(f"trying {valve.name}")
        sized.append(_sized(trials, valve))
    good = [place for place, item in enumerate(sized) if item.works and item.mass is not None]
    suggested = min(good, key=lambda place: (sized[place].mass, sized[place].pressure), default=None)
    recording = None if suggested is None else _recording(trials, sized[suggested])
    return Sizing(
        problem=chosen,
        valves=tuple(sized),
        suggested=suggested,
        recording=recording,
        runs=trials.runs,
        failures=dict(trials.failures),
        seconds=time.perf_counter() - begun,
    )


def smallest_bottle(bottles: Sequence[Part], gas: float) -> Part | None:
    """Return the lightest full bottle that holds an amount of gas [kg]; None where none does."""
    enough = [bottle for bottle in bottles if bottle.values["content"] >= gas]
    return min(enough, key=lambda bottle: bottle.full_mass, default=None)


def _sized(trials: Trials, valve: Part) -> SizedValve:
    problem = trials.problem
    tried = tried_pressures(trials, valve)
    place = _place(problem, tried)
    pressure, error, gas = (float(series[place]) for series in (tried.pressure, tried.trial.error, tried.trial.gas))
    gains = int(tried.trial.gains[place])
    works = tried.first is not None
    bottle = _bottle(problem, gas) if works else None
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
        remark=_remark(problem, valve, tried, gas, bottle),
        curve=(tried.pressure, tried.trial.error, tried.trial.gas),
    )


def _place(problem: SizingProblem, tried: Pressures) -> int:
    """Return the place of the pressure to choose: that with the lightest bottle, of these the lowest.

    Without a bottle the lowest pressure that works; where none works, the one with the least error.
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


def _remark(problem: SizingProblem, valve: Part, tried: Pressures, gas: float, bottle: Part | None) -> str:
    """Return what a reader has to know besides the numbers, an empty text where nothing."""
    said = []
    if tried.fails_above is not None:
        said.append(f"at {_gauge(problem, tried.fails_above):.1f} psi_g the error limit is missed again")
    if highest_pressure(problem, valve) < problem.highest_pressure and tried.first is None:
        highest = _gauge(problem, highest_pressure(problem, valve))
        said.append(f"not tried above {highest:.0f} psi_g, for which its parts are made")
    if tried.first is not None and bottle is None:
        largest = max(problem.bottles, key=lambda item: item.values["content"])
        lasts = largest.values["content"] / _gas_in_all(problem, gas)
        said.append(f"no bottle is large enough: {largest.name} lasts for {100 * lasts:.0f} % of the use")
    return "; ".join(said)


def _gauge(problem: SizingProblem, pressure: float) -> float:
    return from_si(pressure, "psi_g", "Pa_a", problem.scenario.device.supply.atmospheric_pressure)


def _recording(trials: Trials, sized: SizedValve) -> Recording:
    """Return the recording of a sized valve on the profile."""
    columns = trials.columns(sized.valve, np.array([sized.pressure]), np.array([0]), np.ones(1))
    numbers = {path: float(values[0]) for path, values in columns.items()} | dict(sized.gains)
    return simulate(with_numbers(trials.problem.scenario, numbers)).recording
