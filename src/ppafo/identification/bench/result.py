"""What a bench procedure returns: estimates with one verdict each, a table and two panels, in SI units.

The figures have the paper's style; figure 3 is the static torque beside the free decay.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.identification.estimate import Estimate, Verdict
from ppafo.identification.fit import Fit
from ppafo.identification.source import Source, kind_of, told_of_readings
from ppafo.identification.wording import conflict_in_words, widened_by
from ppafo.report.style import BLACK, BLUE, VERMILION, house_style, mark_kind
from ppafo.signals import RecordingKind
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Role = Literal["rising", "falling", "measured", "law"]
"""How a series looks: crosses, circles, dots, a line."""


@dataclass(frozen=True, slots=True)
class Series:
    """Points or a line: values along both axes in the units of the panel; an empty name stays out of the legend."""

    name: str
    x: Floats
    y: Floats
    role: Role


@dataclass(frozen=True, slots=True)
class Panel:
    """One panel: what its axes are, their SI units, and what is drawn."""

    title: str
    x_name: str
    x_unit: str
    y_name: str
    y_unit: str
    series: tuple[Series, ...] = ()


def fitted_panels(panel: Panel, name: str, x: Floats, measured: Floats, model: Floats) -> tuple[Panel, Panel]:
    """Return a panel with readings and the curve of a law by ``name``, and the one of their differences."""
    order = np.argsort(x)
    series = Series("measured", x, measured, "measured"), Series(name, x[order], model[order], "law")
    return with_residuals(replace(panel, series=series), x, measured - model)


def with_residuals(panel: Panel, x: Floats, residuals: Floats) -> tuple[Panel, Panel]:
    """Return a panel and the one of its residuals, in the units of its axes."""
    zero = Series("", np.array([x.min(), x.max()]), np.zeros(2), "law")
    left = Series("", x, residuals, "measured")
    axes = panel.x_name, panel.x_unit, "Measured minus fitted", panel.y_unit
    return panel, Panel("Residuals", *axes, (left, zero))


@dataclass(frozen=True, slots=True)
class BenchResult:
    """Result of one procedure. ``kind`` is the kind of its recordings; figures say so where nobody measured them.

    ``conflict`` is the sentence on readings that want other numbers than all together, empty where they agree.
    """

    procedure: str
    summary: str
    estimates: tuple[Estimate, ...]
    panels: tuple[Panel, ...]
    kind: RecordingKind
    conflict: str = ""
    remarks: tuple[str, ...] = ()

    def __getitem__(self, path: str) -> Estimate:
        """Return the estimate at a path; KeyError where the procedure gave none."""
        for estimate in self.estimates:
            if estimate.path == path:
                return estimate
        raise KeyError(path)


def count_of(number: int, noun: str) -> str:
    """Return a number with its noun, ``1 decay`` or ``3 decays``."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


@dataclass(frozen=True, slots=True)
class Reported:
    """A number of a fit that is reported: its name there, which is its path, SI unit, and what it is in a sentence.

    ``size`` stands in for the size of a value that may be zero, in that unit.
    """

    path: str
    unit: str
    text: str
    size: float | None = None


_AT_BOUND = 1.0e-6


def result_of(
    procedure: str,
    sources: tuple[Source, ...],
    found: Fit,
    reported: Sequence[Reported],
    confidence: float,
    summary: str,
    panels: tuple[Panel, ...],
    remedy: str,
    remarks: tuple[str, ...] = (),
) -> BenchResult:
    """Return what a procedure has found: an estimate for each number that is reported, and what to know of them.

    ``remedy`` is what to do where some readings want other numbers than all together.
    """
    estimates = []
    for item in reported:
        place = found.index(item.path)
        value, low, high = (float(one[place]) for one in (found.values, found.low, found.high))
        number = found.numbers[place]
        size, half = abs(value) if item.size is None else item.size, 0.5 * (high - low)
        bound = next((end for end in (number.low, number.high) if abs(value - end) <= _AT_BOUND * number.scale), None)
        # Not 1e-17 where 0 is meant.
        value = value if bound is None else bound
        verdict: Verdict = "identified"
        sentence = f"{item.text}; {widened_by(found, item.path)}."
        if bound is not None:
            verdict = "at its bound"
            sentence = f"{sentence} The readings want a value at or beyond {value:.4g}; the interval ends there."
        # Then zero, or twice the value, is inside the interval as well.
        elif half >= size:
            verdict, sentence = "not identifiable", f"{sentence} The interval is as wide as the value."
        elif found.conflict is not None:
            verdict = "holds for this model only"
        origin = tuple(source.trace for source in sources)
        estimates.append(Estimate(item.path, value, item.unit, low, high, verdict, sentence, origin, confidence))
    kind, told = kind_of(one.recording.kind for one in sources), (*remarks, *told_of_readings(sources))
    return BenchResult(procedure, summary, tuple(estimates), panels, kind, conflict_in_words(found, remedy), told)


_SIZE = (8.4, 3.7)
_SHOWN_IN = {
    "Pa": ("psi", 1.0 / PASCALS_PER_PSI),
    "Pa_d": ("psi", 1.0 / PASCALS_PER_PSI),
    "rad": ("deg", 180.0 / math.pi),
    "m^2": ("mm$^2$", 1.0e6),
    "kg/s": ("g/s", 1.0e3),
    "kg/(s Pa)": ("g/s per bar", 1.0e8),
    "rad/s^2": ("rad/s$^2$", 1.0),
    "-": ("", 1.0),
}
_READING = {"linestyle": "none", "markersize": 5, "markeredgewidth": 1.1}
_LOOKS: dict[Role, dict[str, Any]] = {
    "rising": {"marker": "x", "color": BLUE, **_READING},
    "falling": {"marker": "o", "color": VERMILION, "markerfacecolor": "none", **_READING},
    "measured": {"marker": ".", "color": BLUE, "linestyle": "none", "markersize": 4},
    "law": {"color": BLACK, "linewidth": 1.4},
}
_MAXIMUM_POINTS = 1200


def procedure_figure(result: BenchResult) -> "Figure":
    """Return the figure of a procedure: its two panels side by side."""
    return _figure(result.panels, (result.kind,))


def figure_3(results: Sequence[BenchResult]) -> "Figure | None":
    """Return figure 3 of the paper, torque over pressure and damping; None unless both were identified."""
    by_name = {result.procedure: result for result in reversed(results)}
    torque, decay = by_name.get("static-torque"), by_name.get("free-decay")
    if torque is None or decay is None:
        return None
    return _figure((torque.panels[0], decay.panels[1]), (torque.kind, decay.kind))


def synthetic_figure_3(torque: BenchResult, decay: BenchResult) -> "Figure":
    """Return figure 3 of the paper from synthetic recordings, which each panel says of itself."""
    panels = []
    for panel in (torque.panels[0], decay.panels[1]):
        names = {"measured": "synthetic measurement"}
        series = tuple(replace(item, name=names.get(item.name, item.name)) for item in panel.series)
        panels.append(replace(panel, title=f"{panel.title}, synthetic", series=series))
    return _figure(tuple(panels), (torque.kind, decay.kind))


def _figure(panels: tuple[Panel, ...], kinds: tuple[RecordingKind, ...]) -> "Figure":
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    with house_style():
        # The strip above the panels is left to the kind of the recordings, clear of titles and legends.
        layout = ConstrainedLayoutEngine(rect=(0.0, 0.0, 1.0, 0.94))
        figure = Figure(figsize=_SIZE, layout=layout)
        row = figure.subplots(1, len(panels), squeeze=False)[0]
        for letter, axes, panel in zip("AB", row, panels, strict=False):
            _draw(axes, letter, panel)
        mark_kind(figure, kind_of(kinds))
        return figure


def _draw(axes: "Axes", letter: str, panel: Panel) -> None:
    (x_unit, x_scale), (y_unit, y_scale) = (_SHOWN_IN.get(unit, (unit, 1.0)) for unit in (panel.x_unit, panel.y_unit))
    for item in sorted(panel.series, key=lambda one: one.role == "law"):
        # A page with every sample would be some megabytes, and look the same.
        thin = slice(None, None, 1 if item.role == "law" else max(1, item.x.size // _MAXIMUM_POINTS))
        axes.plot(x_scale * item.x[thin], y_scale * item.y[thin], label=item.name, **_LOOKS[item.role])
    axes.set_title(f"$\\bf{{{letter}}}$   {panel.title}", pad=20)
    axes.set_xlabel(f"{panel.x_name} ({x_unit})" if x_unit else panel.x_name)
    axes.set_ylabel(f"{panel.y_name} ({y_unit})" if y_unit else panel.y_name)
    axes.margins(0.04)
    named = [item for item in panel.series if item.name]
    if len(named) > 1:
        axes.legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.1, handlelength=1.2, columnspacing=1.0
        )
