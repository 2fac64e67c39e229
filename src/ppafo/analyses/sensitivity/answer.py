"""Report of a sensitivity analysis: a table for each metric, and panels of the indices and their convergence."""

import math
from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ppafo.analyses.sensitivity.methods import METHODS
from ppafo.analyses.sensitivity.solve import Influences, MetricSensitivity
from ppafo.report.finding import Column, Finding, Section
from ppafo.report.kind import Kind, of_metric
from ppafo.report.panels import Mark, Panel
from ppafo.report.setting_names import label_of
from ppafo.report.style import COLOURS, GREY, MARKERS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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


def finding_of(influences: Influences) -> Finding[Influences]:
    """Return the sensitivity indices as a finding, with a table and two panels for each metric."""
    settings, method = influences.settings, METHODS[influences.method]
    sentences = [
        f"{influences.study}: {influences.method}, {settings.samples:,} {method.sizes_label}, {influences.runs:,} runs "
        f"of {len(influences.paths)} uncertain values; bands with {100.0 * settings.confidence:g} % confidence",
        f"{influences.failed:,} runs failed; up to {100.0 * settings.maximum_failed:g} % are allowed, and every "
        f"{method.block_label} with a failed run is left out",
    ]
    if influences.not_following:
        sentences.append(
            f"in {influences.not_following:,} runs the reference is not followed; the indices include these runs"
        )
    sentences += filter(None, influences.gains)
    figure = Section(
        "Indices and their convergence",
        panels=partial(_panels, influences),
        name="sensitivity",
        caption=_CAPTION.format(
            filled=_TITLES[method.shown[0]],
            open="".join(f", {_TITLES[name]} open" for name in method.shown[1:]),
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
    kind, indices = of_metric(metric.metric, "+.3g"), metric.indices
    order = np.argsort(-indices.values[METHODS[influences.method].shown[0]])
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
        label = METHODS[influences.method].sizes_label
        heading += f"; {metric.dropped_blocks:,} of {influences.settings.samples:,} {label} left out"
    return Section(heading, columns, remarks=remarks(influences, metric))


def overlapping_pairs(influences: Influences, metric: MetricSensitivity) -> list[tuple[str, str]]:
    """Return pairs of neighbours in the ranking whose confidence bands overlap, so that their order is open.

    Values surely below a hundredth of the largest index are left out as negligible.
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


def remarks(influences: Influences, metric: MetricSensitivity) -> list[str]:
    """Return remarks on overlapping bands and on the sum of first-order indices.

    A difference of the sum from 1 within its error is not attributed to interactions.
    """
    sentences = []
    if unsettled := overlapping_pairs(influences, metric):
        pairs = ", ".join(f"{first} and {second}" for first, second in unsettled)
        sentences.append(f"not converged at this sample size, confidence bands overlap: {pairs}")
    indices = metric.indices
    if "first" in indices.values:
        alone, error = float(np.sum(indices.values["first"])), float(np.linalg.norm(indices.bands["first"]))
        interactions = ": interactions, if any, are within this error"
        if alone + error < 1.0:
            interactions = "; the rest comes from interactions"
        sentences.append(f"first-order indices sum to {alone:.3f} ± {error:.2g}{interactions}")
    return sentences


def _colour_of(rank: int) -> str:
    """Return the colour of a value by its rank; grey for values beyond the lines of the convergence panel."""
    return COLOURS[rank] if rank < _MAXIMUM_LINES else GREY


# A function with a name: a lambda in a report cannot be pickled.
def _panels(influences: Influences) -> list[Panel]:
    return [draw(influences, metric) for metric in influences.metrics for draw in (_bars, _course)]


def _bars(influences: Influences, metric: MetricSensitivity) -> Panel:
    """Return a panel of the indices with their bands, a row and a colour for each value.

    The second index has open markers.
    """
    shown, indices = METHODS[influences.method].shown, metric.indices
    labels = [label_of(path) for path in influences.paths]
    order = np.argsort(-indices.values[shown[0]])
    places = np.arange(order.size)[::-1]
    marks = []
    for name, filled, shift in zip(shown, ("full", "none"), (0.14, -0.14), strict=False):
        base_style = {"markersize": 5, "elinewidth": 1.4, "fillstyle": filled}
        for rank, row in enumerate(order):
            colour = _colour_of(rank)
            height, style = places[rank] + shift, {**base_style, "fmt": MARKERS.get(colour, "o")}
            # One entry of the legend for each index: the markers of the first row.
            label = _TITLES[name] if rank == 0 and len(shown) > 1 else ""
            marks.append(
                Mark("reach", [indices.values[name][row]], [height], [indices.bands[name][row]], label, colour, style)
            )

    def name_values(axes: "Axes") -> None:
        axes.set_yticks(places, [labels[row] for row in order])
        axes.axvline(0.0, color="#9a9a9a", linewidth=0.8)

    fraction = Kind("Fraction of the variance")
    return Panel(fraction, Kind(), marks, of_metric(metric.metric).words, legend="figure", then=name_values)


def _course(influences: Influences, metric: MetricSensitivity) -> Panel:
    """Return a panel of the largest indices for growing parts of the sample."""
    method = METHODS[influences.method]
    name, sizes = method.shown[0], [step.blocks for step in metric.settling]
    order = np.argsort(-metric.indices.values[name])[:_MAXIMUM_LINES]
    marks = []
    for rank, row in enumerate(order):
        colour = _colour_of(rank)
        values = np.array([step.indices[name][row] for step in metric.settling])
        bands = np.array([step.bands[name][row] for step in metric.settling])
        line = {"marker": MARKERS.get(colour, "o"), "markersize": 3.5, "linewidth": 1.2}
        marks.append(Mark("line", sizes, values, colour=colour, style=line))
        marks.append(Mark("band", sizes, np.stack([values - bands, values + bands]), colour=colour))
    title = f"{_TITLES[name][:1].upper()}{_TITLES[name][1:]}, {order.size} largest"
    axis = Kind(f"{method.sizes_label[:1].upper()}{method.sizes_label[1:]}")
    return Panel(axis, Kind(), marks, title, then=partial(_set_sizes, sizes))


def _set_sizes(sizes: Sequence[int], axes: "Axes") -> None:
    """Make the axis of the sizes logarithmic, with ticks at the largest size and at even steps below."""
    axes.set_xscale("log", base=2)
    ticks = sizes[:: -math.ceil(len(sizes) / _MOST_SIZES)]
    axes.set_xticks(ticks, [str(size) for size in ticks])
    axes.minorticks_off()
