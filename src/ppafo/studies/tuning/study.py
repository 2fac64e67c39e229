"""Tunes a scenario: search, then both settings, before and after, looked at closely."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ppafo.errors import StudyError
from ppafo.simulation.result import Result
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate
from ppafo.studies.comparison.configurations import with_overrides
from ppafo.studies.sweep.sampling.distributions import Floats
from ppafo.studies.tuning.judging import Judged, Runs, bad_ends, judge
from ppafo.studies.tuning.loading import load_tuning
from ppafo.studies.tuning.problem import Gains, Problem
from ppafo.studies.tuning.search import Start, search
from ppafo.studies.uncertainty.outcomes import Model, Outcomes, Tally, Watch, scenario_model

FRESH_DRAWS = 1024
"""Draws that the search never saw, over which the result is judged in the end."""


@dataclass(frozen=True, slots=True)
class Setting:
    """Gains [SI] and what they give.

    ``values`` are the metrics by which they are judged [SI]: as the device is said to be, or at their bad end over the
    draws of the search; ``fresh`` the same over draws that the search never saw (empty without uncertainty).
    ``objective`` and ``violation`` are those of the search; ``result`` is one run of the device as it is said to be.
    """

    gains: Gains
    values: Mapping[str, float]
    fresh: Mapping[str, float]
    objective: float
    violation: float
    without_value: float
    result: Result

    @property
    def is_feasible(self) -> bool:
        """True where all constraints are kept and no run fails."""
        return self.violation == 0.0 and self.without_value == 0.0


@dataclass(frozen=True, slots=True)
class Tuning:
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
    tuning: Problem | str | Path | Mapping[str, Any],
    overrides: Sequence[str] = (),
    threads: int | None = None,
    watch: Watch | None = None,
) -> Tuning:
    """Search the best values of a tuning: a name, a TOML file, data laid out as one, or a Problem.

    Every generation is one ensemble, and every candidate sees the same draws. StudyError for bad input, and where a
    goal has no scale because the scenario as it is gives 0 or nothing.
    """
    problem = _loaded(tuning, overrides)
    tally = Tally(_most_runs(problem), watch)
    model = scenario_model(problem.scenario, problem.metrics, threads, tally.add)
    fixed = _draws(problem, 0, 1 if problem.spread is None else problem.spread.draws)
    scales = _scales(problem, _runs(model, problem, [problem.before], fixed))

    def costs(shares: Floats) -> Floats:
        values = {item.path: item.value(shares[:, column]) for column, item in enumerate(problem.searched)}
        return judge(_crossed(model, values, fixed), problem, scales).cost

    before = [item.share(item.before) for item in problem.searched]
    starts = tuple(search(costs, before, problem.effort))
    settings = [_setting(model, problem, scales, gains) for gains in (problem.before, problem.gains(starts[0].shares))]
    return Tuning(problem, scales, settings[0], settings[1], starts, tally.done)


def _loaded(tuning: Problem | str | Path | Mapping[str, Any], overrides: Sequence[str]) -> Problem:
    if not isinstance(tuning, Problem):
        return load_tuning(tuning, overrides)
    if overrides:
        raise StudyError("a Problem cannot be overridden any more; load it with the overrides")
    return tuning


def _most_runs(problem: Problem) -> int:
    effort, draws = problem.effort, 1 if problem.spread is None else problem.spread.draws
    candidates = effort.candidates_per_gain * len(problem.searched) * (effort.generations + 1) * effort.starts
    return draws * (candidates + 3) + (2 * FRESH_DRAWS if problem.spread is not None else 0)


def _draws(problem: Problem, first: int, count: int) -> dict[str, Floats]:
    """Return draws of the uncertain values; nothing without uncertainty."""
    spread = problem.spread
    return {} if spread is None else spread.uncertainty.random_columns(first, count, spread.seed)


def _runs(model: Model, problem: Problem, gains: Sequence[Gains], draws: Mapping[str, Floats]) -> Runs:
    values = {item.path: np.array([one[item.path] for one in gains]) for item in problem.searched}
    return _crossed(model, values, draws)


def _crossed(model: Model, values: Mapping[str, Floats], draws: Mapping[str, Floats]) -> Runs:
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
                f"tuning '{problem.name}': objective '{goal.metric}' is {found:g} before tuning, which is no scale; "
                "give one, scale = 'VALUE UNIT'"
            )
        scales[goal.metric] = found
    return scales


def _setting(model: Model, problem: Problem, scales: Mapping[str, float], gains: Gains) -> Setting:
    spread = problem.spread
    fixed = _draws(problem, 0, 1 if spread is None else spread.draws)
    runs = _runs(model, problem, [gains], fixed)
    judged: Judged = judge(runs, problem, scales)
    fresh: dict[str, float] = {}
    if spread is not None:
        fresh = _values(_runs(model, problem, [gains], _draws(problem, spread.draws, FRESH_DRAWS)), problem)
    return Setting(
        gains=gains,
        values=_values(runs, problem),
        fresh=fresh,
        objective=float(judged.objective[0]),
        violation=float(judged.violation[0]),
        without_value=float(judged.without_value[0]),
        result=simulate(tuned_scenario(problem, gains)),
    )


def tuned_scenario(problem: Problem, gains: Gains) -> Scenario:
    """Return the scenario of a problem with gains in it, as the pasted lines give it."""
    if gains == problem.before:
        return problem.scenario
    return with_overrides(problem.scenario, problem.lines(gains))


def _values(runs: Runs, problem: Problem) -> dict[str, float]:
    """Return every metric of the problem as the first candidate is judged by it; nan where a run has none."""
    less = {goal.metric: goal.weight > 0.0 for goal in problem.goals}
    less |= {item.metric: item.is_most for item in problem.constraints if item.metric not in less}
    return {name: float(bad_ends(runs.metrics[name], problem.spread, less[name])[0]) for name in problem.metrics}
