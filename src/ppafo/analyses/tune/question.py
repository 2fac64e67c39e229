"""The question which gains are best: its arguments."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.arguments import Overrides, Seed, Threads, Word, checked
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report

if TYPE_CHECKING:
    from ppafo.analyses.tune.problem import Problem
    from ppafo.analyses.tune.result import Tuned
    from ppafo.report.finding import Finding

TuningLike = Annotated["Problem | str | Path | Mapping[str, Any]", Word("TUNING")]


@checked
def tune(
    tuning: TuningLike,
    *,
    overrides: Overrides = (),
    seed: Seed | None = None,
    threads: Threads | None = None,
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
    name_plugins(plugins)
    from dataclasses import replace

    from ppafo.analyses.tune.answer import finding_of
    from ppafo.analyses.tune.problem import Problem, load_tuning
    from ppafo.analyses.tune.result import FRESH_DRAWS
    from ppafo.analyses.tune.solve import REFINEMENTS, crossed, judge, rows_of_gains, scales_of, search, setting_of
    from ppafo.errors import StudyError
    from ppafo.simulation.tracking.pair_step import warn_of_coarse_pairs
    from ppafo.studies.distributions import Floats
    from ppafo.studies.sampling import NOISE_DRAWS
    from ppafo.study.runs import RunCounter, Runs, with_companions

    if isinstance(tuning, Problem) and overrides:
        raise StudyError("a loaded Problem takes no overrides; give them to load_tuning")
    problem = tuning if isinstance(tuning, Problem) else load_tuning(tuning, overrides)
    if seed is not None:
        problem = replace(problem, effort=problem.effort.model_copy(update={"seed": seed}))
        # Noise alone follows the seed of the search; draws of a study keep the seed of the study.
        if problem.spread is not None and not problem.spread.study:
            problem = replace(problem, spread=replace(problem.spread, seed=seed))
    warn_of_coarse_pairs([problem.scenario])
    effort, spread = problem.effort, problem.spread
    candidates = effort.candidates_per_gain * len(problem.searched) * (effort.generations + 1) * effort.starts
    expected = candidates + REFINEMENTS * len(problem.searched) * effort.starts + 3
    if spread is not None:
        expected = spread.draws * expected + 2 * (FRESH_DRAWS + NOISE_DRAWS * spread.uncertainty.has_noise)
    metrics = with_companions(problem.metrics, problem.scenario)
    runs = Runs(problem.scenario, metrics, RunCounter(expected, progress), problem.gauge, threads)
    draws = {} if spread is None else spread.uncertainty.random_columns(0, spread.draws, spread.seed)
    scales = scales_of(problem, rows_of_gains(runs, problem, problem.before, draws))

    def costs(fractions: Floats) -> Floats:
        values = {gain.path: gain.value(fractions[:, column]) for column, gain in enumerate(problem.searched)}
        return judge(crossed(runs, problem, values, draws), problem, scales).cost

    before = [gain.fraction(gain.before) for gain in problem.searched]
    starts = search(costs, before, effort)
    first, last = (
        setting_of(runs, problem, scales, gains, draws)
        for gains in (problem.before, problem.gains(starts[0].fractions))
    )
    return finding_of(problem, scales, first, last, starts, runs.count)
