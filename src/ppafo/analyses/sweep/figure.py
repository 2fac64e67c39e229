"""Figure of a study: a panel for each metric over the varied values, and bands of channels over time."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from operator import methodcaller
from typing import TYPE_CHECKING

import numpy as np

from ppafo.analyses.sweep.results import StudyResults, metric_kind
from ppafo.report.finding import Section
from ppafo.report.kind import TIME, Kind, of_path
from ppafo.report.panels import Mark, Panel
from ppafo.report.setting_names import label_of
from ppafo.report.style import BLUE, GREEN, GREY, ORANGE, VERMILION, font_size
from ppafo.signals.recording import CHANNELS
from ppafo.simulation.numbers import NOISE_SEED
from ppafo.study.store import FOLLOWS
from ppafo.units.shown import quantity_of_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FIGURE = "figure"
COLOURS = (BLUE, VERMILION, GREEN, ORANGE, GREY)
MOST_CONFIGURATIONS = len(COLOURS)
"""Largest number of configurations in a figure: as many as distinguishable colours."""
MOST_METRICS, MOST_COMPARED = 4, 2
"""Largest number of metrics in a figure, and with a panel for each configuration: more would be too low to read."""
MAXIMUM_DRAWN = 4_000_000
"""Largest number of runs in a figure, spread evenly over all; printed statistics use all runs."""
_COLUMNS = 2
"""Number of panels side by side in a figure."""
_PANEL, _COMPARED_PANEL = (2.9, 2.4), (2.7, 2.3)
"""Width and height of a panel [inches], and of a panel in a row that compares configurations."""
_HISTOGRAM_BINS = 60
"""Largest number of bins in the histogram of a metric."""
_MAXIMUM_POINTS = 3000
"""Largest number of runs in a curve or in the points of a panel."""
_MEDIAN = 0.5
_OPACITIES = (0.18, 0.32, 0.45)
"""Opacities of the bands of one channel, from the outermost to the innermost."""
_GRIDDED = ("grid", "list")
"""Kinds of ``[[vary]]`` entries that form a full grid with each other."""
_NAMED = 3
"""Largest number of varied values named in the title of a figure."""
_CAPTION = (
    "Distributions of the metrics, their dependence on the varied values, and quantiles over time where requested."
)


def figure_of(results: StudyResults, sentences: Sequence[str], remarks: Sequence[str]) -> Section:
    """Return the figure of a study: panels of the metrics, and bands over time.

    A grid of two axes is drawn as maps, two drawn values as coloured points, all else as one panel for each metric.
    """
    study, all_metrics = results.document["study"], list(results.document["metrics"])
    # A metric that no run has would be a hole in the figure, unless no metric has a value.
    with_values = [
        metric for metric in all_metrics if any(described[metric]["count"] for described in results.metrics.values())
    ]
    differing = _differing(results, with_values) or with_values[:1] or all_metrics
    constant = ", ".join(metric for metric in with_values if metric not in differing)
    # No more configurations than distinguishable colours.
    names = results.configurations[:MOST_CONFIGURATIONS]
    # The value of a seed has no meaning.
    varied = [path for path in results.varied if path != NOISE_SEED]
    grid = [number["path"] for number in study.get("vary", ()) if number["kind"] in _GRIDDED]
    # Over two paths each configuration has a panel of each metric, a map or points; else all share one panel.
    is_mapped = 2 in (len(grid), len(varied))
    # Panels over two paths of several configurations have a row for each metric.
    is_compared = is_mapped and len(names) > 1
    most = MOST_COMPARED if is_compared else MOST_METRICS
    # Metrics of a part of the run, such as rms_error_ramp, come after those of the whole run.
    of_part = {metric for metric in differing for whole in differing if metric.startswith(f"{whole}_")}
    metrics = sorted(differing, key=of_part.__contains__)[:most]
    left_out = ", ".join(metric for metric in differing if metric not in metrics)
    # A map of the verdict, if some runs follow their reference and others do not.
    if is_mapped and "not_following" in results.summary:
        verdicts = np.concatenate(list(results.thin(FOLLOWS, MAXIMUM_DRAWN).values()))
        metrics += [FOLLOWS] if {0.0, 1.0} <= set(verdicts.tolist()) else []
    title = f"{results.name}, {results.summary['completed']:,} runs"
    if not is_mapped and len(varied) > 1:
        labels = [label_of(path) for path in varied[:_NAMED]]
        # Within the sentence a label is in lower case, but for abbreviations.
        labels = [label if label[:2].isupper() else label[:1].lower() + label[1:] for label in labels]
        more = f" and {len(varied) - _NAMED} more" if len(varied) > _NAMED else ""
        title += f" over {len(varied)} values: {', '.join(labels)}{more}"
    count = len(metrics) + len(study["outputs"].get("bands", ()))
    return Section(
        said=sentences,
        remarks=remarks,
        panels=partial(_panels, results, metrics, names, varied, grid),
        name=FIGURE,
        caption=_CAPTION
        + f" Not drawn, because without a difference in the runs: {constant}." * bool(constant)
        + f" Not drawn either, unless outputs.metrics names at most {most}: {left_out}." * bool(left_out),
        across=len(names) if is_compared else min(_COLUMNS, max(1, count)),
        size=_COMPARED_PANEL if is_compared else _PANEL,
        title=title,
        is_detail=True,
    )


def _differing(results: StudyResults, metrics: Sequence[str]) -> list[str]:
    """Return the metrics that differ between runs in their displayed digits, each set of equal metrics once."""
    chosen: dict[str, str] = {}
    for metric in metrics:
        kind = metric_kind(results, metric)
        rows = [described[metric] for described in results.metrics.values() if described[metric]["count"]]
        ends = [[kind.text(row[end]) for end in ("minimum", "maximum") if end in row] for row in rows]
        if any(len(set(texts)) != 1 for texts in ends) or len({texts[0] for texts in ends}) > 1:
            # Equal in every statistic is equal in every run.
            chosen.setdefault(str(rows), metric)
    return list(chosen.values())


def _panels(
    results: StudyResults, metrics: Sequence[str], names: Sequence[str], varied: Sequence[str], grid: Sequence[str]
) -> list[Panel]:
    """Return a panel for each metric and each band.

    Over two paths, every configuration has its own panel of a metric.
    """
    if 2 in (len(grid), len(varied)):
        over_two = partial(_map, results, grid) if len(grid) == 2 else partial(_points, results, varied)
        panels = [over_two(metric, name, len(names) > 1) for metric in metrics for name in names]
    elif len(varied) == 1:
        panels = [_over(results, varied[0], metric, names) for metric in metrics]
    else:
        panels = [_histogram(results, metric) for metric in metrics]
    panels += [_band(results, channel, names) for channel in results.document["study"]["outputs"].get("bands", ())]
    # The first panel with curves names the configurations for all.
    with_names = next((panel for panel in panels if len(names) > 1 and any(mark.label for mark in panel.marks)), None)
    return [replace(panel, legend="inside" if panel is with_names else "") for panel in panels]


def _kind(results: StudyResults, path: str) -> Kind:
    """Return label, unit and number format of the values of a varied path."""
    varied = results.document["varied"][path]
    return of_path(path, varied["unit"].removeprefix("-"), given=varied.get("given", ""))


def _histogram(results: StudyResults, metric: str) -> Panel:
    """Return a panel with the histogram of a metric for every configuration."""
    values_by_name = {name: values[np.isfinite(values)] for name, values in results.thin(metric, MAXIMUM_DRAWN).items()}
    filled = [values for values in values_by_name.values() if values.size]
    marks = []
    if filled:
        low, high = min(float(values.min()) for values in filled), max(float(values.max()) for values in filled)
        are_whole = all(bool(np.all(values == np.round(values))) for values in filled)
        if high == low:
            # One bar about the only value.
            edges = low + (abs(low) or 1.0) * np.array([-0.05, 0.05])
        elif are_whole and high - low < _HISTOGRAM_BINS:
            # A bin for each whole number where values are counts of few kinds: others would be empty now and then.
            edges = np.arange(low - 0.5, high + 1.0)
        else:
            bins = min(_HISTOGRAM_BINS, max(8, round(sum(values.size for values in filled) ** 0.5)))
            edges = np.linspace(low, high, 1 + bins)
        for (name, values), colour in zip(values_by_name.items(), COLOURS, strict=False):
            marks.append(Mark("bars", edges, np.histogram(values, edges)[0], label=name, colour=colour))
    kind = metric_kind(results, metric)
    only = {"xticks": kind.values(np.array([low]))} if filled and high == low else {}
    return Panel(kind, Kind(), marks, then=methodcaller("set", yticks=[], **only))


def _over(results: StudyResults, path: str, metric: str, names: Sequence[str]) -> Panel:
    """Return a panel of a metric over the single varied path."""
    across, values = results.thin(path, MAXIMUM_DRAWN), results.thin(metric, MAXIMUM_DRAWN)
    marks = []
    for name, colour in zip(names, COLOURS, strict=False):
        # Draws come in any order, a line goes from left to right.
        order = np.argsort(across[name], kind="stable")
        order = order[:: max(1, order.size // _MAXIMUM_POINTS)]
        marks.append(
            Mark("line", across[name][order], values[name][order], label=name, colour=colour, style={"marker": "."})
        )
    return Panel(_kind(results, path), metric_kind(results, metric), marks)


def _map(results: StudyResults, grid: Sequence[str], metric: str, name: str, is_compared: bool) -> Panel:
    """Return a map of the mean of a metric over two paths for one configuration; white if no run completed."""
    across, upward = (results.thin(path, MAXIMUM_DRAWN)[name] for path in grid)
    columns, column = np.unique(across, return_inverse=True)
    rows, row = np.unique(upward, return_inverse=True)
    # A point of the grid may have several draws, some of which failed: the mean of the others.
    values = results.thin(metric, MAXIMUM_DRAWN)[name]
    cell, known = row * columns.size + column, np.isfinite(values)
    count = np.bincount(cell[known], minlength=rows.size * columns.size)
    total = np.bincount(cell[known], weights=values[known], minlength=rows.size * columns.size)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(rows.size, columns.size)
    kind = metric_kind(results, metric)
    declared = {number["path"]: number for number in results.document["study"]["vary"]}
    kinds = [_kind(results, path) for path in grid]
    # Values of a list are drawn side by side, in cells of equal size, with their values at the ticks.
    are_listed = [declared[path]["kind"] == "list" for path in grid]
    places = [
        np.arange(float(levels.size)) if is_listed else levels
        for levels, is_listed in zip((columns, rows), are_listed, strict=True)
    ]

    def mark_axes(axes: "Axes") -> None:
        """Set ticks for the values of a list, and logarithmic scales."""
        axes.grid(visible=False)
        sides = ((axes.xaxis, axes.set_xscale, columns), (axes.yaxis, axes.set_yscale, rows))
        for number, (axis, set_scale, levels) in enumerate(sides):
            if are_listed[number]:
                axis.set_ticks(places[number], [f"{value:g}" for value in kinds[number].values(levels)])
            elif declared[grid[number]].get("spacing") == "logarithmic":
                set_scale("log")

    marks = (Mark("map", places[0], places[1], kind.values(mean)),)
    across_kind, upward_kind = (
        Kind(axis_kind.axis) if is_listed else axis_kind for axis_kind, is_listed in zip(kinds, are_listed, strict=True)
    )
    return Panel(across_kind, upward_kind, marks, name if is_compared else "", scale=kind, then=mark_axes)


def _points(results: StudyResults, paths: Sequence[str], metric: str, name: str, is_compared: bool) -> Panel:
    """Return a panel of points over two drawn values, coloured by a metric, for one configuration."""
    most, kind = _MAXIMUM_POINTS * len(results.configurations), metric_kind(results, metric)
    x, y, values = (results.thin(path, most)[name] for path in (*paths, metric))
    marks = (Mark("points", x, y, kind.values(values)),)
    across, upward = (_kind(results, path) for path in paths)
    return Panel(across, upward, marks, name if is_compared else "", scale=kind)


def _band(results: StudyResults, channel: str, names: Sequence[str]) -> Panel:
    """Return a panel with the quantile bands of a channel for every configuration.

    The outermost pair of quantiles is drawn light, the next one darker.
    """
    table = results.bands()
    # The quantiles that the study asked for are the columns of its file.
    fractions = sorted(float(name[1:]) for name in table if name.startswith("q"))
    pairs = [(low, high) for low, high in zip(fractions, reversed(fractions), strict=True) if low < high]
    marks = []
    for name, colour in zip(names, COLOURS, strict=False):
        rows = (table["configuration"] == name) & (table["channel"] == channel)
        for pair, opacity in zip(pairs, _OPACITIES, strict=False):
            ends = np.stack([table[f"q{fraction:g}"][rows] for fraction in pair])
            marks.append(Mark("band", table["time"][rows], ends, colour=colour, style={"alpha": opacity}))
        if _MEDIAN in fractions:
            marks.append(Mark("line", table["time"][rows], table["q0.5"][rows], label=name, colour=colour))
    unit = CHANNELS[channel].unit
    kind = Kind(channel.replace("_", " ").capitalize(), unit, quantity_of_unit(unit))
    percentages = ", ".join(f"{100.0 * fraction:g}" for fraction in fractions)
    title = f"{percentages} % of runs below"
    return Panel(TIME, kind, marks, then=lambda axes: axes.set_title(title, fontsize=font_size(9.0)))
