"""Influence of uncertain values on metrics: Sobol or Shapley indices and signed changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.arguments import (
    Confidence,
    Executor,
    MaximumFailed,
    Metrics,
    Name,
    Overrides,
    Seed,
    Threads,
    Whole,
    Word,
    checked,
)
from ppafo.errors import StudyError
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report
from ppafo.units.shown import shown_in
from ppafo.wording import known_names

if TYPE_CHECKING:
    from ppafo.analyses.sensitivity.methods import Influences
    from ppafo.report.finding import Finding
    from ppafo.studies.study import Study

DistributedStudy = Annotated[
    "Study | str | Path | Mapping[str, Any]", Word("STUDY", help="a study with distributions: a name, or a .toml file")
]
MethodName = Annotated[str, Word("sobol|shapley")]


@checked
def sensitivity(
    study: DistributedStudy,
    *,
    method: MethodName | None = None,
    metrics: Metrics = (),
    samples: Whole | None = None,
    configuration: Name | None = None,
    independent: bool = False,
    overrides: Overrides = (),
    seed: Seed | None = None,
    confidence: Confidence = 0.95,
    maximum_failed: MaximumFailed = 0.02,
    threads: Threads | None = None,
    executor: Executor | None = None,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Influences]:
    """Rank uncertain values by their influence: Sobol or Shapley indices, signed changes.

    Sensor noise counts as one of the values. A block of the sample with a failed run is left out and counted.

    Arguments:
        study: a study with distributions: a name, or a .toml file
        method: default: sobol, or shapley if values are correlated
        metrics: metric to analyse, may be repeated; default: the metrics of the study
        samples: number of base points (sobol, default 8192) or orders (shapley, 2048)
        configuration: configuration of the study, needed if it has several
        independent: ignore the correlations of the study
        overrides: values to change, for example 'valve.area=12.6 mm^2'; may be repeated
        seed: random seed; default: the file's
        confidence: confidence of all intervals; default 95%
        maximum_failed: fraction of the runs that may fail before the study is refused; default 2%
        threads: number of threads; default: all cores
        executor: an Executor of concurrent.futures, such as a cluster's, or the MODULE:OBJECT of one; default: this
            process
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is the Influences: indices with bands of every metric

    Raises:
        StudyError: a study that cannot be used, and more than ``maximum_failed`` of its runs fail

    >>> import ppafo
    >>> study, choice = "torque-task-uncertainty", {"configuration": "solenoid", "metrics": "rms_error"}
    >>> print(ppafo.sensitivity(study, samples=64, **choice).said[0])
    torque-task-uncertainty, solenoid: shapley, 64 orders, 1,152 runs of 7 uncertain values; bands with 95 %
    confidence
    """
    name_plugins(plugins)
    from ppafo.analyses.sensitivity.methods import DEFAULT_SAMPLES, METHODS, analyse, finding_of
    from ppafo.simulation.gains import remark_on_following_gains
    from ppafo.studies.loading import drawn_in
    from ppafo.study.executing import executor_of
    from ppafo.study.runs import RunCounter, scenario_runs

    if method is not None and method not in METHODS:
        raise StudyError(f"there is no method '{method}'{known_names(method, METHODS)}")
    chosen, base, used = drawn_in(study, overrides, configuration, independent)
    # Sobol indices of correlated values mean nothing; Shapley effects take more runs for the same bands.
    by = METHODS[method or ("sobol" if used.scores is None else "shapley")]
    requested = tuple(metrics) or chosen.outputs.metrics
    if not requested:
        raise StudyError(f"the outputs of study '{chosen.name}' have no metric; name the metric to analyse")
    count = DEFAULT_SAMPLES[by.name] if samples is None else samples
    tally = RunCounter(count * by.block_rows(len(used.drawn)), progress)
    runs = scenario_runs(base.scenario, requested, tally, used.gauge, threads, executor_of(executor))
    with shown_in(chosen.shown_for(base.scenario)):
        seed = chosen.sample.seed if seed is None else seed
        found = analyse(runs, used, by, count, requested, seed, confidence, maximum_failed)
        gains = remark_on_following_gains(base.scenario, used.paths), base.scenario.origin.replaced
        finding = finding_of(replace(found, study=f"{chosen.name}, {base.name}", gains=gains))
        return replace(finding, overrides=chosen.changes)
