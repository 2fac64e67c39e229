"""Tunes a scenario: the search, then both settings, before and after, over fresh draws and on the nominal device."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ppafo.answers import Solved
from ppafo.errors import StudyError
from ppafo.metrics import METRICS
from ppafo.progress import Report
from ppafo.questions.tune.file import load_tuning
from ppafo.questions.tune.problem import Constraint, Gains, Problem, Spread
from ppafo.questions.tune.search import Judgement, Runs, Start, bad_ends, judge, keeps, search, shortfall
from ppafo.simulation.ensemble.columns import absolute
from ppafo.simulation.numbers import TIMES, with_numbers
from ppafo.simulation.result import Result
from ppafo.simulation.scenario import Scenario, worn_kind
from ppafo.simulation.simulate import OPEN_LOOP, simulate
from ppafo.studies.configurations import with_overrides
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import with_new_noise
from ppafo.studies.intervals import Interval, noise_interval
from ppafo.studies.outcomes import Model, Outcomes, Tally, scenario_model

FRESH_DRAWS = 1024
"""Draws that the search never saw, over which the result is judged in the end."""
MINIMUM_ERRORS = ("peak_error", "rms_error_hold")
"""Metrics that are never below what the supply lacks of the largest reference."""
_NOISE_DRAWS = 512
"""Fresh draws that are run once more with other noise."""
_NOISE_CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Ceiling:
    """Draws in which the reference needs more torque than the supply can hold, whatever the gains.

    ``fraction`` is theirs of all; ``explains`` are the metrics of the constraints that they alone break: no gains can
    keep them, or the other draws do.
    """

    fraction: float
    explains: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Setting:
    """Gains [SI] and what they give.

    ``values`` are the metrics by which the search judges them [SI]: as the device is said to be, or at their bad end
    over the draws of the search; ``fresh`` the same over draws that the search did not use (empty without draws).
    ``objective`` is that of the search. ``violation`` and ``without_value`` are those of the search first, of the fresh
    draws second (the same again without draws). ``noise`` is the fraction of the variance over the fresh draws that is
    due to sensor noise, by metric. ``result`` is one run of the nominal device.
    """

    gains: Gains
    values: Mapping[str, float]
    fresh: Mapping[str, float]
    objective: float
    violation: tuple[float, float]
    without_value: tuple[float, float]
    ceiling: Ceiling
    noise: Mapping[str, Interval]
    result: Result

    @property
    def is_feasible_in_search(self) -> bool:
        """True where all constraints are kept and no run fails over what the search saw."""
        return self.violation[0] == 0.0 and self.without_value[0] == 0.0

    @property
    def is_feasible(self) -> bool:
        """True where all constraints are kept and no run fails, over fresh draws too."""
        return self.is_feasible_in_search and self.violation[1] == 0.0 and self.without_value[1] == 0.0


@dataclass(frozen=True, slots=True)
class Tuning(Solved):
    """What a search came to. ``starts`` are best first; ``runs`` counts all simulated runs."""

    problem: Problem
    scales: Mapping[str, float]
    before: Setting
    after: Setting
    starts: tuple[Start, ...]
    runs: int

    @property
    def bounds_reached(self) -> dict[str, Literal["minimum", "maximum"]]:
        """The gains that ended at a bound, and at which: a better one may lie beyond."""
        found = {item.path: item.bound_reached(self.after.gains[item.path]) for item in self.problem.searched}
        return {path: bound for path, bound in found.items() if bound is not None}

    @property
    def lines(self) -> list[str]:
        """The gains found, as overrides ``PATH=VALUE`` to paste."""
        return self.problem.lines(self.after.gains)


def tune(
    tuning: Problem | str | Path | Mapping[str, Any] | None = None,
    overrides: Sequence[str] = (),
    seed: int | None = None,
    threads: int | None = None,
    progress: Report | None = None,
) -> Tuning:
    """Search the best values of a tuning: a name, a TOML file, data laid out as one, or a Problem.

    ``overrides`` change the scenario, ``seed`` is that of the search, of the file by default. Every generation is one
    ensemble, and every candidate sees the same draws. StudyError for bad input, and where a goal has no scale because
    the scenario as it is gives 0 or nothing.
    """
    problem = _problem_of(tuning, overrides)
    if seed is not None:
        problem = replace(problem, effort=replace(problem.effort, seed=seed))
        if problem.spread is not None and not problem.spread.study:
            problem = replace(problem, spread=replace(problem.spread, seed=seed))
    tally = Tally(_most_runs(problem), progress)
    model = scenario_model(problem.scenario, problem.metrics, threads, tally.add, problem.gauge)
    fixed = _draws(problem, 0, 1 if problem.spread is None else problem.spread.draws)
    scales = _scales(problem, _runs(model, problem, [problem.before], fixed))

    def costs(fractions: Floats) -> Floats:
        values = {item.path: item.value(fractions[:, column]) for column, item in enumerate(problem.searched)}
        return judge(_run_crossed(model, values, fixed), problem, scales).cost

    before = [item.fraction(item.before) for item in problem.searched]
    starts = tuple(search(costs, before, problem.effort))
    settings = [
        _setting(model, problem, scales, gains) for gains in (problem.before, problem.gains(starts[0].fractions))
    ]
    return Tuning(problem, scales, settings[0], settings[1], starts, tally.done)


def _problem_of(tuning: Problem | str | Path | Mapping[str, Any] | None, overrides: Sequence[str]) -> Problem:
    if tuning is None:
        raise StudyError("no tuning was given: name one or give a .toml file; 'ppafo tune --list' shows them")
    if not isinstance(tuning, Problem):
        return load_tuning(tuning, overrides)
    if overrides:
        raise StudyError("a loaded Problem takes no overrides; give them to load_tuning")
    return tuning


def _most_runs(problem: Problem) -> int:
    effort, draws = problem.effort, 1 if problem.spread is None else problem.spread.draws
    candidates = effort.candidates_per_gain * len(problem.searched) * (effort.generations + 1) * effort.starts
    noise = _NOISE_DRAWS if problem.spread is not None and problem.spread.uncertainty.has_noise else 0
    return draws * (candidates + 3) + (2 * (FRESH_DRAWS + noise) if problem.spread is not None else 0)


def _draws(problem: Problem, first: int, count: int) -> dict[str, Floats]:
    """Return draws of the uncertain values; nothing without uncertainty."""
    spread = problem.spread
    return {} if spread is None else spread.uncertainty.random_columns(first, count, spread.seed)


def _runs(model: Model, problem: Problem, gains: Sequence[Gains], draws: Mapping[str, Floats]) -> Runs:
    values = {item.path: np.array([one[item.path] for one in gains]) for item in problem.searched}
    return _run_crossed(model, values, draws)


def _run_crossed(model: Model, values: Mapping[str, Floats], draws: Mapping[str, Floats]) -> Runs:
    """Run every candidate (values, each (candidates,)) with every draw (columns, each (draws,))."""
    candidates = len(next(iter(values.values())))
    count = len(next(iter(draws.values()))) if draws else 1
    columns = {path: np.repeat(column, count) for path, column in values.items()}
    columns |= {path: np.tile(column, candidates) for path, column in draws.items()}
    outcomes: Outcomes = model(columns)
    shape = (candidates, count)
    metrics = {name: found.reshape(shape) for name, found in outcomes.metrics.items()}
    return Runs(metrics, outcomes.failed.reshape(shape))


def _scales(problem: Problem, before: Runs) -> dict[str, float]:
    """Return the size of each goal: the given one, or its value before tuning."""
    scales = {}
    for goal in problem.goals:
        found = goal.scale
        if found is None:
            found = abs(float(bad_ends(before.metrics[goal.metric], problem.spread, goal.weight > 0.0)[0]))
        if not np.isfinite(found) or found == 0.0:
            raise StudyError(
                f"tuning '{problem.name}': objective '{goal.metric}' is {found:g} before tuning, which cannot be "
                "the scale; give one, scale = 'VALUE UNIT'"
            )
        scales[goal.metric] = found
    return scales


def _setting(model: Model, problem: Problem, scales: Mapping[str, float], gains: Gains) -> Setting:
    spread = problem.spread
    runs = _runs(model, problem, [gains], _draws(problem, 0, 1 if spread is None else spread.draws))
    judged: Judgement = judge(runs, problem, scales)
    columns = {} if spread is None else _draws(problem, spread.draws, FRESH_DRAWS)
    again = runs if spread is None else _runs(model, problem, [gains], columns)
    rejudged: Judgement = judge(again, problem, scales)
    noise: dict[str, Interval] = {}
    if spread is not None and spread.uncertainty.has_noise:
        other = _runs(model, problem, [gains], with_new_noise(columns, _NOISE_DRAWS))
        noise = _noise(again, other)
    return Setting(
        gains=gains,
        values=_values(runs, problem),
        fresh={} if spread is None else _values(again, problem),
        objective=float(judged.objective[0]),
        violation=(float(judged.violation[0]), float(rejudged.violation[0])),
        without_value=(float(judged.without_value[0]), float(rejudged.without_value[0])),
        ceiling=_ceiling(problem, gains, columns, again),
        noise=noise,
        result=simulate(scenario_with(problem, gains)),
    )


def _noise(runs: Runs, other: Runs) -> dict[str, Interval]:
    """Return the fraction of noise in each metric of the first candidate, where it varies."""
    pairs = {name: (runs.metrics[name][0], values[0]) for name, values in other.metrics.items()}
    found = {
        name: noise_interval(first[: second.size], second, _NOISE_CONFIDENCE) for name, (first, second) in pairs.items()
    }
    return {name: fraction for name, fraction in found.items() if fraction is not None}


def _ceiling(problem: Problem, gains: Gains, draws: Mapping[str, Floats], runs: Runs) -> Ceiling:
    """Return in how many draws the supply cannot hold the reference, and which violated constraints that explains."""
    base = scenario_with(problem, gains)
    given = {path: column for path, column in absolute(base, draws, problem.gauge).items() if path not in TIMES}
    scenario = with_numbers(base, given)
    if scenario.control.kind == OPEN_LOOP or worn_kind(scenario) is not None:
        return Ceiling(0.0, ())
    known = runs.metrics
    lacking = np.broadcast_to(shortfall(scenario), known[problem.metrics[0]][:1].shape)
    explained = [
        item.metric
        for item in problem.constraints
        if "reference" in METRICS[item.metric].channels
        and not keeps(item, float(bad_ends(known[item.metric], problem.spread, item.is_most)[0]))
        and _is_explained(item, problem.spread, known[item.metric], lacking)
    ]
    return Ceiling(float(np.mean(lacking > 0.0)), tuple(explained) if lacking.any() else ())


def _is_explained(item: Constraint, spread: Spread | None, values: Floats, lacking: Floats) -> bool:
    """Tell whether the draws below the ceiling alone break a constraint: no gains can, or the others keep it."""
    if item.metric in MINIMUM_ERRORS and item.is_most:
        least = np.mean(lacking, axis=1) if spread is None or spread.fraction is None else spread.bad_end(lacking, True)
        if not keeps(item, float(least[0])):
            return True
    rest = values[:, lacking[0] == 0.0]
    return rest.shape[1] < 2 or keeps(item, float(bad_ends(rest, spread, item.is_most)[0]))


def scenario_with(problem: Problem, gains: Gains) -> Scenario:
    """Return the scenario of a problem with gains in it, as the pasted lines give it."""
    if gains == problem.before:
        return problem.scenario
    return with_overrides(problem.scenario, problem.lines(gains))


def _values(runs: Runs, problem: Problem) -> dict[str, float]:
    """Return every metric of the problem as the first candidate is judged by it; nan where a run has none."""
    less = {goal.metric: goal.weight > 0.0 for goal in problem.goals}
    less |= {item.metric: item.is_most for item in problem.constraints if item.metric not in less}
    return {name: float(bad_ends(runs.metrics[name], problem.spread, less[name])[0]) for name in problem.metrics}
