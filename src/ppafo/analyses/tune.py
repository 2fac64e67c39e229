"""Search for gains by an objective under constraints: the question; ``tuning`` has its file, search and report."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.arguments import Executor, Overrides, Seed, Threads, Word, checked
from ppafo.plugins import Plugins
from ppafo.progress import Report

if TYPE_CHECKING:
    from ppafo.analyses.tuning import Problem, Tuned
    from ppafo.report.finding import Finding

TuningLike = Annotated["Problem | str | Path | Mapping[str, Any]", Word("TUNING")]


@checked
def tune(
    tuning: TuningLike,
    *,
    overrides: Overrides = (),
    seed: Seed | None = None,
    threads: Threads | None = None,
    executor: Executor | None = None,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Tuned]:
    """Tune gains for an objective under constraints, optionally robust.

    Every generation is one ensemble, and every candidate sees the same draws.

    Arguments:
        tuning: name of a tuning, or a .toml file
        overrides: values to change, for example 'valve.area=12.6 mm^2'; may be repeated
        seed: random seed; default: the file's
        threads: number of threads; default: all cores
        executor: an Executor of concurrent.futures, such as a cluster's, or the MODULE:OBJECT of one; default: this
            process
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is a Tuned: the gains found and the objective before and after

    Raises:
        StudyError: a tuning that cannot be used, and a goal without a scale because the scenario as it is gives 0 or
            nothing

    >>> import ppafo
    >>> print(ppafo.tune("pid-gains").said[0])
    pid-gains: objective 1 before, 0.008313 after (-99.2 %)
    """
    from dataclasses import replace

    from ppafo.analyses.tuning import Problem, load_tuning, solve_tuning
    from ppafo.errors import StudyError
    from ppafo.study.executing import executor_of

    if isinstance(tuning, Problem) and overrides:
        raise StudyError("overrides: not allowed with a loaded Problem; give them to load_tuning")
    problem = tuning if isinstance(tuning, Problem) else load_tuning(tuning, overrides)
    if seed is not None:
        # Noise alone follows the seed of the search; draws of a study keep the seed of the study.
        effort = replace(problem.effort, seed=seed)
        problem = replace(problem, effort=effort, seed=seed if problem.robust is None else problem.seed)
    return solve_tuning(problem, threads, progress, executor_of(executor))
