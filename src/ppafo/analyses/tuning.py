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
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from ppafo.arguments import Overrides, checked
from ppafo.documents.toml_text import TomlKind, beside
from ppafo.errors import ParameterError, ScenarioError, StudyError, UnitError, refused_as
from ppafo.linear_algebra import on_one_thread
from ppafo.loading import load_scenario, placed, reloaded, usage_text
from ppafo.metrics import Metric
from ppafo.metrics.metric import controlled_in
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.model.declaration import Number
from ppafo.parameters.declared import SHORT_NAME, Words
from ppafo.parameters.overrides import over
from ppafo.parameters.records import SchemaVersion, checked_record, keyed, record_schema
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report, report_nothing
from ppafo.report.finding import Column, Finding, Section, columns_of
from ppafo.report.kind import TIME, Kind, of_metric
from ppafo.report.panels import Mark, Panel
from ppafo.report.setting_names import label_of
from ppafo.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION
from ppafo.simulation.clock import TIMES
from ppafo.simulation.ensemble.columns import absolute
from ppafo.simulation.numbers import NOISE_SEED, changes_in, with_numbers
from ppafo.simulation.scenario import LARGEST_SEED, Scenario
from ppafo.simulation.simulate import Result, simulate
from ppafo.simulation.tracking.rule import shortfall
from ppafo.studies.distributions import Distribution, Floats
from ppafo.studies.draws import Uncertainty, uncertainty_of
from ppafo.studies.limits import MetricLimit, atmosphere_of, check_metrics, difference_of, level_of
from ppafo.studies.loading import list_studies, load_study, read_source
from ppafo.studies.study import with_overrides
from ppafo.studies.varying import VariedPath, given_in, in_its_unit, value_at, varied_path
from ppafo.study.runs import Rows, RunCounter, Runs, scenario_runs
from ppafo.units.shown import in_units, quantity_of_unit
from ppafo.wording import count_of, first_twice, percentage, without_exponent

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAXIMUM_DRAWS, NOISE_STREAMS, FRESH_DRAWS = 4096, 16, 1024
"""Largest number of draws of each candidate, number of noise streams if only the sensors are uncertain, and number of
draws outside the search, over which the tuned gains are evaluated."""
INFEASIBLE, UNUSABLE = 1.0e6, 1.0e12
"""Lowest cost of a candidate that violates a constraint, and of one with a failed run, whose fraction is added."""
_TOLERANCE, _REFINEMENTS, _SIMPLEX_SIZES = 1.0e-3, 60, (0.01, 0.1)
"""Relative spread of the candidates' costs below which a start has converged; largest number of candidates of the
simplex for each gain, and its smallest and largest initial size, as a fraction of the range."""
_AT_BOUND, _AS_GOOD, _DIFFERENT = 0.01, 0.01, 0.1
"""Fraction of the range from a bound that counts as at the bound, relative excess of an equally good cost, and fraction
of the range above which two starts count as ended at different gains."""
_START_LINES: tuple[tuple[str, Any], ...] = (
    (GREEN, "--"),
    (PURPLE, ":"),
    (ORANGE, "-."),
    (GREY, (0, (6, 1, 1, 1, 1, 1))),
)
"""Colours and dashes of the starts of a search; the gains before and after have other colours."""
_BEYOND, _DECADE = 0.05, 10.0
"""Fraction of the range by which gains outside the bounds are drawn beyond them; ratio of a logarithmic axis' ends."""
_SEARCH_CAPTION = (
    "Above: the best objective so far in each start. Below: where the gains lie between their bounds; a gain "
    "before that is beyond a bound is drawn beside it."
)
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


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalSection:
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
    objective: tuple[GoalSection, ...]
    constraints: tuple[Constraint, ...] = ()
    robust: Robust | None = keyed("uncertainty to be robust against; default: the nominal device", None)
    effort: SearchEffort = SearchEffort()


json_schema = partial(record_schema, TuningFile, "ppafo tuning")
"""JSON Schema of a tuning file."""
TUNING = TomlKind("tuning", "tuning", resources.files("ppafo") / "analyses" / "tunings", StudyError)


@dataclass(frozen=True, slots=True)
class SearchedParameter:
    """Searched parameter between its bounds, with its value before tuning [SI].

    ``is_logarithmic``: True if the logarithm of the value is searched
    ``place``: conversion between values and text
    """

    path: str
    minimum: float
    maximum: float
    is_logarithmic: bool
    before: float
    place: VariedPath

    def value(self, fraction: Floats) -> Floats:
        """Return values of the parameter [SI] at fractions of its range from minimum to maximum."""
        kind = "log_uniform" if self.is_logarithmic else "uniform"
        return Distribution(kind, (self.minimum, self.maximum)).values(fraction)

    def fraction(self, value: float) -> float:
        """Return the position of a value [SI] in the range, from 0 to 1; below 0 or above 1 beyond the bounds."""
        if self.is_logarithmic:
            return math.log(value / self.minimum) / math.log(self.maximum / self.minimum) if value > 0.0 else -math.inf
        return (value - self.minimum) / (self.maximum - self.minimum)

    def bound_reached(self, value: float) -> Literal["minimum", "maximum"] | None:
        """Return the bound at which a value lies; None for a value between the bounds."""
        fraction = self.fraction(value)
        if fraction <= _AT_BOUND:
            return "minimum"
        return "maximum" if fraction >= 1.0 - _AT_BOUND else None


@dataclass(frozen=True, slots=True)
class ObjectiveTerm:
    """Term of the objective: weight times metric divided by scale [SI]; scale None is the value before tuning."""

    metric: str
    weight: float
    scale: float | None


@dataclass(frozen=True, slots=True, repr=False)
class Problem:
    """Tuning problem of a scenario, whose ``overrides`` include the caller's ``changes``.

    Candidates are evaluated over ``draws`` of the ``uncertainty``, None for the nominal device with noise-free sensors;
    ``study`` is empty if only sensor noise is drawn. What counts is the quantile of ``fraction``, or, if that is None,
    the mean and ``deviations`` standard deviations.
    """

    name: str
    description: str
    scenario: Scenario
    overrides: tuple[str, ...]
    searched: tuple[SearchedParameter, ...]
    goals: tuple[ObjectiveTerm, ...]
    constraints: tuple[MetricLimit, ...]
    effort: SearchEffort
    changes: tuple[str, ...] = ()
    uncertainty: Uncertainty | None = None
    study: str = ""
    draws: int = 1
    seed: int = 0
    deviations: float = 0.0
    fraction: float | None = None

    def __repr__(self) -> str:
        """Return name, scenario and searched parameters."""
        return f"Tuning '{self.name}' of '{self.scenario.name}': {', '.join(gain.path for gain in self.searched)}"

    @property
    def measure(self) -> str:
        """Statistic of the draws by which candidates are evaluated, in words."""
        if self.fraction is not None:
            return f"{100.0 * self.fraction:g} % quantile"
        noun = "standard deviation" if self.deviations == 1.0 else "standard deviations"
        return f"mean and {self.deviations:g} {noun}" if self.deviations else "mean"

    @property
    def is_worse_high(self) -> dict[str, bool]:
        """Metrics of the goals and constraints: True if a larger value is worse, by the goal if in both."""
        worse = {goal.metric: goal.weight > 0.0 for goal in self.goals}
        return worse | {limit.metric: limit.is_most for limit in self.constraints if limit.metric not in worse}

    @property
    def before(self) -> Gains:
        """Values of the gains before tuning [SI]."""
        return {gain.path: gain.before for gain in self.searched}

    def bad_end(self, values: Floats, is_high: bool) -> Floats:
        """Return the unfavourable end of values (candidates, draws) [SI], high or low, as an array (candidates,)."""
        if self.uncertainty is None:
            return values[:, 0]
        if self.fraction is not None:
            return np.asarray(np.quantile(values, self.fraction if is_high else 1.0 - self.fraction, axis=1))
        # Of a sample, hence n - 1; the draws are the same for all candidates, so that it ranks them fairly.
        deviations = self.deviations * np.std(values, axis=1, ddof=1)
        return np.asarray(np.mean(values, axis=1) + (deviations if is_high else -deviations))

    @property
    def gauge(self) -> frozenset[str]:
        """Searched and drawn paths whose values are gauge pressures, relative to the atmosphere of their run."""
        drawn = frozenset[str]() if self.uncertainty is None else self.uncertainty.gauge
        return drawn | {gain.path for gain in self.searched if gain.place.is_gauge}

    def gains(self, fractions: Sequence[float]) -> Gains:
        """Return the gains [SI] at fractions of their ranges, rounded as in the overrides to paste and as simulated."""
        # Through the text that is pasted: a run of that line gives these bits again.
        pairs = list(zip(self.searched, fractions, strict=True))
        texts = [gain.place.quote(float(gain.value(np.asarray(fraction)))) for gain, fraction in pairs]
        return {gain.path: gain.place.level(text) for gain, text in zip(self.searched, texts, strict=True)}

    def lines(self, gains: Gains) -> list[str]:
        """Format gains as overrides, ``PATH=VALUE``."""
        return [f"{gain.path}={gain.place.quote(gains[gain.path])}" for gain in self.searched]


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
    metrics: Mapping[str, Metric]
    result: Result = field(compare=False, repr=False)

    @property
    def useless(self) -> str:
        """Verdict on a nominal run that should follow its reference and does not; empty for others."""
        tracking = self.result.tracking
        return tracking.sentence if tracking.is_useless else ""

    @property
    def is_feasible(self) -> bool:
        """True if all constraints are satisfied, no run failed and the reference is followed, also over fresh draws."""
        broken = self.violation or self.fresh_violation or self.share_without_value or self.fresh_share_without_value
        return not broken and self.off == 0.0


@dataclass(frozen=True, slots=True)
class Tuned:
    """Result of a tuning: gains before and after, starts of the search, and remarks; numbers in SI units.

    ``overrides`` turn the scenario of the tuning file into the tuned one; ``bounds_reached`` are gains that ended at a
    bound, beyond which a better value may lie. The best of the ``starts`` is the first.
    """

    tuning: str
    scenario: str
    verdict: str
    is_feasible: bool
    overrides: list[str]
    bounds_reached: dict[str, Literal["minimum", "maximum"]]
    scales: dict[str, float]
    before: GainResult
    after: GainResult
    starts: list[SearchStart]
    runs: int
    remarks: list[str]
    problem: Problem = field(compare=False, repr=False)

    @property
    def lines(self) -> list[str]:
        """Gains found, as overrides ``PATH=VALUE`` to paste."""
        return self.problem.lines(self.after.gains)


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
    name_plugins(plugins)
    document, source = read_source(TUNING, tuning)
    parsed = checked_record(TuningFile, document, source.file, StudyError, source.text)
    with refused_as(StudyError, source.file, ScenarioError, ParameterError, StudyError):
        scenario = load_scenario(placed(parsed.scenario, source.folder), parsed.overrides)
        scenario = reloaded(scenario, overrides) if overrides else scenario
        metrics = [*(goal.metric for goal in parsed.objective), *(goal.metric for goal in parsed.constraints)]
        check_metrics(list(dict.fromkeys(metrics)), scenario)
        paths = [gain.path for gain in parsed.search]
        uncertain = _uncertain(parsed, source.folder, paths, scenario)
        if (repeated := first_twice(paths)) is not None:
            raise StudyError(f"'{repeated}' appears in two [[search]] tables; omit one")
        drawn = uncertain.get("uncertainty")
        atmosphere = atmosphere_of(scenario, (*(() if drawn is None else (*drawn.paths, *drawn.same)), *paths))
        return Problem(
            name=parsed.name,
            description=" ".join(parsed.description.split()),
            scenario=scenario,
            overrides=scenario.origin.overrides,
            searched=tuple(_searched(gain, scenario, atmosphere is None) for gain in parsed.search),
            goals=tuple(map(_objective_term, parsed.objective)),
            constraints=tuple(_metric_limit(constraint, atmosphere) for constraint in parsed.constraints),
            effort=parsed.effort,
            changes=changes_in(scenario, overrides=overrides),
            **uncertain,
        )


def _objective_term(goal: GoalSection) -> ObjectiveTerm:
    """Return a term of the objective with its scale in SI; StudyError for a weight of 0 or a scale not above 0."""
    if goal.weight == 0.0:
        raise StudyError(f"objective '{goal.metric}': weight = 0 has no effect; omit this objective")
    where = f"objective '{goal.metric}': scale = '{goal.scale}'"
    scale = None if goal.scale is None else difference_of(goal.scale, goal.metric, where)
    if scale is not None and scale <= 0.0:
        raise StudyError(f"{where}: must be above 0")
    return ObjectiveTerm(goal.metric, goal.weight, scale)


def _metric_limit(constraint: Constraint, atmosphere: float | None) -> MetricLimit:
    """Return the limit of a constraint in SI; StudyError unless it has exactly one of at_most and at_least.

    Gauge pressures are relative to ``atmosphere`` [Pa absolute], and refused if it is None because it varies.
    """
    bounds = [text for text in (constraint.at_most, constraint.at_least) if text is not None]
    if len(bounds) != 1:
        has = "both" if bounds else "neither"
        raise StudyError(f"constraint '{constraint.metric}': has {has} of at_most and at_least; give one of them")
    where = f"constraint '{constraint.metric}' = '{bounds[0]}'"
    limit = level_of(bounds[0], constraint.metric, where, atmosphere)
    return MetricLimit(constraint.metric, limit, constraint.at_most is not None, bounds[0])


def _searched(gain: SearchRange, scenario: Scenario, atmosphere_varies: bool) -> SearchedParameter:
    """Return a searched parameter with bounds in SI; StudyError for a path or bounds that cannot be searched."""
    with refused_as(StudyError, f"search '{gain.path}'", UnitError, ScenarioError, StudyError):
        place, ends = varied_path(gain.path, scenario), (gain.minimum, gain.maximum)
        place = given_in(in_its_unit(place, ends) if atmosphere_varies else place, ends)
        minimum, maximum = map(place.level, ends)
        before, is_logarithmic = value_at(gain.path, scenario), gain.spacing == "logarithmic"
        if before is None:
            raise StudyError(
                f"scenario '{scenario.name}' has no value for '{gain.path}'; set it in the scenario or by an override"
            )
        if gain.path == NOISE_SEED:
            raise StudyError("cannot be searched, because all candidates use the same noise; omit this search")
        if minimum >= maximum:
            raise StudyError(f"minimum = {gain.minimum!r} must be less than maximum = {gain.maximum!r}")
        if is_logarithmic and minimum <= 0.0:
            raise StudyError(f"spacing = 'logarithmic' needs a minimum above 0, not {gain.minimum!r}")
    # Where the atmosphere varies, gauge bounds count from each run's own; so does the value before.
    before -= place.atmosphere if place.is_gauge else 0.0
    return SearchedParameter(gain.path, minimum, maximum, is_logarithmic, before, place)


def _uncertain(parsed: TuningFile, folder: Path, searched: Sequence[str], scenario: Scenario) -> dict[str, Any]:
    """Return the draws over which candidates are evaluated, as fields of the problem: of a study, of noise, or none."""
    robust = parsed.robust
    if robust is None:
        noise = Uncertainty(()).with_noise_of([scenario])
        return {"uncertainty": noise, "draws": NOISE_STREAMS, "seed": parsed.effort.seed} if noise.drawn else {}
    with refused_as(StudyError, "robust", StudyError):
        study = load_study(beside(robust.study, folder, list_studies()))
        uncertainty = uncertainty_of(study).with_noise_of([scenario])
        if study.only:
            raise StudyError(
                f"'{next(iter(study.only))}' varies in some configurations only; choose a study without 'only'"
            )
        if (both := next((path for path in uncertainty.paths if path in searched), None)) is not None:
            raise StudyError(f"study '{study.name}' draws '{both}', which is also searched; omit one of both")
    return {
        "uncertainty": uncertainty,
        "study": study.name,
        "draws": robust.draws,
        "seed": study.sample.seed,
        "deviations": robust.deviations,
        "fraction": robust.share if robust.measure == "quantile" else None,
    }


def solve_tuning(
    problem: Problem, threads: int | None, progress: Report | None, executor: Executor | None = None
) -> Finding[Tuned]:
    """Solve a tuning problem: search for gains, and evaluation of the gains before and after."""
    report, effort, uncertainty = progress or report_nothing, problem.effort, problem.uncertainty
    # As many as are made if no start converges early: the first candidates are a generation of their own, the gains
    # before run for the scales and for their result, the gains found once, and both over fresh draws.
    of_start = len(problem.searched) * (effort.candidates_per_gain * (effort.generations + 1) + _REFINEMENTS)
    most = problem.draws * (effort.starts * of_start + 3) + (0 if uncertainty is None else 2 * FRESH_DRAWS)
    counter = RunCounter(most, lambda now: report(replace(now, activity="tuning", is_bound=True)))
    runs = scenario_runs(problem.scenario, [*problem.is_worse_high], counter, problem.gauge, threads, executor)
    draws = {} if uncertainty is None else uncertainty.random_columns(0, problem.draws, problem.seed)
    tried = _tried(runs, {path: [value] for path, value in problem.before.items()}, draws)
    scales = dict[str, float]()
    for goal in problem.goals:
        # By default each goal is 1 before tuning: goals in different units then weigh as much as their weights say.
        before_tuning = problem.bad_end(tried[f"judged_{goal.metric}"], goal.weight > 0.0)
        scale = abs(float(before_tuning[0])) if goal.scale is None else goal.scale
        if not np.isfinite(scale) or scale == 0.0:
            raise StudyError(
                f"tuning '{problem.name}': objective '{goal.metric}' is {scale:g} before tuning, which cannot be its "
                "scale; set scale = 'VALUE UNIT' in this objective"
            )
        scales[goal.metric] = scale

    def costs(fractions: Floats) -> Floats:
        # As they are pasted: what keeps a constraint by less than the last digit would break it.
        candidates = [problem.gains(each) for each in fractions.tolist()]
        values = {gain.path: np.array([gains[gain.path] for gains in candidates]) for gain in problem.searched}
        return judge(_tried(runs, values, draws), problem, scales)["cost"]

    starts = search(costs, [gain.fraction(gain.before) for gain in problem.searched], effort)
    before, after = (
        _evaluate(runs, problem, scales, gains, draws) for gains in (problem.before, problem.gains(starts[0].fractions))
    )
    bounds = ((gain.path, gain.bound_reached(after.gains[gain.path])) for gain in problem.searched)
    tuned = Tuned(
        tuning=problem.name,
        scenario=problem.scenario.name,
        verdict=_verdict(problem, before, after),
        is_feasible=after.is_feasible,
        overrides=list(over(problem.overrides, problem.lines(after.gains), valve=problem.scenario.device.valve_name)),
        bounds_reached={path: bound for path, bound in bounds if bound is not None},
        scales=scales,
        before=before,
        after=after,
        starts=starts,
        runs=runs.count,
        remarks=[],
        problem=problem,
    )
    return _finding(replace(tuned, remarks=_remarks(tuned)))


def _tried(runs: Runs, values: Mapping[str, Sequence[float] | Floats], draws: Mapping[str, Floats]) -> Rows:
    """Run every candidate with every draw; returns arrays (candidates, draws), with one draw without uncertainty.

    ``values`` are the gains by path, each (candidates,); ``draws`` are the uncertain values by path, each (draws,).
    Candidates are ranked by ``judged_NAME``, ``off`` and ``unusable``: gains with which the loop oscillates are no
    better than ones with which the run fails.
    """
    candidates = len(next(iter(values.values())))
    count = len(next(iter(draws.values()))) if draws else 1
    columns = {path: np.repeat(column, count) for path, column in values.items()}
    columns |= {path: np.tile(column, candidates) for path, column in draws.items()}
    return {name: column.reshape(candidates, count) for name, column in runs.run(columns).items()}


def judge(rows: Rows, problem: Problem, scales: Mapping[str, float]) -> Rows:
    """Score candidates, each (candidates,), by objective, constraints, tracking and runs without a value.

    ``scales`` are scales of the goals by metric [SI]. The scores are ``cost``, by which candidates are ranked,
    ``objective``, ``violation``, ``off``, and ``without_value``, the fraction of runs that failed or lack a metric.
    """
    judged = {name: rows[f"judged_{name}"] for name in problem.is_worse_high}
    lacks_metric = np.any([~np.isfinite(values) for values in judged.values()], axis=0)
    without_value = np.asarray(np.mean(rows["unusable"] | lacks_metric, axis=1))
    # Candidates with failed runs are ranked by how many fail: 0 keeps nan out of the sums meanwhile.
    known = {name: np.where(without_value[:, None] > 0.0, 0.0, values) for name, values in judged.items()}
    objective, violation = np.zeros(without_value.size), np.zeros(without_value.size)
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
def search(costs: Callable[[Floats], Floats], before: Sequence[float], effort: SearchEffort) -> list[SearchStart]:
    """Return the result of each start of the search, the best first; equal seeds give equal results.

    ``costs`` takes fractions of the ranges (candidates, gains). ``before`` are those before tuning; they are among the
    first candidates if they lie within the bounds. The search is differential evolution (Storn and Price, 1997) as in
    SciPy, followed by the simplex method of Nelder and Mead (1965). Both use only comparisons of costs.
    """
    from scipy.optimize import differential_evolution, minimize

    starts, batches, box = list[SearchStart](), list[Floats](), [(0.0, 1.0)] * len(before)

    def batch_costs(columns: Floats) -> Floats:
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
        size = np.clip(np.std(evolved.population, axis=0), *_SIMPLEX_SIZES)
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


def _is_settled(costs: Floats) -> bool:
    """Return whether the costs of a generation have converged."""
    least, most = np.min(costs), np.max(costs)
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
    as_good = [start for start in starts if start.cost <= best.cost + _AS_GOOD * abs(scale)]
    return max(float(np.max(np.abs(np.subtract(start.fractions, best.fractions)))) for start in as_good)


def _evaluate(
    runs: Runs, problem: Problem, scales: Mapping[str, float], gains: Gains, draws: Mapping[str, Floats]
) -> GainResult:
    """Return the result of a set of gains over the draws of the search, over fresh draws and on the nominal device."""
    candidate, fresh = {path: [value] for path, value in gains.items()}, dict[str, Floats]()
    over_fresh = in_search = _tried(runs, candidate, draws)
    if problem.uncertainty is not None:
        # Draws that follow those of the search: the gains were not chosen on them.
        fresh = problem.uncertainty.random_columns(problem.draws, FRESH_DRAWS, problem.seed)
        over_fresh = _tried(runs, candidate, fresh)
    scores, fresh_scores = (
        {name: float(values[0]) for name, values in judge(rows, problem, scales).items()}
        for rows in (in_search, over_fresh)
    )
    # Unchanged gains are not written and read again, which would round them.
    is_changed = gains != problem.before
    scenario = with_overrides(problem.scenario, problem.lines(gains)) if is_changed else problem.scenario
    numbers = {path: each for path, each in absolute(scenario, fresh, problem.gauge).items() if path not in TIMES}
    drawn, result = with_numbers(scenario, numbers), simulate(scenario)

    def ends(rows: Rows, prefix: str = "") -> dict[str, float]:
        return {
            name: float(problem.bad_end(rows[prefix + name], high)[0]) for name, high in problem.is_worse_high.items()
        }

    return GainResult(
        gains=gains,
        values=ends(in_search),
        fresh=ends(over_fresh) if fresh else {},
        judged=ends(over_fresh, "judged_"),
        objective=scores["objective"],
        violation=scores["violation"],
        off=max(scores["off"], fresh_scores["off"]),
        share_off=float(np.mean(np.concatenate([in_search["off"], over_fresh["off"]], axis=1) > 0.0)),
        share_without_value=scores["without_value"],
        fresh_violation=fresh_scores["violation"],
        fresh_share_without_value=fresh_scores["without_value"],
        beyond_reach=float(np.mean(np.asarray(shortfall(drawn)) > 0.0)) if drawn.follows_reference else 0.0,
        metrics=result.metrics,
        result=result,
    )


def _verdict(problem: Problem, before: GainResult, after: GainResult) -> str:
    """Return the result of a tuning as a sentence."""

    def where(fraction: float) -> str:
        return "" if problem.uncertainty is None else f" in {percentage(fraction, 2)} of the draws"

    beyond = (
        f"; the reference requires more torque than the actuator gives at the supply pressure"
        f"{where(after.beyond_reach)}, which no gains can change"
    ) * (after.beyond_reach > 0.0)
    if after.share_without_value:
        failing = percentage(after.share_without_value, 3)
        said = f"with the best gains found, {failing} of the runs fail, oscillate, or lack a required metric"
    elif after.off:
        missed = f"the tracking limits are exceeded by {percentage(after.off, 3)}{where(after.share_off)}"
        said = "no gains within the bounds let the loop follow its reference; with the best gains found, "
        said += f"{after.useless or missed}{beyond}"
    elif after.violation:
        broken = f"the best gains found exceed the limits by {percentage(after.violation, 3)}"
        said = f"no gains within the bounds satisfy all constraints; {broken}{beyond}"
    elif not after.is_feasible:
        said = "the gains found satisfy all constraints over the draws of the search, but not over "
        said += f"{FRESH_DRAWS:,} fresh draws{beyond}"
    elif after.useless:
        said = f"with the best gains found, {after.useless}"
    elif before.off:
        missed = f"with the previous gains it did not{where(before.share_off)}"
        said = f"the loop follows its reference, {missed}; objective {after.objective:.4g}"
    elif not before.is_feasible:
        said = "the gains found satisfy all constraints, which the previous gains did not; objective "
        said += f"{after.objective:.4g}"
    # Beyond a bound the gains before are no candidates, and the best within may be worse.
    elif after.objective >= before.objective:
        said = "nothing better than the previous gains was found within the bounds"
    else:
        said = f"objective {before.objective:.4g} before, {after.objective:.4g} after"
        if before.objective:
            change = 100.0 * (after.objective - before.objective) / abs(before.objective)
            said += f" ({without_exponent(change, '+.3g')} %)"
    return f"{problem.name}: {said}"


def _remarks(tuned: Tuned) -> list[str]:
    """Return remarks on convergence, bounds that were reached, ambiguous gains, draws, and a loop that swings."""
    problem, after, starts = tuned.problem, tuned.after, tuned.starts
    remarks = [
        f"{count_of(len(starts), 'start')}, {sum(start.candidates for start in starts):,} "
        f"candidates, {tuned.runs:,} runs; {sum(start.is_settled for start in starts)} of {len(starts)} converged "
        "before the maximum number of generations",
        *filter(None, [problem.scenario.origin.replaced]),
    ]
    remarks += [
        f"{path} ended at its {bound}: a better value may lie beyond; widen the bounds if the device allows it"
        for path, bound in tuned.bounds_reached.items()
    ]
    if (difference := agreement(starts)) > _DIFFERENT:
        remarks.append(
            f"starts whose objectives agree within 1 % differ by up to {100.0 * difference:.0f} % of the range between "
            "the bounds: the objective does not determine the gains uniquely"
        )
    printed = after.fresh or after.values
    return remarks + [
        f"the loop still oscillates in the second half of the hold, so {name} depends on the instant: the RMS error of "
        f"that half, {of_metric(name).number(judged)}, counts instead"
        for name, judged in after.judged.items()
        if judged > printed[name]
    ]


@in_units(lambda tuned: tuned.problem.scenario.device.shown)
def _finding(tuned: Tuned) -> Finding[Tuned]:
    """Return the result of a tuning as a finding; it has passed if the gains satisfy all constraints."""
    problem, after, scenario = tuned.problem, tuned.after, tuned.problem.scenario
    rows = []
    for gain in problem.searched:
        numbers = (gain.before, after.gains[gain.path], gain.minimum, gain.maximum)
        end = f"at its {tuned.bounds_reached[gain.path]}" if gain.path in tuned.bounds_reached else ""
        rows.append((gain.path, *map(gain.place.quote, numbers), end))
    kinds, sides = {name: of_metric(name) for name in problem.is_worse_high}, {"before": tuned.before.values}
    if problem.uncertainty is not None:
        sides = {f"before ({problem.measure})": tuned.before.values}
    sides["after"] = after.values
    if problem.uncertainty is not None:
        sides |= {"before, fresh draws": tuned.before.fresh, "after, fresh draws": after.fresh}
        for title, side in (("before, nominal", tuned.before), ("after, nominal", after)):
            sides[title] = {name: metric.value for name, metric in side.metrics.items()}
    columns = {
        "metric": [f"{name} ({kind.shown_unit})" if kind.quantity else name for name, kind in kinds.items()],
        **{
            title: [
                kind.number(own[name]) if math.isfinite(own.get(name, math.nan)) else "" for name, kind in kinds.items()
            ]
            for title, own in sides.items()
        },
        "constraint": [
            ", ".join(limit.words for limit in problem.constraints if limit.metric == name) for name in kinds
        ],
    }
    # The scenario's file, or the name of one that comes with the package, finds it again.
    name, command = scenario.origin.file or scenario.name, scenario.motion.motion_kind.command
    # Texts of TOML and of Python alike.
    used = usage_text(reloaded(scenario, tuned.lines))
    listed = ", ".join(json.dumps(line, ensure_ascii=False) for line in tuned.overrides)
    pasted = (
        f"# {tuned.verdict}\n\n# on the command line\n{used}\n\n# in a study file\noverrides = [{listed}]\n\n"
        f"# in Python\nppafo.{command}({name!r}, overrides=[{listed}])\n"
    )
    return Finding(
        name="tune",
        kicker="Tuning",
        title=problem.name,
        said=(tuned.verdict, *([problem.description] if problem.description else [])),
        parts=(
            Section("Gains", columns_of(("gain", "before", "after", "minimum", "maximum", ""), rows)),
            Section(
                "Before and after",
                [Column(title, cells) for title, cells in columns.items()],
                panels=partial(_task_panels, tuned),
                name="task",
                caption="The nominal device.",
                size=(5.4, 1.9),
            ),
            Section(
                "The search",
                remarks=tuned.remarks,
                panels=partial(_search_panels, tuned),
                name="search",
                caption=_SEARCH_CAPTION,
                size=(5.4, max(2.2, 0.9 + 0.3 * len(problem.searched))),
            ),
            Section("To use the gains", code=used),
        ),
        found=tuned,
        passed=after.is_feasible and not after.useless,
        files={"overrides.txt": pasted.encode},
        overrides=problem.changes,
    )


def _task_panels(tuned: Tuned) -> list[Panel]:
    """Return panels of controlled quantity, command and gas over time, before and after, for the nominal device."""
    recording = tuned.after.result.recording
    controlled = controlled_in(recording) or CONTROLLED[TORQUE]
    words, unit = controlled.words, controlled.level.unit
    kinds = {
        controlled.name: Kind(words[:1].upper() + words[1:], unit, quantity_of_unit(unit)),
        "command": Kind("Valve command"),
        "supplied_mass": Kind("Gas supplied", "kg", "gas mass"),
    }
    # Broader below, so that both show where they agree.
    sides = ((tuned.before, VERMILION, "before", 1.8), (tuned.after, BLUE, "after", 1.1))
    panels: list[Panel] = []
    for channel, kind in kinds.items():
        marks = []
        for setting, colour, label, width in sides:
            own = setting.result.recording
            style = {"linewidth": width, "drawstyle": "steps-post" if channel == "command" else "default"}
            marks.append(Mark("line", own.time, own[channel], label=label, colour=colour, style=style))
        if channel == controlled.name and controlled.reference in recording:
            dashed, reference = {"linestyle": "--", "linewidth": 1.2}, recording[controlled.reference]
            marks.append(Mark("line", recording.time, reference, label="reference", colour=BLACK, style=dashed))
        panels.append(Panel(TIME, kind, marks, legend="" if panels else "figure", shares_x=True))
    return panels


def _search_panels(tuned: Tuned) -> list[Panel]:
    """Return panels of the best cost of each start over its generations, and of the gains between their bounds."""
    searched, starts, courses = tuned.problem.searched, tuned.starts, list[Mark]()
    for number, start in enumerate(starts):
        costs = np.array(start.generations)
        costs[costs >= INFEASIBLE] = np.nan  # no candidate keeps the constraints yet
        colour, dashes = _START_LINES[number % len(_START_LINES)]
        label = f"start {number + 1}" if len(starts) <= len(_START_LINES) else ""
        style = {"linewidth": 1.3, "linestyle": dashes}
        courses.append(Mark("line", np.arange(costs.size), costs, label=label, colour=colour, style=style))
    courses.append(Mark("level", y=tuned.before.objective, label="before", colour=BLACK, style={"linewidth": 0.8}))

    def scale(axes: "Axes") -> None:
        axes.locator_params(axis="x", integer=True)
        # Below a decade a logarithmic axis has no tick that reads as a number.
        if axes.dataLim.ymax > _DECADE * axes.dataLim.ymin > 0.0:
            axes.set_yscale("log")

    rows = np.arange(len(searched))[::-1]
    ends = [
        gain.fraction(float(gain.value(np.array(fraction))))
        for start in starts
        for gain, fraction in zip(searched, start.fractions, strict=True)
    ]
    previous = [float(np.clip(gain.fraction(gain.before), -_BEYOND, 1.0 + _BEYOND)) for gain in searched]
    found = [gain.fraction(tuned.after.gains[gain.path]) for gain in searched]
    dots: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 7}
    ticks: dict[str, Any] = {"linestyle": "", "marker": "|", "markersize": 11}
    marks = (
        *(Mark("line", [0.0, 1.0], [row, row], colour=GREY, style={"linewidth": 1.0}) for row in rows),
        Mark("line", ends, np.tile(rows, len(starts)), label="end of a start", colour=BLACK, style=ticks),
        Mark("line", previous, rows, label="before", colour=VERMILION, style={**dots, "marker": "s"}),
        Mark("line", found, rows, label="after", colour=BLUE, style=dots),
    )
    every = {"yticks": rows, "yticklabels": [label_of(gain.path) for gain in searched], "xticks": [0.0, 1.0]}
    every |= {"ylim": (-0.6, len(searched) - 0.4), "xticklabels": ["minimum", "maximum"]}
    return [
        Panel(Kind("Generation"), Kind(), courses, "Objective, best so far", legend="inside", then=scale),
        Panel(Kind("Between bounds"), Kind(), marks, then=lambda axes: axes.set(**every)),
    ]
