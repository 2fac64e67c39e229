"""Influence of uncertain values on metrics: Sobol indices, Shapley effects and signed changes.

A design consists of blocks: a base point of Sobol with its exchanged copies, or an order of the values for Shapley. A
block is the smallest unit that can be left out.

Failed runs: the analysis is refused if more than a given fraction of all runs has no value, because the indices would
describe only the remaining ones. Otherwise every block (base point or order) with such a run is left out and counted,
since the formulas need complete blocks; the indices then hold for values at which the model runs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from ppafo.analyses import ask, np
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
from ppafo.plugins import Plugins
from ppafo.progress import Report
from ppafo.units.shown import shown_in
from ppafo.wording import argument_text, known_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from ppafo.report.finding import Finding
    from ppafo.studies.distributions import Floats
    from ppafo.studies.study import Study

DistributedStudy = Annotated[
    "Study | str | Path | Mapping[str, Any]", Word("STUDY", help="a study with distributions: a name, or a .toml file")
]
MethodName = Annotated[str, Word("sobol|shapley")]
DEFAULT_SAMPLES = {"sobol": 8192, "shapley": 2048}
"""Default number of blocks by method: tens of thousands of runs for a few values."""
# Limits of the number of blocks.
_FEWEST = 64
_MOST = 2**17
_NEGLIGIBLE = 0.01
"""Fraction of the largest index below which the influence of a value counts as negligible."""
_MAXIMUM_LINES = 5
"""Number of varied values whose indices are plotted over the sample size."""
_TITLES = {"total": "total", "first": "first order", "shapley": "Shapley effect"}
SCRAMBLES = 8
"""Number of independent scrambles of the Sobol sequence, to which base points are assigned in turn."""
_INNER = 3
"""Number of draws of the free values for each conditional variance (Song, Nelson and Staum, 2016)."""
_SMALLEST = 2.0**-53
"""Smallest fraction of a draw; normal scores are finite from this fraction to 1 minus this fraction."""


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
    if method is not None and method not in METHODS:
        raise StudyError(f"there is no method '{method}'{known_names(method, METHODS)}")
    chosen, base, used = ask.drawn_in(study, overrides, configuration, independent)
    # Sobol indices of correlated values mean nothing; Shapley effects take more runs for the same bands.
    by = METHODS[method or ("sobol" if used.scores is None else "shapley")]
    requested = tuple(metrics) or chosen.outputs.metrics
    if not requested:
        raise StudyError(f"the outputs of study '{chosen.name}' have no metric; name the metric to analyse")
    count = DEFAULT_SAMPLES[by.name] if samples is None else samples
    tally = ask.RunCounter(count * by.block_rows(len(used.drawn)), progress)
    runs = ask.scenario_runs(base.scenario, requested, tally, used.gauge, threads, ask.executor_of(executor))
    with shown_in(chosen.shown_for(base.scenario)):
        seed = chosen.sample.seed if seed is None else seed
        found = analyse(runs, used, by, count, requested, seed, confidence, maximum_failed)
        gains = ask.remark_on_following_gains(base.scenario, used.paths), base.scenario.origin.replaced
        finding = finding_of(replace(found, study=f"{chosen.name}, {base.name}", gains=gains))
        return replace(finding, overrides=chosen.changes)


@dataclass(frozen=True, slots=True)
class Indices:
    """Sensitivity indices by name, each (paths,), and the half widths of their bands; the first ranks the inputs.

    ``blocks``, ``used``: number of blocks of the part of the sample, and of those without a missing value
    """

    values: Mapping[str, Floats]
    bands: Mapping[str, Floats]
    blocks: int = 0
    used: int = 0


class Method(NamedTuple):
    """Method of sensitivity analysis: design and evaluation.

    ``noun``: name of the blocks
    ``block_rows``: number of runs of a block for a number of values
    ``design``: function of uncertainty, number of blocks and seed; returns fractions in (0, 1), shape (blocks *
        block_rows, paths), block after block
    ``indices``: function of values (blocks, block_rows) [SI] of complete blocks, their numbers (blocks,), number of
        paths, seed of the design and confidence; returns indices and half widths of their bands by name, each (paths,)
    """

    name: str
    noun: str
    block_rows: Callable[[int], int]
    design: Callable[[ask.Uncertainty, int, int], Floats]
    indices: Callable[[Floats, NDArray[np.intp], int, int, float], tuple[dict[str, Floats], dict[str, Floats]]]


def _sobol_design(uncertainty: ask.Uncertainty, blocks: int, seed: int) -> Floats:
    """Return fractions in (0, 1) for a power of 2 of blocks; block b belongs to scramble b % SCRAMBLES."""
    if blocks & (blocks - 1):
        raise StudyError(f"samples = {blocks}: Sobol indices need a power of 2, for example {1 << blocks.bit_length()}")
    from scipy.stats import qmc

    dimensions = len(uncertainty.drawn)
    points_of_scramble = blocks // SCRAMBLES
    design = np.empty((points_of_scramble, SCRAMBLES, dimensions + 2, dimensions))
    exchanged = np.arange(dimensions)
    for number in range(SCRAMBLES):
        scramble_seed = ask.replicate_seed(seed, number) % 2**32
        # Saltelli (2002): a point A, its copies in which value i comes from B, and B. `seed`, not `rng`: the points of
        # earlier studies.
        points = qmc.Sobol(2 * dimensions, scramble=True, seed=scramble_seed).random(points_of_scramble)
        design[:, number] = points[:, None, :dimensions]
        design[:, number, -1] = points[:, dimensions:]
        design[:, number, 1 + exchanged, exchanged] = points[:, dimensions:]
    return np.clip(design.reshape(-1, dimensions), _SMALLEST, 1.0 - _SMALLEST)


def _sobol_indices(
    table: Floats, blocks: NDArray[np.intp], _paths: int, _seed: int, confidence: float
) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Return the indices ``first`` and ``total`` with bands.

    The columns of the table are f(A), then f(AB_i) with value i from B for each path, then f(B). With V the variance of
    f(A) and f(B): total_i = mean (f(A) - f(AB_i))^2 / 2 V (Jansen, 1999), first_i = mean f(B) (f(AB_i) - f(A)) / V
    (Saltelli et al., 2010).
    """

    def total_and_first(table: Floats) -> Floats:
        # Centred: the estimate of the first order is a mean of products, whose error grows with the mean of the metric.
        table = table - np.mean(table[:, [0, -1]])
        first = table[:, :1]
        copies = table[:, 1:-1]
        second = table[:, -1:]
        variance = float(np.mean(table[:, [0, -1]] ** 2))
        total = 0.5 * np.mean((first - copies) ** 2, axis=0)
        return np.stack([total, np.mean(second * (copies - first), axis=0)]) / (variance or math.nan)

    # Points of one scramble depend on each other, scrambles do not: those are left out in turn.
    scramble = blocks % SCRAMBLES
    left_out = np.array([total_and_first(table[scramble != number]) for number in np.unique(scramble)])
    values = total_and_first(table)
    reach = ask.jackknife_reach(left_out, confidence)
    return {"total": values[0], "first": values[1]}, {"total": reach[0], "first": reach[1]}


SOBOL = Method("sobol", "base points", lambda dimensions: dimensions + 2, _sobol_design, _sobol_indices)
"""Sobol indices, fractions of the variance: first-order (a value alone) and total (with all interactions).

Saltelli's design on independent scrambles of the Sobol sequence. The bands come from the spread between the scrambles,
because the points of one sequence are not independent and resampling them gives bands that are several times too wide.
"""


def _shapley_design(uncertainty: ask.Uncertainty, blocks: int, seed: int) -> Floats:
    """Return fractions in (0, 1) of a design for Shapley effects.

    For each block and each prefix of its order of values, there are draws with the remaining values fixed.
    """
    from scipy.special import ndtr

    count = len(uncertainty.drawn)
    lower = np.eye(count) if uncertainty.scores is None else np.asarray(uncertainty.scores)
    covariance = lower @ lower.T
    random = np.random.default_rng([seed, 1])
    scores = random.standard_normal((blocks, count - 1, 1, count)) @ lower.T
    scores = np.repeat(scores, _INNER, axis=2)
    fresh = random.standard_normal((blocks, count - 1, _INNER, count))
    # In pattern after pattern of which values are free, since all rows of one share a conditional distribution.
    places = np.argsort(_orders(count, blocks, seed), axis=1)
    free = places[:, None, :] <= np.arange(count - 1)[None, :, None]
    for pattern in np.unique(free.reshape(-1, count), axis=0):
        rows = np.all(free == pattern, axis=2)
        # Scores of free values from fixed ones: a matrix for the mean, a factor for the rest.
        across = covariance[np.ix_(pattern, ~pattern)]
        mean = np.linalg.solve(covariance[np.ix_(~pattern, ~pattern)], across.T).T
        factor = np.linalg.cholesky(covariance[np.ix_(pattern, pattern)] - mean @ across.T)
        drawn = scores[rows][..., ~pattern] @ mean.T + fresh[rows][..., pattern] @ factor.T
        part = scores[rows]
        part[..., pattern] = drawn
        scores[rows] = part
    uniform = ndtr(np.linalg.solve(lower, scores.reshape(-1, count).T).T)
    return np.asarray(np.clip(uniform, _SMALLEST, 1.0 - _SMALLEST))


def _shapley_indices(
    table: Floats, blocks: NDArray[np.intp], paths: int, seed: int, confidence: float
) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Return the index ``shapley`` with bands by the delta method over the orders."""
    from scipy.special import stdtrit

    count = blocks.size
    table = table.reshape(blocks.size, paths - 1, _INNER)
    variances = np.mean((table - np.mean(table)) ** 2, axis=(1, 2))
    conditional = np.var(table, axis=2, ddof=1)
    gains = np.diff(np.concatenate([np.zeros((count, 1)), conditional, variances[:, None]], axis=1), axis=1)
    orders = _orders(paths, int(blocks.max()) + 1, seed)[blocks]
    effects = np.take_along_axis(gains, np.argsort(orders, axis=1), axis=1)
    variance = float(np.mean(variances))
    fractions = np.mean(effects, axis=0) / variance
    deviations = (effects - fractions * variances[:, None]) / variance
    reach = float(stdtrit(count - 1, 0.5 + 0.5 * confidence)) * np.std(deviations, axis=0, ddof=1) / math.sqrt(count)
    return {"shapley": fractions}, {"shapley": reach}


def _orders(count: int, blocks: int, seed: int) -> NDArray[np.intp]:
    """Return the order of the values in each block (blocks, count); a larger number of blocks keeps the first ones."""
    ranks = np.random.default_rng([seed, 2]).random((blocks, count))
    return np.argsort(ranks, axis=1)


SHAPLEY = Method("shapley", "orders", lambda paths: _INNER * (paths - 1), _shapley_design, _shapley_indices)
"""Shapley effects: fractions of the variance that add up to 1, for independent and for correlated values.

Variance that two values explain together, by interaction or by correlation, is divided between them (Owen, 2014).
The values are added in random orders: each value gets its increase of the variance that remains when all later
values of the order are fixed (Song, Nelson and Staum, 2016). Fixed values are drawn from the Gaussian copula.
"""
METHODS = {method.name: method for method in (SOBOL, SHAPLEY)}
"""Methods of sensitivity analysis by name; a new method needs a design, indices, and an entry here."""


def _change(
    values: Floats, inputs: Floats, ends: Floats, part: NDArray[np.intp], confidence: float
) -> tuple[float, float]:
    """Return the change of a metric from the 5 to the 95 % quantile of a value, and its half band; nan for noise.

    The change has the unit of the metric and is positive if the metric grows with the value. It is the difference
    between two conditional means of the metric, with the value at either quantile (``ends``) and all other values as
    drawn, so that correlated values change too. Each mean is the value of a parabola fitted to the nearest runs
    (Cleveland, 1979, without weights). The band adds two errors: the spread between parts of the blocks, one part for
    each scramble, and twice the difference from the change with the nearer half of these runs, as the error of the
    parabola. ``values``, ``inputs`` and ``part`` are of runs (runs,), the values about their mean.
    """
    if np.isnan(ends).any():
        return math.nan, math.nan
    whole, nearer = (
        np.subtract(*(_levels(values, inputs, float(end), part, nearest) for end in ends[::-1]))
        for nearest in (0.2, 0.1)
    )
    # Of the bend the interval of one standard deviation.
    spread, bend_spread = (ask.jackknife_reach(*of) for of in ((whole[1:], confidence), ((whole - nearer)[1:], 0.6827)))
    # Of the square of the difference, what is chance on average is no bend.
    bend = math.sqrt(max(float((whole - nearer)[0] ** 2 - bend_spread**2), 0.0))
    return float(whole[0]), float(spread) + 2.0 * bend


def _levels(values: Floats, inputs: Floats, end: float, part: NDArray[np.intp], nearest: float) -> Floats:
    """Return the mean metric at the value ``end`` of an input: from all parts, then without each part (parts + 1,).

    ``nearest`` is the fraction of the runs, nearest to the end, to which the parabola is fitted.
    """
    distance = np.abs(inputs - end)
    count = int(part.max()) + 1
    rank = int(nearest * distance.size)
    near = distance <= np.partition(distance, rank)[rank]
    scaled = (inputs[near] - end) / (np.max(distance[near]) or 1.0)
    powers = np.stack([scaled**power for power in range(5)])
    moments = np.stack([np.bincount(part[near], power, count) for power in powers])
    mixed = np.stack([np.bincount(part[near], power * values[near], count) for power in powers[:3]])
    # All parts, and all but one in turn.
    total = np.sum(moments, axis=1, keepdims=True)
    mixed_total = np.sum(mixed, axis=1, keepdims=True)
    moments = np.concatenate([total, total - moments], axis=1)
    mixed = np.concatenate([mixed_total, mixed_total - mixed], axis=1)
    # A value of one or two levels needs no parabola: the pseudo-inverse leaves at 0 what they do not tell.
    normal = np.stack([moments[row : row + 3] for row in range(3)]).transpose(2, 0, 1)
    solved = np.linalg.pinv(normal, rcond=1.0e-9, hermitian=True) @ mixed.T[:, :, None]
    return np.asarray(solved[:, 0, 0])


# Indices of all metrics, and the report.


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


@dataclass(frozen=True, slots=True)
class Influences:
    """Sensitivity indices of metrics with respect to uncertain values.

    ``samples``, ``noun``, ``seed``: number of blocks of the sample, their name, and random seed
    ``confidence``: confidence level of the bands
    ``maximum_failed``: fraction of the runs above which failures are refused
    ``paths``: paths of the uncertain values
    ``runs``, ``failed``: number of runs, and of failed runs
    ``tracking``: completed runs that follow their reference, do not, or are beyond reach on purpose
    ``constant``: metrics that no value influences, with the number that they are in every run [SI]
    ``gains``: remarks on controller gains that follow the uncertain values or are kept from another kind; or empty
    """

    method: str
    noun: str
    samples: int
    seed: int
    confidence: float
    maximum_failed: float
    paths: list[str]
    runs: int
    failed: int
    tracking: ask.TrackingCounts
    metrics: list[MetricSensitivity]
    constant: dict[str, float]
    study: str = ""
    gains: tuple[str, ...] = ()


@on_one_thread
def analyse(
    runs: ask.Runs,
    uncertainty: ask.Uncertainty,
    method: Method,
    samples: int,
    metrics: Sequence[str],
    seed: int = 1,
    confidence: float = 0.95,
    maximum_failed: float = 0.02,
) -> Influences:
    """Return the sensitivity indices of metrics; StudyError for settings that cannot be used or too many failures."""
    if uncertainty.scores is not None and method is SOBOL:
        raise StudyError(
            f"sensitivity: {method.name} assumes independent values, but the study has [[correlations]]; use "
            f"{argument_text('method', 'shapley')}, or ignore the correlations with {argument_text('independent')}"
        )
    if len(uncertainty.drawn) < 2:
        raise StudyError("sensitivity: the study has only one uncertain value; vary two or more")
    if not _FEWEST <= samples <= _MOST:
        raise StudyError(f"samples = {samples}: {method.name} needs {_FEWEST} to {_MOST:,} {method.noun}")
    # Checked before anything runs: a design takes thousands of runs.
    columns = uncertainty.columns(method.design(uncertainty, samples, seed))
    rows = runs.run(columns)
    runs.check(rows, maximum_failed, "sensitivity", metrics)
    constant = {
        name: float(np.nanmin(rows[name])) for name in metrics if np.nanmin(rows[name]) == np.nanmax(rows[name])
    }
    if len(constant) == len(metrics):
        said = ", ".join(f"'{name}' is {number:g}" for name, number in constant.items())
        raise StudyError(f"sensitivity: {said} in every run, so no value influences it; choose another metric")
    found = []
    for name in (name for name in metrics if name not in constant):
        table = rows[name].reshape(samples, -1)
        # The formulas need whole blocks: one run without a value takes its block with it.
        known = np.isfinite(table)
        settling = []
        whole = np.flatnonzero(known.all(axis=1))
        # All blocks, and halves, and halves of halves, as far as they say something: many of the first may be left out,
        # and a metric that counts may be the same in all.
        halved = {samples >> halvings for halvings in range(6)}
        for size in sorted({size for size in halved if size >= _FEWEST} | {samples}):
            first = whole[whole < size]
            if first.size >= 4 and float(np.ptp(table[first])) > 0.0:
                estimated = method.indices(table[first], first, len(uncertainty.drawn), seed, confidence)
                settling.append(Indices(*estimated, size, first.size))
        if not settling or settling[-1].blocks != samples:
            raise StudyError(
                f"sensitivity: only {whole.size:,} of {samples:,} {method.noun} "
                f"have '{name}' in all their runs; use more samples, or correct the runs that fail"
            )
        values = table[whole].ravel()
        part = np.repeat(np.unique(whole % SCRAMBLES, return_inverse=True)[1], table.shape[1])
        changes = []
        for number in uncertainty.drawn:
            # A seed has no order: from its 5 to its 95 % quantile nothing changes.
            ends = number.distribution.values(np.array([0.05, 0.95])) * (
                np.nan if number.path == ask.NOISE_SEED else 1.0
            )
            inputs = columns[number.path].reshape(samples, -1)[whole].ravel()
            # About the mean, because the sums of the lines below cancel.
            changes.append(_change(values - np.mean(values), inputs, ends, part, confidence))
        found.append(
            MetricSensitivity(
                metric=name,
                mean=float(np.mean(table[known])),
                standard_deviation=float(np.std(table[known], ddof=1)),
                runs_without_value=int(np.count_nonzero(~known)),
                change_from_5_to_95_percent=[change for change, _ in changes],
                band_of_change=[band for _, band in changes],
                settling=settling,
            )
        )
    return Influences(
        method=method.name,
        noun=method.noun,
        samples=samples,
        seed=seed,
        confidence=confidence,
        maximum_failed=maximum_failed,
        paths=list(uncertainty.paths),
        runs=runs.count,
        failed=runs.failures,
        tracking=ask.tracking_counts(rows, runs.count - runs.failures),
        metrics=found,
        constant=constant,
    )


def finding_of(found: Influences) -> Finding[Influences]:
    """Return the sensitivity indices as a finding, with a table and two panels for each metric."""
    first, *others = (_TITLES[name] for name in found.metrics[0].indices.values)
    sentences = [
        f"{found.study}: {found.method}, {found.samples:,} {found.noun}, {found.runs:,} "
        f"runs of {len(found.paths)} uncertain values; bands with {100.0 * found.confidence:g} % confidence",
        f"{found.failed:,} runs failed; up to {100.0 * found.maximum_failed:g} % are allowed, and every "
        f"{found.noun[:-1]} with a failed run is left out",
    ]
    if found.tracking.do_not_follow or found.tracking.beyond_reach_on_purpose:
        sentences.append(f"{found.tracking.sentence}; the indices include all of them")
    for name, number in found.constant.items():
        sentences.append(f"{name} is {ask.of_metric(name).text(number)} in every run: no value influences it")
    caption = f"Left: indices with confidence bands, {first} filled{''.join(f', {other} open' for other in others)}."
    caption += " Right: convergence of the largest indices with the sample size, in the same colours and markers."
    figure = ask.Section(
        "Indices and their convergence",
        panels=partial(_panels, found),
        name="sensitivity",
        caption=caption,
        across=2,
        size=(3.0, max(2.5, 0.9 + 0.27 * len(found.paths))),
        title=f"Sensitivity of {found.study}",
        is_detail=True,
    )
    return ask.Finding(
        name="sensitivity",
        kicker="Sensitivity",
        title=f"Sensitivity of {found.study}",
        said=(*sentences, *filter(None, found.gains)),
        parts=(*(_part(found, metric) for metric in found.metrics), figure),
        found=found,
    )


def _part(found: Influences, metric: MetricSensitivity) -> ask.Section:
    """Return a table with a row for each uncertain value, the most influential first, with remarks.

    The remarks are on neighbours in the ranking whose bands overlap, and on the sum of first-order indices. Values
    surely below a hundredth of the largest index are left out as negligible. A difference of the sum from 1 within its
    error is not attributed to interactions.
    """
    kind = ask.of_metric(metric.metric, "+.3g")
    indices = metric.indices
    remarks = []
    ranking, reach = (next(iter(each.values())) for each in (indices.values, indices.bands))
    order = np.argsort(-ranking).tolist()
    columns = [ask.Column("value", [found.paths[row] for row in order])]
    for name, values in indices.values.items():
        columns.extend(
            (
                ask.Column(_TITLES[name], [f"{round(values[row], 3) + 0.0:.3f}" for row in order]),
                ask.Column("band", [f"± {indices.bands[name][row]:.3f}" for row in order]),
            )
        )
    changes = [metric.change_from_5_to_95_percent[row] for row in order]
    ends = [f"± {kind.change_number(metric.band_of_change[row], '.2g')}" for row in order]
    bands = [None if math.isnan(change) else end for change, end in zip(changes, ends, strict=True)]
    columns += [ask.Column("change, 5 to 95 %", changes, kind, is_change=True), ask.Column("band", bands)]
    mean = ask.of_metric(metric.metric).number(metric.mean)
    heading = f"{metric.metric}: mean {mean}, sd {kind.change(metric.standard_deviation)}"
    if dropped := indices.blocks - indices.used:
        heading += f"; {dropped:,} of {found.samples:,} {found.noun} left out"
    # In the order of the table, in which only neighbours can be mistaken for each other.
    counting = [row for row in order if (ranking + reach)[row] >= _NEGLIGIBLE * np.max(ranking)]
    unsettled = [
        f"{found.paths[one]} and {found.paths[other]}"
        for one, other in pairwise(counting)
        if ranking[one] - reach[one] < ranking[other] + reach[other]
    ]
    if unsettled:
        remarks.append(f"not converged at this sample size, confidence bands overlap: {', '.join(unsettled)}")
    if "first" in indices.values:
        alone = float(np.sum(indices.values["first"]))
        error = float(np.linalg.norm(indices.bands["first"]))
        rest = "; the rest comes from interactions"
        rest = rest if alone + error < 1.0 else ": interactions, if any, are within this error"
        remarks.append(f"first-order indices sum to {alone:.3f} ± {error:.2g}{rest}")
    return ask.Section(heading, columns, remarks=remarks)


# A function with a name: a lambda in a report cannot be pickled.
def _panels(found: Influences) -> list[ask.Panel]:
    """Return two panels for each metric: its indices with their bands, and the largest for growing parts of the sample.

    A row and a colour are of a value, grey beyond the values of the second panel; a second index has open markers.
    """

    def name_values(axes: Axes, places: NDArray[np.intp], labels: Sequence[str]) -> None:
        axes.set_yticks(places, labels)
        axes.axvline(0.0, color="#9a9a9a", linewidth=0.8)

    def set_sizes(axes: Axes, sizes: Sequence[int]) -> None:
        """Make the axis of the sizes logarithmic, with ticks at the largest size and at even steps below."""
        axes.set_xscale("log", base=2)
        # The labels of more than three would run together.
        ticks = sizes[:: -math.ceil(len(sizes) / 3)]
        axes.set_xticks(ticks, [str(size) for size in ticks])
        axes.minorticks_off()

    panels = list[ask.Panel]()
    for metric in found.metrics:
        indices = metric.indices
        bars = []
        courses = list[ask.Mark]()
        name = next(iter(indices.values))
        sizes = [step.blocks for step in metric.settling]
        order = np.argsort(-indices.values[name])
        colours = [ask.COLOURS[rank] if rank < _MAXIMUM_LINES else ask.GREY for rank in range(order.size)]
        places = np.arange(order.size)[::-1]
        for (index, values), filled, shift in zip(
            indices.values.items(), ("full", "none"), (0.14, -0.14) if len(indices.values) > 1 else (0.0,), strict=False
        ):
            for row, colour, place in zip(order, colours, places, strict=True):
                style = {"markersize": 5, "elinewidth": 1.4, "fillstyle": filled, "fmt": ask.MARKERS.get(colour, "o")}
                # One entry of the legend for each index: the markers of the first row.
                label = _TITLES[index] if row == order[0] and len(indices.values) > 1 else ""
                at = [values[row]], [place + shift], [indices.bands[index][row]]
                bars.append(ask.Mark("reach", *at, label, colour, style))
        settled = np.array([[step.values[name], step.bands[name]] for step in metric.settling])
        for row, colour in zip(order[:_MAXIMUM_LINES], colours, strict=False):
            values, bands = settled[:, :, row].T
            line = {"marker": ask.MARKERS.get(colour, "o"), "markersize": 3.5, "linewidth": 1.2}
            courses.extend(
                (
                    ask.Mark("line", sizes, values, colour=colour, style=line),
                    ask.Mark("band", sizes, np.stack([values - bands, values + bands]), colour=colour),
                )
            )
        named = partial(name_values, places=places, labels=[ask.label_of(found.paths[row]) for row in order])
        words = ask.of_metric(metric.metric).words
        title = f"{_TITLES[name].capitalize()}, {len(courses) // 2} largest"
        axis = ask.Kind(found.noun.capitalize())
        panels.extend(
            (
                ask.Panel(ask.Kind("Fraction of the variance"), ask.Kind(), bars, words, legend="figure", then=named),
                ask.Panel(axis, ask.Kind(), courses, title, then=partial(set_sizes, sizes=sizes)),
            )
        )
    return panels
