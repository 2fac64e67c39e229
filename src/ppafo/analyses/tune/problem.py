"""Tuning problem: layout of a tuning file, and loading from a name, a file or plain data into SI units."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from ppafo.arguments import Overrides, checked
from ppafo.documents.models import SchemaVersion, StrictTable, Text, Texts, make_schema, validate
from ppafo.documents.toml_text import NAME, TomlKind, beside
from ppafo.errors import ParameterError, ScenarioError, StudyError, UnitError, refused_as
from ppafo.loading import load_scenario, placed, reloaded
from ppafo.plugins import Plugins, name_plugins
from ppafo.simulation.numbers import NOISE_SEED, changes_in
from ppafo.simulation.scenario import LARGEST_SEED, Scenario
from ppafo.studies.distributions import Floats, LogUniformBetween, UniformBetween
from ppafo.studies.draws import Uncertainty, uncertainty_of
from ppafo.studies.limits import MetricLimit, atmosphere_of, check_metrics, difference_of, level_of
from ppafo.studies.loading import list_studies, load_study, read_source
from ppafo.studies.varying import VariedPath, given_in, in_its_unit, value_at, varied_path
from ppafo.wording import first_twice

MAXIMUM_DRAWS = 4096
"""Largest number of draws over which each candidate of a tuning runs."""
_Value = Annotated[str | float | int, Field(description="text with unit; a plain number if there is no unit")]
_Metric = Annotated[Text, Field(description="name of a metric, such as 'rms_error'")]


class SearchRange(StrictTable):
    """Section of a tuning file for a searched parameter: path, bounds with units, linear or logarithmic spacing."""

    path: Annotated[Text, Field(description="as for --set, such as 'controller.proportional_gain'")]
    minimum: _Value
    maximum: _Value
    spacing: Annotated[Literal["linear", "logarithmic"], Field(description="default: linear")] = "linear"


class GoalSection(StrictTable):
    """Section of a tuning file for a term of the minimised objective: weight times metric divided by scale.

    A metric with a negative weight is maximised.
    """

    metric: _Metric
    weight: float = 1.0
    scale: Annotated[Text | None, Field(description="value that is scaled to 1; default: the value before tuning")] = (
        None
    )


class Constraint(StrictTable):
    """Section of a tuning file for a constraint: upper or lower limit of a metric."""

    metric: _Metric
    at_most: Annotated[Text | None, Field(description="largest value with its unit")] = None
    at_least: Annotated[Text | None, Field(description="smallest value with its unit")] = None


class Robust(StrictTable):
    """Section of a tuning file for robustness: candidates run over the same draws; the unfavourable end counts."""

    study: Annotated[Text, Field(description="name of a study, or a path relative to this file")]
    measure: Annotated[
        Literal["mean_and_deviations", "quantile"],
        Field(description="mean plus 'deviations' standard deviations, or the 'share' quantile"),
    ] = "mean_and_deviations"
    deviations: Annotated[float, Field(ge=0.0, le=10.0)] = 1.0
    share: Annotated[float, Field(ge=0.5, lt=1.0)] = 0.9
    draws: Annotated[int, Field(ge=8, le=MAXIMUM_DRAWS)] = 64


class SearchEffort(StrictTable):
    """Section of a tuning file for the effort of the search.

    ``starts``: number of independent starts
    ``generations``: maximum number of generations of each start
    ``candidates_per_gain``: candidates of a generation for each gain
    ``seed``: random seed
    """

    starts: Annotated[int, Field(ge=1, le=100)] = 3
    generations: Annotated[int, Field(ge=1, le=100_000)] = 100
    candidates_per_gain: Annotated[int, Field(ge=4, le=1000)] = 10
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = 1


class TuningFile(StrictTable):
    """Tuning file: scenario, searched parameters, objective, constraints, robustness and effort."""

    schema_version: SchemaVersion
    name: Annotated[str, Field(pattern=NAME, max_length=100)]
    description: str = ""
    scenario: Annotated[Text, Field(description="name of a scenario, or a path relative to this file")]
    overrides: Annotated[Texts, Field(description="such as 'valve.area=12.6mm^2'")] = ()
    search: Annotated[tuple[SearchRange, ...], Field(strict=False, min_length=1)]
    objective: Annotated[tuple[GoalSection, ...], Field(strict=False, min_length=1)]
    constraints: Annotated[tuple[Constraint, ...], Field(strict=False)] = ()
    robust: Annotated[
        Robust | None, Field(description="uncertainty to be robust against; default: the nominal device")
    ] = None
    effort: SearchEffort = SearchEffort()


json_schema = partial(make_schema, TuningFile, "ppafo tuning")
"""JSON Schema of a tuning file."""


AT_BOUND = 0.01
"""Fraction of the range from a bound within which a gain counts as ended at the bound."""
Gains = Mapping[str, float]


@dataclass(frozen=True, slots=True)
class SearchedParameter:
    """Searched parameter of a tuning problem, with its bounds and its value before tuning.

    ``path``: dotted path
    ``minimum``, ``maximum``: bounds [SI]
    ``is_logarithmic``: True if the logarithm of the value is searched
    ``before``: value before tuning [SI]
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
        between = LogUniformBetween if self.is_logarithmic else UniformBetween
        return between(self.minimum, self.maximum).values(fraction)

    def fraction(self, value: float) -> float:
        """Return the position of a value [SI] in the range, from 0 to 1; below 0 or above 1 beyond the bounds."""
        if self.is_logarithmic:
            return math.log(value / self.minimum) / math.log(self.maximum / self.minimum) if value > 0.0 else -math.inf
        return (value - self.minimum) / (self.maximum - self.minimum)

    def bound_reached(self, value: float) -> Literal["minimum", "maximum"] | None:
        """Return the bound at which a value lies; None for a value between the bounds."""
        fraction = self.fraction(value)
        if fraction <= AT_BOUND:
            return "minimum"
        return "maximum" if fraction >= 1.0 - AT_BOUND else None


@dataclass(frozen=True, slots=True)
class ObjectiveTerm:
    """Term of the objective: weight times metric divided by scale [SI]; scale None is the value before tuning."""

    metric: str
    weight: float
    scale: float | None


@dataclass(frozen=True, slots=True)
class Spread:
    """Draws over which candidates are evaluated, and the statistic of their metrics that counts.

    ``uncertainty``: distributions of the uncertain values
    ``study``: name of the study; empty if only sensor noise is drawn
    ``draws``, ``seed``: number of draws, and random seed
    ``deviations``: number of standard deviations added to the mean, if ``fraction`` is None
    ``fraction``: fraction of the quantile that judges a candidate; None for mean and standard deviations
    """

    uncertainty: Uncertainty
    study: str
    draws: int
    seed: int
    deviations: float
    fraction: float | None

    @property
    def measure(self) -> str:
        """Statistic by which candidates are evaluated, in words."""
        if self.fraction is not None:
            return f"{100.0 * self.fraction:g} % quantile"
        if self.deviations == 0.0:
            return "mean"
        noun = "standard deviation" if self.deviations == 1.0 else "standard deviations"
        return f"mean and {self.deviations:g} {noun}"


@dataclass(frozen=True, slots=True, repr=False)
class Problem:
    """Tuning problem: gains with bounds, objective, constraints and effort for one scenario.

    ``spread`` is None for the nominal device with noise-free sensors. ``overrides`` are all of the scenario, of which
    ``changes`` are the caller's.
    """

    name: str
    description: str
    scenario: Scenario
    overrides: tuple[str, ...]
    searched: tuple[SearchedParameter, ...]
    goals: tuple[ObjectiveTerm, ...]
    constraints: tuple[MetricLimit, ...]
    spread: Spread | None
    effort: SearchEffort
    changes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return name, scenario and searched parameters."""
        return f"Tuning '{self.name}' of '{self.scenario.name}': {', '.join(gain.path for gain in self.searched)}"

    def with_seed(self, seed: int) -> "Problem":
        """Return the problem with another random seed of the search."""
        effort, spread = self.effort.model_copy(update={"seed": seed}), self.spread
        # Noise alone follows the seed of the search; draws of a study keep the seed of the study.
        if spread is not None and not spread.study:
            spread = replace(spread, seed=seed)
        return replace(self, effort=effort, spread=spread)

    @property
    def metrics(self) -> tuple[str, ...]:
        """Metrics of the goals and constraints, without duplicates."""
        names = [*(goal.metric for goal in self.goals), *(constraint.metric for constraint in self.constraints)]
        return tuple(dict.fromkeys(names))

    @property
    def before(self) -> Gains:
        """Values of the gains before tuning [SI]."""
        return {gain.path: gain.before for gain in self.searched}

    def bad_end(self, values: Floats, is_high: bool) -> Floats:
        """Return the unfavourable end of values (candidates, draws) [SI], high or low, as an array (candidates,)."""
        spread = self.spread
        if spread is None:
            return values[:, 0]
        if spread.fraction is not None:
            return np.asarray(np.quantile(values, spread.fraction if is_high else 1.0 - spread.fraction, axis=1))
        # Of a sample, hence n - 1; the draws are the same for all candidates, so that it ranks them fairly.
        deviations = spread.deviations * np.std(values, axis=1, ddof=1)
        return np.asarray(np.mean(values, axis=1) + (deviations if is_high else -deviations))

    @property
    def gauge(self) -> frozenset[str]:
        """Searched and drawn paths whose values are gauge pressures, relative to the atmosphere of their run."""
        drawn = frozenset[str]() if self.spread is None else self.spread.uncertainty.gauge
        return drawn | {gain.path for gain in self.searched if gain.place.is_gauge}

    def gains(self, fractions: Sequence[float]) -> Gains:
        """Return the gains [SI] at fractions of their ranges, rounded as in the overrides to paste.

        The rounded values are also the simulated ones.
        """
        # Through the text that is pasted: a run of that line gives these bits again.
        values = {
            gain.path: float(gain.value(np.asarray(fraction)))
            for gain, fraction in zip(self.searched, fractions, strict=True)
        }
        return {gain.path: gain.place.level(gain.place.quote(values[gain.path])) for gain in self.searched}

    def lines(self, gains: Gains) -> list[str]:
        """Format gains as overrides, ``PATH=VALUE``."""
        return [f"{gain.path}={gain.place.quote(gains[gain.path])}" for gain in self.searched]


TUNING = TomlKind("tuning", "tuning", resources.files("ppafo") / "analyses" / "tune" / "library", StudyError)
SEARCH_NOISE_STREAMS = 16
"""Number of noise streams for every candidate if only the sensors are uncertain."""


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
    parsed = validate(TuningFile, document, source.file, StudyError, source.text)
    with refused_as(StudyError, source.file, ScenarioError, ParameterError, StudyError):
        scenario = load_scenario(placed(parsed.scenario, source.folder), parsed.overrides)
        scenario = reloaded(scenario, overrides) if overrides else scenario
        metrics = [*(goal.metric for goal in parsed.objective), *(goal.metric for goal in parsed.constraints)]
        check_metrics(list(dict.fromkeys(metrics)), scenario)
        paths = [gain.path for gain in parsed.search]
        spread = _spread(parsed, source.folder, paths, scenario)
        if (repeated := first_twice(paths)) is not None:
            raise StudyError(f"'{repeated}' appears in two [[search]] tables; omit one")
        drawn = () if spread is None else (*spread.uncertainty.paths, *spread.uncertainty.same)
        atmosphere = atmosphere_of(scenario, (*drawn, *paths))
        return Problem(
            name=parsed.name,
            description=" ".join(parsed.description.split()),
            scenario=scenario,
            overrides=scenario.origin.overrides,
            searched=tuple(_searched(gain, scenario, atmosphere is None) for gain in parsed.search),
            goals=tuple(map(_objective_term, parsed.objective)),
            constraints=tuple(_metric_limit(constraint, atmosphere) for constraint in parsed.constraints),
            spread=spread,
            effort=parsed.effort,
            changes=changes_in(scenario, overrides=overrides),
        )


def _objective_term(goal: GoalSection) -> ObjectiveTerm:
    """Return a term of the objective with its scale in SI; StudyError for a weight of 0 or a scale not above 0."""
    if goal.weight == 0.0:
        raise StudyError(f"objective '{goal.metric}': weight = 0 has no effect; omit this objective")
    if goal.scale is None:
        return ObjectiveTerm(goal.metric, goal.weight, None)
    where = f"objective '{goal.metric}': scale = '{goal.scale}'"
    scale = difference_of(goal.scale, goal.metric, where)
    if scale <= 0.0:
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
    with refused_as(StudyError, f"search '{gain.path}'", UnitError, ScenarioError):
        varied = varied_path(gain.path, scenario)
        ends = (gain.minimum, gain.maximum)
        varied = given_in(in_its_unit(varied, ends) if atmosphere_varies else varied, ends)
        minimum, maximum = varied.level(gain.minimum), varied.level(gain.maximum)
        before = value_at(gain.path, scenario)
        if before is None:
            raise ScenarioError(
                f"scenario '{scenario.name}' has no value for '{gain.path}'; set it in the scenario or by an override"
            )
    if gain.path == NOISE_SEED:
        raise StudyError(
            f"search '{gain.path}': cannot be searched, because all candidates use the same noise; omit this search"
        )
    if minimum >= maximum:
        raise StudyError(
            f"search '{gain.path}': minimum = {gain.minimum!r} must be less than maximum = {gain.maximum!r}"
        )
    is_logarithmic = gain.spacing == "logarithmic"
    if is_logarithmic and minimum <= 0.0:
        raise StudyError(f"search '{gain.path}': spacing = 'logarithmic' needs a minimum above 0, not {gain.minimum!r}")
    # Where the atmosphere varies, gauge bounds count from each run's own; so does the value before.
    before -= varied.atmosphere if varied.is_gauge else 0.0
    return SearchedParameter(gain.path, minimum, maximum, is_logarithmic, before, varied)


def _spread(parsed: TuningFile, folder: Path, searched: Sequence[str], scenario: Scenario) -> Spread | None:
    """Return the draws over which candidates are evaluated: of a study, of sensor noise, or of both; None without."""
    robust = parsed.robust
    if robust is None:
        noise = Uncertainty(()).with_noise_of([scenario])
        return Spread(noise, "", SEARCH_NOISE_STREAMS, parsed.effort.seed, 0.0, None) if noise.drawn else None
    with refused_as(StudyError, "robust", StudyError):
        study = load_study(beside(robust.study, folder, list_studies()))
        uncertainty = uncertainty_of(study).with_noise_of([scenario])
        if study.only:
            raise StudyError(
                f"'{next(iter(study.only))}' varies only in some configurations of the study, but must vary in all of "
                "them; choose a study whose [[vary]] tables have no 'only'"
            )
    if (both := next((path for path in uncertainty.paths if path in searched), None)) is not None:
        raise StudyError(
            f"robust: study '{study.name}' draws '{both}', which is also searched; omit the [[vary]] or the [[search]] "
            f"of '{both}'"
        )
    share = robust.share if robust.measure == "quantile" else None
    return Spread(uncertainty, study.name, robust.draws, study.sample.seed, robust.deviations, share)
