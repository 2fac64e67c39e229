"""Influence of uncertain values on metrics: Sobol or Shapley indices and signed changes, for growing sample sizes.

Failed runs: the analysis is refused if more than a given fraction of all runs has no value, because the indices would
describe only the remaining ones. Otherwise every block (base point or order) with such a run is left out and counted,
since the formulas need complete blocks; the indices then hold for values at which the model runs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
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
from ppafo.linear_algebra import on_one_thread
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report
from ppafo.units.shown import shown_in
from ppafo.wording import argument_text, known_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ppafo.analyses.sensitivity.methods import EvaluatedBlocks, Indices, Method
    from ppafo.report.finding import Finding, Section
    from ppafo.report.panels import Panel
    from ppafo.simulation.scenario import Scenario
    from ppafo.studies.distributions import Floats
    from ppafo.studies.draws import Uncertainty
    from ppafo.studies.study import Study
    from ppafo.study.runs import Runs

DistributedStudy = Annotated[
    "Study | str | Path | Mapping[str, Any]", Word("STUDY", help="a study with distributions: a name, or a .toml file")
]
MethodName = Annotated[str, Word("sobol|shapley")]
_ENDS = (0.05, 0.95)
"""Quantiles of a varied value between which the change of a metric is computed."""
DEFAULT_SAMPLES = {"sobol": 8192, "shapley": 2048}
"""Default number of blocks by method: tens of thousands of runs for a few values."""
_FEWEST_WHOLE = 4
"""Smallest number of complete blocks for an estimate."""
_SIZES = 6
"""Number of sample sizes at which the indices are shown: all blocks, and repeated halves."""
_NEGLIGIBLE = 0.01
"""Fraction of the largest index below which the influence of a value counts as negligible."""
_INCHES_OF_A_BAR = 0.27
"""Height of the row of a varied value in a panel [inches]."""
_MAXIMUM_LINES = 5
"""Number of varied values whose indices are plotted over the sample size."""
_MOST_SIZES = 3
"""Largest number of sample sizes with a tick, whose labels would run together if there were more."""
_TITLES = {"total": "total", "first": "first order", "shapley": "Shapley effect"}
_CAPTION = (
    "Left: indices with confidence bands, {filled} filled{open}. Right: convergence of the largest indices with the "
    "sample size, in the colours and markers of the left panel.{settings}"
)


@dataclass(frozen=True, slots=True)
class MetricSensitivity:
    """Sensitivity of a metric at growing sample sizes.

    ``mean``, ``standard_deviation``: over all runs [SI]
    ``change_from_5_to_95_percent``: signed change of the metric from the 5 to the 95 % quantile of each value [SI], nan
        for noise
    ``band_of_change``: half width of the band of this change [SI]
    ``settling``: indices at growing sample sizes; the last is the result
    """

    metric: str
    mean: float
    standard_deviation: float
    runs_without_value: int
    change_from_5_to_95_percent: list[float]
    band_of_change: list[float]
    settling: list[Indices]

    @property
    def indices(self) -> Indices:
        """Sensitivity indices of the metric from all blocks."""
        return self.settling[-1]

    @property
    def dropped_blocks(self) -> int:
        """Number of blocks left out because of a failed run."""
        return self.indices.blocks - self.indices.used


@dataclass(frozen=True, slots=True)
class Influences:
    """Sensitivity indices of metrics with respect to uncertain values.

    ``samples``, ``noun``, ``seed``: number of blocks of the sample, their name, and random seed
    ``confidence``: confidence level of the bands
    ``maximum_failed``: fraction of the runs above which failures are refused
    ``paths``: paths of the uncertain values
    ``runs``, ``failed``: number of runs, and of failed runs
    ``not_following``: number of completed runs that do not follow their reference
    ``constant``: metrics that no value influences, with the number that they are in every run [SI]
    ``gains``: remarks on controller gains that follow the uncertain values or are kept from another kind; or empty
    """

    study: str
    method: str
    noun: str
    samples: int
    seed: int
    confidence: float
    maximum_failed: float
    paths: list[str]
    runs: int
    failed: int
    not_following: int
    metrics: list[MetricSensitivity]
    constant: dict[str, float]
    gains: tuple[str, ...] = ()


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
    from ppafo.analyses.sensitivity.methods import METHODS
    from ppafo.simulation.tracking.pair_step import warn_of_coarse_pairs
    from ppafo.studies.draws import drawn_in
    from ppafo.study.executing import executor_of
    from ppafo.study.runs import RunCounter, scenario_runs, with_companions

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
    warn_of_coarse_pairs([base.scenario])
    companions = with_companions(requested, base.scenario)
    runs = scenario_runs(base.scenario, companions, tally, used.gauge, threads, executor_of(executor))
    with shown_in(chosen.shown_for(base.scenario)):
        found = analyse(
            runs,
            used,
            by,
            count,
            seed=chosen.sample.seed if seed is None else seed,
            confidence=confidence,
            maximum_failed=maximum_failed,
            study=f"{chosen.name}, {base.name}",
            scenario=base.scenario,
            metrics=requested,
        )
        return replace(finding_of(found), overrides=chosen.changes)


@on_one_thread
def analyse(
    runs: Runs,
    uncertainty: Uncertainty,
    method: Method,
    samples: int,
    *,
    seed: int = 1,
    confidence: float = 0.95,
    maximum_failed: float = 0.02,
    study: str = "",
    scenario: Scenario | None = None,
    metrics: Sequence[str] = (),
) -> Influences:
    """Return the sensitivity indices of metrics.

    ``scenario`` is the scenario of the runs, None for a model; ``metrics`` are the metrics to analyse, () for all.
    Raises StudyError for invalid settings, dependent values or too many failures.
    """
    import numpy as np

    from ppafo.analyses.sensitivity.methods import EvaluatedBlocks
    from ppafo.simulation.gains import remark_on_following_gains
    from ppafo.simulation.numbers import NOISE_SEED
    from ppafo.studies.limits import CONFIDENCE, check_fraction
    from ppafo.study.runs import tracking_violation

    if uncertainty.scores is not None and not method.takes_dependent:
        raise StudyError(
            f"sensitivity: {method.name} assumes independent values, but the study has [[correlations]]; use "
            f"{argument_text('method', 'shapley')}, or ignore the correlations with {argument_text('independent')}"
        )
    if len(uncertainty.drawn) < 2:
        raise StudyError("sensitivity: the study has only one uncertain value; vary two or more")
    if not method.fewest <= samples <= method.most:
        raise StudyError(f"samples = {samples}: {method.name} needs {method.fewest} to {method.most:,} {method.noun}")
    if seed < 0:
        raise StudyError(f"seed = {seed}: must be 0 or more")
    check_fraction(confidence, *CONFIDENCE)
    check_fraction(maximum_failed, "maximum_failed")
    # Checked before anything runs: a design takes thousands of runs.
    design = method.design(uncertainty, samples, seed)
    columns = uncertainty.columns(design)
    rows = runs.run(columns)
    requested = tuple(metrics) or runs.metrics
    runs.check(rows, maximum_failed, "sensitivity", requested)
    values = {name: rows[name] for name in requested}
    constant = {name: float(np.nanmin(each)) for name, each in values.items() if np.nanmin(each) == np.nanmax(each)}
    if len(constant) == len(values):
        said = ", ".join(f"'{name}' is {number:g}" for name, number in constant.items())
        raise StudyError(f"sensitivity: {said} in every run, so no value influences it; choose another metric")
    ends = np.array([number.distribution.values(np.array(_ENDS)) for number in uncertainty.drawn]).T
    # A seed has no order: from its 5 to its 95 % quantile nothing changes.
    ends[:, [path == NOISE_SEED for path in uncertainty.paths]] = np.nan
    inputs = np.stack([columns[path] for path in uncertainty.paths], axis=1)
    blocks = np.repeat(np.arange(samples), design.shape[0] // samples)
    # The design of all metrics, without the values of one.
    evaluated = EvaluatedBlocks(inputs=inputs, values=np.empty(0), blocks=blocks, ends=ends, seed=seed)
    off = 0 if scenario is None else np.count_nonzero(tracking_violation(rows, scenario, columns, uncertainty.gauge))
    return Influences(
        study=study,
        method=method.name,
        noun=method.noun,
        samples=samples,
        seed=seed,
        confidence=confidence,
        maximum_failed=maximum_failed,
        paths=list(uncertainty.paths),
        runs=runs.count,
        failed=runs.failures,
        not_following=int(off),
        metrics=[
            _metric_sensitivity(name, each, evaluated, method, samples, confidence)
            for name, each in values.items()
            if name not in constant
        ],
        constant=constant,
        gains=()
        if scenario is None
        else (remark_on_following_gains(scenario, uncertainty.paths), scenario.origin.replaced),
    )


def _metric_sensitivity(
    name: str, values: Floats, design: EvaluatedBlocks, method: Method, samples: int, confidence: float
) -> MetricSensitivity:
    """Return the sensitivity of a metric with ``values`` (rows,), for growing parts of the sample.

    Raises StudyError if too few blocks are complete.
    """
    import numpy as np

    from ppafo.analyses.sensitivity.methods import changes

    known = np.isfinite(values)
    # The formulas need whole blocks: one run without a value takes its block with it.
    is_whole = np.all(known.reshape(samples, -1), axis=1)
    # All blocks, and halves, and halves of halves, as far as they say something: many of the first may be left out, and
    # a metric that counts may be the same in all.
    halved = {samples >> halvings for halvings in range(_SIZES)}
    sizes = []
    for size in sorted({size for size in halved if size >= method.fewest} | {samples}):
        complete = values.reshape(samples, -1)[:size][is_whole[:size]]
        if len(complete) >= _FEWEST_WHOLE and float(np.ptp(complete)) > 0.0:
            sizes.append(size)
    if samples not in sizes:
        raise StudyError(
            f"sensitivity: only {int(np.count_nonzero(is_whole)):,} of {is_whole.size:,} {method.noun} "
            f"have '{name}' in all their runs; use more samples, or correct the runs that fail"
        )

    def part(members: Any) -> EvaluatedBlocks:
        """Return some blocks of the design with the values of the metric."""
        rows = np.isin(design.blocks, members)
        return replace(design, inputs=design.inputs[rows], values=values[rows], blocks=members)

    settling = []
    for size in sizes:
        complete_blocks = np.flatnonzero(is_whole[:size])
        estimated = method.indices(part(complete_blocks), confidence)
        settling.append(replace(estimated, blocks=size, used=complete_blocks.size))
    change, band = changes(part(np.flatnonzero(is_whole)), confidence)
    return MetricSensitivity(
        metric=name,
        mean=float(np.mean(values[known])),
        standard_deviation=float(np.std(values[known], ddof=1)),
        runs_without_value=int(np.count_nonzero(~known)),
        change_from_5_to_95_percent=change.tolist(),
        band_of_change=band.tolist(),
        settling=settling,
    )


def finding_of(influences: Influences) -> Finding[Influences]:
    """Return the sensitivity indices as a finding, with a table and two panels for each metric."""
    from ppafo.report.finding import Finding, Section
    from ppafo.report.kind import of_metric

    shown = list(influences.metrics[0].indices.values)
    sentences = [
        f"{influences.study}: {influences.method}, {influences.samples:,} {influences.noun}, {influences.runs:,} "
        f"runs of {len(influences.paths)} uncertain values; bands with {100.0 * influences.confidence:g} % confidence",
        f"{influences.failed:,} runs failed; up to {100.0 * influences.maximum_failed:g} % are allowed, and every "
        f"{influences.noun[:-1]} with a failed run is left out",
    ]
    if influences.not_following:
        sentences.append(
            f"in {influences.not_following:,} runs the reference is not followed; the indices include these runs"
        )
    for name, number in influences.constant.items():
        sentences.append(f"{name} is {of_metric(name).text(number)} in every run: no value influences it")
    sentences += filter(None, influences.gains)
    figure = Section(
        "Indices and their convergence",
        panels=partial(_panels, influences),
        name="sensitivity",
        caption=_CAPTION.format(
            filled=_TITLES[shown[0]],
            open="".join(f", {_TITLES[name]} open" for name in shown[1:]),
            settings=" Settings of the controller are recomputed in every run." if any(influences.gains[:1]) else "",
        ),
        across=2,
        size=(3.0, max(2.5, 0.9 + _INCHES_OF_A_BAR * len(influences.paths))),
        title=f"Sensitivity of {influences.study}",
        is_detail=True,
    )
    return Finding(
        name="sensitivity",
        kicker="Sensitivity",
        title=f"Sensitivity of {influences.study}",
        said=tuple(sentences),
        parts=(*(_part(influences, metric) for metric in influences.metrics), figure),
        found=influences,
    )


def _part(influences: Influences, metric: MetricSensitivity) -> Section:
    """Return a table with a row for each uncertain value, the most influential first, with remarks."""
    import numpy as np

    from ppafo.report.finding import Column, Section
    from ppafo.report.kind import of_metric

    kind, indices = of_metric(metric.metric, "+.3g"), metric.indices
    order = np.argsort(-indices.ranking)
    columns = [Column("value", [influences.paths[row] for row in order])]
    for name, values in indices.values.items():
        columns.append(Column(_TITLES[name], [f"{round(values[row], 3) + 0.0:.3f}" for row in order]))
        columns.append(Column("band", [f"± {indices.bands[name][row]:.3f}" for row in order]))
    change, band = metric.change_from_5_to_95_percent, metric.band_of_change
    ends = [None if math.isnan(change[row]) else f"± {kind.change_number(band[row], '.2g')}" for row in order]
    change_cells = [None if math.isnan(change[row]) else change[row] for row in order]
    columns += [Column("change, 5 to 95 %", change_cells, kind, is_change=True), Column("band", ends)]
    mean = of_metric(metric.metric).number(metric.mean)
    heading = f"{metric.metric}: mean {mean}, sd {kind.change(metric.standard_deviation)}"
    if metric.dropped_blocks:
        heading += f"; {metric.dropped_blocks:,} of {influences.samples:,} {influences.noun} left out"
    return Section(heading, columns, remarks=_remarks(influences, metric))


def _remarks(influences: Influences, metric: MetricSensitivity) -> list[str]:
    """Return remarks on neighbours in the ranking whose bands overlap, and on the sum of first-order indices.

    Values surely below a hundredth of the largest index are left out as negligible. A difference of the sum from 1
    within its error is not attributed to interactions.
    """
    import numpy as np

    sentences, indices = [], metric.indices
    values, bands = indices.ranking, next(iter(indices.bands.values()))
    # In the order of the table, in which only neighbours can be mistaken for each other.
    order = np.argsort(-values)
    order = order[(values + bands)[order] >= _NEGLIGIBLE * np.max(values)]
    unsettled = [
        f"{influences.paths[first]} and {influences.paths[second]}"
        for first, second in pairwise(order)
        if values[first] - bands[first] < values[second] + bands[second]
    ]
    if unsettled:
        sentences.append(f"not converged at this sample size, confidence bands overlap: {', '.join(unsettled)}")
    if "first" in indices.values:
        alone, error = float(np.sum(indices.values["first"])), float(np.linalg.norm(indices.bands["first"]))
        interactions = ": interactions, if any, are within this error"
        if alone + error < 1.0:
            interactions = "; the rest comes from interactions"
        sentences.append(f"first-order indices sum to {alone:.3f} ± {error:.2g}{interactions}")
    return sentences


def _colour_of(rank: int) -> str:
    """Return the colour of a value by its rank; grey for values beyond the lines of the convergence panel."""
    from ppafo.report.style import COLOURS, GREY

    return COLOURS[rank] if rank < _MAXIMUM_LINES else GREY


# A function with a name: a lambda in a report cannot be pickled.
def _panels(influences: Influences) -> list[Panel]:
    return [draw(influences, metric) for metric in influences.metrics for draw in (_bars, _course)]


def _bars(influences: Influences, metric: MetricSensitivity) -> Panel:
    """Return a panel of the indices with their bands, a row and a colour for each value.

    The second index has open markers.
    """
    import numpy as np

    from ppafo.report.kind import Kind, of_metric
    from ppafo.report.panels import Mark, Panel
    from ppafo.report.setting_names import label_of
    from ppafo.report.style import MARKERS

    indices = metric.indices
    labels = [label_of(path) for path in influences.paths]
    order = np.argsort(-indices.ranking)
    places = np.arange(order.size)[::-1]
    marks = []
    for name, filled, shift in zip(indices.values, ("full", "none"), (0.14, -0.14), strict=False):
        base_style = {"markersize": 5, "elinewidth": 1.4, "fillstyle": filled}
        for rank, row in enumerate(order):
            colour = _colour_of(rank)
            height, style = places[rank] + shift, {**base_style, "fmt": MARKERS.get(colour, "o")}
            # One entry of the legend for each index: the markers of the first row.
            label = _TITLES[name] if rank == 0 and len(indices.values) > 1 else ""
            marks.append(
                Mark("reach", [indices.values[name][row]], [height], [indices.bands[name][row]], label, colour, style)
            )

    def name_values(axes: Axes) -> None:
        axes.set_yticks(places, [labels[row] for row in order])
        axes.axvline(0.0, color="#9a9a9a", linewidth=0.8)

    fraction = Kind("Fraction of the variance")
    return Panel(fraction, Kind(), marks, of_metric(metric.metric).words, legend="figure", then=name_values)


def _course(influences: Influences, metric: MetricSensitivity) -> Panel:
    """Return a panel of the largest indices for growing parts of the sample."""
    import numpy as np

    from ppafo.report.kind import Kind
    from ppafo.report.panels import Mark, Panel
    from ppafo.report.style import MARKERS

    name, sizes = next(iter(metric.indices.values)), [step.blocks for step in metric.settling]
    order = np.argsort(-metric.indices.ranking)[:_MAXIMUM_LINES]
    marks = []
    for rank, row in enumerate(order):
        colour = _colour_of(rank)
        values = np.array([step.values[name][row] for step in metric.settling])
        bands = np.array([step.bands[name][row] for step in metric.settling])
        line = {"marker": MARKERS.get(colour, "o"), "markersize": 3.5, "linewidth": 1.2}
        marks.append(Mark("line", sizes, values, colour=colour, style=line))
        marks.append(Mark("band", sizes, np.stack([values - bands, values + bands]), colour=colour))
    title = f"{_TITLES[name].capitalize()}, {order.size} largest"
    axis = Kind(influences.noun.capitalize())
    return Panel(axis, Kind(), marks, title, then=partial(_set_sizes, sizes))


def _set_sizes(sizes: Sequence[int], axes: Axes) -> None:
    """Make the axis of the sizes logarithmic, with ticks at the largest size and at even steps below."""
    axes.set_xscale("log", base=2)
    ticks = sizes[:: -math.ceil(len(sizes) / _MOST_SIZES)]
    axes.set_xticks(ticks, [str(size) for size in ticks])
    axes.minorticks_off()
