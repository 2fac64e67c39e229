"""Carries out a sizing study: problem in, every valve with pressure, bottle, margins and limit out."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ppafo.answers import Solved
from ppafo.answers.display_units import quantity_text
from ppafo.parameters.parts import Part
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.size.file import SizingProblem, load_sizing
from ppafo.questions.size.search import (
    Floats,
    Limit,
    Pressures,
    Trials,
    ceiling,
    flow_margin,
    highest_pressure,
    limit_of,
    try_pressures,
)
from ppafo.questions.size.volumes import OtherChambers, with_other_chambers
from ppafo.signals import Recording
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.simulate import simulate


@dataclass(frozen=True, slots=True)
class Margins:
    """How far a sized valve is from its limits, as fractions [-].

    ``error``: how much smaller the RMS error is than its limit. ``torque``: how much more torque the pressure can hold
    than the profile asks for; below 0 where the error limit lets its crest be cut. ``flow``: how much smaller the
    opening might be if the gauge pressure were a tenth higher. ``gas``: how much more gas the bottle has than is used;
    None without a bottle.
    """

    error: float
    torque: float
    flow: float
    gas: float | None


@dataclass(frozen=True, slots=True, eq=False)
class SizedValve:
    """A valve at a supply pressure [Pa absolute] that keeps the error limit: the one with the lightest bottle.

    ``works`` False: it keeps the limit at no pressure; then ``pressure`` is the one with the smallest error.
    ``lowest_pressure`` [Pa absolute] is the lowest that works, and ``limit`` what keeps it from being lower. ``gains``
    are those of the controller, by path, in SI. Error [N m], gas per repetition [kg], total gas with the reserve [kg];
    ``bottle`` None where none is large enough; ``mass`` [kg] of valve, bottle, regulators, and actuator where one was
    named. ``curve`` has pressures [Pa absolute], errors [N m] and gas per repetition [kg] with the best gains of each.
    """

    valve: Part
    works: bool
    pressure: float
    lowest_pressure: float | None
    gains: Mapping[str, float]
    error: float
    gas: float
    gas_in_all: float
    bottle: Part | None
    mass: float | None
    margins: Margins | None
    limit: Limit
    remark: str
    curve: tuple[Floats, Floats, Floats]


@dataclass(frozen=True, slots=True, eq=False)
class Sizing(Solved):
    """The result of a sizing study: every valve, and the place of the lightest that works with a bottle, if any.

    ``recording`` is the suggestion on the profile, None without one. ``failures`` maps reasons of failed runs to how
    many had them. ``others`` is the suggestion with other readings of the paper's chambers.
    ``streams`` of noise were met by every trial, its error the largest of them; 0 without noise.
    """

    problem: SizingProblem
    valves: tuple[SizedValve, ...]
    suggested: int | None
    recording: Recording | None
    runs: int
    failures: Mapping[str, int]
    seconds: float
    others: tuple[OtherChambers, ...]
    streams: int = 0

    @property
    def choice(self) -> SizedValve | None:
        """The suggestion."""
        return None if self.suggested is None else self.valves[self.suggested]

    @property
    def doubtful(self) -> tuple[tuple[Part, str], ...]:
        """Figures that are quoted or assumed, of the parts that the result rests on."""
        problem = self.problem
        parts = [item.valve for item in self.valves] + [item.bottle for item in self.valves if item.bottle is not None]
        parts += [*problem.regulators, *([] if problem.actuator is None else [problem.actuator])]
        once = {(part.group, part.name): part for part in parts}.values()
        return tuple((part, name) for part in once for name in part.doubtful)


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


def _remark(problem: SizingProblem, valve: Part, tried: Pressures, gas: float, bottle: Part | None) -> str:
    """Return what a reader has to know besides the numbers, an empty text where nothing."""
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
    return "; ".join(said)


def _recording(trials: Trials, sized: SizedValve) -> Recording:
    """Return the recording of a sized valve on the profile."""
    columns = trials.columns(sized.valve, np.array([sized.pressure]), np.array([0]), np.ones(1))
    numbers = {path: float(values[0]) for path, values in columns.items()} | dict(sized.gains)
    return simulate(with_numbers(trials.problem.scenario, numbers)).recording
