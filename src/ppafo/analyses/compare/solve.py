"""Comparison of configurations: nominal runs, and runs over the same draws of uncertain values."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from ppafo.analyses.compare.answer import ComparisonResult, ConfigurationResult, OnTask, front_of, remarks_of
from ppafo.analyses.compare.pairs import COMPARED, Paired, best_probabilities, compare_pairs
from ppafo.errors import StudyError
from ppafo.metrics import METRICS
from ppafo.progress import Report
from ppafo.report.kind import ConfidenceInterval
from ppafo.running import tried
from ppafo.simulation.ensemble.running import lacking
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate_many
from ppafo.simulation.tracking.pair_step import warn_of_coarse_pairs
from ppafo.studies.declaration import DEFAULT_SEED
from ppafo.studies.draws import FEWEST_DRAWS, MAXIMUM_DRAWS, Uncertainty, uncertainty_of
from ppafo.studies.limits import CONFIDENCE, check_fraction
from ppafo.studies.sampling import NOISE, with_new_noise
from ppafo.studies.study import Configuration, Study, with_overrides
from ppafo.studies.varying import value_at, varied_path
from ppafo.study.runs import Rows, RunCounter, Runs, failures_of, unvaried
from ppafo.wording import first_twice, nearest_name

AS_WRITTEN = "as written"
"""Name of the task of configurations that run as written."""
DEFAULT_DRAWS = 4096
"""Default number of draws of the uncertain values."""
_SAME = 1.0e-9
"""Relative difference up to which two values count as equal."""


@dataclass(frozen=True, slots=True)
class Draws:
    """Number of draws of the uncertain values, and acceptance rules for their runs.

    ``requested``: number of draws; None for the default
    ``seed``: random seed; None for the seed of the study
    ``confidence``: confidence level of the intervals
    ``maximum_failed``: fraction of failed runs above which the comparison is refused
    """

    requested: int | None
    seed: int | None
    confidence: float
    maximum_failed: float
    threads: int | None
    progress: Report | None

    @property
    def count(self) -> int:
        """Number of draws."""
        return DEFAULT_DRAWS if self.requested is None else self.requested

    def check(self) -> None:
        """Raise StudyError for numbers outside their ranges."""
        if not FEWEST_DRAWS <= self.count <= MAXIMUM_DRAWS:
            raise StudyError(f"draws = {self.count!r}: must be at least {FEWEST_DRAWS} and at most {MAXIMUM_DRAWS:,}")
        check_fraction(self.confidence, *CONFIDENCE)
        check_fraction(self.maximum_failed, "maximum_failed")


Scenarios = Mapping[tuple[str, str], Scenario]
"""Scenarios by task and configuration."""


_DrawnRuns = Mapping[tuple[str, str], tuple[Rows, Rows | None, str]]
"""Runs of each case over the draws, first runs repeated with other noise or None, reason of the first failure."""


def compared(
    configurations: Sequence[Configuration],
    baseline: str | None,
    tasks: Iterable[tuple[str, Sequence[str]]],
    study: Study | None,
    draws: Draws,
) -> ComparisonResult:
    """Return the comparison of configurations on tasks and over the uncertain values of a study.

    ``tasks`` are pairs of name and overrides; without tasks, the scenarios run as written. ``baseline`` is the name of
    the reference configuration, by default the first one. Without a study, only sensor noise is drawn, if there is any.

    Raises StudyError if too many runs fail, and for a study that draws a value in which the configurations differ.
    """
    names = [configuration.name for configuration in configurations]
    if baseline is not None and baseline not in names:
        hint = nearest_name(baseline, names)
        raise StudyError(f"baseline: no configuration '{baseline}'{hint}; available: {', '.join(names)}")
    baseline = baseline or names[0]
    pairs = list(tasks) or [(AS_WRITTEN, ())]
    repeated = first_twice([name for name, _ in pairs])
    if repeated is not None:
        raise StudyError(f"there are two tasks named '{repeated}'; give each its own name")
    overrides = dict(pairs)
    scenarios: dict[tuple[str, str], Scenario] = {}
    for task, texts in overrides.items():
        for configuration in configurations:
            scenarios[task, configuration.name] = with_overrides(configuration.scenario, texts)
    warn_of_coarse_pairs(scenarios.values())
    # Those of the table that all scenarios can have: without a reference there is no error.
    metrics = [
        name for name in COMPARED if not any(lacking(scenario, METRICS[name]) for scenario in scenarios.values())
    ]
    distributions = Uncertainty(()) if study is None or not study.paths else uncertainty_of(study)
    uncertainty = distributions.with_noise_of(scenarios.values())
    seed = draws.seed
    if seed is None:
        seed = DEFAULT_SEED if study is None else study.sample.seed
    drawn = _drawn_runs(scenarios, metrics, study, uncertainty, draws, seed)
    cases = _cases(scenarios, drawn, draws.threads)
    comparison = ComparisonResult(
        units="SI: N m, kg, J; fractions from 0 to 1",
        configurations=names,
        baseline=baseline,
        draws=draws.count if drawn else 0,
        seed=seed if drawn else 0,
        remarks=[],
        varied=[path for path in uncertainty.paths if path != NOISE],
        confidence=draws.confidence,
        tasks=[
            _on_task(task, texts, cases[task], baseline, metrics, draws.confidence) for task, texts in overrides.items()
        ],
        metrics=tuple(metrics),
    )
    return replace(comparison, remarks=remarks_of(comparison))


def _drawn_runs(
    scenarios: Scenarios,
    metrics: Sequence[str],
    study: Study | None,
    uncertainty: Uncertainty,
    draws: Draws,
    seed: int,
) -> _DrawnRuns:
    """Return the runs of every case over the same draws; empty if nothing is random.

    Raises StudyError if draws are requested although nothing is random.
    """
    if not uncertainty.drawn:
        if draws.requested is not None:
            raise StudyError(
                f"draws = {draws.requested}: nothing in this comparison is random; give a study or sensors with "
                f"noise, or omit draws"
            )
        return {}
    if study is not None:
        # Where cases differ in a value that the study draws for all of them, the difference would not count.
        # Orifices of different valves are meant to differ: what the study draws replaces each one's own.
        for path in (path for path in study.paths if not path.startswith("valve.") and path != NOISE):
            own = [value_at(path, scenario) for (_, name), scenario in scenarios.items() if study.varies(path, name)]
            values = [value for value in own if value is not None]
            lowest, highest = min(values, default=0.0), max(values, default=0.0)
            if highest - lowest > _SAME * max(abs(lowest), abs(highest)):
                place = varied_path(path, next(iter(scenarios.values())))
                raise StudyError(
                    f"the study draws '{path}' for every configuration, so the different values of the configurations "
                    f"({place.quote(lowest)} and {place.quote(highest)}) would be ignored; use a study that does not "
                    "draw it"
                )
    columns = uncertainty.replicated_columns(0, draws.count, seed)
    renoised = with_new_noise(columns) if uncertainty.has_noise else {}
    tally = RunCounter((draws.count + len(renoised.get(NOISE, ()))) * len(scenarios), draws.progress)
    drawn: dict[tuple[str, str], tuple[Rows, Rows | None, str]] = {}
    for (task, name), scenario in scenarios.items():
        runs = Runs(scenario, metrics, tally, uncertainty.gauge, draws.threads)
        # The noise is in all configurations, whatever a study says of its paths.
        paths = [path for path in columns if study is None or path == NOISE or study.varies(path, name)]
        rows = runs.run({path: columns[path] for path in paths} or unvaried(scenario, draws.count))
        runs.check(rows, draws.maximum_failed, f"configuration '{name}', task '{task}'")
        # The reason of the draws themselves: the runs with other noise may overwrite it.
        reason = runs.reason
        again = runs.run({path: renoised[path] for path in paths}) if renoised else None
        drawn[task, name] = rows, again, reason
    return drawn


def _cases(scenarios: Scenarios, drawn: _DrawnRuns, threads: int | None) -> dict[str, list[ConfigurationResult]]:
    """Return the results of each task: nominal run of every configuration, and its runs over the draws."""
    # With the seed of each scenario: what the tables call nominal is one realisation of its noise.
    results = simulate_many(list(scenarios.values()), threads)
    cases: dict[str, list[ConfigurationResult]] = {}
    for ((task, name), scenario), result in zip(scenarios.items(), results, strict=True):
        rows, renoised, reason = drawn.get((task, name), (None, None, ""))
        cases.setdefault(task, []).append(
            ConfigurationResult(
                configuration=name,
                status=result.status,
                metrics={metric: value for metric, value in result.metrics.items() if metric in COMPARED},
                tracking=tried(scenario, result.tracking),
                failed_draws=0 if rows is None else failures_of(rows),
                reason=reason,
                scenario=scenario,
                rows=rows,
                renoised=renoised,
            )
        )
    return cases


def _on_task(
    task: str,
    overrides: Sequence[str],
    cases: list[ConfigurationResult],
    baseline: str,
    metrics: Sequence[str],
    confidence: float,
) -> OnTask:
    """Return the results of a task; with draws, also paired statistics and probabilities of being the best."""
    first = next(case for case in cases if case.configuration == baseline)
    pairs: dict[str, list[Paired]] = {}
    for case in cases:
        if case is first:
            continue
        pairs[case.configuration] = []
        if first.rows is None or case.rows is None:
            continue
        for name in metrics:
            renoised = None
            if first.renoised is not None and case.renoised is not None:
                renoised = (first.renoised[name], case.renoised[name])
            pair = compare_pairs(name, first.rows[name], case.rows[name], COMPARED[name], confidence, renoised)
            pairs[case.configuration] += [] if pair is None else [pair]
    # A case that does not follow its reference is not among the best, and a metric may have no end that is better.
    judged = [case for case in cases if case.follows]
    rows = [case.rows for case in judged if case.rows is not None]
    best: dict[str, dict[str, ConfidenceInterval]] = {}
    for name in (name for name in metrics if rows and COMPARED[name]):
        # All at once: no pair says which of three is the best. No shares where no draw has a value of all.
        shares = best_probabilities([row[name] for row in rows], COMPARED[name], confidence)
        best[name] = dict(zip([case.configuration for case in judged], shares, strict=False))
    return OnTask(task, list(overrides), cases, front_of(cases), pairs, best)
