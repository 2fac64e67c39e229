"""Public function ``compare``: arguments of a comparison of configurations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.arguments import Confidence, MaximumFailed, Name, Overrides, Seed, Tasks, Threads, Whole, Word, checked
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report

if TYPE_CHECKING:
    from ppafo.analyses.compare.answer import ComparisonResult
    from ppafo.report.finding import Finding
    from ppafo.simulation.scenario import Scenario
    from ppafo.studies.study import Study

Configured = Annotated[
    "Mapping[str, Scenario | str | Path] | Sequence[Scenario | str | Path]", Word("SCENARIO", is_repeated=True)
]
StudyLike = Annotated["Study | str | Path | Mapping[str, Any]", Word("STUDY", option="--study")]


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
        a Finding whose ``found`` is a ComparisonResult: per task the cases with their metrics, and the differences
        from the baseline

    Raises:
        StudyError: a study or a configuration that cannot be used, and more than ``maximum_failed`` of its runs fail

    >>> import ppafo
    >>> compared = ppafo.compare(["torque-task-proportional", "torque-task-solenoid"]).found
    >>> (task,) = compared.tasks
    >>> [(case.configuration, f"{case.metrics['rms_error'].value:.3f} N m") for case in task.cases]
    [('torque-task-proportional', '0.869 N m'), ('torque-task-solenoid', '1.026 N m')]
    """
    name_plugins(plugins)
    from dataclasses import replace

    from ppafo.analyses.compare.answer import finding_of
    from ppafo.analyses.compare.solve import DEFAULT_DRAWS, DrawSettings, compared
    from ppafo.arguments.conversion import taken_tasks
    from ppafo.errors import StudyError
    from ppafo.studies.draws import FEWEST_DRAWS, MAXIMUM_DRAWS, study_of
    from ppafo.studies.limits import CONFIDENCE, check_fraction
    from ppafo.studies.study import changes_of, choose_configurations
    from ppafo.units.shown import shown_in

    count = DEFAULT_DRAWS if draws is None else draws
    if not FEWEST_DRAWS <= count <= MAXIMUM_DRAWS:
        raise StudyError(f"draws = {count!r}: must be at least {FEWEST_DRAWS} and at most {MAXIMUM_DRAWS:,}")
    check_fraction(confidence, *CONFIDENCE)
    check_fraction(maximum_failed, "maximum_failed")
    settings = DrawSettings(count, draws is None, seed, confidence, maximum_failed, threads, progress)
    loaded = study_of(study) if study is not None else None
    chosen = choose_configurations(configurations or None, loaded, overrides)
    comparison = compared(chosen, baseline, taken_tasks(tasks), loaded, settings)
    device, of_study = comparison.tasks[0].cases[0].scenario, None if configurations else loaded
    with shown_in(device.device.shown if loaded is None else loaded.shown_for(device)):
        finding = replace(finding_of(comparison), overrides=changes_of(chosen, of_study, overrides))
    if not check:
        return finding
    is_steady = all(case.follows for task in comparison.tasks for case in task.cases)
    return replace(finding, passed=finding.passed and is_steady)
