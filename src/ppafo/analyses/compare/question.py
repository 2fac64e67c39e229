"""The question which configuration is better: its arguments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.arguments import Confidence, MaximumFailed, Name, Overrides, Seed, Tasks, Threads, Whole, Word, checked
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report

if TYPE_CHECKING:
    from ppafo.analyses.compare.answer import Compared
    from ppafo.report.finding import Finding
    from ppafo.simulation.scenario import Scenario
    from ppafo.studies.study import Study

Configured = Annotated[
    "Mapping[str, Scenario | str | Path] | Sequence[Scenario | str | Path]", Word("SCENARIO", is_repeated=True)
]
StudyLike = Annotated["Study | str | Path | Mapping[str, Any]", Word("STUDY", option="--study")]


@checked("configurations", "study", "tasks", "overrides")
def compare(
    configurations: Configured | None = None,
    *,
    study: StudyLike | None = None,
    tasks: Tasks = (),
    overrides: Overrides = (),
    baseline: Name | None = None,
    draws: Whole = 4096,
    seed: Seed | None = None,
    confidence: Confidence = 0.95,
    maximum_failed: MaximumFailed = 0.01,
    threads: Threads | None = None,
    check: bool = False,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Compared]:
    """Compare configurations, also over an uncertain device.

    All have common random numbers. ``configurations`` are scenarios by name (or a list of names, files or Scenario
    objects). Draws are randomised Sobol replicates whatever the study's sampling method; where a controller receives
    noise, each has a noise stream of its own, the same in all configurations, and without a study the noise alone is
    drawn. StudyError for bad input and where more than the fraction ``maximum_failed`` of a configuration's runs fails;
    fewer are left out in pairs.

    configurations: names of scenarios or .toml files; default: the configurations of --study
    study: study file that gives the distributions and, without SCENARIO, the configurations
    tasks: a task for all configurations, for example 'slow:reference.ramp_time=2 s'; default: as the scenarios are
        written
    baseline: configuration that all others are compared with; default: the first
    draws: draws of the uncertain values; default 4096
    check: end with exit code 1 where the loop of a nominal run oscillates
    plugins: modules of your own, files or names, whose objects files may name

    >>> import ppafo
    >>> compared = ppafo.compare(["torque-task-proportional", "torque-task-solenoid"]).found
    >>> (task,) = compared.tasks
    >>> [(case.configuration, f"{case.metrics['rms_error'].value:.3f} N m") for case in task.cases]
    [('torque-task-proportional', '0.869 N m'), ('torque-task-solenoid', '1.026 N m')]
    """
    name_plugins(plugins)
    from dataclasses import replace

    from ppafo.analyses.compare.answer import Case, Compared, finding_of, remarks_of
    from ppafo.analyses.compare.pairs import COMPARED, compared_metrics
    from ppafo.analyses.compare.solve import DEFAULT_SEED, drawn_runs, on_task, overrides_by_task
    from ppafo.arguments.words import taken_tasks
    from ppafo.errors import StudyError, nearest_name
    from ppafo.simulation.simulate import simulate_many
    from ppafo.studies.draws import (
        CONFIDENCE,
        FEWEST_DRAWS,
        MAXIMUM_DRAWS,
        Uncertainty,
        check_fraction,
        study_of,
        uncertainty_of,
    )
    from ppafo.studies.sampling import NOISE
    from ppafo.studies.study import choose_configurations, with_overrides
    from ppafo.study.runs import failures_of

    if not FEWEST_DRAWS <= draws <= MAXIMUM_DRAWS:
        raise StudyError(f"draws = {draws!r}: must be at least {FEWEST_DRAWS} and at most {MAXIMUM_DRAWS:,}")
    check_fraction(confidence, *CONFIDENCE)
    check_fraction(maximum_failed, "maximum_failed")
    known = study_of(study) if study is not None else None
    chosen = choose_configurations(configurations or None, known, overrides)
    names = [configuration.name for configuration in chosen]
    reference = names[0] if baseline is None else baseline
    if reference not in names:
        hint = nearest_name(reference, names)
        raise StudyError(f"baseline: no configuration '{reference}'{hint}; available: {', '.join(names)}")
    wanted = overrides_by_task(taken_tasks(tasks))
    scenarios = {
        (task, configuration.name): with_overrides(configuration.scenario, texts)
        for task, texts in wanted.items()
        for configuration in chosen
    }
    metrics = compared_metrics(scenarios.values())
    distributions = Uncertainty(()) if known is None or not known.paths else uncertainty_of(known)
    uncertainty = distributions.with_noise_of(scenarios.values())
    if seed is None:
        seed = DEFAULT_SEED if known is None else known.sample.seed
    drawn = drawn_runs(scenarios, metrics, known, uncertainty, draws, seed, maximum_failed, threads, progress)
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
                oscillation=result.oscillation if result.status.is_completed else None,
                failed_draws=0 if rows_of_case is None else failures_of(rows_of_case),
                reason=reason,
                scenario=scenario,
                rows=rows_of_case,
                renoised=renoised,
            )
        )
    comparison = Compared(
        units="SI: N m, kg, J; fractions from 0 to 1",
        configurations=names,
        baseline=reference,
        draws=draws if drawn else 0,
        seed=seed if drawn else 0,
        remarks=[],
        varied=[path for path in uncertainty.paths if path != NOISE],
        confidence=confidence,
        tasks=[on_task(task, texts, cases[task], reference, metrics, confidence) for task, texts in wanted.items()],
        metrics=metrics,
    )
    said = finding_of(replace(comparison, remarks=remarks_of(comparison)))
    steady = all(case.oscillation is None for of_task in cases.values() for case in of_task)
    return replace(said, passed=said.passed and steady) if check else said
