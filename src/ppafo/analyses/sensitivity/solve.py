"""The sensitivity of metrics to what has a distribution in a study: the analysis at growing sizes, and the answer.

Policy for runs that fail: where more than a fraction of all runs has no value it is refused, because the indices
would be the survivors'. Otherwise every block (base point or order) with such a run is left out whole,
since the formulas need whole blocks, and counted; the indices then hold for values with which the model runs.
"""

import math
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ppafo.analyses.sensitivity.methods import METHODS, Evaluated, Indices, Method, changes
from ppafo.errors import StudyError
from ppafo.linear_algebra import on_one_thread
from ppafo.report.finding import Column, Finding, Part
from ppafo.report.kind import Kind, of_metric
from ppafo.report.panels import Mark, Panel
from ppafo.report.setting_names import label_of
from ppafo.report.style import BLUE, COLOURS, ORANGE
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import CONFIDENCE, Uncertainty, check_fraction
from ppafo.studies.sampling import NOISE
from ppafo.study.runs import Runs

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ENDS = (0.05, 0.95)
"""Fractions between which a value goes for the change of a metric."""
_NEGLIGIBLE = 0.01
_FEWEST_WHOLE = 4
_SIZES = 6
"""Sizes at which the indices are shown: all blocks, and halved again and again."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Number of blocks, seed, confidence of the bands, fraction of the runs that may fail."""

    samples: int
    seed: int = 1
    confidence: float = 0.95
    maximum_failed: float = 0.02


@dataclass(frozen=True, slots=True)
class Settling:
    """The indices of one metric, and their bands, by name from the first ``blocks`` blocks; ``used`` had all values."""

    blocks: int
    used: int
    indices: dict[str, list[float]]
    bands: dict[str, list[float]]


@dataclass(frozen=True, slots=True)
class OfMetric:
    """The indices of a metric at growing sizes, the last the result; mean and standard deviation [SI] of all runs.

    The change [SI] is how the metric goes from the 5 to the 95 % quantile of each value, with its sign and the half
    width of its band; nan for the noise.
    """

    metric: str
    mean: float
    standard_deviation: float
    runs_without_value: int
    change_from_5_to_95_percent: list[float]
    band_of_change: list[float]
    settling: list[Settling]

    @property
    def indices(self) -> Indices:
        """The indices from all blocks."""
        last = self.settling[-1]
        return Indices(*({name: np.array(each) for name, each in part.items()} for part in (last.indices, last.bands)))

    @property
    def dropped_blocks(self) -> int:
        """Number of blocks that were left out."""
        return self.settling[-1].blocks - self.settling[-1].used


@dataclass(frozen=True, slots=True)
class Influences:
    """Indices of some metrics with regard to some paths; ``runs`` were made, ``failed`` of them failed."""

    study: str
    method: str
    settings: Settings
    paths: list[str]
    runs: int
    failed: int
    policy: str
    metrics: list[OfMetric]


_POLICY = "above the maximum fraction refused; below, every block with a failed run is left out"


def overlapping_pairs(influences: Influences, metric: OfMetric) -> list[tuple[str, str]]:
    """Return neighbours in the order of the first index whose bands overlap: which of the two matters more is open.

    Nothing is said of two that both are surely below a hundredth of the largest: neither matters.
    """
    name, indices = METHODS[influences.method].shown[0], metric.indices
    # In the order of the table, in which only neighbours can be mistaken for each other.
    values, bands = indices.values[name], indices.bands[name]
    order = np.argsort(-values)
    order = order[(values + bands)[order] >= _NEGLIGIBLE * np.max(values)]
    return [
        (influences.paths[first], influences.paths[second])
        for first, second in pairwise(order)
        if values[first] - bands[first] < values[second] + bands[second]
    ]


@on_one_thread
def analyse(runs: Runs, uncertainty: Uncertainty, method: Method, settings: Settings, study: str = "") -> Influences:
    """Return the indices of the metrics; StudyError for bad settings, dependent values or too many failures."""
    if uncertainty.scores is not None and not method.takes_dependent:
        raise StudyError(
            f"sensitivity: the indices of {method.name} need values that are independent, and the study has "
            "[[correlations]]; use '--method shapley', or treat the values as independent (--independent)"
        )
    if len(uncertainty.drawn) < 2:
        raise StudyError("sensitivity: there is only one uncertain value; vary two or more")
    if not method.fewest <= settings.samples <= method.most:
        raise StudyError(
            f"samples = {settings.samples}: {method.name} needs {method.fewest} to {method.most:,} {method.sizes_label}"
        )
    if settings.seed < 0:
        raise StudyError(f"seed = {settings.seed}: must be 0 or more")
    check_fraction(settings.confidence, *CONFIDENCE)
    check_fraction(settings.maximum_failed, "maximum_failed")
    # Checked before anything runs: a design takes thousands of runs.
    design = method.design(uncertainty, settings.samples, settings.seed)
    columns = uncertainty.columns(design)
    rows = runs.run(columns)
    runs.check(rows, settings.maximum_failed, "sensitivity", runs.metrics)
    ends = np.array([number.distribution.values(np.array(_ENDS)) for number in uncertainty.drawn]).T
    # A seed has no order: from its 5 to its 95 % quantile nothing changes.
    ends[:, [path == NOISE for path in uncertainty.paths]] = np.nan
    inputs = np.stack([columns[path] for path in uncertainty.paths], axis=1)
    blocks = np.repeat(np.arange(settings.samples), design.shape[0] // settings.samples)
    whole = Evaluated(design, inputs, np.empty(0), blocks, ends, settings.seed)
    metrics = [_of_metric(name, rows[name], whole, method, settings) for name in runs.metrics]
    return Influences(
        study, method.name, settings, list(uncertainty.paths), runs.count, runs.failures, _POLICY, metrics
    )


def _of_metric(name: str, values: Floats, design: Evaluated, method: Method, settings: Settings) -> OfMetric:
    known = np.isfinite(values)
    if float(np.ptp(values[known])) == 0.0:
        raise StudyError(f"sensitivity: '{name}' is {values[known][0]:g} in every run, so no value influences it")
    # The formulas need whole blocks: one run without a value takes its block with it.
    rows = values.size // settings.samples
    whole = np.all(known.reshape(-1, rows), axis=1)
    halved = {whole.size >> halvings for halvings in range(_SIZES)}
    sizes = []
    for size in sorted({size for size in halved if size >= method.fewest} | {whole.size}):
        # The first blocks may say nothing: many may be left out, and a metric that counts may be the same in all.
        kept = values.reshape(-1, rows)[:size][whole[:size]]
        if len(kept) >= _FEWEST_WHOLE and float(np.ptp(kept)) > 0.0:
            sizes.append(size)
    if whole.size not in sizes:
        raise StudyError(
            f"sensitivity: {int(np.count_nonzero(whole)):,} of {whole.size:,} {method.sizes_label} have '{name}' in "
            "all their runs, which is too few; use more samples, or fix what makes the runs fail"
        )
    settling = []
    for size in sizes:
        kept = np.flatnonzero(whole[:size])
        places = np.flatnonzero(np.isin(design.blocks, kept))
        part = Evaluated(
            design.fractions[places], design.inputs[places], values[places], kept, design.ends, design.seed
        )
        estimated = method.indices(part, settings.confidence)
        indices, bands = (
            {name: each.tolist() for name, each in values.items()} for values in (estimated.values, estimated.bands)
        )
        settling.append(Settling(size, kept.size, indices, bands))
    change, band = changes(part, settings.confidence)
    return OfMetric(
        metric=name,
        mean=float(np.mean(values[known])),
        standard_deviation=float(np.std(values[known], ddof=1)),
        runs_without_value=int(np.count_nonzero(~known)),
        change_from_5_to_95_percent=change.tolist(),
        band_of_change=band.tolist(),
        settling=settling,
    )


DEFAULT_SAMPLES = {"sobol": 8192, "shapley": 2048}


_LINE = 0.27
_MAXIMUM_LINES = 5
_TITLES = {"total": "total", "first": "first order", "shapley": "Shapley effect"}
_CAPTION = (
    "Left: the indices with their bands. Right: the largest of them, in the colours of their names, from growing "
    "parts of the sample: whether they have converged."
)


def finding_of(influences: Influences) -> Finding[Influences]:
    """Return the indices in words, a table and two panels for each metric."""
    settings, method = influences.settings, METHODS[influences.method]
    said = (
        f"{influences.study}: {influences.method}, {settings.samples:,} {method.sizes_label}, {influences.runs:,} runs "
        f"of {len(influences.paths)} uncertain values; bands with {100.0 * settings.confidence:g} % confidence",
        f"{influences.failed:,} runs failed; up to {100.0 * settings.maximum_failed:g} % are allowed, and every "
        f"{method.block_label} with a failed run is left out",
    )
    figure = Part(
        "Indices and their convergence",
        panels=partial(_panels, influences),
        name="sensitivity",
        caption=_CAPTION,
        across=2,
        size=(4.8, max(2.9, 0.9 + _LINE * len(influences.paths))),
        is_detail=True,
    )
    return Finding(
        name="sensitivity",
        kicker="Sensitivity",
        title=f"What matters in {influences.study}",
        said=said,
        parts=(*(_part(influences, metric) for metric in influences.metrics), figure),
        found=influences,
    )


def _panels(influences: Influences) -> list[Panel]:
    return [draw(influences, metric) for metric in influences.metrics for draw in (_bars, _course)]


def _part(influences: Influences, metric: OfMetric) -> Part:
    """Return a row for each uncertain value, the most important one first, and what these numbers leave open."""
    kind, indices = of_metric(metric.metric, "+.3g"), metric.indices
    order = np.argsort(-indices.values[METHODS[influences.method].shown[0]])
    columns = [Column("value", [influences.paths[row] for row in order])]
    for name, values in indices.values.items():
        columns.append(Column(_TITLES[name], [f"{round(values[row], 3) + 0.0:.3f}" for row in order]))
        columns.append(Column("band", [f"± {indices.bands[name][row]:.3f}" for row in order]))
    change, band = metric.change_from_5_to_95_percent, metric.band_of_change
    ends = [None if math.isnan(change[row]) else f"± {kind.change_number(band[row], '.2g')}" for row in order]
    shown = [None if math.isnan(change[row]) else change[row] for row in order]
    columns += [Column("change, 5 to 95 %", shown, kind, is_change=True), Column("band", ends)]
    heading = f"{metric.metric}: sd {kind.change(metric.standard_deviation)}"
    if metric.dropped_blocks:
        label = METHODS[influences.method].sizes_label
        heading += f"; {metric.dropped_blocks:,} of {influences.settings.samples:,} {label} left out"
    return Part(heading, columns, remarks=remarks(influences, metric))


def remarks(influences: Influences, metric: OfMetric) -> list[str]:
    """Return what these numbers leave open; a rest within the error of the sum may be no interaction."""
    said = []
    unsettled = overlapping_pairs(influences, metric)
    if unsettled:
        pairs = ", ".join(f"{first} and {second}" for first, second in unsettled)
        said.append(f"not converged at this size, their bands overlap: {pairs}")
    indices = metric.indices
    if "first" in indices.values:
        alone, error = float(np.sum(indices.values["first"])), float(np.linalg.norm(indices.bands["first"]))
        rest = (
            "; the rest comes from interactions"
            if alone + error < 1.0
            else ": interactions, if any, are within this error"
        )
        said.append(f"first-order indices sum to {alone:.3f} ± {error:.2g}{rest}")
    return said


def _bars(influences: Influences, metric: OfMetric) -> Panel:
    """Return the indices with their bands; the names of the largest have the colours of the panel beside."""
    shown, indices, labels = (
        METHODS[influences.method].shown,
        metric.indices,
        [label_of(path) for path in influences.paths],
    )
    order = np.argsort(indices.values[shown[0]])
    places = np.arange(order.size)
    marks = [
        Mark(
            "reach",
            indices.values[name][order],
            places + shift,
            indices.bands[name][order],
            _TITLES[name],
            colour,
            {"markersize": 5, "elinewidth": 1.4},
        )
        for name, colour, shift in zip(shown, (BLUE, ORANGE), (0.14, -0.14), strict=False)
    ]

    def name_values(axes: "Axes") -> None:
        axes.set_yticks(places, [labels[row] for row in order])
        for label, colour in zip(reversed(axes.get_yticklabels()), COLOURS[:_MAXIMUM_LINES], strict=False):
            label.set_color(colour)
        axes.axvline(0.0, color="#9a9a9a", linewidth=0.8)

    fraction = Kind("Fraction of the variance")
    return Panel(fraction, Kind(), marks, of_metric(metric.metric).words, legend="inside", then=name_values)


def _course(influences: Influences, metric: OfMetric) -> Panel:
    """Return the largest indices from growing parts of the sample."""
    method = METHODS[influences.method]
    name, sizes = method.shown[0], [each.blocks for each in metric.settling]
    order = np.argsort(-metric.indices.values[name])[:_MAXIMUM_LINES]
    marks = []
    for colour, row in zip(COLOURS, order, strict=False):
        values = np.array([each.indices[name][row] for each in metric.settling])
        bands = np.array([each.bands[name][row] for each in metric.settling])
        line = {"marker": "o", "markersize": 3.5, "linewidth": 1.2}
        marks.append(Mark("line", sizes, values, colour=colour, style=line))
        marks.append(Mark("band", sizes, np.stack([values - bands, values + bands]), colour=colour))
    title = f"{_TITLES[name][:1].upper()}{_TITLES[name][1:]}, {order.size} largest"
    axis = Kind(f"{method.sizes_label[:1].upper()}{method.sizes_label[1:]}")
    return Panel(axis, Kind(), marks, title, then=lambda axes: axes.set_xscale("log", base=2))
