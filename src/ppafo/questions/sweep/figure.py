"""The figure of a sweep: what its metrics came to, how they depend on what varied, and bands over time."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.display_units import axis_unit, display_values, quantity_of_unit
from ppafo.answers.shown_metrics import metric_quantity, metric_title
from ppafo.answers.style import BLUE, GREEN, GREY, ORANGE, VERMILION, house_style, mark_kind
from ppafo.questions.sweep.results import StudyResults
from ppafo.signals.channels import CHANNELS
from ppafo.studies.distributions import Floats
from ppafo.studies.noise import NOISE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, GREY)
MOST_METRICS, MOST_CONFIGURATIONS = 9, len(COLOURS)
_COLUMNS, _PANEL = 3, (3.5, 2.7)
_HISTOGRAM_BINS = 60
_MAXIMUM_POINTS = 3000
_MEDIAN = 0.5
_OPACITIES = (0.18, 0.32, 0.45)
MAXIMUM_DRAWN = 4_000_000
"""Runs from which a figure is drawn, spread evenly over all; the numbers beside it are from all of them."""

_GRIDDED = ("grid", "list")


def study_figure(results: StudyResults) -> "Figure":
    """Return maps for a grid of two axes, otherwise a panel a metric; and a panel for each band."""
    from matplotlib.figure import Figure

    metrics = list(results.document["metrics"])[:MOST_METRICS]
    bands = list(results.document["study"]["outputs"].get("bands", ()))
    names = results.configurations[:MOST_CONFIGURATIONS]
    is_mapped = _is_map(results)
    panels = [(metric, name) for metric in metrics for name in (names if is_mapped else ("",))]
    count = max(1, len(panels) + len(bands))
    columns = 2 if count == 4 else min(_COLUMNS, count)
    rows = -(-count // columns)
    with house_style():
        figure = Figure(figsize=(_PANEL[0] * columns + 0.3, _PANEL[1] * rows + 0.7), layout=_layout())
        grid = figure.subplots(rows, columns, squeeze=False)
        places = list(grid.flat)
        _draw_metrics(places, panels, results, is_mapped)
        for axes, channel in zip(places[len(panels) :], bands, strict=False):
            _draw_bands(axes, results, channel, dict(zip(names, COLOURS, strict=False)))
        for axes in places[len(panels) + len(bands) :]:
            axes.set_axis_off()
        _finish(figure, results, names, is_mapped)
        return figure


def _layout() -> "ConstrainedLayoutEngine":
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    return ConstrainedLayoutEngine(w_pad=0.12, h_pad=0.08)


def _draw_metrics(places: "list[Axes]", panels: list[tuple[str, str]], results: StudyResults, is_mapped: bool) -> None:
    device = [path for path in results.varied if path != NOISE]
    for axes, (metric, name) in zip(places, panels, strict=False):
        if is_mapped:
            _draw_map(axes, results, name, metric)
        elif len(device) == 1:
            _draw_over(axes, results, device[0], metric)
        else:
            _draw_histogram(axes, results, metric)


def _draw_histogram(axes: "Axes", results: StudyResults, metric: str) -> None:
    """Draw how often each value came, for every configuration."""
    parts = {name: _metric_values(metric, values) for name, values in results.thin(metric, MAXIMUM_DRAWN).items()}
    parts = {name: values[np.isfinite(values)] for name, values in parts.items()}
    axes.set_xlabel(metric_title(metric))
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
    across, values = results.thin(path, MAXIMUM_DRAWN), results.thin(metric, MAXIMUM_DRAWN)
    for name, colour in zip(results.configurations, COLOURS, strict=False):
        order = np.argsort(across[name], kind="stable")
        order = order[:: max(1, order.size // _MAXIMUM_POINTS)]
        shown = _path_for_display(results, path, across[name][order])[1]
        axes.plot(shown, _metric_values(metric, values[name])[order], ".-", color=colour, label=name)
    axes.set_xlabel(_path_for_display(results, path, np.zeros(1))[0])
    axes.set_ylabel(metric_title(metric))


def _finish(figure: "Figure", results: StudyResults, names: tuple[str, ...], is_mapped: bool) -> None:
    """Name the study and its configurations above the panels."""
    from matplotlib.lines import Line2D

    figure.suptitle(f"{results.name}, {results.summary['completed']:,} runs", x=0.01, ha="left", fontsize=11)
    if not is_mapped and len(names) > 1:
        handles = [Line2D([], [], color=colour) for colour in COLOURS[: len(names)]]
        figure.legend(handles, names, loc="outside lower center", ncols=len(names))
    mark_kind(figure, "simulated")


def _is_map(results: StudyResults) -> bool:
    """Tell whether exactly two paths vary over a grid or list."""
    return len(_grid_paths(results)) == 2


def _draw_map(axes: "Axes", results: StudyResults, name: str, metric: str) -> None:
    """Draw the mean of a metric over the two paths, for one configuration; white where no run completed."""
    across, upward = _grid_paths(results)
    columns, column = np.unique(results.thin(across, MAXIMUM_DRAWN)[name], return_inverse=True)
    rows, row = np.unique(results.thin(upward, MAXIMUM_DRAWN)[name], return_inverse=True)
    values = _metric_values(metric, results.thin(metric, MAXIMUM_DRAWN)[name])
    mean = _means(values, row * columns.size + column, rows.size * columns.size).reshape(rows.size, columns.size)
    (x_label, x), (y_label, y) = _path_for_display(results, across, columns), _path_for_display(results, upward, rows)
    mesh = axes.pcolormesh(x, y, mean, shading="nearest", rasterized=True, cmap="cividis")
    axes.figure.colorbar(mesh, ax=axes, pad=0.02)
    axes.grid(visible=False)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    if _is_logarithmic(results, across):
        axes.set_xscale("log")
        _mark_plainly(axes.xaxis)
    if _is_logarithmic(results, upward):
        axes.set_yscale("log")
        _mark_plainly(axes.yaxis)
    label = metric_title(metric)
    axes.set_title(label if len(results.configurations) == 1 else f"{label}, {name}")


def _grid_paths(results: StudyResults) -> list[str]:
    return [item["path"] for item in results.document["study"].get("vary", ()) if item["kind"] in _GRIDDED]


def _means(values: Floats, place: "np.ndarray[tuple[int], np.dtype[np.int64]]", places: int) -> Floats:
    """Return the mean of the values at each place, nan where there are none."""
    known = np.isfinite(values)
    count = np.bincount(place[known], minlength=places)
    total = np.bincount(place[known], weights=values[known], minlength=places)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _is_logarithmic(results: StudyResults, path: str) -> bool:
    items = {item["path"]: item for item in results.document["study"]["vary"]}
    return bool(items[path].get("spacing") == "logarithmic")


def _mark_plainly(axis: "Axis") -> None:
    """Put plain numbers at 1, 2 and 5 of every decade."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def _draw_bands(axes: "Axes", results: StudyResults, channel: str, colours: Mapping[str, str]) -> None:
    """Draw the bands of a channel for every configuration: the outermost pair of quantiles light, the next darker."""
    table, unit = results.bands(), CHANNELS[channel].unit
    quantity = quantity_of_unit(unit)
    levels = {name: display_values(values, quantity) for name, values in table.items() if name.startswith("q")}
    fractions = sorted(float(name[1:]) for name in levels)
    pairs = [(low, high) for low, high in zip(fractions, reversed(fractions), strict=True) if low < high]
    for name, colour in colours.items():
        own = (table["configuration"] == name) & (table["channel"] == channel)
        time = table["time"][own]
        for (low, high), opacity in zip(pairs, _OPACITIES, strict=False):
            axes.fill_between(
                time, levels[f"q{low:g}"][own], levels[f"q{high:g}"][own], color=colour, alpha=opacity, linewidth=0
            )
        if _MEDIAN in fractions:
            axes.plot(time, levels["q0.5"][own], color=colour, label=name)
    axes.set_xlabel("time (s)")
    label = channel.replace("_", " ")
    axes.set_ylabel(_axis_label(label, quantity, unit))
    percentages = ", ".join(f"{100.0 * fraction:g}" for fraction in fractions)
    axes.set_title(f"{label}: {percentages} % of runs below", fontsize=9)


def _metric_values(name: str, values: Floats) -> Floats:
    return display_values(values, metric_quantity(name))


def _path_for_display(results: StudyResults, path: str, values: Floats) -> tuple[str, Floats]:
    """Return label and values of a varied path [SI] in the units of the field."""
    unit = results.document["varied"][path]["unit"]
    quantity = quantity_of_unit(unit)
    return _axis_label(path.replace(".", " ").replace("_", " "), quantity, unit), display_values(values, quantity)


def _axis_label(name: str, quantity: str, unit: str) -> str:
    """Return a name with the unit in which it is drawn: that of its quantity, else its own."""
    drawn = axis_unit(quantity) if quantity else unit.removeprefix("-")
    return f"{name} ({drawn})" if drawn else name
