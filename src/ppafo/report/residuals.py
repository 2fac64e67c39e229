"""Panels of fits and comparisons: measurements with the fitted model, and the residuals."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ppafo.report.kind import Kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, BLUE, CHAMBER_1, CHAMBER_2, GREY, VERMILION
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_HOLLOW = {"linestyle": "", "markerfacecolor": "none"}
_READING = {"linestyle": "none", "markersize": 5, "markeredgewidth": 1.1}
_ROUNDING = 1.0e-9
"""Largest residual, relative to the range of the samples, that counts as zero [-]."""


class _ReadingStyle(NamedTuple):
    """Style of measured points: colour, largest number of points drawn, Matplotlib keywords.

    The number is limited because a page with every sample would be several megabytes.
    """

    colour: str
    most: int
    style: dict[str, Any]


_LOOKS = {
    "rising": _ReadingStyle(BLUE, 1200, {"marker": "x", **_READING}),
    "falling": _ReadingStyle(VERMILION, 1200, {"marker": "o", "markerfacecolor": "none", **_READING}),
    "measured": _ReadingStyle(BLUE, 1200, {"marker": ".", "linestyle": "none", "markersize": 4}),
    "circles": _ReadingStyle(BLACK, 90, {"marker": "o", "markersize": 3.6, "markeredgewidth": 0.7, **_HOLLOW}),
    "pressure_1": _ReadingStyle(CHAMBER_1.colour, 1200, {"marker": "^", "linestyle": "none", "markersize": 3}),
    "pressure_2": _ReadingStyle(CHAMBER_2.colour, 1200, {"marker": "v", "linestyle": "none", "markersize": 3}),
    "dots": _ReadingStyle(BLACK, 400, {"marker": ".", "markersize": 2.6, "linestyle": ""}),
}
"""Styles of measured points by name."""


def readings_mark(label: str, x: Floats, y: Floats, look: str = "measured") -> Mark:
    """Return measured points [SI] as a mark in a named style; of many points, an evenly spaced subset is drawn."""
    drawn_as = _LOOKS[look]
    some = slice(None, None, math.ceil(x.size / drawn_as.most))
    return Mark("line", x[some], y[some], (), label, drawn_as.colour, drawn_as.style)


def curve_mark(label: str, x: Floats, y: Floats) -> Mark:
    """Return the curve of a model [SI], sorted by x, as a mark; an empty label keeps it out of the legend."""
    order = np.argsort(x, kind="stable")
    return Mark("line", x[order], y[order], (), label, BLACK, {"linewidth": 1.4})


def with_residuals(
    title: str, x: Kind, y: Kind, series: Sequence[tuple[str, str, Floats, Floats, Floats]], curves: Sequence[Mark]
) -> tuple[Panel, Panel]:
    """Return a panel of readings with curves of the model, and a panel of the residuals.

    ``series`` are label, name of the style, horizontal positions, readings and model [SI]; the last lies uppermost.
    """
    quantity = "pressure change" if y.quantity == "pressure" else y.quantity
    upper = [readings_mark(label, at, readings, look) for label, look, at, readings, _ in series]
    lower = [readings_mark("", at, readings - model, look) for _, look, at, readings, model in series]
    lower.append(Mark("level", (), 0.0, colour=BLACK, style={"linewidth": 1.4}))
    below = Panel(x, Kind("Residual (measured - model)", y.unit, quantity), lower, "Residuals", legend="")
    return Panel(x, y, [*upper, *curves], title, legend="figure"), below


@dataclass(frozen=True, slots=True)
class FittedCurve:
    """Samples and fitted model at the same times; ``time`` and ``level`` are the kinds of the numbers on the axes.

    ``change`` is the kind of the residual, ``names`` are the legend labels of samples and model, ``colour`` is the
    colour of the model.
    """

    time: Kind
    level: Kind
    change: Kind
    times: Floats
    samples: Floats
    model: Floats
    names: tuple[str, str]
    colour: str


def course_panels(course: FittedCurve, look: str, legend: str, limits: Sequence[float] = ()) -> list[Panel]:
    """Return a panel of samples and model over time, and a half-height panel of the residual with dashed ``limits``."""
    upper = [
        readings_mark(course.names[0], course.times, course.samples, look),
        Mark("line", course.times, course.model, (), course.names[1], course.colour, {"linewidth": 1.3}),
    ]
    lower = [
        Mark("line", course.times, course.samples - course.model, colour=course.colour, style={"linewidth": 0.9}),
        Mark("level", (), 0.0, colour=GREY, style={"linewidth": 0.8}),
    ]
    ends = course.times[0], course.times[-1]
    dashed = {"linewidth": 0.8, "linestyle": (0, (4, 3))}
    lower += [Mark("level", (), limit, colour=GREY, style=dashed) for limit in limits]

    def set_both(axes: "Axes") -> None:
        # The lower one too: axes that are joined later take the limits of the one below them.
        axes.set_xlim(*ends)
        largest = max(map(abs, axes.dataLim.intervaly)) * 1.1
        # A residual of rounding alone is none.
        largest = largest if largest > _ROUNDING * float(course.change.values(np.ptp(course.samples))) else 1.0
        axes.set_ylim(-largest, largest)
        axes.locator_params(axis="y", nbins=3)

    return [
        Panel(course.time, course.level, upper, legend=legend, then=lambda axes: axes.set_xlim(*ends), shares_x=True),
        Panel(course.time, course.change, lower, then=set_both, tall=0.5, shares_x=True),
    ]
