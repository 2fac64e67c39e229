"""Figures laid out by hand, in inches: matplotlib's automatic layouts draw a figure several times over."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True)
class Margins:
    """Inches around the panels, between rows and between columns, and from a panel to the name of its value axis."""

    left: float
    right: float
    top: float
    bottom: float
    row_gap: float
    column_gap: float = 0.0
    label: float = 0.5


def figure_of_panels(
    size: tuple[float, float], margins: Margins, rows: int, columns: int = 1, heights: Sequence[float] | None = None
) -> "tuple[Figure, list[list[Axes]]]":
    """Return a figure of this width and height [inches] and its panels by row, all of them over one horizontal axis."""
    figure, panel_width = _figure_with_margins(size, margins, rows, columns)
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False, height_ratios=heights).tolist()
    for axes in figure.axes:
        axes.yaxis.set_label_coords(-margins.label / panel_width, 0.5)
    return figure, grid


def figure_of_free_panels(
    size: tuple[float, float], margins: Margins, rows: int, columns: int, widths: Sequence[float] | None = None
) -> "tuple[Figure, list[list[Axes]]]":
    """Return a figure of this width and height [inches] and its panels by row, each with axes of its own."""
    figure, _ = _figure_with_margins(size, margins, rows, columns)
    return figure, figure.subplots(rows, columns, squeeze=False, width_ratios=widths).tolist()


def _figure_with_margins(
    size: tuple[float, float], margins: Margins, rows: int, columns: int
) -> "tuple[Figure, float]":
    """Return an empty figure with its margins, and the width of a panel [inches]."""
    from matplotlib.figure import Figure

    width, height = size
    panel_width = (width - margins.left - margins.right - (columns - 1) * margins.column_gap) / columns
    panel_height = (height - margins.top - margins.bottom - (rows - 1) * margins.row_gap) / rows
    figure = Figure(figsize=size)
    figure.subplots_adjust(
        left=margins.left / width,
        bottom=margins.bottom / height,
        right=1.0 - margins.right / width,
        top=1.0 - margins.top / height,
        wspace=margins.column_gap / panel_width,
        hspace=margins.row_gap / panel_height,
    )
    return figure, panel_width
