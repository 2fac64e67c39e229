"""Tuning of a scenario: cost, search, and evaluation of the gains before and after over fresh draws.

A candidate that satisfies all constraints is always better than one that does not; among infeasible candidates, less
violation is better; a candidate with a failed run is worse than all others (Deb's rules, 2000).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.analyses.tune.answer import remarks_of, verdict
from ppafo.analyses.tune.problem import Gains, Problem, SearchEffort
from ppafo.analyses.tune.result import FRESH_DRAWS, INFEASIBLE, GainResult, SearchStart, Tuned, UnreachableDraws
from ppafo.errors import StudyError
from ppafo.linear_algebra import on_one_thread
from ppafo.metrics import METRICS
from ppafo.parameters.overrides import over
from ppafo.progress import Report, report_nothing
from ppafo.report.kind import ConfidenceInterval
from ppafo.simulation.clock import TIMES
from ppafo.simulation.ensemble.columns import absolute
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate
from ppafo.simulation.tracking.shortfall import shortfall
from ppafo.studies.distributions import Floats
from ppafo.studies.intervals import noise_interval
from ppafo.studies.limits import MetricLimit
from ppafo.studies.sampling import NOISE_DRAWS, with_new_noise
from ppafo.studies.study import with_overrides
from ppafo.study.runs import (
    FAILED,
    RunCounter,
    Runs,
    oscillating,
    scenario_runs,
    settled,
    tracking_violation,
    with_companions,
)

UNUSABLE = 1.0e12
"""Lowest cost of a candidate with a failed run; the fraction of failed runs is added."""
_TOLERANCE = 1.0e-3
"""Relative spread of the candidates' costs below which a start has converged."""
_REFINEMENTS = 60
"""Largest number of candidates of the simplex for each gain."""
_SIMPLEX_SIZES = (0.01, 0.1)
"""Smallest and largest initial size of the simplex, as a fraction of the range."""
MINIMUM_ERRORS = ("peak_error", "rms_error_hold")
"""Error metrics that cannot be smaller than the torque shortfall of the supply at the largest reference."""
_NOISE_CONFIDENCE = 0.95
"""Confidence level of the interval of the fraction of the variance due to sensor noise."""
Costs = Callable[[Floats], Floats]
"""Function from fractions of the ranges (candidates, gains) to costs (candidates,)."""


def solve_tuning(problem: Problem, threads: int | None, progress: Report | None) -> Tuned:
    """Solve a tuning problem: search for gains, and evaluation of the gains before and after."""
    spread, report = problem.spread, progress or report_nothing
    metrics = with_companions(problem.metrics, problem.scenario)
    counter = RunCounter(_largest_runs(problem), lambda now: report(replace(now, activity="tuning", is_bound=True)))
    runs = scenario_runs(problem.scenario, metrics, counter, problem.gauge, threads)
    draws = {} if spread is None else spread.uncertainty.random_columns(0, spread.draws, spread.seed)
    gains_before = {path: [value] for path, value in problem.before.items()}
    scales = _scales(problem, _metrics_of_candidates(runs, problem, gains_before, draws))

    def costs(fractions: Floats) -> Floats:
        # As they are pasted: what keeps a constraint by less than the last digit would break it.
        candidates = [problem.gains(each) for each in fractions.tolist()]
        values = {gain.path: np.array([gains[gain.path] for gains in candidates]) for gain in problem.searched}
        return judge(_metrics_of_candidates(runs, problem, values, draws), problem, scales).cost

    starts = search(costs, [gain.fraction(gain.before) for gain in problem.searched], problem.effort)
    before, after = (
        _evaluate(runs, problem, scales, gains, draws) for gains in (problem.before, problem.gains(starts[0].fractions))
    )
    bounds = ((gain.path, gain.bound_reached(after.gains[gain.path])) for gain in problem.searched)
    reached = {path: bound for path, bound in bounds if bound is not None}
    valve = problem.scenario.device.valve_name
    return Tuned(
        tuning=problem.name,
        scenario=problem.scenario.name,
        verdict=verdict(problem, before, after),
        is_feasible=after.is_feasible,
        overrides=list(over(problem.overrides, problem.lines(after.gains), valve=valve)),
        bounds_reached=reached,
        scales=scales,
        goals=list(problem.goals),
        constraints=list(problem.constraints),
        robust=None if spread is None else {"study": spread.study or None, "measure": spread.measure},
        effort=problem.effort.model_dump(),
        before=before,
        after=after,
        starts=starts,
        runs=runs.count,
        remarks=remarks_of(problem, after, starts, runs.count, reached),
        problem=problem,
    )


def _largest_runs(problem: Problem) -> int:
    """Return the number of runs of a tuning in which no start converges early."""
    effort, gains, spread = problem.effort, len(problem.searched), problem.spread
    # The first candidates are a generation of their own.
    runs_of_start = gains * (effort.candidates_per_gain * (effort.generations + 1) + _REFINEMENTS)
    # Beside the candidates, the gains before run for the scales and for their result, and the gains found once.
    in_search = effort.starts * runs_of_start + 3
    if spread is None:
        return in_search
    # Both results run over fresh draws too, and the first of these again with other noise.
    fresh = FRESH_DRAWS + NOISE_DRAWS * spread.uncertainty.has_noise
    return spread.draws * in_search + 2 * fresh


@dataclass(frozen=True, slots=True)
class CandidateMetrics:
    """Metrics of candidates, each array (candidates, draws), with one draw if there is no uncertainty.

    ``metrics``: metrics by name [SI]
    ``judged``: metrics by which candidates are ranked; for a loop that swings in the second half of the hold, the
        error at a single instant does not count
    ``failed``: True for failed and oscillating runs
    ``off``: fraction by which a run exceeds the tracking limits
    """

    metrics: Mapping[str, Floats]
    judged: Mapping[str, Floats]
    failed: NDArray[np.bool_]
    off: Floats


@dataclass(frozen=True, slots=True)
class _CandidateScores:
    """Scores of candidates, each (candidates,).

    ``cost``: cost by which candidates are ranked
    ``objective``, ``violation``: objective, and violation of the constraints
    ``off``: fraction by which tracking exceeds its limits
    ``without_value``: fraction of the runs that failed or lack a metric
    """

    cost: Floats
    objective: Floats
    violation: Floats
    off: Floats
    without_value: Floats


def judge(runs: CandidateMetrics, problem: Problem, scales: Mapping[str, float]) -> _CandidateScores:
    """Score candidates by objective, constraints and tracking; ``scales`` are scales of the goals by metric [SI]."""
    lacks_metric = np.any([~np.isfinite(values) for values in runs.judged.values()], axis=0)
    without_value = np.asarray(np.mean(runs.failed | lacks_metric, axis=1))
    # Candidates with failed runs are ranked by how many fail: 0 keeps nan out of the sums meanwhile.
    known = {name: np.where(without_value[:, None] > 0.0, 0.0, values) for name, values in runs.judged.items()}
    objective, violation = np.zeros(without_value.size), np.zeros(without_value.size)
    for goal in problem.goals:
        objective += goal.weight * problem.bad_end(known[goal.metric], goal.weight > 0.0) / scales[goal.metric]
    for constraint in problem.constraints:
        reached = problem.bad_end(known[constraint.metric], constraint.is_most)
        excess = reached - constraint.limit if constraint.is_most else constraint.limit - reached
        # As a fraction of the limit, so that constraints in different units add up; a limit of 0 has no fractions.
        violation += np.maximum(0.0, excess) / (abs(constraint.limit) or 1.0)
    # A loop that does not follow its reference violates a constraint that holds in every tuning.
    off = np.maximum(0.0, problem.bad_end(runs.off, True))
    # Deb's rules in one number, since SciPy compares nothing else.
    broken = violation + off
    cost = np.where(broken > 0.0, INFEASIBLE + broken, objective)
    cost = np.where(without_value > 0.0, UNUSABLE * (1.0 + without_value), cost)
    return _CandidateScores(cost, objective, violation, off, without_value)


@on_one_thread
def search(costs: Costs, before: Sequence[float], effort: SearchEffort) -> list[SearchStart]:
    """Return the result of each start of the search, the best first; equal seeds give equal results.

    ``before`` are the values before tuning as fractions of the ranges; they are among the first candidates if they lie
    within the bounds. The search is differential evolution (Storn and Price, 1997) as in SciPy, followed by the simplex
    method of Nelder and Mead (1965). Both use only comparisons of costs.
    """
    seeds = np.random.SeedSequence(effort.seed).spawn(effort.starts)
    finished = [_search_from_start(costs, before, effort, np.random.default_rng(seed)) for seed in seeds]
    return sorted(finished, key=lambda start: start.cost)


def _search_from_start(
    costs: Costs, before: Sequence[float], effort: SearchEffort, random: np.random.Generator
) -> SearchStart:
    """Return the result of one start: differential evolution, then a simplex around its best candidate."""
    from scipy.optimize import minimize

    batches: list[Floats] = []

    def batch_costs(columns: Floats) -> Floats:
        # SciPy has a candidate in each column, the costs one in each row.
        batches.append(costs(np.clip(np.atleast_2d(columns.T), 0.0, 1.0)))
        return batches[-1]

    evolved = _evolution(batch_costs, before, effort, random)
    generations = len(batches)
    # In a flat valley generations come to within a hundredth of the best, and hardly nearer.
    size = np.clip(np.std(evolved.population, axis=0), *_SIMPLEX_SIZES)
    corners = [evolved.x, *(evolved.x + np.diag(np.where(evolved.x + size > 1.0, -size, size)))]
    refined = minimize(
        lambda fractions: float(batch_costs(fractions[:, None])[0]),
        evolved.x,
        method="Nelder-Mead",
        bounds=[(0.0, 1.0)] * len(before),
        options={
            "initial_simplex": np.array(corners),
            "maxfev": _REFINEMENTS * len(before),
            "xatol": _TOLERANCE,
            "fatol": _TOLERANCE * _TOLERANCE * abs(float(evolved.fun)),
        },
    )
    best = np.minimum.accumulate([np.min(batch) for batch in batches]).tolist()
    return SearchStart(
        fractions=tuple(map(float, refined.x)),
        cost=float(refined.fun),
        candidates=sum(map(len, batches)),
        # The simplex adds one cost, where it ended.
        generations=(*best[:generations], best[-1]),
        is_settled=_is_settled(evolved.population_energies),
    )


def _evolution(costs: Costs, before: Sequence[float], effort: SearchEffort, random: np.random.Generator) -> Any:
    """Return SciPy's result of the differential evolution, with its last population."""
    from scipy.optimize import differential_evolution

    # SciPy refuses a first candidate beyond the bounds.
    is_within = all(0.0 <= fraction <= 1.0 for fraction in before)
    return differential_evolution(
        costs,
        [(0.0, 1.0)] * len(before),
        x0=np.asarray(before) if is_within else None,
        init="latinhypercube",
        popsize=effort.candidates_per_gain,
        maxiter=effort.generations,
        # No test of SciPy's own: ``_is_settled`` decides, which knows what a broken constraint adds to the costs.
        tol=0.0,
        callback=lambda intermediate_result: _is_settled(intermediate_result.population_energies),
        # SciPy's polishing would take derivatives of a cost that jumps where a constraint breaks.
        polish=False,
        # A whole generation at a time, so that it is one ensemble.
        updating="deferred",
        vectorized=True,
        rng=random,
    )


def _is_settled(costs: Floats) -> bool:
    """Return whether the costs of a generation have converged."""
    least, most = np.min(costs), np.max(costs)
    if most >= UNUSABLE or least < INFEASIBLE <= most:
        return False
    # Where all break a constraint, what counts is by how much they break it.
    excess = costs - INFEASIBLE if least >= INFEASIBLE else costs
    return float(np.std(excess)) <= _TOLERANCE * abs(float(np.mean(excess)))


def _metrics_of_candidates(
    runs: Runs, problem: Problem, values: Mapping[str, Sequence[float] | Floats], draws: Mapping[str, Floats]
) -> CandidateMetrics:
    """Run every candidate with every draw and return the metrics.

    ``values`` are the gains by path, each (candidates,); ``draws`` are the uncertain values by path, each (draws,).
    """
    candidates = len(next(iter(values.values())))
    count = len(next(iter(draws.values()))) if draws else 1
    columns = {path: np.repeat(column, count) for path, column in values.items()}
    columns |= {path: np.tile(column, candidates) for path, column in draws.items()}
    rows = runs.run(columns)
    shape = (candidates, count)
    # Gains with which the loop oscillates are no better than ones with which the run fails.
    unusable = rows[FAILED] | oscillating(rows, problem.scenario)
    return CandidateMetrics(
        metrics={name: rows[name].reshape(shape) for name in problem.metrics},
        judged={name: settled(rows, name).reshape(shape) for name in problem.metrics},
        failed=unusable.reshape(shape),
        off=tracking_violation(rows, problem.scenario, columns, problem.gauge).reshape(shape),
    )


def _scales(problem: Problem, before: CandidateMetrics) -> dict[str, float]:
    """Return the scale of each goal: the given one, or the value of the metric before tuning."""
    # By default each goal is 1 before tuning: goals in different units then weigh as much as their weights say.
    scales = {}
    for goal in problem.goals:
        scale = goal.scale
        if scale is None:
            scale = abs(float(problem.bad_end(before.judged[goal.metric], goal.weight > 0.0)[0]))
        if not np.isfinite(scale) or scale == 0.0:
            raise StudyError(
                f"tuning '{problem.name}': objective '{goal.metric}' is {scale:g} before tuning, which cannot be its "
                "scale; set scale = 'VALUE UNIT' in this objective"
            )
        scales[goal.metric] = scale
    return scales


def _evaluate(
    runs: Runs, problem: Problem, scales: Mapping[str, float], gains: Gains, draws: Mapping[str, Floats]
) -> GainResult:
    """Return the result of a set of gains over the draws of the search, over fresh draws and on the nominal device."""
    spread = problem.spread
    candidate = {path: [value] for path, value in gains.items()}
    over_fresh = in_search = _metrics_of_candidates(runs, problem, candidate, draws)
    fresh: dict[str, Floats] = {}
    noise: dict[str, ConfidenceInterval] = {}
    if spread is not None:
        # Draws that follow those of the search: the gains were not chosen on them.
        fresh = spread.uncertainty.random_columns(spread.draws, FRESH_DRAWS, spread.seed)
        over_fresh = _metrics_of_candidates(runs, problem, candidate, fresh)
        if spread.uncertainty.has_noise:
            renewed = _metrics_of_candidates(runs, problem, candidate, with_new_noise(fresh))
            for name, values in renewed.metrics.items():
                if share := noise_interval(over_fresh.metrics[name][0], values[0], _NOISE_CONFIDENCE):
                    noise[name] = share
    scores, fresh_scores = (judge(metrics, problem, scales) for metrics in (in_search, over_fresh))
    # Unchanged gains are not written and read again, which would round them.
    is_changed = gains != problem.before
    scenario = with_overrides(problem.scenario, problem.lines(gains)) if is_changed else problem.scenario
    result = simulate(scenario)
    return GainResult(
        gains=gains,
        values=_values(in_search.metrics, problem),
        fresh={} if spread is None else _values(over_fresh.metrics, problem),
        judged=_values(over_fresh.judged, problem),
        objective=float(scores.objective[0]),
        violation=float(scores.violation[0]),
        off=float(max(scores.off[0], fresh_scores.off[0])),
        share_off=float(np.mean(np.concatenate([in_search.off, over_fresh.off], axis=1) > 0.0)),
        share_without_value=float(scores.without_value[0]),
        fresh_violation=float(fresh_scores.violation[0]),
        fresh_share_without_value=float(fresh_scores.without_value[0]),
        torque_ceiling=_unreachable_draws(problem, scenario, fresh, over_fresh),
        share_of_noise=noise,
        metrics=result.metrics,
        result=result,
    )


def _unreachable_draws(
    problem: Problem, base: Scenario, draws: Mapping[str, Floats], runs: CandidateMetrics
) -> UnreachableDraws:
    """Return the draws in which the supply limits the torque, and the violated constraints that this explains."""
    columns = {path: column for path, column in absolute(base, draws, problem.gauge).items() if path not in TIMES}
    scenario = with_numbers(base, columns)
    if not scenario.follows_reference:
        return UnreachableDraws(0.0, ())
    lacking = np.broadcast_to(shortfall(scenario), runs.failed[:1].shape)
    explained = [
        constraint.metric
        for constraint in problem.constraints
        if METRICS[constraint.metric].of_reference
        and _is_explained(problem, constraint, runs.judged[constraint.metric], lacking)
    ]
    return UnreachableDraws(float(np.mean(lacking > 0.0)), tuple(explained) if lacking.any() else ())


def _is_explained(problem: Problem, constraint: MetricLimit, values: Floats, lacking: Floats) -> bool:
    """Return whether the torque that the supply is ``lacking`` in each draw [N m] is all that breaks a constraint."""
    is_most = constraint.is_most
    if constraint.is_kept(float(problem.bad_end(values, is_most)[0])):
        return False
    if constraint.metric in MINIMUM_ERRORS and is_most:
        # An error is never below what the supply lacks: where that alone is too much, no gains can keep the limit.
        is_mean = problem.spread is None or problem.spread.fraction is None
        smallest_error = np.mean(lacking, axis=1) if is_mean else problem.bad_end(lacking, True)
        if not constraint.is_kept(float(smallest_error[0])):
            return True
    # Else the draws that lack nothing must keep it alone; a standard deviation needs two of them.
    within_reach = values[:, lacking[0] == 0.0]
    return within_reach.shape[1] < 2 or bool(constraint.is_kept(float(problem.bad_end(within_reach, is_most)[0])))


def _values(metrics: Mapping[str, Floats], problem: Problem) -> dict[str, float]:
    """Return the metrics of the first candidate by name, at the unfavourable end.

    A metric is nan if a run does not have it.
    """
    less = {constraint.metric: constraint.is_most for constraint in problem.constraints}
    less |= {goal.metric: goal.weight > 0.0 for goal in problem.goals}
    return {name: float(problem.bad_end(metrics[name], less[name])[0]) for name in problem.metrics}
