"""Comparison of configurations: nominal runs, and runs over the same draws of uncertain values."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import cycle, islice, product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.analyses import ask, np
from ppafo.arguments import Confidence, MaximumFailed, Name, Overrides, Seed, Tasks, Threads, Whole, Word, checked
from ppafo.errors import StudyError, at_fault
from ppafo.plugins import Plugins
from ppafo.progress import Report
from ppafo.units.shown import shown_in
from ppafo.wording import count_of, first_twice, known_names, said_of_configuration, without_exponent

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ppafo.report.finding import Finding
    from ppafo.simulation.scenario import Scenario
    from ppafo.studies.study import Study

Configured = Annotated[
    "Mapping[str, Scenario | str | Path] | Sequence[Scenario | str | Path]", Word("SCENARIO", is_repeated=True)
]
StudyLike = Annotated["Study | str | Path | Mapping[str, Any]", Word("STUDY", option="--study")]
AS_WRITTEN = "as written"
"""Task name of scenarios that run as written, without overrides of a task."""
DEFAULT_DRAWS = 4096
"""Default number of draws of the uncertain values."""
_GAS = "gas_supplied"
_READING = (
    "The intervals of the mean difference and of the probability show how precisely the draws estimate them; they "
    "shrink with more draws. The change from 5 to 95 % of the draws shows the effect of the uncertain values; it "
    "does not shrink."
)
_NOISE = (
    "sensors are noisy: every draw has its own noise, the same in all configurations; the nominal change is "
    "one realisation"
)


@dataclass(frozen=True, slots=True)
class PairedMetric:
    """Paired statistics of a metric of a configuration against the baseline, over the pairs in which both have a value.

    - ``pairs``: number of pairs
    - ``difference``: mean of configuration minus baseline [SI], with confidence interval
    - ``change``: median over the draws of this difference divided by the baseline value, nan if the baseline is 0
    - ``change_low``, ``change_high``: 5 and 95 % quantile of the same ratio; more draws do not narrow this range
    - ``better``: probability that the configuration is better in a draw; None for a metric without preferred direction
    - ``equal``: fraction of draws in which both values are equal
    - ``effective_size``: effective sample size of the mean difference
    - ``noise``: fraction of the variance of the difference that is due to sensor noise; None without noise
    """

    pairs: int
    difference: ask.ConfidenceInterval
    change: float
    change_low: float
    change_high: float
    better: ask.ConfidenceInterval | None
    equal: float
    effective_size: float
    noise: ask.ConfidenceInterval | None = None


@dataclass(frozen=True, slots=True)
class ComparedCase:
    """Result of a configuration on a task: nominal run, and runs over the draws.

    - ``verdict``: end of the nominal run in a word; ``tracking``: how it follows, with a tried remedy
    - ``follows``: True if the nominal run completes and follows its reference
    - ``is_ranked``: True if it does, is not judged, or misses the reference because it is beyond reach on purpose
    - ``failed``: number of draws whose run failed
    - ``draws``: draws that follow, do not, or are beyond reach on purpose; None without a verdict on any
    - ``is_on_front``: True if the case is ranked and no other one beats it in both error and gas
    - ``pairs``: statistics against the baseline by metric, ``best``: probability of being the best; empty without draws
    - ``rows``: runs over the draws, by column; empty without
    """

    configuration: str
    status: ask.Status
    verdict: str
    follows: bool
    is_ranked: bool
    tracking: ask.Tracking
    metrics: Mapping[str, ask.Metric]
    failed: int
    draws: ask.TrackingCounts | None
    is_on_front: bool
    pairs: dict[str, PairedMetric]
    best: dict[str, ask.ConfidenceInterval]
    scenario: Scenario = field(compare=False, repr=False)
    rows: ask.Rows = field(compare=False, repr=False)

    def value(self, metric: str) -> float:
        """Return a metric [SI] of the nominal run; nan if the run does not have the metric."""
        return self.metrics[metric].value if metric in self.metrics else math.nan


@dataclass(frozen=True, slots=True)
class ComparisonResult:
    """Comparison of configurations with a ``baseline``, by task; numbers in SI.

    - ``draws``: number of draws, 0 without uncertainty
    - ``varied``: uncertain paths except sensor noise
    - ``confidence``: confidence level of the intervals
    - ``error``: metric of the error of the controlled quantity; empty if the configurations have none in common
    - ``metrics``: compared metrics, -1 if smaller is better, 1 if larger is better, 0 if neither
    - ``task_overrides``: overrides of each task
    """

    units: str
    configurations: list[str]
    baseline: str
    draws: int
    seed: int
    remarks: list[str]
    varied: list[str]
    has_noise: bool
    confidence: float
    error: str
    metrics: dict[str, int]
    task_overrides: dict[str, list[str]]
    tasks: dict[str, list[ComparedCase]]


@checked
def compare(
    configurations: Configured | None = None,
    *,
    study: StudyLike | None = None,
    tasks: Tasks = (),
    overrides: Overrides = (),
    baseline: Name | None = None,
    draws: Whole | None = None,
    seed: Seed | None = None,
    confidence: Confidence = 0.95,
    maximum_failed: MaximumFailed = 0.01,
    threads: Threads | None = None,
    check: bool = False,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[ComparisonResult]:
    """Compare configurations, also over an uncertain device.

    All configurations get the same random numbers. ``configurations`` are scenarios by name (or a list of names, files
    or Scenario objects). Draws are randomised Sobol replicates whatever the study's sampling method. With sensor noise,
    each draw has its own noise stream, the same in all configurations; without a study, only the noise is drawn. A draw
    that fails in a configuration is left out of its pairs.

    Arguments:
        configurations: names of scenarios or .toml files; default: the configurations of the study
        study: study file that gives the distributions and, without others, the configurations
        tasks: a task for all configurations, for example 'slow:reference.ramp_time=2 s'; default: as the scenarios are
            written
        overrides: values to change, for example 'valve.area=12.6 mm^2'; of one configuration: 'NAME:PATH=VALUE'; may be
            repeated
        baseline: configuration that all others are compared with; default: the first
        draws: draws of the uncertain values of the study, or of the noise, at least 32; default 4096, whatever the
            runs of the study
        seed: random seed; default: the file's
        confidence: confidence of all intervals; default 95%
        maximum_failed: fraction of the runs that may fail before the study is refused; default 1%
        threads: number of threads; default: all cores
        check: end with exit code 1 where a nominal run does not follow its reference
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is a ComparisonResult: the cases of each task with their metrics, and the
        differences from the baseline

    Raises:
        StudyError: a study or a configuration that cannot be used, and more than ``maximum_failed`` of its runs fail

    >>> import ppafo
    >>> compared = ppafo.compare(["torque-task-proportional", "torque-task-solenoid"]).found
    >>> (cases,) = compared.tasks.values()
    >>> [(case.configuration, f"{case.metrics['rms_error'].value:.3f} N m") for case in cases]
    [('torque-task-proportional', '0.869 N m'), ('torque-task-solenoid', '1.026 N m')]
    """
    count = DEFAULT_DRAWS if draws is None else draws
    if not ask.FEWEST_DRAWS <= count <= ask.MAXIMUM_DRAWS:
        raise StudyError(f"draws = {count!r}: must be at least {ask.FEWEST_DRAWS} and at most {ask.MAXIMUM_DRAWS:,}")
    loaded = ask.study_of(study) if study is not None else None
    chosen = _chosen(configurations or None, loaded, tuple(overrides))
    names = [configuration.name for configuration in chosen]
    if baseline is not None and baseline not in names:
        raise StudyError(f"baseline: there is no configuration '{baseline}'{known_names(baseline, names)}")
    named_tasks = list(ask.taken_tasks(tasks)) or [(AS_WRITTEN, ())]
    if (repeated := first_twice([name for name, _ in named_tasks])) is not None:
        raise StudyError(f"two tasks are named '{repeated}'; give every task a different name")
    scenarios = {
        (task, configuration.name): configuration.scenario
        for task, of_task in named_tasks
        for configuration in ask.configurations_with(chosen, of_task)
    }
    # The error of the controlled quantity first (of a walk the last), and what the study asks for.
    errors = [*(name for name in ask.TRACKING if name.startswith("rms_") and name.endswith("_error")), "torque_error"]
    asked = () if loaded is None else loaded.outputs.metrics
    compared = (name for name, kind in ask.METRICS.items() if kind.better is not None)
    # Without a reference there is no error.
    lacks = {
        name: any(ask.lacking(scenario, ask.METRICS[name]) for scenario in scenarios.values())
        for name in dict.fromkeys((*errors, *asked, *compared))
    }
    metrics = {name: ask.METRICS[name].better or 0 for name, is_lacking in lacks.items() if not is_lacking}
    distributions = ask.Uncertainty(()) if loaded is None or not loaded.paths else ask.uncertainty_of(loaded)
    uncertainty = distributions.with_noise_of(scenarios.values())
    if not uncertainty.drawn and draws is not None:
        raise StudyError(
            f"draws = {count}: nothing in this comparison is random; omit draws, or give a study or sensors with noise"
        )
    if loaded is not None:
        _check_different_values(loaded, scenarios)
    if seed is None:
        seed = ask.DEFAULT_SEED if loaded is None else loaded.sample.seed
    drawn = _drawn_runs(scenarios, [*metrics], loaded, uncertainty, (count, seed, maximum_failed), threads, progress)
    # Nominal runs use the seed of each scenario: with noise, a nominal run is one realisation of the noise.
    nominal = dict(zip(scenarios, ask.simulate_many(list(scenarios.values()), threads), strict=True))
    error = next((name for name in metrics if name in errors), "")
    found = ComparisonResult(
        units="SI: N m, kg, J; fractions from 0 to 1",
        configurations=names,
        baseline=baseline or names[0],
        draws=count if drawn else 0,
        seed=seed if drawn else 0,
        remarks=[],
        varied=[path for path in uncertainty.paths if path != ask.NOISE_SEED],
        has_noise=bool(drawn) and uncertainty.has_noise,
        confidence=confidence,
        error=error,
        metrics=metrics,
        task_overrides={task: list(of_task) for task, of_task in named_tasks},
        tasks={},
    )
    for task, _ in named_tasks:
        found.tasks[task] = _cases(found, {name: (nominal[task, name], drawn.get((task, name))) for name in names})
    remarks = [
        *(f"outputs: '{name}' is left out: not every configuration has this metric" for name in asked if lacks[name]),
        *_remarks(found),
    ]
    device = next(iter(scenarios.values()))
    with shown_in(device.device.shown if loaded is None else loaded.shown_for(device)):
        changes = _changes_of(chosen, None if configurations else loaded, tuple(overrides))
        return _finding(replace(found, remarks=remarks), check, changes)


def _chosen(
    configurations: Configured | None, study: Study | None, overrides: Sequence[str]
) -> tuple[ask.Configuration, ...]:
    """Return the given scenarios, else the configurations of the study: at least two, with different names."""
    # Distributions that hold in some configurations only name those of the study, not the ones given here.
    if configurations is None:
        if study is None:
            raise StudyError("nothing to compare: give scenarios, a study, or both")
        chosen = study.configurations
    else:
        if study is not None and study.only:
            path, varying = next(iter(study.only.items()))
            raise StudyError(
                f"study '{study.name}': '{path}' varies only in {', '.join(varying)}; omit the other scenarios"
            )
        pairs = (
            configurations.items() if isinstance(configurations, Mapping) else [("", each) for each in configurations]
        )
        with at_fault("configurations"):
            loaded = [(name, ask.scenario_or_load(scenario)) for name, scenario in pairs]
        chosen = tuple(ask.Configuration(name or scenario.name, scenario) for name, scenario in loaded)
        if (repeated := first_twice([each.name for each in chosen])) is not None:
            raise StudyError(f"two scenarios are named '{repeated}'; give different names in a study file")
    if len(chosen) < 2:
        raise StudyError(f"a comparison needs at least two configurations, not {len(chosen)}")
    return ask.configurations_with(chosen, overrides)


def _changes_of(
    configurations: Sequence[ask.Configuration], study: Study | None, overrides: Sequence[str]
) -> tuple[str, ...]:
    """Return the caller's overrides of compared configurations; of one configuration alone as ``NAME:PATH=VALUE``.

    Overrides in the file of a ``study``, whose configurations are compared, are not among them.
    """
    if study is not None:
        return *study.changes, *ask.changes_in(*(each.scenario for each in configurations), overrides=overrides)
    own = [(each.name, text) for each in configurations for text in ask.changes_in(each.scenario)]
    uses = Counter(text for _, text in own)
    common = {text for text, count in uses.items() if count == len(configurations)}
    return tuple(dict.fromkeys(text if text in common else f"{name}:{text}" for name, text in own))


def _check_different_values(study: Study, scenarios: Mapping[tuple[str, str], Scenario]) -> None:
    """Raise StudyError for a path that the study draws once for scenarios whose declared values differ."""
    for path in study.paths:
        # Orifices of different valves are meant to differ: what the study draws replaces the value of each.
        if path.startswith("valve.") or path == ask.NOISE_SEED:
            continue
        declared = (ask.value_at(path, each) for (_, name), each in scenarios.items() if study.varies(path, name))
        values = [value for value in declared if value is not None]
        lowest = min(values, default=0.0)
        highest = max(values, default=0.0)
        if highest - lowest > 1.0e-9 * max(abs(lowest), abs(highest)):
            varied = ask.varied_path(path, next(iter(scenarios.values())))
            raise StudyError(
                f"the study draws '{path}' for every configuration, so the values {varied.quote(lowest)} and "
                f"{varied.quote(highest)} of the configurations would be ignored; use a study that does not draw "
                f"'{path}'"
            )


def _drawn_runs(
    scenarios: Mapping[tuple[str, str], Scenario],
    metrics: Sequence[str],
    study: Study | None,
    uncertainty: ask.Uncertainty,
    draws: tuple[int, int, float],
    threads: int | None,
    progress: Report | None,
) -> dict[tuple[str, str], ask.Rows]:
    """Return the runs of every scenario over the same draws; StudyError if too many of them fail.

    ``draws`` are their number, the seed, and the fraction that may fail. With sensor noise the first draws are repeated
    behind the others, with another noise.
    """
    if not uncertainty.drawn:
        return {}
    count, seed, maximum_failed = draws
    columns = uncertainty.replicated_columns(count, seed)
    drawn = {}
    counter = ask.RunCounter(max(map(len, columns.values())) * len(scenarios), progress)
    for (task, name), scenario in scenarios.items():
        runs = ask.scenario_runs(scenario, metrics, counter, uncertainty.gauge, threads)
        # The noise is in all configurations, even if the study varies other paths in some of them only.
        paths = [path for path in columns if study is None or path == ask.NOISE_SEED or study.varies(path, name)]
        rows = runs.run({path: columns[path] for path in paths} or ask.unvaried(scenario, count))
        first = {metric: values[:count] for metric, values in rows.items()}
        runs.check(first, maximum_failed, f"configuration '{name}', task '{task}'")
        drawn[task, name] = rows
    return drawn


def _cases(found: ComparisonResult, runs: Mapping[str, tuple[ask.Result, ask.Rows | None]]) -> list[ComparedCase]:
    """Return the cases of a task, from the nominal run and the drawn runs of each configuration."""
    cases = []
    draws = found.draws
    base = runs[found.baseline][1]
    for name, (nominal, rows) in runs.items():
        with said_of_configuration(name):
            tracking = ask.verdict_of(nominal)
        is_completed = nominal.status.is_completed
        pairs = {}
        word = str(nominal.status.kind)
        if tracking.fails and is_completed:
            word = "beyond reach on purpose" if tracking.accepted else tracking.kind
        if base is not None and rows is not None and name != found.baseline:
            # Without a pair of values a metric has no statistics.
            for metric, better in found.metrics.items():
                if pair := compare_pairs(base[metric], rows[metric], better, found.confidence, draws):
                    pairs[metric] = pair
        first = {} if rows is None else {metric: values[:draws] for metric, values in rows.items()}
        failed = int(np.count_nonzero(first.get(ask.FAILED, 0)))
        counts = ask.tracking_counts(first, draws - failed) if first else None
        case = ComparedCase(
            configuration=name,
            status=nominal.status,
            verdict=word,
            follows=is_completed and bool(tracking.follows),
            is_ranked=is_completed and not tracking.is_useless,
            tracking=tracking,
            metrics={metric: value for metric, value in nominal.metrics.items() if metric in found.metrics},
            failed=failed,
            draws=counts if counts is not None and counts.without_verdict < draws - failed else None,
            is_on_front=False,
            pairs=pairs,
            best={},
            scenario=nominal.scenario,
            rows=first,
        )
        cases.append(case)
    # A case that does not follow its reference is not among the best.
    ranked = [case for case in cases if case.is_ranked]
    points = np.array([[case.value(name) for name in (found.error, _GAS)] for case in ranked]).reshape(-1, 2)
    front = dict(zip([case.configuration for case in ranked], pareto_front(points).tolist(), strict=True))
    for metric, better in found.metrics.items() if draws else ():
        # All at once: no pair says which of three is the best. Empty where no draw has a value of all.
        values = [case.rows[metric] for case in ranked]
        shares = best_probabilities(values, better, found.confidence) if better and values else []
        for case, share in zip(ranked, shares, strict=False):
            case.best[metric] = share
    return [replace(case, is_on_front=front.get(case.configuration, False)) for case in cases]


def pareto_front(points: ask.Floats) -> NDArray[Any]:
    """Return a mask of the points (points, goals) that no other point dominates; every goal is minimised."""
    front = np.zeros(len(points), dtype=np.bool_)
    for row, point in enumerate(points):
        if np.all(np.isfinite(point)):
            is_dominating = np.all(points <= point, axis=1) & np.any(points < point, axis=1)
            front[row] = not bool(np.any(is_dominating))
    return front


def compare_pairs(
    baseline: ask.Floats, other: ask.Floats, better: int, confidence: float, draws: int | None = None
) -> PairedMetric | None:
    """Return the paired statistics of values (runs,) [SI], nan for a missing value; None without any pair.

    Draws are assigned to the replicates in turn; behind a number of ``draws``, by default all, are the values of the
    first draws, repeated with other noise. ``better`` is -1 if a smaller value is better, 1 if a larger value is
    better, 0 if neither. A draw with equal values counts for neither configuration.
    """
    all_runs = other - baseline
    baseline = baseline[:draws]
    other = other[:draws]
    both = np.isfinite(baseline) & np.isfinite(other)
    baseline_values = baseline[both]
    other_values = other[both]
    if baseline_values.size == 0:
        return None
    # Relative to the size of the baseline, so that the sign is the difference's; a baseline of 0 has no fractions.
    change = (other_values - baseline_values)[baseline_values != 0.0] / np.abs(baseline_values[baseline_values != 0.0])
    low, middle, high = np.quantile(change, (0.05, 0.5, 0.95)) if change.size else (np.nan,) * 3
    difference, repeated = np.split(all_runs, [baseline.size])
    # A tie is no win on either side: of equal configurations neither is better in any draw.
    wins = np.where(both, better * difference > 0.0, np.nan)
    return PairedMetric(
        pairs=baseline_values.size,
        difference=ask.replicates_interval(difference, ask.REPLICATES, confidence),
        change=float(middle),
        change_low=float(low),
        change_high=float(high),
        better=ask.share_interval(wins, ask.REPLICATES, confidence) if better else None,
        equal=float(np.mean(baseline_values == other_values)),
        effective_size=ask.effective_sample_size(other_values - baseline_values),
        noise=ask.noise_interval(difference, repeated, confidence) if repeated.size else None,
    )


def best_probabilities(values: Sequence[ask.Floats], better: int, confidence: float) -> list[ask.ConfidenceInterval]:
    """Return the probability of each configuration to be the best in a draw; a tie counts for all of the best."""
    table = better * np.stack(values)
    known = np.all(np.isfinite(table), axis=0)
    if not known.any():
        return []
    # Draws in which one has no value say nothing about which is the best.
    is_best = np.where(known, table == np.max(table, axis=0), np.nan)
    return [ask.share_interval(row, ask.REPLICATES, confidence) for row in is_best]


def _remarks(found: ComparisonResult) -> list[str]:
    """Return remarks on differing tasks, failed runs, means that depend on few draws, and noise."""
    remarks = []
    failed = []
    uncertain = []
    for task, cases in found.tasks.items():
        followed = {case.configuration: (case.scenario.reference, case.scenario.run.duration) for case in cases}
        # Compared by reference and duration and not by file: two configurations may name one task differently.
        others = [name for name, reference in followed.items() if reference != followed[found.baseline]]
        if others:
            follow, run = ("follows", "runs") if len(others) == 1 else ("follow", "run")
            remarks.append(
                f"task '{task}': {', '.join(others)} {follow} a different reference, or {run} for a different "
                f"time, than {found.baseline}: the differences come partly from the task"
            )
        for case in cases:
            where = f"{case.configuration}, {task}"
            with said_of_configuration(case.configuration):
                remarks.append(ask.remark_on_following_gains(case.scenario, found.varied))
                if kept := case.scenario.origin.replaced:
                    remarks.append(f"{where}: {kept}")
                if not case.is_ranked:
                    remarks.append(f"{where}: {case.tracking.sentence}; not counted among the best")
            if not case.status.is_completed:
                failed.append(f"{where}: {case.status.message}")
            if case.failed:
                failed.append(
                    f"{where}: {case.failed:,} of {found.draws:,} draws failed and are left out of every pair; the "
                    f"first: {next(filter(None, case.rows['reason']), '')}"
                )
            uncertain += [
                f"{case.configuration}, task '{task}': the mean difference of {metric} has an effective sample size "
                f"of {pair.effective_size:.3g} of {pair.pairs:,} draws: do not trust its interval; the probability of "
                "being better is not affected"
                for metric, pair in case.pairs.items()
                # From 50 on a normal interval is accurate to half a percent. Of few draws half their number suffices:
                # if all are equal, the interval has no width and is reliable.
                if pair.effective_size < min(50.0, 0.5 * pair.pairs)
            ]
    # Several tasks may have the same remark.
    return [*dict.fromkeys(filter(None, remarks)), *failed, *uncertain, *([_NOISE] if found.has_noise else [])]


def _finding(found: ComparisonResult, check: bool, overrides: Sequence[str]) -> Finding[ComparisonResult]:
    """Return a comparison as a finding with sentences, tables and panels; ``check`` asks that all nominal runs follow.

    Panels are made by functions with a name, since a lambda in a report cannot be pickled.
    """
    names = found.configurations
    cases = [case for of_task in found.tasks.values() for case in of_task]
    lead = f"{len(names)} configurations on {count_of(len(found.tasks), 'task')}, baseline {found.baseline}; "
    if not found.draws:
        lead += "the nominal device, without uncertainty"
    elif not found.varied:
        lead += f"the nominal device, over {found.draws:,} draws of the sensor noise"
    else:
        beside = " and of the sensor noise" if found.has_noise else ""
        lead += f"{found.draws:,} draws of {count_of(len(found.varied), 'uncertain value')}{beside}, the same for all; "
        lead += f"each interval with {100.0 * found.confidence:g} % confidence"
    pareto = ask.Section(
        "Error against gas",
        panels=partial(_front_panels, found),
        name="pareto",
        caption="Marks: the nominal device; dots: draws. The line joins the configurations that no other one beats in "
        "both.",
        is_detail=True,
    )
    # The axes and the legend say what is drawn.
    change = ask.Section(
        "Spread of the change over the draws",
        panels=partial(_change_panels, found),
        name="change",
        across=2,
        size=(3.0, 2.5),
        is_detail=True,
    )
    return ask.Finding(
        name="compare",
        kicker="Comparison",
        title=" and ".join(names) if len(names) == 2 else f"{len(names)} configurations against {found.baseline}",
        said=(lead,),
        parts=(
            *(part for task in found.tasks for part in _tables(found, task)),
            *([pareto] if found.error else []),
            *([change] if found.error and found.draws else []),
            ask.Section(remarks=found.remarks),
            ask.Section("How to read it", said=[_READING], is_detail=True) if found.draws else ask.Section(),
        ),
        found=found,
        passed=all(case.status.is_completed and (case.is_ranked or not check) for case in cases),
        overrides=overrides,
    )


def _tables(found: ComparisonResult, task: str) -> list[ask.Section]:
    """Return the tables of a task: metrics, changes against the baseline, probability of being the best."""
    cases = found.tasks[task]
    where = "" if len(found.tasks) == 1 else f", {task}"
    # A column without any number, such as the error of a hold that no task has, says nothing.
    held = (name for name in found.metrics if not all(math.isnan(case.value(name)) for case in cases))
    kinds = {name: ask.of_metric(name) for name in held}
    ranked = [case for case in cases if case.is_ranked]
    best = []
    for metric in (name for name in kinds if name in (found.error, _GAS)):
        shares = [
            f"{case.configuration} {ask.Kind(form='.4g').interval(case.best[metric])}"
            for case in ranked
            if metric in case.best
        ]
        values = [case.value(metric) for case in ranked]
        if shares and len(cases) > 2:
            best.append(f"best: {metric}: {', '.join(shares)}")
        elif not found.draws and len(values) > 1 and all(map(math.isfinite, values)):
            least = min(values)
            named = ", ".join(case.configuration for case in ranked if case.value(metric) == least)
            best.append(f"best: {metric}: {named} ({kinds[metric].text(least)})")
    gains = ((case, ask.gains_of(case.scenario)) for case in cases)
    return [
        ask.Section(
            f"Task: {task}",
            [
                ask.Column("configuration", [case.configuration for case in cases]),
                *(ask.Column(kind.words, [case.value(name) for case in cases], kind) for name, kind in kinds.items()),
                ask.Column("status", [case.verdict for case in cases]),
            ],
            remarks=[
                *(f"{case.configuration}: {case.draws.sentence}" for case in cases if case.draws is not None),
                *(f"{case.configuration}: {used.sentence}" for case, used in gains if used is not None),
            ],
        ),
        *(
            ask.Section(f"{case.configuration} against {found.baseline}{where}", _paired(found, cases, case))
            for case in cases
            if case.pairs
        ),
        *([ask.Section(remarks=best)] if best else []),
    ]


def _paired(found: ComparisonResult, cases: Sequence[ComparedCase], case: ComparedCase) -> list[ask.Column]:
    """Return the columns of a table with a row for each metric: change, mean difference, probability of improvement."""
    base = next(each for each in cases if each.configuration == found.baseline)
    rows = []
    for metric, pair in case.pairs.items():
        kind = ask.of_metric(metric, "+.3g")
        low = _percent(pair.change_low)
        high = _percent(pair.change_high)
        # A value that is zero within the accuracy of a run has no percentage.
        scale = abs(kind.shown_change(base.value(metric)))
        away = kind.shown_change(case.value(metric) - base.value(metric))
        better = "-" if pair.better is None else ask.Kind(form=".4g").interval(pair.better)
        row = (
            metric,
            kind.shown_unit if kind.quantity else "",
            _percent(away / scale) if scale else "-",
            f"{_percent(pair.change)} ({low} to {high})" if math.isfinite(pair.change) and scale else "-",
            kind.change_interval(pair.difference),
            "equal in all" if pair.better is not None and pair.equal == 1.0 else better,
        )
        share = pair.noise
        noise = "-"
        if share is not None:
            noise = f"{100.0 * share.value:.3g} % [{100.0 * share.low:.3g}, {100.0 * share.high:.3g}]"
        rows.append((*row, noise) if found.has_noise else row)
    titles = ("metric", "unit", "nominal change", "change over the draws: median (5 to 95 %)", "mean difference")
    probable = ("probability of being better", *(["spread due to noise"] if found.has_noise else []))
    return ask.columns_of((*titles, *probable), rows)


def _percent(fraction: float) -> str:
    return "" if math.isnan(fraction) else f"{without_exponent(100.0 * fraction, '+.3g')} %"


def _colours(cases: Sequence[ComparedCase]) -> dict[str, str]:
    """Return a colour for each configuration: colours of the valves if all differ, else of the palette in order."""
    colours = [ask.look_of_valve(case.scenario.device.valve.kind).colour for case in cases]
    colours = colours if len(set(colours)) == len(colours) else [*islice(cycle(ask.COLOURS), len(colours))]
    return dict(zip((case.configuration for case in cases), colours, strict=True))


def _front_panels(found: ComparisonResult) -> list[ask.Panel]:
    """Return a panel for each task of error over gas: a mark for each completed case, a dot for each draw."""
    panels = []
    for task, cases in found.tasks.items():
        colours = _colours(cases)
        marks = []
        completed = [case for case in cases if case.status.is_completed]
        for number, case in enumerate(completed):
            colour = colours[case.configuration]
            marker = "osD^vP"[number % 6]
            if case.rows:
                gas, error = (case.rows[name][:1500] for name in (_GAS, found.error))
                marks.append(ask.dots(gas, error, ".", "", colour, alpha=0.35, markersize=4, markeredgewidth=0))
            x, y = ([case.value(name)] for name in (_GAS, found.error))
            marks.append(ask.dots(x, y, marker, case.configuration, colour, markersize=8, markeredgecolor="white"))
        # From left to right, so that the front is a line and no zigzag.
        front = sorted((case.value(_GAS), case.value(found.error)) for case in completed if case.is_on_front)
        x_front, y_front = np.array(front).reshape(-1, 2).T
        marks.append(ask.Mark("line", x_front, y_front, colour=ask.GREY, style={"linewidth": 1.0, "zorder": 1}))
        title = f"Task: {task}" if len(found.tasks) > 1 else ""
        panels.append(ask.Panel(ask.of_metric(_GAS), ask.of_metric(found.error), marks, title, legend="inside"))
    return panels


def _change_panels(found: ComparisonResult) -> list[ask.Panel]:
    """Return panels with histograms of the change of error and gas against the baseline; dashed: nominal device."""
    panels = []
    for (task, cases), metric in product(found.tasks.items(), (found.error, _GAS)):
        colours = _colours(cases)
        base = next(case for case in cases if case.configuration == found.baseline)
        marks = []
        ends = list[float]()
        for case in cases:
            change = _relative(base.rows[metric], case.rows[metric]) if case is not base else np.zeros(0)
            if change.size == 0:
                continue
            # A few distant changes would squeeze all others into one bar.
            colour = colours[case.configuration]
            low, high = np.percentile(change, (0.5, 99.5))
            # Fewer bins for fewer draws, so that each has some of them.
            counts, edges = np.histogram(change, min(40, max(8, round(1.5 * change.size**0.5))), (low, high))
            marks.append(ask.Mark("bars", edges, counts, label=case.configuration, colour=colour))
            nominal = _relative(*(np.array([side.value(metric)]) for side in (base, case)))
            dashed = {"linestyle": "--", "linewidth": 1.2}
            # One dashed line of the legend stands for all.
            said = "" if ends else "nominal device"
            marks += [ask.Mark("at", value, label=said, colour=colour, style=dashed) for value in nominal]
            ends += [float(low), float(high), *nominal.tolist()]
        axis = ask.Kind(f"{ask.of_metric(metric).words}, change from {found.baseline}", "%")
        panel = ask.Panel(
            axis, ask.Kind(), marks, legend="figure", then=partial(_limit_changes, ends) if ends else None
        )
        if metric == found.error:
            title = f"Task: {task}" if len(found.tasks) > 1 else ""
            panel = replace(panel, y=ask.Kind("Draws"), title=title, legend="")
        panels.append(panel)
    return panels


def _limit_changes(ends: Sequence[float], axes: Any) -> None:
    """Limit the axis of the change to the ``ends`` of what is drawn, and to zero where it is near."""
    from matplotlib.ticker import MaxNLocator

    # Far from all changes zero would squeeze them into a few pixels.
    low = min(ends)
    high = max(ends)
    span = high - low or 1.0
    if low - 0.5 * span <= 0.0 <= high + 0.5 * span:
        axes.axvline(0.0, color=ask.BLACK, linewidth=0.8)
        low = min(low, 0.0)
        high = max(high, 0.0)
    axes.set_xlim(low - 0.08 * span, high + 0.08 * span)
    # Of more intervals, labels such as -98.85 would touch.
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.locator_params(axis="y", integer=True)


def _relative(baseline: ask.Floats, other: ask.Floats) -> ask.Floats:
    # In pairs: a draw that failed on one side says nothing about a change.
    both = np.isfinite(baseline) & np.isfinite(other) & (baseline != 0.0)
    return np.asarray(100.0 * (other[both] - baseline[both]) / np.abs(baseline[both]))
