"""Comparison of configurations: nominal runs, and runs over the same draws of uncertain values."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from ppafo.analyses.compare.answer import (
    ComparisonResult,
    ConfigurationResult,
    TaskComparison,
    error_of,
    front_of,
    remarks_of,
)
from ppafo.analyses.compare.pairs import COMPARED, RMS_ERRORS, PairedMetric, best_probabilities, compare_pairs
from ppafo.errors import StudyError
from ppafo.metrics import METRICS
from ppafo.progress import Report
from ppafo.remedy_trials import tried
from ppafo.report.kind import ConfidenceInterval
from ppafo.simulation.ensemble.running import lacking
from ppafo.simulation.numbers import NOISE_SEED
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result, simulate_many
from ppafo.simulation.tracking.pair_step import unlimited_switching
from ppafo.studies.declaration import DEFAULT_SEED
from ppafo.studies.draws import Uncertainty, uncertainty_of
from ppafo.studies.sampling import with_new_noise
from ppafo.studies.study import Configuration, Study, configurations_with
from ppafo.studies.varying import value_at, varied_path
from ppafo.study.runs import FAILED, Rows, RunCounter, excess, scenario_runs, unvaried, with_companions
from ppafo.wording import argument_text, first_twice, known_names, said_of_configuration

AS_WRITTEN = "as written"
"""Task name of scenarios that run as written, without overrides of a task."""
DEFAULT_DRAWS = 4096
"""Default number of draws of the uncertain values."""
_SAME = 1.0e-9
"""Relative difference up to which two values count as equal."""


@dataclass(frozen=True, slots=True)
class DrawSettings:
    """Number of draws of the uncertain values, and acceptance rules for their runs.

    ``count``: number of draws
    ``is_default``: True if the number of draws is not requested by the caller
    ``seed``: random seed; None for the seed of the study
    ``confidence``: confidence level of the intervals
    ``maximum_failed``: fraction of failed runs above which the comparison is refused
    """

    count: int
    is_default: bool
    seed: int | None
    confidence: float
    maximum_failed: float
    threads: int | None
    progress: Report | None


Scenarios = Mapping[tuple[str, str], Scenario]
"""Scenarios by name of the task and name of the configuration."""


class _DrawnRuns(NamedTuple):
    """Runs of a scenario over the draws of the uncertain values.

    ``rows``: runs; None without draws
    ``renoised``: first runs repeated with other sensor noise; None without noise
    ``failure``: reason of the first failed run
    ``following``: number of runs that follow their reference; None without a verdict on any
    """

    rows: Rows | None = None
    renoised: Rows | None = None
    failure: str = ""
    following: int | None = None


def compared(
    configurations: Sequence[Configuration],
    baseline: str | None,
    tasks: Iterable[tuple[str, Sequence[str]]],
    study: Study | None,
    draws: DrawSettings,
) -> ComparisonResult:
    """Return the comparison of configurations on tasks and over the uncertain values of a study.

    ``tasks`` are pairs of name and overrides; without tasks, the scenarios run as written. ``baseline`` is the name of
    the reference configuration, by default the first one. Without a study, only sensor noise is drawn, if there is any.

    Raises StudyError if too many runs fail, and for a study that draws a value in which the configurations differ.
    """
    names = [configuration.name for configuration in configurations]
    if baseline is not None and baseline not in names:
        raise StudyError(f"baseline: there is no configuration '{baseline}'{known_names(baseline, names)}")
    baseline = baseline or names[0]
    named_tasks = list(tasks) or [(AS_WRITTEN, ())]
    if (repeated := first_twice([name for name, _ in named_tasks])) is not None:
        raise StudyError(f"two tasks are named '{repeated}'; give every task a different name")
    scenarios = {
        (task, configuration.name): configuration.scenario
        for task, overrides in named_tasks
        for configuration in configurations_with(configurations, overrides)
    }
    # The controlled quantity first, and what the study asks for. Without a reference there is no error.
    asked = () if study is None else study.outputs.metrics
    lacks = {
        name: any(lacking(scenario, METRICS[name]) for scenario in scenarios.values())
        for name in dict.fromkeys((*RMS_ERRORS, *asked, *COMPARED))
    }
    metrics = [name for name, is_lacking in lacks.items() if not is_lacking]
    uncertainty = _uncertainty_of_comparison(scenarios, study, draws)
    seed = draws.seed if draws.seed is not None else DEFAULT_SEED if study is None else study.sample.seed
    drawn = _runs_over_draws(scenarios, metrics, study, uncertainty, draws, seed) if uncertainty.drawn else {}
    # Nominal runs use the seed of each scenario: with noise, a nominal run is one realisation of the noise.
    nominal = dict(zip(scenarios, simulate_many(list(scenarios.values()), draws.threads), strict=True))
    cases = {
        (task, name): _configuration_result(name, result, metrics, drawn.get((task, name), _DrawnRuns()))
        for (task, name), result in nominal.items()
    }
    comparison = ComparisonResult(
        units="SI: N m, kg, J; fractions from 0 to 1",
        configurations=names,
        baseline=baseline,
        draws=draws.count if drawn else 0,
        seed=seed if drawn else 0,
        remarks=[],
        varied=[path for path in uncertainty.paths if path != NOISE_SEED],
        confidence=draws.confidence,
        tasks=[
            _task_result(task, overrides, [cases[task, name] for name in names], baseline, metrics, draws.confidence)
            for task, overrides in named_tasks
        ],
        metrics=tuple(metrics),
    )
    switching = ((task, name, unlimited_switching(result)) for (task, name), result in nominal.items())
    left_out = [
        f"outputs: '{name}' is left out: not every configuration has this metric" for name in asked if lacks[name]
    ]
    remarks = [
        *left_out,
        *(f"{name}, {task}: {text}" for task, name, text in switching if text),
        *remarks_of(comparison),
    ]
    if study is not None and study.drawn and draws.is_default and study.sample.runs != draws.count:
        remarks.append(
            f"study '{study.name}': sample.runs = {study.sample.runs} applies to 'ppafo sweep' only; 'compare' used "
            f"{draws.count:,} draws, which {argument_text('draws')} changes"
        )
    return replace(comparison, remarks=remarks)


def _uncertainty_of_comparison(scenarios: Scenarios, study: Study | None, draws: DrawSettings) -> Uncertainty:
    """Return the distributions of a study and of the sensor noise.

    Raises StudyError if draws are requested but nothing is random, and if the study draws a value in which the
    scenarios differ.
    """
    distributions = Uncertainty(()) if study is None or not study.paths else uncertainty_of(study)
    uncertainty = distributions.with_noise_of(scenarios.values())
    if not uncertainty.drawn and not draws.is_default:
        raise StudyError(
            f"draws = {draws.count}: nothing in this comparison is random; omit draws, or give a study or "
            "sensors with noise"
        )
    if study is not None:
        _check_different_values(study, scenarios)
    return uncertainty


def _check_different_values(study: Study, scenarios: Scenarios) -> None:
    """Raise StudyError for a path that the study draws once for scenarios whose declared values differ."""
    for path in study.paths:
        # Orifices of different valves are meant to differ: what the study draws replaces the value of each.
        if path.startswith("valve.") or path == NOISE_SEED:
            continue
        declared = [value_at(path, scenario) for (_, name), scenario in scenarios.items() if study.varies(path, name)]
        values = [value for value in declared if value is not None]
        lowest, highest = min(values, default=0.0), max(values, default=0.0)
        if highest - lowest > _SAME * max(abs(lowest), abs(highest)):
            varied = varied_path(path, next(iter(scenarios.values())))
            raise StudyError(
                f"the study draws '{path}' for every configuration, so the values {varied.quote(lowest)} and "
                f"{varied.quote(highest)} of the configurations would be ignored; use a study that does not draw "
                f"'{path}'"
            )


def _runs_over_draws(
    scenarios: Scenarios,
    metrics: Sequence[str],
    study: Study | None,
    uncertainty: Uncertainty,
    draws: DrawSettings,
    seed: int,
) -> dict[tuple[str, str], _DrawnRuns]:
    """Return the runs of every scenario over the same draws; StudyError if too many of them fail."""
    columns = uncertainty.replicated_columns(draws.count, seed)
    renoised_columns = with_new_noise(columns) if uncertainty.has_noise else {}
    runs_of_scenario = draws.count + len(renoised_columns.get(NOISE_SEED, ()))
    counter = RunCounter(runs_of_scenario * len(scenarios), draws.progress)
    drawn = {}
    for (task, name), scenario in scenarios.items():
        judged = with_companions(metrics, scenario)
        runs = scenario_runs(scenario, judged, counter, uncertainty.gauge, draws.threads)
        # The noise is in all configurations, even if the study varies other paths in some of them only.
        paths = [path for path in columns if study is None or path == NOISE_SEED or study.varies(path, name)]
        varied = {path: columns[path] for path in paths} or unvaried(scenario, draws.count)
        rows = runs.run(varied)
        runs.check(rows, draws.maximum_failed, f"configuration '{name}', task '{task}'")
        # Read before the runs with other noise, which may overwrite it.
        failure = runs.reason
        renoised = runs.run({path: renoised_columns[path] for path in paths}) if renoised_columns else None
        follows = excess(rows, scenario, varied, uncertainty.gauge).follows
        following = int(np.count_nonzero(follows == 1.0)) if np.isfinite(follows).any() else None
        drawn[task, name] = _DrawnRuns(rows, renoised, failure, following)
    return drawn


def _configuration_result(name: str, nominal: Result, metrics: Sequence[str], drawn: _DrawnRuns) -> ConfigurationResult:
    """Return the result of a configuration on a task, with a tried remedy if it does not follow its reference."""
    with said_of_configuration(name):
        tracking = tried(nominal.scenario, nominal.tracking)
    return ConfigurationResult(
        configuration=name,
        status=nominal.status,
        metrics={metric: value for metric, value in nominal.metrics.items() if metric in metrics},
        tracking=tracking,
        failed_draws=0 if drawn.rows is None else int(drawn.rows[FAILED].sum()),
        reason=drawn.failure,
        scenario=nominal.scenario,
        rows=drawn.rows,
        renoised=drawn.renoised,
        following=drawn.following,
    )


def _task_result(
    task: str,
    overrides: Sequence[str],
    cases: list[ConfigurationResult],
    baseline: str,
    metrics: Sequence[str],
    confidence: float,
) -> TaskComparison:
    """Return the results of a task; with draws, also paired statistics and probabilities of being the best."""
    base = next(case for case in cases if case.configuration == baseline)
    pairs: dict[str, list[PairedMetric]] = {case.configuration: [] for case in cases if case is not base}
    for case, name in product(cases, metrics):
        if case is base or base.rows is None or case.rows is None:
            continue
        noise = None
        if base.renoised is not None and case.renoised is not None:
            noise = base.renoised[name], case.renoised[name]
        pair = compare_pairs(name, base.rows[name], case.rows[name], COMPARED.get(name, 0), confidence, noise)
        # Without a pair of values a metric has no statistics.
        if pair is not None:
            pairs[case.configuration].append(pair)
    # A case that does not follow its reference is not among the best.
    following = [case for case in cases if case.follows]
    rows = [case.rows for case in following if case.rows is not None]
    best: dict[str, dict[str, ConfidenceInterval]] = {}
    for name in metrics:
        better = COMPARED.get(name, 0)
        # A metric may have no better end.
        if rows and better:
            # All at once: no pair says which of three is the best. Empty where no draw has a value of all.
            shares = best_probabilities([row[name] for row in rows], better, confidence)
            best[name] = dict(zip([case.configuration for case in following], shares, strict=False))
    return TaskComparison(task, list(overrides), cases, front_of(cases, error_of(metrics)), pairs, best)
