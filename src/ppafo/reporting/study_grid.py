"""Maps of a metric over two varied paths: the mean over the draws at every grid point."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.reporting.study_units import Floats, metric_label, shown_path, shown_values
from ppafo.studies.sweep.results import StudyResults

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

MOST_DRAWN = 4_000_000
"""Runs from which a figure is drawn, spread evenly over all; the numbers beside it are from all of them."""

_GRIDDED = ("grid", "list")


def is_map(results: StudyResults) -> bool:
    """Tell whether exactly two paths vary over a grid or list."""
    return len(_gridded_paths(results)) == 2


def draw_map(axes: "Axes", results: StudyResults, name: str, metric: str) -> None:
    """Draw the mean of a metric over the two paths, for one configuration; white where no run completed."""
    across, upward = _gridded_paths(results)
    columns, column = np.unique(results.thinned(across, MOST_DRAWN)[name], return_inverse=True)
    rows, row = np.unique(results.thinned(upward, MOST_DRAWN)[name], return_inverse=True)
    values = shown_values(metric, results.thinned(metric, MOST_DRAWN)[name])
    mean = _means(values, row * columns.size + column, rows.size * columns.size).reshape(rows.size, columns.size)
    (x_label, x), (y_label, y) = shown_path(results, across, columns), shown_path(results, upward, rows)
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
    label = metric_label(metric)
    axes.set_title(label if len(results.configurations) == 1 else f"{label}, {name}")


def _gridded_paths(results: StudyResults) -> list[str]:
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
