"""Configurations side by side: each as it is, and all of them over the same uncertain values."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ppafo.analyses.compare.answer import Case, Compared, OnTask, finding_of, front_of, remarks_of
from ppafo.analyses.compare.pairs import COMPARED, Paired, best_probabilities, compare_pairs, compared_metrics
from ppafo.errors import StudyError, first_twice, nearest_name
from ppafo.progress import Report
from ppafo.report.finding import Finding
from ppafo.report.kind import Interval
from ppafo.running import oscillation
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate_many
from ppafo.studies.draws import (
    CONFIDENCE,
    FEWEST_DRAWS,
    MAXIMUM_DRAWS,
    Uncertainty,
    check_fraction,
    study_of,
    uncertainty_of,
    with_new_noise,
)
from ppafo.studies.sampling import NOISE
from ppafo.studies.study import Configurations, Study, choose_configurations, with_overrides
from ppafo.studies.varying import value_at
from ppafo.study.runs import Rows, Runs, Tally, failures_of, unvaried

AS_WRITTEN = "as written"
"""What the task of a configuration is called where no other is requested."""
DEFAULT_SEED = 1
_SAME = 1.0e-9
"""Values that differ by less than this fraction are one."""
Source = Study | str | Path | Mapping[str, Any]


def compare(
    configurations: Configurations | None = None,
    study: Source | None = None,
    tasks: Mapping[str, Sequence[str]] | Sequence[tuple[str, Sequence[str]]] = (),
    overrides: Sequence[str] = (),
    baseline: str | None = None,
    draws: int = 4096,
    seed: int | None = None,
    confidence: float = 0.95,
    maximum_failed: float = 0.01,
    threads: int | None = None,
    progress: Report | None = None,
) -> Finding[Compared]:
    """Compare configurations on tasks, and over the distributions of a study with common random numbers.

    ``study`` is a study file, name or Study, whose distributions hold in all configurations. ``tasks`` has overrides by
    name, such as ``{"slow": ["reference.ramp_time=2 s"]}``; ``overrides`` change every configuration. The rest is as
    ``ppafo.compare`` describes it.
    """
    if not FEWEST_DRAWS <= draws <= MAXIMUM_DRAWS:
        raise StudyError(f"draws = {draws!r}: must be at least {FEWEST_DRAWS} and at most {MAXIMUM_DRAWS:,}")
    check_fraction(confidence, *CONFIDENCE)
    check_fraction(maximum_failed, "maximum_failed")
    known = study_of(study) if study is not None else None
    chosen = choose_configurations(configurations or None, known, overrides)
    names = [item.name for item in chosen]
    reference = names[0] if baseline is None else baseline
    if reference not in names:
        hint = nearest_name(reference, names)
        raise StudyError(f"baseline: no configuration '{reference}'{hint}; available: {', '.join(names)}")
    wanted = _tasks(tasks)
    scenarios = {
        (task, item.name): with_overrides(item.scenario, texts) for task, texts in wanted.items() for item in chosen
    }
    metrics = compared_metrics(scenarios.values())
    distributions = Uncertainty(()) if known is None or not known.paths else uncertainty_of(known)
    uncertainty = distributions.with_noise_of(scenarios.values())
    if seed is None:
        seed = DEFAULT_SEED if known is None else known.sample.seed
    drawn = _runs(scenarios, metrics, known, uncertainty, draws, seed, maximum_failed, threads, progress)
    # The nominal devices too, with the seed of each scenario: what the tables call nominal is one realisation.
    results = simulate_many(list(scenarios.values()), threads)
    cases: dict[str, list[Case]] = {task: [] for task in wanted}
    for ((task, name), scenario), result in zip(scenarios.items(), results, strict=True):
        rows_of_case, renoised, reason = drawn.get((task, name), (None, None, ""))
        cases[task].append(
            Case(
                configuration=name,
                status=result.status,
                metrics={name: metric for name, metric in result.metrics.items() if name in COMPARED},
                oscillation=oscillation(result) if result.status.is_completed else None,
                failed_draws=0 if rows_of_case is None else failures_of(rows_of_case),
                reason=reason,
                scenario=scenario,
                rows=rows_of_case,
                renoised=renoised,
            )
        )
    found = Compared(
        units="SI: N m, kg, J; fractions from 0 to 1",
        configurations=names,
        baseline=reference,
        draws=draws if drawn else 0,
        seed=seed if drawn else 0,
        remarks=[],
        varied=[path for path in uncertainty.paths if path != NOISE],
        confidence=confidence,
        tasks=[_on_task(task, texts, cases[task], reference, metrics, confidence) for task, texts in wanted.items()],
        metrics=metrics,
    )
    return finding_of(replace(found, remarks=remarks_of(found)))


def _tasks(tasks: Mapping[str, Sequence[str]] | Sequence[tuple[str, Sequence[str]]]) -> dict[str, Sequence[str]]:
    """Return the overrides of each task by its name; as the scenarios are written where there is none."""
    pairs = list(tasks.items() if isinstance(tasks, Mapping) else tasks) or [(AS_WRITTEN, ())]
    repeated = first_twice([name for name, _ in pairs])
    if repeated is not None:
        raise StudyError(f"there are two tasks named '{repeated}'; give each its own name")
    return dict(pairs)


Scenarios = Mapping[tuple[str, str], Scenario]
"""Scenarios by task and configuration."""
_Drawn = tuple[Rows, Rows | None, str]
"""The runs of a case over the draws, the first of them again with other noise, and why the first failed."""


def _runs(
    scenarios: Scenarios,
    metrics: Sequence[str],
    study: Study | None,
    uncertainty: Uncertainty,
    draws: int,
    seed: int,
    maximum_failed: float,
    threads: int | None,
    progress: Report | None,
) -> dict[tuple[str, str], _Drawn]:
    """Return the runs of every case, all over the same draws; nothing where nothing is drawn."""
    if not uncertainty.drawn:
        return {}
    if study is not None:
        _check_same(study, scenarios)
    columns = uncertainty.replicated_columns(0, draws, seed)
    again = with_new_noise(columns) if uncertainty.has_noise else {}
    tally = Tally((draws + len(again.get(NOISE, ()))) * len(scenarios), progress)
    found: dict[tuple[str, str], _Drawn] = {}
    for (task, name), scenario in scenarios.items():
        runs = Runs(scenario, metrics, tally, uncertainty.gauge, threads)
        # The noise is in all configurations, whatever a study says of its paths.
        own = [path for path in columns if study is None or path == NOISE or study.varies(path, name)]
        rows = runs.run({path: columns[path] for path in own} or unvaried(scenario, draws))
        runs.check(rows, maximum_failed, f"configuration '{name}', task '{task}'")
        reason = runs.reason
        found[task, name] = rows, runs.run({path: again[path] for path in own}) if again else None, reason
    return found


def _check_same(study: Study, scenarios: Scenarios) -> None:
    """Refuse cases that differ in a value that the study draws for all of them: the difference would not count."""
    # Orifices of different valves are meant to differ: what the study draws replaces each one's own.
    for path in (path for path in study.paths if not path.startswith("valve.") and path != NOISE):
        own = [value_at(path, scenario) for (_, name), scenario in scenarios.items() if study.varies(path, name)]
        values = [value for value in own if value is not None]
        lowest, highest = min(values, default=0.0), max(values, default=0.0)
        if highest - lowest > _SAME * max(abs(lowest), abs(highest)):
            raise StudyError(
                f"the study draws '{path}' for every configuration, so the different values of the configurations "
                f"({lowest:.6g} and {highest:.6g} in SI units) would be ignored; use a study that does not draw it"
            )


def _on_task(
    task: str, overrides: Sequence[str], cases: list[Case], baseline: str, metrics: Sequence[str], confidence: float
) -> OnTask:
    """Return the cases of a task with their statistics."""
    first = next(case for case in cases if case.configuration == baseline)
    pairs: dict[str, list[Paired]] = {case.configuration: [] for case in cases if case is not first}
    for other in cases:
        if other is first or first.rows is None or other.rows is None:
            continue
        for name in metrics:
            again = None
            if first.renoised is not None and other.renoised is not None:
                again = (first.renoised[name], other.renoised[name])
            found = compare_pairs(name, first.rows[name], other.rows[name], COMPARED[name], confidence, again)
            pairs[other.configuration] += [] if found is None else [found]
    best: dict[str, dict[str, Interval]] = {}
    judged = [case for case in cases if case.oscillation is None]
    rows = [case.rows for case in judged if case.rows is not None]
    for name in metrics if rows else ():
        if COMPARED[name]:
            # All at once: no pair says which of three is the best.
            shares = best_probabilities([each[name] for each in rows], COMPARED[name], confidence)
            best[name] = dict(zip([case.configuration for case in judged], shares, strict=False))
    return OnTask(task, list(overrides), cases, front_of(cases), pairs, best)
