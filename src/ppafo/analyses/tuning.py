"""Tuning: its file, the search for numbers such as gains, and the report of what was found.

A candidate that satisfies all constraints is always better than one that does not; among infeasible candidates, less
violation is better; a candidate with a failed run is worse than all others (Deb's rules, 2000).
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import resources
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

from ppafo.analyses import ask, np
from ppafo.arguments import Overrides, checked
from ppafo.documents.toml_text import TomlKind, beside
from ppafo.errors import ParameterError, ScenarioError, StudyError, UnitError, refused_as
from ppafo.linear_algebra import on_one_thread
from ppafo.metrics.metric import controlled_in
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.model.declaration import Number
from ppafo.parameters.declared import SHORT_NAME, Words
from ppafo.parameters.records import SchemaVersion, checked_record, keyed, record_schema
from ppafo.plugins import Plugins
from ppafo.progress import Report, report_nothing
from ppafo.simulation.scenario import LARGEST_SEED, Scenario
from ppafo.units.shown import in_units, quantity_of_unit
from ppafo.wording import count_of, first_twice, percentage, without_exponent

# Largest number of draws of each candidate, number of noise streams if only the sensors are uncertain, and number of
# draws outside the search, over which the tuned gains are evaluated.
MAXIMUM_DRAWS = 4096
NOISE_STREAMS = 16
FRESH_DRAWS = 1024
# Lowest cost of a candidate that violates a constraint, and of one with a failed run, whose fraction is added.
INFEASIBLE = 1.0e6
UNUSABLE = 1.0e12
# Relative spread of the candidates' costs below which a start has converged; largest number of candidates of the
# simplex for each gain.
_TOLERANCE = 1.0e-3
_REFINEMENTS = 60
_START_COLOURS = (ask.GREEN, ask.PURPLE, ask.ORANGE, ask.GREY)
"""Colours of the starts of a search; the gains before and after have other colours."""
Gains = Mapping[str, float]
_Value = Annotated[str | float, Words("text with unit; a plain number if there is no unit", form=float)]
_Metric = Annotated[str, Words("name of a metric, such as 'rms_error'")]
_Count = partial(Number, "", whole=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchRange:
    """Section of a tuning file for a searched parameter: path, bounds with units, linear or logarithmic spacing."""

    path: str = keyed("as for --set, such as 'controller.proportional_gain'")
    minimum: _Value
    maximum: _Value
    spacing: Literal["linear", "logarithmic"] = keyed("default: linear", "linear")


@dataclass(frozen=True, slots=True)
class ObjectiveTerm:
    """Section of a tuning file for a term of the minimised objective: weight times metric divided by scale.

    A metric with a negative weight is maximised.
    """

    metric: _Metric
    weight: float = 1.0
    scale: str | None = keyed("value that is scaled to 1; default: the value before tuning", None)


@dataclass(frozen=True, slots=True)
class Constraint:
    """Section of a tuning file for a constraint: upper or lower limit of a metric."""

    metric: _Metric
    at_most: str | None = keyed("largest value with its unit", None)
    at_least: str | None = keyed("smallest value with its unit", None)


@dataclass(frozen=True, slots=True)
class Robust:
    """Section of a tuning file for robustness: candidates run over the same draws; the unfavourable end counts."""

    study: str = keyed("name of a study, or a path relative to this file")
    measure: Literal["mean_and_deviations", "quantile"] = keyed(
        "mean plus 'deviations' standard deviations, or the 'share' quantile", "mean_and_deviations"
    )
    deviations: float = keyed(Number("", "", None, 0.0, 10.0, plain=True), 1.0)
    share: float = keyed(Number("", "", None, 0.5, math.nextafter(1.0, 0.0), plain=True), 0.9)
    draws: int = keyed(_Count("", None, 8, MAXIMUM_DRAWS), 64)

    def __str__(self) -> str:
        """Return the statistic of the draws by which candidates are evaluated, in words."""
        if self.measure == "quantile":
            return f"{100.0 * self.share:g} % quantile"
        noun = "standard deviation" if self.deviations == 1.0 else "standard deviations"
        return f"mean and {self.deviations:g} {noun}" if self.deviations else "mean"


@dataclass(frozen=True, slots=True)
class SearchEffort:
    """Section of a tuning file for the effort of the search.

    ``starts``: number of independent starts
    ``generations``: maximum number of generations of each start
    ``candidates_per_gain``: candidates of a generation for each gain
    ``seed``: random seed
    """

    starts: int = keyed(_Count("", None, 1, 100), 3)
    generations: int = keyed(_Count("", None, 1, 100_000), 100)
    candidates_per_gain: int = keyed(_Count("", None, 4, 1000), 10)
    seed: int = keyed(_Count("", None, 0, LARGEST_SEED), 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class TuningFile:
    """Tuning file: scenario, searched parameters, objective, constraints, robustness and effort."""

    schema_version: SchemaVersion
    name: str = keyed(Words(pattern=SHORT_NAME))
    description: str = ""
    scenario: str = keyed("name of a scenario, or a path relative to this file")
    overrides: tuple[str, ...] = keyed("such as 'valve.area=12.6mm^2'", ())
    search: tuple[SearchRange, ...]
    objective: tuple[ObjectiveTerm, ...]
    constraints: tuple[Constraint, ...] = ()
    robust: Robust | None = keyed("uncertainty to be robust against; default: the nominal device", None)
    effort: SearchEffort = SearchEffort()


json_schema = partial(record_schema, TuningFile, "ppafo tuning")
"""JSON Schema of a tuning file."""
TUNING = TomlKind("tuning", "tuning", resources.files("ppafo") / "analyses" / "tunings", StudyError)


@dataclass(frozen=True, slots=True)
class SearchedParameter:
    """Searched parameter: path with its units, uniform or log-uniform range, and value before tuning [SI]."""

    place: ask.VariedPath
    range: ask.Distribution
    before: float

    def quote(self, fraction: float) -> str:
        """Format the value at a fraction of the range from minimum to maximum, with its unit, as in an override."""
        return self.place.quote(float(self.range.values(np.asarray(fraction))))


@dataclass(frozen=True, slots=True, repr=False)
class Problem:
    """Tuning problem of a scenario, whose overrides include the caller's ``changes``.

    Candidates are evaluated over ``draws`` of the ``uncertainty``; nothing is drawn for the nominal device with
    noise-free sensors, and ``robust`` is None if only sensor noise is. ``scales`` are those given for metrics [SI].
    """

    name: str
    description: str
    scenario: Scenario
    searched: tuple[SearchedParameter, ...]
    goals: tuple[ObjectiveTerm, ...]
    constraints: tuple[ask.MetricLimit, ...]
    effort: SearchEffort
    scales: Mapping[str, float] = field(default_factory=dict)
    changes: tuple[str, ...] = ()
    uncertainty: ask.Uncertainty = field(default_factory=partial(ask.Uncertainty, ()))
    robust: Robust | None = None
    draws: int = 1
    seed: int = 0

    def __repr__(self) -> str:
        """Return name, scenario and searched parameters."""
        return f"Tuning '{self.name}' of '{self.scenario.name}': {', '.join(self.before)}"

    @property
    def overrides(self) -> tuple[str, ...]:
        """Overrides of the tuned scenario, to be given before those of the gains."""
        return self.scenario.origin.overrides

    @property
    def is_worse_high(self) -> dict[str, bool]:
        """Metrics of the goals and constraints: True if a larger value is worse, by the goal if in both."""
        worse = {goal.metric: goal.weight > 0.0 for goal in self.goals}
        return worse | {limit.metric: limit.is_most for limit in self.constraints if limit.metric not in worse}

    @property
    def before(self) -> Gains:
        """Values of the gains before tuning [SI]."""
        return {gain.place.path: gain.before for gain in self.searched}

    def bad_end(self, values: ask.Floats, is_high: bool) -> ask.Floats:
        """Return the unfavourable end of values (candidates, draws) [SI], high or low, as an array (candidates,)."""
        if not self.uncertainty.drawn:
            return values[:, 0]
        if self.robust is not None and self.robust.measure == "quantile":
            share = self.robust.share
            return np.asarray(np.quantile(values, share if is_high else 1.0 - share, axis=1))
        # Of a sample, hence n - 1; the draws are the same for all candidates, so that it ranks them fairly.
        away = (0.0 if self.robust is None else self.robust.deviations) * np.std(values, axis=1, ddof=1)
        return np.asarray(np.mean(values, axis=1) + (away if is_high else -away))

    def gains(self, fractions: Sequence[float]) -> Gains:
        """Return the gains [SI] at fractions of their ranges, rounded as in the overrides to paste and as simulated."""
        # Through the text that is pasted: a run of that line gives these bits again.
        pairs = zip(self.searched, fractions, strict=True)
        return {gain.place.path: gain.place.level(gain.quote(fraction)) for gain, fraction in pairs}

    def lines(self, gains: Gains) -> list[str]:
        """Format gains as overrides, ``PATH=VALUE``."""
        return [f"{gain.place.path}={gain.place.quote(gains[gain.place.path])}" for gain in self.searched]


@dataclass(frozen=True, slots=True)
class SearchStart:
    """Start of the search: best candidate as ``fractions`` (gains,) of the ranges, its cost, best cost by generation.

    ``is_settled``: True if the candidates converged before the generations ran out
    """

    fractions: tuple[float, ...]
    cost: float
    candidates: int
    generations: tuple[float, ...]
    is_settled: bool


@dataclass(frozen=True, slots=True)
class GainResult:
    """Gains [SI] with their metrics and the violation of constraints, in the search and over ``fresh`` draws.

    ``values``, ``fresh``: metrics [SI] of the nominal device, or at their unfavourable end over the draws; fresh ones
        are those that the search did not use, empty without draws
    ``judged``: metrics compared with the constraints over fresh draws; for a loop that swings in the second half
        of the hold, the error at a single instant does not count
    ``off``, ``share_off``: fraction by which the runs exceed the tracking limits, and fraction of the draws that do
    ``beyond_reach``: fraction of the draws in which the reference requires more torque than the supply allows
    ``tracking``: fresh draws that follow the reference, do not, or are beyond reach on purpose
    ``metrics``, ``result``: metrics and result of one run of the nominal device
    """

    gains: Gains
    values: Mapping[str, float]
    fresh: Mapping[str, float]
    judged: Mapping[str, float]
    objective: float
    violation: float
    off: float
    share_off: float
    share_without_value: float
    fresh_violation: float
    fresh_share_without_value: float
    beyond_reach: float
    tracking: ask.TrackingCounts
    metrics: Mapping[str, ask.Metric]
    result: ask.Result = field(compare=False, repr=False)

    @property
    def is_feasible(self) -> bool:
        """True if all constraints are satisfied, no run failed and the reference is followed, also over fresh draws."""
        broken = self.violation or self.fresh_violation or self.share_without_value or self.fresh_share_without_value
        return not broken and self.off == 0.0


@dataclass(frozen=True, slots=True)
class Tuned:
    """Result of a tuning: gains before and after, starts of the search, and remarks; numbers in SI units.

    ``overrides`` turn the scenario of the tuning file into the tuned one, and ``lines`` are those of the gains;
    ``bounds_reached`` are gains that ended at a bound, beyond which a better value may lie. The best of the ``starts``
    is the first. ``follows``: True if the nominal run follows its reference, None if it is not judged.
    """

    tuning: str
    scenario: str
    verdict: str
    is_feasible: bool
    follows: bool | None
    overrides: list[str]
    lines: list[str]
    bounds_reached: dict[str, Literal["minimum", "maximum"]]
    scales: dict[str, float]
    before: GainResult
    after: GainResult
    starts: list[SearchStart]
    runs: int
    remarks: list[str]
    problem: Problem = field(compare=False, repr=False)


def list_tunings() -> tuple[str, ...]:
    """Return the names of the tunings of the package.

    >>> import ppafo
    >>> ppafo.list_tunings()
    ('pid-gains', 'pid-gains-robust', 'push-off')
    """
    return TUNING.names()


@checked
def load_tuning(tuning: str | Path | Mapping[str, Any], overrides: Overrides = (), *, plugins: Plugins = ()) -> Problem:
    """Load a tuning problem.

    Arguments:
        tuning: name of a tuning, a .toml file, or data laid out as such a file
        overrides: changes of the scenario, as texts or a dictionary
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        the Problem, checked

    Raises:
        StudyError: a tuning that cannot be used

    >>> import ppafo
    >>> print(ppafo.load_tuning("pid-gains"))
    Tuning 'pid-gains' of 'torque-task-proportional': controller.proportional_gain, controller.integral_gain,
    controller.derivative_gain
    """
    source = ask.read_source(TUNING, tuning)
    parsed = checked_record(TuningFile, source)
    robust = parsed.robust
    paths = [gain.path for gain in parsed.search]
    with refused_as(StudyError, source.label, ScenarioError, ParameterError, StudyError):
        scenario = ask.load_scenario(ask.placed(parsed.scenario, source.folder), parsed.overrides)
        scenario = ask.reloaded(scenario, overrides) if overrides else scenario
        metrics = [*(goal.metric for goal in parsed.objective), *(limit.metric for limit in parsed.constraints)]
        ask.check_metrics(list(dict.fromkeys(metrics)), scenario)
        uncertainty = ask.Uncertainty(()).with_noise_of([scenario])
        seed = parsed.effort.seed
        if robust is not None:
            with refused_as(StudyError, "robust", StudyError):
                study = ask.load_study(beside(robust.study, source.folder, ask.list_studies()))
                uncertainty = ask.uncertainty_of(study).with_noise_of([scenario])
                seed = study.sample.seed
                if (path := next(iter(study.only), None)) is not None:
                    raise StudyError(f"'{path}' varies in some configurations only; choose a study without 'only'")
                if (path := next((path for path in uncertainty.paths if path in paths), None)) is not None:
                    raise StudyError(f"study '{study.name}' draws '{path}', which is also searched; omit one of both")
        if (repeated := first_twice(paths)) is not None:
            raise StudyError(f"'{repeated}' appears in two [[search]] tables; omit one")
        atmosphere = ask.atmosphere_of(scenario, (*uncertainty.paths, *uncertainty.same, *paths))
        scales = {}
        for goal in parsed.objective:
            if goal.weight == 0.0:
                raise StudyError(f"objective '{goal.metric}': weight = 0 has no effect; omit this objective")
            if goal.scale is not None:
                where = f"objective '{goal.metric}': scale = '{goal.scale}'"
                scales[goal.metric] = ask.difference_of(goal.scale, goal.metric, where)
                if scales[goal.metric] <= 0.0:
                    raise StudyError(f"{where}: must be above 0")
        limits = []
        for constraint in parsed.constraints:
            metric = constraint.metric
            where = f"constraint '{constraint.metric}'"
            bounds = [text for text in (constraint.at_most, constraint.at_least) if text is not None]
            if len(bounds) != 1:
                has = "both" if bounds else "neither"
                raise StudyError(f"{where}: has {has} of at_most and at_least; give one of them")
            # Gauge pressures are refused where the atmosphere varies.
            limit = ask.level_of(bounds[0], metric, f"{where} = '{bounds[0]}'", atmosphere)
            limits.append(ask.MetricLimit(metric, limit, constraint.at_most is not None, bounds[0]))
        for least, most in product(limits, limits):
            if least.metric == most.metric and least.limit > most.limit and most.is_most and not least.is_most:
                raise StudyError(
                    f"constraint '{least.metric}': at_least = '{least.text}' is above at_most = '{most.text}', so no "
                    "gains satisfy both"
                )
        return Problem(
            name=parsed.name,
            description=" ".join(parsed.description.split()),
            scenario=scenario,
            searched=tuple(_searched(gain, scenario, atmosphere is None) for gain in parsed.search),
            goals=parsed.objective,
            constraints=tuple(limits),
            effort=parsed.effort,
            scales=scales,
            changes=ask.changes_in(scenario, overrides=overrides),
            robust=robust,
            uncertainty=uncertainty,
            draws=(NOISE_STREAMS if robust is None else robust.draws) if uncertainty.drawn else 1,
            seed=seed,
        )


def _searched(gain: SearchRange, scenario: Scenario, atmosphere_varies: bool) -> SearchedParameter:
    """Return a searched parameter with its range in SI; StudyError for a path or bounds that cannot be searched."""
    kind = "log_uniform" if gain.spacing == "logarithmic" else "uniform"
    with refused_as(StudyError, f"search '{gain.path}'", UnitError, ScenarioError, StudyError):
        if gain.path == ask.NOISE_SEED:
            raise StudyError("cannot be searched, because all candidates use the same noise; omit this search")
        place = ask.varied_path(gain.path, scenario, (gain.minimum, gain.maximum), atmosphere_varies)
        between = ask.distribution_in({"kind": kind, "minimum": gain.minimum, "maximum": gain.maximum}, place)
        if (before := ask.value_at(gain.path, scenario)) is None:
            raise StudyError(
                f"scenario '{scenario.name}' has no value for '{gain.path}'; set it in the scenario or by an override"
            )
    # Where the atmosphere varies, gauge bounds count from each run's own; so does the value before.
    return SearchedParameter(place, between, before - (place.atmosphere if place.is_gauge else 0.0))


def solve_tuning(
    problem: Problem, threads: int | None, progress: Report | None, executor: Executor | None = None
) -> ask.Finding[Tuned]:
    """Solve a tuning problem: search for gains, and evaluation of the gains before and after."""
    scenario = problem.scenario
    effort = problem.effort
    uncertainty = problem.uncertainty
    report = progress or report_nothing
    # As many as are made if no start converges early: the first candidates are a generation of their own, the gains
    # before run for the scales and for their result, the gains found once, and both over fresh draws.
    of_start = len(problem.searched) * (effort.candidates_per_gain * (effort.generations + 1) + _REFINEMENTS)
    most = problem.draws * (effort.starts * of_start + 3) + (2 * FRESH_DRAWS if uncertainty.drawn else 0)
    counter = ask.RunCounter(most, lambda now: report(replace(now, activity="tuning", is_bound=True)))
    gauge = uncertainty.gauge | {gain.place.path for gain in problem.searched if gain.place.is_gauge}
    # The fresh draws follow those of the search: the gains were not chosen on them.
    draws, fresh = (
        uncertainty.random_columns(first, count, problem.seed) if uncertainty.drawn else {}
        for first, count in ((0, problem.draws), (problem.draws, FRESH_DRAWS))
    )
    runs = ask.scenario_runs(scenario, [*problem.is_worse_high], counter, gauge, threads, executor)

    def tried(candidates: Sequence[Gains], draws: Mapping[str, ask.Floats]) -> ask.Rows:
        """Run every candidate with every draw; returns arrays (candidates, draws), one draw without uncertainty."""
        count = len(next(iter(draws.values()), (0.0,)))
        columns = {path: np.repeat([gains[path] for gains in candidates], count) for path in problem.before}
        columns |= {path: np.tile(column, len(candidates)) for path, column in draws.items()}
        return {name: column.reshape(-1, count) for name, column in runs.run(columns).items()}

    # By default each goal is 1 before tuning: goals in different units then weigh as much as their weights say.
    scales = dict(problem.scales)
    first = tried([problem.before], draws)
    for goal in problem.goals:
        name = goal.metric
        is_high = goal.weight > 0.0
        scale = scales.setdefault(name, abs(float(problem.bad_end(first[f"judged_{name}"], is_high)[0])))
        if not np.isfinite(scale) or scale == 0.0:
            raise StudyError(
                f"tuning '{problem.name}': objective '{name}' is {scale:g} before tuning, which cannot be its scale; "
                "set scale = 'VALUE UNIT' in this objective"
            )

    def costs(fractions: ask.Floats) -> ask.Floats:
        # As they are pasted: what keeps a constraint by less than the last digit would break it.
        return judge(tried([problem.gains(each) for each in fractions.tolist()], draws), problem, scales)["cost"]

    def evaluated(gains: Gains) -> GainResult:
        """Evaluate gains over the draws of the search, over fresh draws and on the nominal device."""
        in_search = tried([gains], draws)
        over_fresh = tried([gains], fresh) if fresh else in_search
        scores, fresh_scores = (judge(rows, problem, scales) for rows in (in_search, over_fresh))
        # Unchanged gains are not written and read again, which would round them.
        is_changed = gains != problem.before
        result = ask.simulate(ask.with_overrides(scenario, problem.lines(gains)) if is_changed else scenario)

        def ends(rows: ask.Rows, prefix: str = "") -> dict[str, float]:
            worse = problem.is_worse_high.items()
            return {name: float(problem.bad_end(rows[prefix + name], high)[0]) for name, high in worse}

        return GainResult(
            gains=gains,
            values=ends(in_search),
            fresh=ends(over_fresh) if fresh else {},
            judged=ends(over_fresh, "judged_"),
            objective=float(scores["objective"][0]),
            violation=float(scores["violation"][0]),
            off=float(max(scores["off"][0], fresh_scores["off"][0])),
            share_off=float(np.mean(np.concatenate([in_search["off"], over_fresh["off"]], axis=1) > 0.0)),
            share_without_value=float(scores["without_value"][0]),
            fresh_violation=float(fresh_scores["violation"][0]),
            fresh_share_without_value=float(fresh_scores["without_value"][0]),
            beyond_reach=float(np.mean(over_fresh["beyond_reach"] > 0.0)),
            tracking=ask.tracking_counts(over_fresh, int(np.count_nonzero(~over_fresh[ask.FAILED]))),
            metrics=result.metrics,
            result=result,
        )

    # The search begins with the better of the gains before and those that an ensemble about them chooses together.
    together = ask.joint_gains(scenario, problem.before) if scenario.follows_reference else None
    firsts = [problem.before, *([] if together is None else [{**problem.before, **together[0].numbers}])]
    rows = [[gain.range.fraction(gains[gain.place.path]) for gain in problem.searched] for gains in firsts]
    starts = search(costs, rows[int(np.argmin(costs(np.clip(rows, 0.0, 1.0))))], effort)
    before, after = map(evaluated, (problem.before, problem.gains(starts[0].fractions)))
    bounds: dict[str, Literal["minimum", "maximum"]] = {}
    for gain in problem.searched:
        fraction = gain.range.fraction(after.gains[gain.place.path])
        if not 0.01 < fraction < 1.0 - 0.01:
            bounds[gain.place.path] = "minimum" if fraction <= 0.01 else "maximum"
    tracking = ask.verdict_of(after.result)
    lines = problem.lines(after.gains)
    tuned = Tuned(
        tuning=problem.name,
        scenario=scenario.name,
        verdict=f"{problem.name}: {_verdict(problem, before, after, tracking.sentence if tracking.is_useless else '')}",
        is_feasible=after.is_feasible,
        follows=tracking.follows,
        overrides=list(ask.over(scenario.origin.overrides, lines, valve=scenario.device.valve_name)),
        lines=lines,
        bounds_reached=bounds,
        scales=scales,
        before=before,
        after=after,
        starts=starts,
        runs=runs.count,
        remarks=_remarks(after, starts, bounds, runs.count, scenario.origin.replaced),
        problem=problem,
    )
    return _finding(tuned)


def judge(rows: ask.Rows, problem: Problem, scales: Mapping[str, float]) -> ask.Rows:
    """Score candidates, each (candidates,), by objective, constraints, tracking and runs without a value.

    ``scales`` are scales of the goals by metric [SI]. The scores are ``cost``, by which candidates are ranked,
    ``objective``, ``violation``, ``off``, and ``without_value``, the fraction of runs that failed or lack a metric.
    """
    judged = {name: rows[f"judged_{name}"] for name in problem.is_worse_high}
    lacks_metric = np.any([~np.isfinite(values) for values in judged.values()], axis=0)
    without_value = np.asarray(np.mean(rows["unusable"] | lacks_metric, axis=1))
    # Candidates with failed runs are ranked by how many fail: 0 keeps nan out of the sums meanwhile.
    known = {name: np.where(without_value[:, None] > 0.0, 0.0, values) for name, values in judged.items()}
    objective = np.zeros(without_value.size)
    violation = np.zeros(without_value.size)
    for goal in problem.goals:
        objective += goal.weight * problem.bad_end(known[goal.metric], goal.weight > 0.0) / scales[goal.metric]
    for constraint in problem.constraints:
        reached = problem.bad_end(known[constraint.metric], constraint.is_most)
        excess = reached - constraint.limit if constraint.is_most else constraint.limit - reached
        # As a fraction of the limit, so that constraints in different units add up; a limit of 0 has no fractions.
        violation += np.maximum(0.0, excess) / (abs(constraint.limit) or 1.0)
    # A loop that does not follow its reference violates a constraint that holds in every tuning.
    off = np.maximum(0.0, problem.bad_end(rows["off"], True))
    # Deb's rules in one number, since SciPy compares nothing else.
    broken = violation + off
    cost = np.where(broken > 0.0, INFEASIBLE + broken, objective)
    cost = np.where(without_value > 0.0, UNUSABLE * (1.0 + without_value), cost)
    return {"cost": cost, "objective": objective, "violation": violation, "off": off, "without_value": without_value}


@on_one_thread
def search(
    costs: Callable[[ask.Floats], ask.Floats], before: Sequence[float], effort: SearchEffort
) -> list[SearchStart]:
    """Return the result of each start of the search, the best first; equal seeds give equal results.

    ``costs`` takes fractions of the ranges (candidates, gains). ``before`` are those before tuning; they are among the
    first candidates if they lie within the bounds. The search is differential evolution (Storn and Price, 1997) as in
    SciPy, followed by the simplex method of Nelder and Mead (1965). Both use only comparisons of costs.
    """
    from scipy.optimize import differential_evolution, minimize

    starts = []
    batches = []
    box = [(0.0, 1.0)] * len(before)

    def batch_costs(columns: ask.Floats) -> ask.Floats:
        # SciPy has a candidate in each column, the costs one in each row.
        batches.append(costs(np.clip(np.atleast_2d(columns.T), 0.0, 1.0)))
        return batches[-1]

    for seed in np.random.SeedSequence(effort.seed).spawn(effort.starts):
        batches.clear()
        evolved = differential_evolution(
            batch_costs,
            box,
            # SciPy refuses a first candidate beyond the bounds.
            x0=np.asarray(before) if all(0.0 <= fraction <= 1.0 for fraction in before) else None,
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
            rng=np.random.default_rng(seed),
        )
        generations = len(batches)
        # In a flat valley generations come to within a hundredth of the best, and hardly nearer.
        size = np.clip(np.std(evolved.population, axis=0), 0.01, 0.1)
        corners = [evolved.x, *(evolved.x + np.diag(np.where(evolved.x + size > 1.0, -size, size)))]
        refined = minimize(
            lambda fractions: float(batch_costs(fractions[:, None])[0]),
            evolved.x,
            method="Nelder-Mead",
            bounds=box,
            options={
                "initial_simplex": np.array(corners),
                "maxfev": _REFINEMENTS * len(before),
                "xatol": _TOLERANCE,
                "fatol": _TOLERANCE * _TOLERANCE * abs(float(evolved.fun)),
            },
        )
        best = np.minimum.accumulate([np.min(batch) for batch in batches]).tolist()
        start = SearchStart(
            fractions=tuple(map(float, refined.x)),
            cost=float(refined.fun),
            candidates=sum(map(len, batches)),
            # The simplex adds one cost, where it ended.
            generations=(*best[:generations], best[-1]),
            is_settled=_is_settled(evolved.population_energies),
        )
        starts.append(start)
    return sorted(starts, key=lambda start: start.cost)


def _is_settled(costs: ask.Floats) -> bool:
    """Return whether the costs of a generation have converged."""
    least = np.min(costs)
    most = np.max(costs)
    if most >= UNUSABLE or least < INFEASIBLE <= most:
        return False
    # Where all break a constraint, what counts is by how much they break it.
    excess = costs - INFEASIBLE if least >= INFEASIBLE else costs
    return float(np.std(excess)) <= _TOLERANCE * abs(float(np.mean(excess)))


def agreement(starts: Sequence[SearchStart]) -> float:
    """Return the largest difference of a gain between the best and equally good starts, as a fraction of its range.

    A start is equally good if its cost is within a hundredth of the best cost. A large difference means that very
    different gains reach the same cost, so the objective does not determine them. The best of ``starts`` is first.
    """
    best = starts[0]
    # Of an infeasible cost only what the violation adds is compared: a hundredth of the offset would take in all.
    scale = best.cost - INFEASIBLE if best.cost >= INFEASIBLE else best.cost
    as_good = [start for start in starts if start.cost <= best.cost + 0.01 * abs(scale)]
    return max(float(np.max(np.abs(np.subtract(start.fractions, best.fractions)))) for start in as_good)


def _verdict(problem: Problem, before: GainResult, after: GainResult, useless: str) -> str:
    """Return the result of a tuning as a sentence; ``useless`` is the verdict on a nominal run that does not follow."""

    def where(fraction: float) -> str:
        return "" if not problem.uncertainty.drawn else f" in {percentage(fraction, 2)} of the draws"

    beyond = (
        "; the reference requires more torque than the actuator gives at the supply pressure"
        f"{where(after.beyond_reach)}, which no gains can change"
        if after.beyond_reach > 0.0
        else ""
    )
    if after.share_without_value:
        failing = percentage(after.share_without_value, 3)
        return f"with the best gains found, {failing} of the runs fail, oscillate, or lack a required metric"
    if after.off:
        missed = f"the tracking limits are exceeded by {percentage(after.off, 3)}{where(after.share_off)}"
        said = "no gains within the bounds let the loop follow its reference; with the best gains found,"
        return f"{said} {useless or missed}{beyond}"
    if after.violation:
        broken = f"the best gains found exceed the limits by {percentage(after.violation, 3)}"
        return f"no gains within the bounds satisfy all constraints; {broken}{beyond}"
    if not after.is_feasible:
        said = "the gains found satisfy all constraints over the draws of the search, but not over"
        return f"{said} {FRESH_DRAWS:,} fresh draws{beyond}"
    if useless:
        return f"with the best gains found, {useless}"
    if before.off or not before.is_feasible:
        said = f"the loop follows its reference, with the previous gains it did not{where(before.share_off)}"
        said = said if before.off else "the gains found satisfy all constraints, which the previous gains did not"
        return f"{said}; objective {after.objective:.4g}"
    # Beyond a bound the gains before are no candidates, and the best within may be worse.
    if after.objective >= before.objective:
        return "nothing better than the previous gains was found within the bounds"
    change = 100.0 * (after.objective - before.objective) / (abs(before.objective) or math.inf)
    percent = f" ({without_exponent(change, '+.3g')} %)" if before.objective else ""
    return f"objective {before.objective:.4g} before, {after.objective:.4g} after{percent}"


def _remarks(
    after: GainResult, starts: Sequence[SearchStart], bounds: Mapping[str, str], runs: int, kept: str
) -> list[str]:
    """Return remarks on convergence, bounds that were reached, ambiguous gains, draws, and a loop that swings."""
    remarks = [
        f"{count_of(len(starts), 'start')}, {sum(start.candidates for start in starts):,} "
        f"candidates, {runs:,} runs; {sum(start.is_settled for start in starts)} of {len(starts)} converged "
        "before the maximum number of generations",
        kept,
        f"over the fresh draws: {after.tracking.sentence}" if after.fresh else "",
    ]
    remarks += [
        f"{path} ended at its {bound}: a better value may lie beyond; widen the bounds if the device allows it"
        for path, bound in bounds.items()
    ]
    if (difference := agreement(starts)) > 0.1:
        remarks.append(
            f"starts whose objectives agree within 1 % differ by up to {100.0 * difference:.0f} % of the range between "
            "the bounds: the objective does not determine the gains uniquely"
        )
    remarks += [
        f"the loop still oscillates in the second half of the hold, so {name} depends on the instant: the RMS error of "
        f"that half, {ask.of_metric(name).number(judged)}, counts instead"
        for name, judged in after.judged.items()
        if judged > (after.fresh or after.values)[name]
    ]
    return list(filter(None, remarks))


@in_units(lambda tuned: tuned.problem.scenario.device.shown)
def _finding(tuned: Tuned) -> ask.Finding[Tuned]:
    """Return the result of a tuning as a finding; it has passed if the gains satisfy all constraints."""
    problem = tuned.problem
    before = tuned.before
    after = tuned.after
    scenario = tuned.problem.scenario
    rows = []
    for gain in problem.searched:
        path = gain.place.path
        quote = gain.place.quote
        end = f"at its {tuned.bounds_reached[path]}" if path in tuned.bounds_reached else ""
        rows.append((path, quote(gain.before), quote(after.gains[path]), gain.quote(0.0), gain.quote(1.0), end))
    sides: dict[str, Mapping[str, float]] = {"before": before.values, "after": after.values}
    if problem.uncertainty.drawn:
        sides = {f"before ({problem.robust or 'mean'})": before.values, "after": after.values}
        sides |= {"before, fresh draws": before.fresh, "after, fresh draws": after.fresh}
        for title, side in (("before, nominal", before), ("after, nominal", after)):
            sides[title] = {name: metric.value for name, metric in side.metrics.items()}
    kinds = {name: ask.of_metric(name) for name in problem.is_worse_high}
    table = [
        ask.Column("metric", [f"{name} ({kind.shown_unit})" if kind.quantity else name for name, kind in kinds.items()])
    ]
    for title, own in sides.items():
        known = {name: kind.number(own.get(name, math.nan)) for name, kind in kinds.items()}
        table.append(ask.Column(title, ["" if text == "nan" else text for text in known.values()]))
    limits = ([limit.words for limit in problem.constraints if limit.metric == name] for name in kinds)
    table.append(ask.Column("constraint", [", ".join(words) for words in limits]))
    # The scenario's file, or the name of one that comes with the package, finds it again.
    name = scenario.origin.file or scenario.name
    command = scenario.motion.motion_kind.command
    # Texts of TOML and of Python alike.
    used = ask.usage_text(ask.reloaded(scenario, tuned.lines))
    listed = ", ".join(json.dumps(line, ensure_ascii=False) for line in tuned.overrides)
    pasted = (
        f"# {tuned.verdict}\n\n# on the command line\n{used}\n\n# in a study file\noverrides = [{listed}]\n\n"
        f"# in Python\nppafo.{command}({name!r}, overrides=[{listed}])\n"
    )
    return ask.Finding(
        name="tune",
        kicker="Tuning",
        title=problem.name,
        said=(tuned.verdict, *([problem.description] if problem.description else [])),
        parts=(
            ask.Section("Gains", ask.columns_of(("gain", "before", "after", "minimum", "maximum", ""), rows)),
            ask.Section(
                "Before and after",
                table,
                panels=partial(_task_panels, tuned),
                name="task",
                caption="The nominal device.",
                size=(5.4, 1.9),
            ),
            ask.Section(
                "The search",
                remarks=tuned.remarks,
                panels=partial(_search_panels, tuned),
                name="search",
                caption="A gain before that is beyond a bound is drawn beside it.",
                size=(5.4, max(2.2, 0.9 + 0.3 * len(problem.searched))),
            ),
            ask.Section("To use the gains", code=used),
        ),
        found=tuned,
        passed=after.is_feasible and (tuned.follows is not False or bool(after.result.tracking.accepted)),
        files={"overrides.txt": pasted.encode},
        overrides=problem.changes,
    )


def _task_panels(tuned: Tuned) -> list[ask.Panel]:
    """Return panels of controlled quantity, command and gas over time, before and after, for the nominal device."""
    before = tuned.before.result.recording
    after = tuned.after.result.recording
    controlled = controlled_in(after) or CONTROLLED[TORQUE]
    words = controlled.words
    unit = controlled.level.unit
    kinds = {
        controlled.name: ask.Kind(words[:1].upper() + words[1:], unit, quantity_of_unit(unit)),
        "command": ask.Kind("Valve command"),
        "supplied_mass": ask.Kind("Gas supplied", "kg", "gas mass"),
    }
    panels: list[ask.Panel] = []
    for channel, kind in kinds.items():
        drawn: dict[str, Any] = {"drawstyle": "steps-post" if channel == "command" else "default"}
        # Broader below, so that both show where they agree.
        marks = [
            ask.Mark("line", own.time, own[channel], label=label, colour=colour, style={"linewidth": width, **drawn})
            for own, colour, label, width in ((before, ask.VERMILION, "before", 1.8), (after, ask.BLUE, "after", 1.1))
        ]
        if channel == controlled.name and controlled.reference in after:
            dashed = {"linestyle": "--", "linewidth": 1.2}
            reference = after[controlled.reference]
            marks.append(ask.Mark("line", after.time, reference, label="reference", colour=ask.BLACK, style=dashed))
        panels.append(ask.Panel(ask.TIME, kind, marks, legend="" if panels else "figure", shares_x=True))
    return panels


def _search_panels(tuned: Tuned) -> list[ask.Panel]:
    """Return panels of the best cost of each start over its generations, and of the gains between their bounds."""
    searched = tuned.problem.searched
    starts = tuned.starts
    courses = []
    for number, start in enumerate(starts):
        costs = np.array(start.generations)
        costs[costs >= INFEASIBLE] = np.nan  # no candidate keeps the constraints yet
        if np.isnan(costs).all():
            continue
        label = f"start {number + 1}" if len(starts) <= len(_START_COLOURS) else ""
        colour = _START_COLOURS[number % len(_START_COLOURS)]
        courses.append(ask.Mark("line", np.arange(costs.size), costs, label=label, colour=colour))
    level = ask.Mark("level", y=tuned.before.objective, label="before", colour=ask.BLACK, style={"linewidth": 0.8})

    def scale(axes: Any) -> None:
        axes.locator_params(axis="x", integer=True)
        # Below a decade a logarithmic axis has no tick that reads as a number.
        if axes.dataLim.ymax > 10.0 * axes.dataLim.ymin > 0.0:
            axes.set_yscale("log")

    rows = np.arange(len(searched))[::-1]
    ends = np.array([start.fractions for start in starts]).ravel()
    previous = np.clip([gain.range.fraction(gain.before) for gain in searched], -0.05, 1.05)
    found = [gain.range.fraction(tuned.after.gains[gain.place.path]) for gain in searched]
    marks = (
        *(ask.Mark("line", [0.0, 1.0], [row, row], colour=ask.GREY, style={"linewidth": 1.0}) for row in rows),
        ask.dots(ends, np.tile(rows, len(starts)), "|", "end of a start", ask.BLACK, markersize=11),
        ask.dots(previous, rows, "s", "before", ask.VERMILION, markersize=7),
        ask.dots(found, rows, "o", "after", ask.BLUE, markersize=7),
    )
    every = {"yticks": rows, "yticklabels": [ask.label_of(gain.place.path) for gain in searched], "xticks": [0.0, 1.0]}
    every |= {"ylim": (-0.6, len(searched) - 0.4), "xticklabels": ["minimum", "maximum"]}
    ranges = ask.Panel(ask.Kind("Between bounds"), ask.Kind(), marks, then=lambda axes: axes.set(**every))
    if not courses:
        return [ranges]
    kinds = (ask.Kind("Generation"), ask.Kind())
    title = "Objective, best so far"
    return [ask.Panel(*kinds, [*courses, level], title, legend="inside", then=scale), ranges]
