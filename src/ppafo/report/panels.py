"""Panels of a figure: description as data, and drawing with Matplotlib, which computes the layout."""

import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.report.kind import YES_OR_NO, Kind
from ppafo.report.style import (
    BLUE,
    DASHES,
    FULL_WIDTH,
    GREY,
    font_size,
    house_style,
    lay_out,
    mark_kind,
    print_scale,
    printed_width,
)
from ppafo.signals import RecordingKind
from ppafo.wording import without_exponent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.ticker import Formatter

_TOP = 0.28
"""Height above the panels for the mark "simulated" or "synthetic" [inches]."""
_LINE = 0.17
"""Line height of the note, and of a legend above all panels [inches]."""
_UNDER_NAMES = 0.08
"""Space between a legend above all panels and the panels [inches]."""
_UNBROKEN = "\u00a0"
"""Space at which no line of a title is broken."""
# Letters of a title per inch, fewest letters per line, and width of the mark "simulated" [inches].
_LETTERS = 11.0
_FEWEST_LETTERS = 24
_KIND = 1.0
# Width of a legend entry without its label [inches], and letters of a label per inch.
_ENTRY = 0.53
_ENTRY_LETTERS = 14.5
# Height of a legend row, and distance from the axes to a title [points].
_ROW = 11.0
_ABOVE = 6.0
_HIGHEST = 9.4
"""Largest height of a figure [inches]: the height of the text on a page."""
# Width of a figure outside its panels, and least width of a panel beside another, at a font of 10 pt [inches].
_EDGES = 0.3
_NARROWEST = 2.4
# Letters of an axis label per inch, and width or height of a panel outside its axes [inches].
_LABEL_LETTERS = 13.0
_AXIS_ROOM = 0.55
# Font size of a title [points], and smallest relative size of a shortened title.
_TITLE_SIZE = 11.0
_SMALLEST_TITLE = 0.72
# Limits of a logarithmic axis whose tick labels are written without an exponent.
_SMALLEST_PLAIN = 1.0e-4
_LARGEST_PLAIN = 1.0e7
# Ratio of the ends of a horizontal and of any logarithmic axis below which 2 and 5 of every decade have a label.
_ONE_DECADE = 10.0
_FEW_DECADES = 100.0
_TITLE_LINE = 0.2
"""Line height of the title [inches]."""


@dataclass(frozen=True, slots=True)
class Mark:
    """Graphical element of a panel: shape (of ``SHAPES``), positions [SI], label, colour and Matplotlib keywords.

    ``to`` holds further numbers [SI], by shape: end positions, half widths or values shown as colours.
    """

    shape: str
    x: Any = ()
    y: Any = ()
    to: Any = ()
    label: str = ""
    colour: str = BLUE
    style: Mapping[str, Any] = field(default_factory=dict)


def dots(x: Any, y: Any, marker: str, label: str = "", colour: str = BLUE, **style: Any) -> Mark:
    """Return points without a line [SI], with Matplotlib keywords."""
    return Mark("line", x, y, label=label, colour=colour, style={"linestyle": "", "marker": marker, **style})


@dataclass(frozen=True, slots=True)
class Panel:
    """Panel of a figure.

    Panels in the same column with ``shares_x`` share the horizontal axis and show the label of the vertical axis as
    title. A panel without marks stays empty; a panel with ``shares_x`` is widened to the whole row if all other panels
    of the row are empty.

    - ``x``, ``y``: kinds of the numbers on the axes
    - ``marks``: graphical elements
    - ``title``: title, empty without one
    - ``scale``: kind of the numbers shown by colours; consecutive panels with the same scale share a colour bar
    - ``legend``: position: "above", "inside", "figure" (above all panels) or empty
    - ``then``: function that is called last with the axes
    - ``tall``: height relative to the other panels [-]
    - ``shares_x``: True to share the horizontal axis
    """

    x: Kind
    y: Kind
    marks: Sequence[Mark]
    title: str = ""
    scale: Kind | None = None
    legend: str = "above"
    then: "Callable[[Axes], object] | None" = None
    tall: float = 1.0
    shares_x: bool = False


_MARKUP = re.compile(r"\\[a-z]+|[${}_^]")
"""Pattern of the markup in a title, which takes no space on the page."""
_OF_LEGEND: Mapping[str, Any] = {
    "borderaxespad": 0.1,
    "handlelength": 2.2,
    "columnspacing": 1.2,
    "labelspacing": 0.2,
    "borderpad": 0.2,
}
"""Matplotlib keywords of a legend above the panels."""
_AREA = {"alpha": 0.15, "linewidth": 0}
"""Default Matplotlib keywords of a band."""


def _bars(axes: "Axes", mark: Mark, x: Any, _y: Any) -> None:
    axes.stairs(mark.y, x, fill=True, color=mark.colour, alpha=0.35)
    axes.stairs(mark.y, x, color=mark.colour, label=mark.label, **{"linewidth": 1.2, **mark.style})


SHAPES: "Mapping[str, Callable[[Axes, Mark, Any, Any], object]]" = {
    "line": lambda axes, mark, x, y: axes.plot(x, y, color=mark.colour, label=mark.label, **mark.style),
    "reach": lambda axes, mark, x, y: axes.errorbar(
        x, y, xerr=mark.to, color=mark.colour, label=mark.label, **{"fmt": "o", **mark.style}
    ),
    "bars": _bars,
    "band": lambda axes, mark, x, y: axes.fill_between(
        x, y[0], y[1], color=mark.colour, label=mark.label, **_AREA | dict(mark.style)
    ),
    "span": lambda axes, mark, x, _y: axes.axvspan(
        x[0], x[1], color=mark.colour, label=mark.label, **_AREA | dict(mark.style)
    ),
    "level": lambda axes, mark, _x, y: axes.axhline(y, color=mark.colour, label=mark.label, **mark.style),
    "at": lambda axes, mark, x, _y: axes.axvline(x, color=mark.colour, label=mark.label, **mark.style),
    # Cells and points by the thousand are kept as pixels: as shapes they would make files of many megabytes.
    "map": lambda axes, mark, x, y: axes.pcolormesh(
        x, y, mark.to, shading="nearest", rasterized=True, cmap="cividis", **mark.style
    ),
    # A long text makes no panel narrower.
    "text": lambda axes, mark, x, y: axes.text(
        x, y, mark.label, color=mark.colour, **{**mark.style, "fontsize": font_size(mark.style.get("fontsize", 10.0))}
    ).set_in_layout(False),
    "points": lambda axes, mark, x, y: axes.scatter(
        x, y, c=mark.to, s=9, linewidths=0, cmap="cividis", rasterized=True, **mark.style
    ),
}
"""Drawing functions of marks by shape; arguments are axes, mark, and its positions in display units.

``line``, ``bars`` (edges and counts), ``reach`` (points with the half width ``to``), ``band`` (between two rows of y),
``span`` (between two x), ``level`` and ``at`` (horizontal and vertical line), ``text`` (the label), ``map`` and
``points`` (coloured by ``to``).
"""


def draw_panels(
    panels: Sequence[Panel],
    across: int = 1,
    size: tuple[float, float] = (5.2, 2.6),
    title: str = "",
    note: str = "",
    kind: RecordingKind = "simulated",
) -> "Figure":
    """Draw panels of a ``size`` [inches] as a figure, with ``across`` panels per row.

    ``note`` is printed below the panels.
    """
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    scale = print_scale()
    # In inches of a figure with fonts of 10 points; all of it is smaller by the scale of the fonts.
    width = printed_width(min(scale * (size[0] * across + _EDGES), FULL_WIDTH)) / scale
    fitting = max(1, int((width - _EDGES) / _NARROWEST))
    if fitting < across:
        if fitting == 1:
            panels = _in_one_column(panels, across)
        across = fitting
        # A panel that only keeps a place beside another has none to keep in one column.
        panels = [panel for panel in panels if panel.marks or across > 1]
    size = ((width - _EDGES) / across, size[1])
    rows = max(1, -(-len(panels) // across))
    heights = [max((panel.tall for panel in panels[across * row :][:across]), default=1.0) for row in range(rows)]
    # About 15 letters of this size go on an inch.
    notes = textwrap.wrap(note, round(15.0 * size[0] * across))
    below = _LINE * len(notes)
    # Beside the title stands what kind of numbers these are.
    lines = _title_lines(title, max(_FEWEST_LETTERS, round(_LETTERS * (width - _KIND))))
    shared = next((panel for panel in panels if panel.legend == "figure"), None)
    names, legend_rows = (0, 0) if shared is None else _legend_rows(shared, "", width if title else width - _KIND)
    legend_height = 0.0 if shared is None else _LINE * max(1, legend_rows) + _UNDER_NAMES
    # A title makes its own room.
    above = legend_height if title else max(_TOP, legend_height)
    # Rows of a legend beyond the first one take their height from no panel.
    legends = [
        max(0, _legend_rows(panel, _title(panel), size[0] - _AXIS_ROOM)[1] - 1) if panel.legend == "above" else 0
        for panel in panels
    ]
    legend_lines = sum(max(legends[across * row :][:across], default=0) for row in range(rows))
    around = 0.4 + below + legend_height + _LINE * legend_lines
    height = min(size[1] * sum(heights) + around, _HIGHEST / scale)
    size = (size[0], (height - around) / sum(heights))
    with house_style():
        rect = (0.0, below / height, 1.0, 1.0 - (above + below) / height)
        layout = ConstrainedLayoutEngine(w_pad=0.1 * scale, h_pad=0.08 * scale, rect=rect)
        figure = Figure(figsize=(scale * width, scale * height), layout=layout)
        grid = list(figure.subplots(rows, across, squeeze=False, height_ratios=heights).flat)
        widened = _widened(panels, across)
        for number in widened:
            grid[number].set_subplotspec(grid[number].get_subplotspec().get_gridspec()[number // across, :])
        panel_sizes = [(size[0] * across if number in widened else size[0], size[1]) for number in range(len(panels))]
        title_size = _TITLE_SIZE * min(map(_title_fit, panels, panel_sizes), default=1.0)
        drawn = [
            (axes, panel, _draw(axes, panel, panel_size, title_size))
            for axes, panel, panel_size in zip(grid, panels, panel_sizes, strict=False)
        ]
        for axes in grid[len(panels) :]:
            axes.set_axis_off()
        for number, (upper, lower, panel, other) in enumerate(
            zip(grid, grid[across:], panels, panels[across:], strict=False)
        ):
            has_same_width = (number in widened) == (number + across in widened)
            if panel.shares_x and other.shares_x and other.marks and has_same_width:
                upper.sharex(lower)
                upper.tick_params(labelbottom=False)
                upper.set_xlabel("")
        _share_scales(figure, drawn, size[1])
        if names:
            handles = next(axes for axes, panel, _ in drawn if panel is shared).get_legend_handles_labels()
            anchor = (0.002, 1.0 - (_TITLE_LINE * len(lines) + 0.08) / height)
            figure.legend(*handles, loc="upper left", bbox_to_anchor=anchor, ncols=names, **_OF_LEGEND)
        # Names and messages come from files: a dollar sign in them begins no formula.
        if title:
            figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=font_size(_TITLE_SIZE), parse_math=False)
        if notes:
            style: dict[str, Any] = {"fontsize": font_size(9.0), "color": GREY, "parse_math": False}
            figure.text(0.012, 0.06 / height, "\n".join(notes), va="bottom", **style)
        mark_kind(figure, kind)
        lay_out(figure)
        return figure


def _in_one_column(panels: Sequence[Panel], across: int) -> list[Panel]:
    """Return the panels of a grid in the order of a single column; each residual panel follows its curve panel."""
    owners = [
        number - across if number >= across and panel.shares_x and panel.tall < panels[number - across].tall else number
        for number, panel in enumerate(panels)
    ]
    return [panels[number] for number in sorted(range(len(panels)), key=lambda number: (owners[number], number))]


def _widened(panels: Sequence[Panel], across: int) -> set[int]:
    """Return the indices of panels over a shared axis that are alone in their row and take its whole width."""
    starts = range(0, len(panels), across)
    return {
        start
        for start in starts
        if panels[start].shares_x
        and across > 1
        and not any(panel.marks for panel in panels[start + 1 : start + across])
    }


def _title(panel: Panel) -> str:
    """Return the title of a panel: its own, or the label of the vertical axis."""
    return panel.title or (panel.y.axis if panel.shares_x else "")


def _title_lines(title: str, letters: int) -> list[str]:
    """Return the lines of a title; a clause that fits into one line is not broken."""
    clauses = [clause.replace(" ", _UNBROKEN) if len(clause) < letters else clause for clause in title.split(", ")]
    return [line.replace(_UNBROKEN, " ") for line in textwrap.wrap(", ".join(clauses), letters)]


def _title_fit(panel: Panel, size: tuple[float, float]) -> float:
    """Return the relative font size at which the title fits a panel of a size [inches], at most 1."""
    letters = max(1, len(_MARKUP.sub("", _title(panel)))) if panel.marks else 1
    return min(1.0, max(_SMALLEST_TITLE, _LETTERS * (size[0] - _AXIS_ROOM) / letters))


def _legend_rows(panel: Panel, title: str, width: float) -> tuple[int, int]:
    """Return the legend entries per row for a width [inches], and the number of legend rows above the title."""
    names = [mark.label for mark in panel.marks if mark.label and mark.shape != "text"]
    widths = [_ENTRY + len(name) / _ENTRY_LETTERS for name in dict.fromkeys(names)]
    title_width = len(title) / _LETTERS if title else 0.0
    if sum(widths) + title_width <= width:
        return len(widths), 0
    for columns in range(len(widths) - 1, 1, -1):
        # A legend is filled column by column.
        if sum(map(max, np.array_split(widths, columns))) <= width:
            return columns, -(-len(widths) // columns)
    return 1, len(widths)


def _draw(axes: "Axes", panel: Panel, size: tuple[float, float], title_size: float) -> Any:
    """Draw a panel of a size [inches], and return the Matplotlib object with a colour scale, if any.

    ``title_size`` is the font size of the title [points].
    """
    from matplotlib.ticker import FixedLocator, LogLocator, NullFormatter

    if not panel.marks:
        axes.set_axis_off()
        return None
    mapped = None
    # Lines of several colours, which would be one in grey, have the dashes of their colours.
    plain = {mark.colour for mark in panel.marks if mark.shape == "line" and "linestyle" not in mark.style}
    for mark in panel.marks:
        is_dashed = len(plain) > 1 and mark.shape == "line"
        style = {"linestyle": DASHES.get(mark.colour, "-"), **mark.style} if is_dashed else mark.style
        artist = SHAPES[mark.shape](axes, replace(mark, style=style), panel.x.values(mark.x), panel.y.values(mark.y))
        mapped = artist if mark.shape in ("map", "points") else mapped
    title = _title(panel)
    pad = _ABOVE
    axes.set_xlabel(_wrapped(panel.x.axis, size[0]))
    axes.set_ylabel(_wrapped(panel.y.axis, size[1] * panel.tall) if panel.title or not panel.shares_x else "")
    # A text carries its words itself.
    if panel.legend and any(mark.label for mark in panel.marks if mark.shape != "text"):
        if panel.legend == "above":
            # Above the axes, out of the way of the data; where there is no room beside the title, below that.
            across, rows = _legend_rows(panel, title, size[0] - _AXIS_ROOM)
            pad += _ROW * rows + (_ABOVE if rows else 0.0)
            # The title, which is higher, keeps the room; a legend that is wider than the axes makes them no narrower.
            axes.legend(
                loc="lower right" if rows == 0 else "lower left",
                bbox_to_anchor=(1.0, 1.0) if rows == 0 else (0.0, 1.0),
                ncols=across,
                **_OF_LEGEND,
            ).set_in_layout(not title)
        elif panel.legend == "inside":
            legend = axes.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none", handlelength=2.2)
            for entry in legend.get_texts():
                letters = _ENTRY_LETTERS * (size[0] - 1.3 * _AXIS_ROOM - _ENTRY)
                # Mathematics is shorter in print than in its source, and a break in it would print the source.
                if "$" not in entry.get_text():
                    lines = textwrap.wrap(entry.get_text(), max(_FEWEST_LETTERS // 2, round(letters)))
                    entry.set_text("\n".join(lines))
    axes.set_title(title, pad=print_scale() * pad, fontsize=font_size(title_size))
    # Last, so that it can undo what Matplotlib chose.
    if panel.then is not None:
        panel.then(axes)
    for axis in (axes.xaxis, axes.yaxis):
        # Ticks that a panel has set are kept.
        if axis.get_scale() == "log" and not isinstance(axis.get_major_locator(), FixedLocator):
            low, high = sorted(axis.get_view_interval())
            if high < _FEW_DECADES * low:
                # Labels side by side take more room than labels above each other.
                is_narrow = axis is axes.xaxis and high >= _ONE_DECADE * low
                axis.set_major_locator(LogLocator(subs=(1.0, 3.0) if is_narrow else (1.0, 2.0, 5.0)))
            axis.set_major_formatter(_logarithmic_ticks(axis))
            axis.set_minor_formatter(NullFormatter())
    return mapped


def _logarithmic_ticks(axis: "Axis") -> "Formatter":
    """Return the labels of a logarithmic axis: plain numbers, or all powers of ten where one would need an exponent."""
    from matplotlib.ticker import FuncFormatter, LogFormatterMathtext

    powers = LogFormatterMathtext()
    powers.set_axis(axis)

    def tick_label(value: float, _position: int | None) -> str:
        low, high = axis.get_view_interval()
        is_plain = low >= _SMALLEST_PLAIN and high < _LARGEST_PLAIN
        return without_exponent(value, ".6g") if is_plain else powers(value)

    return FuncFormatter(tick_label)


def _wrapped(label: str, length: float) -> str:
    """Return the label of an axis, wrapped to the length of the axis in a panel of a length [inches]."""
    letters = max(_FEWEST_LETTERS // 2, round(_LABEL_LETTERS * (length - _AXIS_ROOM)))
    return "\n".join(textwrap.wrap(label, letters, break_on_hyphens=False))


def _share_scales(figure: "Figure", drawn: "Sequence[tuple[Axes, Panel, Any]]", height: float) -> None:
    """Apply common limits and a colour bar to consecutive panels with the same scale; panel ``height`` [inches].

    ``drawn`` are the panels with their axes, and the object with a colour scale, or None.
    """
    for scale, group in groupby(drawn, key=lambda panel_drawn: panel_drawn[1].scale):
        if scale is None:
            continue
        axes, _, coloured = zip(*group, strict=True)
        limits = np.array([drawing.get_clim() for drawing in coloured], dtype=np.float64)
        # A panel of nothing but failed runs has no limits.
        limits = limits[np.isfinite(limits).all(axis=1)]
        if limits.size:
            lowest = float(limits[:, 0].min())
            highest = float(limits[:, 1].max())
            for drawing in coloured:
                drawing.set_clim(lowest, highest)
        bar = figure.colorbar(coloured[0], ax=axes, pad=0.02)
        bar.set_label(_wrapped(scale.axis, height))
        values = np.concatenate([np.ma.compressed(drawing.get_array()) for drawing in coloured])
        if scale.words.endswith(YES_OR_NO) and np.isin(values[np.isfinite(values)], (0.0, 1.0)).all():
            for drawing in coloured:
                drawing.set(clim=(0.0, 1.0), cmap=drawing.get_cmap().resampled(2))
            bar.set_ticks([0.25, 0.75], labels=["no", "yes"])
            bar.set_label(_wrapped(scale.words.removesuffix(YES_OR_NO), height))
