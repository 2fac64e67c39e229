"""Analyses: the paper again, studies, searches, linear models, designs and bottles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.cli.arguments import (
    Confidence,
    Count,
    Flow,
    Length,
    Mass,
    MaximumFailed,
    Metrics,
    Minutes,
    Name,
    Overrides,
    Pressure,
    Seed,
    Threads,
    Time,
    Torque,
    Whole,
    Word,
    fraction,
    point,
    task,
)

if TYPE_CHECKING:
    from ppafo.analyses.compare.answer import Compared
    from ppafo.analyses.design.front.answer import Design
    from ppafo.analyses.design.front.problem import DesignProblem
    from ppafo.analyses.design.profile.answer import Sizing
    from ppafo.analyses.design.profile.problem import SizingProblem
    from ppafo.analyses.design.wearer.wish import WearerSizing
    from ppafo.analyses.endurance.answer import Endurance, Endurances
    from ppafo.analyses.endurance.solve import GasUse
    from ppafo.analyses.find.solve import Threshold
    from ppafo.analyses.linearise.answer import LinearModel
    from ppafo.analyses.reproduce.answer import Reproduction, Studies
    from ppafo.analyses.sensitivity.solve import Influences
    from ppafo.analyses.sweep.results import StudyResults
    from ppafo.analyses.sweep.statistic import Estimate
    from ppafo.analyses.tune.answer import Tuned
    from ppafo.analyses.tune.problem import Problem
    from ppafo.progress import Report
    from ppafo.report.finding import Finding
    from ppafo.simulation.scenario import Scenario
    from ppafo.studies.study import Configurations, Study

StudyLike = Annotated["Study | str | Path | Mapping[str, Any]", Word("STUDY")]
DistributedStudy = Annotated[
    "Study | str | Path | Mapping[str, Any]",
    Word("STUDY", help="a study with distributions: a name, or a .toml file"),
]
ScenarioLike = Annotated["Scenario | str | Path", Word("SCENARIO", help="name of a scenario, or a .toml file")]
ConfigurationsLike = Annotated["Sequence[str] | Configurations", Word("SCENARIO", is_repeated=True)]
Tasks = Annotated[
    "Mapping[str, Sequence[str]] | Sequence[tuple[str, Sequence[str]]]",
    Word("NAME:PATH=VALUE[,PATH=VALUE]", task, option="--task", is_repeated=True),
]
DesignLike = Annotated["DesignProblem | SizingProblem | str | Path", Word("DESIGN")]
TuningLike = Annotated["Problem | str | Path | Mapping[str, Any]", Word("TUNING")]
Place = Annotated["str | Path", Word("DIR")]
Address = Annotated[str, Word("ADDRESS")]
Bottle = Annotated["str | Path", Word("BOTTLE")]
Method = Annotated[str, Word("sobol|shapley")]
Width = Annotated[str, Word("WIDTH")]
Range = Annotated[str, Word("PATH=LOW..HIGH", option="--vary")]
Condition = Annotated[str, Word("CONDITION", option="--such-that")]
Highest = Annotated[bool, Word(off="--lowest", help="find the lowest value (default)")]
Point = Annotated[float | str, Word("TIME", point)]
Fraction = Annotated[float, Word("FRACTION", fraction)]
Metric = Annotated[str, Word("NAME", option="--metric")]
Statistic = Annotated[str, Word("WORDS", option="--statistic")]
OneStudy = Annotated["Study | str | Path | Mapping[str, Any]", Word("STUDY", option="--study")]
Agreed = Annotated[bool, Word(option="--yes")]
GasUseLike = Annotated["GasUse | Sequence[GasUse]", Word("RECORDING", Path, is_repeated=True)]


def reproduce(
    *, study: Name = "ppafo-2011", overrides: Overrides = (), progress: Report | None = None
) -> Finding[Reproduction] | Finding[Studies]:
    """Reproduce the paper's experiments and check its claims.

    ``overrides`` change the experiments (not the paper's reported numbers): a path of a scenario reaches those that
    have it, a path of the device all of them. SimulationError where a run diverges, ScenarioError for a study that is
    none.

    study: publication to run again: a name, a .toml file of claims, or 'all'; default ppafo-2011, the paper
    """
    from ppafo.analyses.reproduce.solve import reproduce

    return reproduce(overrides, progress, study)


def sweep(
    study: StudyLike,
    *,
    out: Place | None = None,
    overrides: Overrides = (),
    draws: Count | None = None,
    seed: Seed | None = None,
    threads: Threads | None = None,
    scheduler: Address | None = None,
    agreed: Agreed = False,
    statistic: Statistic | None = None,
    metric: Metric | None = None,
    width: Width | None = None,
    also: Sequence[Name] = (),
    configuration: Name | None = None,
    first_draws: Count | None = None,
    confidence: Fraction | None = None,
    maximum_failed: Fraction | None = None,
    progress: Report | None = None,
) -> Finding[StudyResults] | Finding[Estimate]:
    """Run a study: many runs, one row each, resumable; or a statistic to a wanted precision.

    study: name of a study, or a .toml file
    out: folder or address for the results; default out/NAME with the name of the study
    draws: number of draws, instead of the number in the file; of a statistic the maximum, default 1,048,576
    scheduler: address of a Dask scheduler whose workers compute the chunks
    agreed: start even if the results will fill much of the disk
    statistic: draw until the interval of a statistic is narrow enough, and keep no rows: mean, 'quantile 0.95',
        'probability above 1.2 N m', 'probability below 0.5 g'
    metric: with --statistic: name of a metric, such as rms_error
    width: target width of the interval: '1 %' of the value (default), or '0.01 N m'; of a probability, 0.02
    also: a further metric, whose mean over the same draws is given; may be repeated
    configuration: configuration of the study, needed if it has several
    first_draws: draws before the first estimate; default 256
    confidence: confidence of the interval; default 95%
    maximum_failed: fraction of the runs that may fail before the statistic is refused; default 1%
    """
    from ppafo.analyses.sweep.solve import sweep_into_folder
    from ppafo.report.drawing import load_drawing

    # Before anything else imports Matplotlib, so that it comes without what it does for others.
    load_drawing()
    return sweep_into_folder(
        study,
        out,
        overrides,
        draws,
        seed,
        threads,
        scheduler,
        agreed,
        statistic,
        metric,
        width,
        also,
        configuration,
        first_draws,
        confidence,
        maximum_failed,
        progress,
    )


def compare(
    configurations: ConfigurationsLike | None = None,
    study: OneStudy | None = None,
    *,
    tasks: Tasks = (),
    overrides: Overrides = (),
    baseline: Name | None = None,
    draws: Whole = 4096,
    seed: Seed | None = None,
    confidence: Confidence = 0.95,
    maximum_failed: MaximumFailed = 0.01,
    threads: Threads | None = None,
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
    """
    from ppafo.analyses.compare.solve import compare

    return compare(
        configurations, study, tasks, overrides, baseline, draws, seed, confidence, maximum_failed, threads, progress
    )


def sensitivity(
    study: DistributedStudy,
    *,
    method: Method | None = None,
    metrics: Metrics = (),
    samples: Whole | None = None,
    configuration: Name | None = None,
    independent: bool = False,
    overrides: Overrides = (),
    seed: Seed | None = None,
    confidence: Confidence = 0.95,
    maximum_failed: MaximumFailed = 0.02,
    threads: Threads | None = None,
    progress: Report | None = None,
) -> Finding[Influences]:
    """Rank uncertain values by their influence: Sobol or Shapley indices, signed changes.

    Noise of the sensors is one of the values. StudyError for bad input, and where more than the fraction
    ``maximum_failed`` of the runs fails; of fewer, whole blocks are left out and counted.

    method: default: sobol, or shapley if values are correlated
    metrics: metric to analyse, may be repeated; default: the metrics of the study
    samples: number of base points (sobol, default 8192) or orders (shapley, 2048)
    configuration: configuration of the study, needed if it has several
    independent: ignore the correlations of the study
    """
    from ppafo.analyses.sensitivity.solve import sensitivity

    return sensitivity(
        study,
        method,
        metrics,
        samples,
        configuration,
        overrides,
        independent,
        seed,
        confidence,
        maximum_failed,
        threads,
        progress,
    )


def find(
    scenario: ScenarioLike,
    vary: Range,
    such_that: Condition,
    *,
    highest: Highest = False,
    grid: Count = 64,
    overrides: Overrides = (),
    threads: Threads | None = None,
    progress: Report | None = None,
) -> Finding[Threshold]:
    """Find the lowest or highest value that meets a condition on a metric.

    A grid of values over the range is run side by side; between the last one that does not meet the condition and the
    first one that does, the bracket is divided again and again down to 1e-6 of the range. What happens between two
    values of the grid on one side of the condition is not seen. StudyError or ScenarioError for bad input, and where
    every run fails.

    vary: a number of the scenario or its device, and its range, for example 'supply.pressure=20..90 psi_g'
    such_that: a metric, <= or >=, and a limit, for example 'final_error <= 0.3 N m'
    highest: find the highest value
    grid: number of evenly spaced values to try first; default 64
    """
    from ppafo.analyses.find.solve import find

    return find(scenario, vary, such_that, highest, grid, overrides, threads, progress)


def tune(
    tuning: TuningLike,
    *,
    overrides: Overrides = (),
    seed: Seed | None = None,
    threads: Threads | None = None,
    progress: Report | None = None,
) -> Finding[Tuned]:
    """Tune gains for an objective under constraints, optionally robust.

    Every generation is one ensemble, and every candidate sees the same draws. StudyError for bad input, and where a
    goal has no scale because the scenario as it is gives 0 or nothing.

    tuning: name of a tuning, or a .toml file
    """
    from ppafo.analyses.tune.solve import tune

    return tune(tuning, overrides, seed, threads, progress)


def linearise(
    scenario: ScenarioLike,
    *,
    at: Point = "equilibrium",
    overrides: Overrides = (),
) -> Finding[LinearModel]:
    """Make a linear model of the plant near one point, for control design.

    The equilibrium is the steady state whose torque is the last value of the reference, or, where the controller is a
    constant command, whose command is that one; the ankle stands where the run leaves it. Derivatives are exact.
    ScenarioError for a time outside the run, where there is no equilibrium, and for a valve that is on or off.

    at: a time of the run, such as '1.5 s', or 'equilibrium' (default): the steady state that holds the last value of
        the reference
    """
    from ppafo.analyses.linearise.solve import linearise

    return linearise(scenario, at, overrides)


def design(
    problem: DesignLike | None = None,
    *,
    seed: Seed | None = None,
    threads: Threads | None = None,
    mass: Mass | None = None,
    stature: Length | None = None,
    torque: Torque | None = None,
    pressure: Pressure | None = None,
    minutes: Minutes | None = None,
    toes: Length | None = None,
    catalogue: Annotated[str | Path, Word("FILE")] | None = None,
    progress: Report | None = None,
) -> Finding[Design] | Finding[Sizing] | Finding[WearerSizing]:
    """Find a device: for a wearer, for a torque profile, or Pareto-optimal in error, gas and mass.

    A wearer has a body mass and may have a stature; torque, pressure and minutes of walking are what the device is for,
    and the toes have to clear the ground.
    StudyError or ParameterError for bad input, and where every run with a valve fails.

    problem: name of a design file, or a .toml file
    mass: body mass of the wearer, '72.5 kg'
    stature: height of the wearer, '1.75 m'; default: of a body mass index of 22 kg/m^2
    torque: peak torque of push-off, '2.5 N m'
    pressure: supply pressure, '50 psi_g'
    minutes: minutes of walking on one bottle
    toes: lowest height of the toes in mid-swing; default: '1 cm', or the healthy gait's own where that is less
    catalogue: a .toml file with parts of your own; default: the catalogue of the package
    """
    from ppafo.analyses.design.solve import design

    return design(problem, seed, threads, mass, stature, torque, pressure, minutes, toes, catalogue, progress)


def bottle(
    recordings: GasUseLike = (),
    *,
    gas_per_stride: Mass | None = None,
    stride_time: Time | None = None,
    peak_flow: Flow | None = None,
    bottle: Bottle | None = None,
    walk: Time | None = None,
    rest: Time | None = None,
    longest: Time = 86400.0,
    overrides: Overrides = (),
) -> Finding[Endurance] | Finding[Endurances]:
    """Compute how long a bottle of gas lasts, and why it ends.

    A walk, its result or its folder, walks on the bottle until that ends it. Any other gas use is in
    ``recordings``, or else ``gas_per_stride`` every ``stride_time`` with at most ``peak_flow``. ``overrides`` are texts
    such as ``room.temperature=5 degC``. ParameterError or DataError for bad input, SimulationError where the solver
    fails.

    recordings: a .csv or .nc file with supplied_mass, or the result folder of a run or a walk; repeated until the
        bottle ends; several are compared side by side
    gas_per_stride: gas per stride, for example '0.3 g'
    stride_time: time of one stride; default: '1.1 s', the whole recording, one stride of a walk, or its task sequence
    peak_flow: largest flow, for example '4.5 g/s'; default: the mean flow
    bottle: name of a bottle or a .toml file; default: the walk's, or the paper's bottle
    walk: time of walking between two rests, with --rest; default '10 min'
    rest: time of each rest; default '0 s' (no rest)
    longest: maximum simulated time; default '1440 min'
    """
    from ppafo.analyses.endurance.solve import endurance

    return endurance(recordings, gas_per_stride, stride_time, peak_flow, bottle, walk, rest, longest, overrides)
