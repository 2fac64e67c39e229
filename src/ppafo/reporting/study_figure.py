"""The figure of a study: what its metrics came to, how they hang on what varied, and bands over time."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.reporting.study_bands import draw_bands
from ppafo.reporting.study_grid import MOST_DRAWN, draw_map, is_map
from ppafo.reporting.study_units import Floats, metric_label, shown_path, shown_values
from ppafo.reporting.style import BLUE, GREEN, GREY, ORANGE, VERMILION, house_style, mark_kind
from ppafo.studies.sweep.noise import NOISE
from ppafo.studies.sweep.results import StudyResults

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, GREY)
MOST_METRICS, MOST_CONFIGURATIONS = 9, len(COLOURS)
_COLUMNS, _PANEL = 3, (3.5, 2.7)
_HISTOGRAM_BINS = 60
_MOST_POINTS = 3000


def study_figure(results: StudyResults) -> "Figure":
    """Return maps for a grid of two axes, otherwise a panel a metric; and a panel for each band."""
    from matplotlib.figure import Figure

    metrics = list(results.document["metrics"])[:MOST_METRICS]
    bands = list(results.document["study"]["outputs"].get("bands", ()))
    names = results.configurations[:MOST_CONFIGURATIONS]
    mapped = is_map(results)
    panels = [(metric, name) for metric in metrics for name in (names if mapped else ("",))]
    count = max(1, len(panels) + len(bands))
    columns = 2 if count == 4 else min(_COLUMNS, count)
    rows = -(-count // columns)
    with house_style():
        figure = Figure(figsize=(_PANEL[0] * columns + 0.3, _PANEL[1] * rows + 0.7), layout=_layout())
        grid = figure.subplots(rows, columns, squeeze=False)
        places = list(grid.flat)
        _draw_metrics(places, panels, results, mapped)
        for axes, channel in zip(places[len(panels) :], bands, strict=False):
            draw_bands(axes, results, channel, dict(zip(names, COLOURS, strict=False)))
        for axes in places[len(panels) + len(bands) :]:
            axes.set_axis_off()
        _finish(figure, results, names, mapped)
        return figure


def _layout() -> "ConstrainedLayoutEngine":
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    return ConstrainedLayoutEngine(w_pad=0.12, h_pad=0.08)


def _draw_metrics(places: "list[Axes]", panels: list[tuple[str, str]], results: StudyResults, mapped: bool) -> None:
    device = [path for path in results.varied if path != NOISE]
    for axes, (metric, name) in zip(places, panels, strict=False):
        if mapped:
            draw_map(axes, results, name, metric)
        elif len(device) == 1:
            _draw_over(axes, results, device[0], metric)
        else:
            _draw_histogram(axes, results, metric)


def _draw_histogram(axes: "Axes", results: StudyResults, metric: str) -> None:
    """Draw how often each value came, for every configuration."""
    parts = {name: shown_values(metric, values) for name, values in results.thinned(metric, MOST_DRAWN).items()}
    parts = {name: values[np.isfinite(values)] for name, values in parts.items()}
    axes.set_xlabel(metric_label(metric))
    axes.set_yticks([])
    filled = [values for values in parts.values() if values.size]
    if not filled:
        return
    edges = _edges(filled)
    for (name, own), colour in zip(parts.items(), COLOURS, strict=False):
        counts, _ = np.histogram(own, edges)
        axes.stairs(counts, edges, fill=True, color=colour, alpha=0.35)
        axes.stairs(counts, edges, color=colour, linewidth=1.2, label=name)


def _edges(parts: list[Floats]) -> Floats:
    """Return the edges of the bins: one for each whole number where values are counts of few kinds."""
    low, high = min(float(part.min()) for part in parts), max(float(part.max()) for part in parts)
    if high - low < _HISTOGRAM_BINS and all(bool(np.all(part == np.round(part))) for part in parts):
        return np.arange(low - 0.5, high + 1.0)
    size = sum(part.size for part in parts)
    return np.linspace(low, high or low + 1.0, 1 + min(_HISTOGRAM_BINS, max(8, round(size**0.5))))


def _draw_over(axes: "Axes", results: StudyResults, path: str, metric: str) -> None:
    """Draw a metric over the one path that varies."""
    across, values = results.thinned(path, MOST_DRAWN), results.thinned(metric, MOST_DRAWN)
    for name, colour in zip(results.configurations, COLOURS, strict=False):
        order = np.argsort(across[name], kind="stable")
        order = order[:: max(1, order.size // _MOST_POINTS)]
        shown = shown_path(results, path, across[name][order])[1]
        axes.plot(shown, shown_values(metric, values[name])[order], ".-", color=colour, label=name)
    axes.set_xlabel(shown_path(results, path, np.zeros(1))[0])
    axes.set_ylabel(metric_label(metric))


def _finish(figure: "Figure", results: StudyResults, names: tuple[str, ...], mapped: bool) -> None:
    """Name the study and its configurations above the panels."""
    from matplotlib.lines import Line2D

    figure.suptitle(f"{results.name}, {results.summary['completed']:,} runs", x=0.01, ha="left", fontsize=11)
    if not mapped and len(names) > 1:
        handles = [Line2D([], [], color=colour) for colour in COLOURS[: len(names)]]
        figure.legend(handles, names, loc="outside lower center", ncols=len(names))
    mark_kind(figure, "simulated")
