"""What a bench procedure returns: estimates with verdicts, checks of the residuals, and what to draw, in SI units.

The figures have the paper's style; figure 3 is the static torque beside the free decay.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ppafo.answers.style import BLACK, BLUE, GREY, ORANGE, VERMILION, house_style, mark_kind
from ppafo.constants import PASCALS_PER_PSI
from ppafo.identification.estimate import WORTH_TELLING, Check, Estimate, Prospect, Verdict
from ppafo.signals import RecordingKind
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Role = Literal["rising", "falling", "measured", "second", "law", "other law"]
"""How a series looks: crosses, circles, dots in one or another colour, a line, a thin line."""


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
    series: tuple[Series, ...]


IDENTIFIED_WITHIN = 0.25
"""Half width over value up to which a value is called identified."""

WEAK_WITHIN = 1.0
"""Half width over value from which the interval reaches zero: such a value is not identifiable."""


@dataclass(frozen=True, slots=True)
class BenchResult:
    """Result of one procedure. ``kind`` is that of its recordings; figures say so where nobody measured them.

    ``checks`` can fail; ``remarks`` are what else is to be known, and nothing is tested by them.
    """

    procedure: str
    summary: str
    estimates: tuple[Estimate, ...]
    checks: tuple[Check, ...]
    panels: tuple[Panel, ...]
    kind: RecordingKind
    remarks: tuple[str, ...] = ()

    def __getitem__(self, path: str) -> Estimate:
        """Return the estimate at a path; KeyError where the procedure gave none."""
        for estimate in self.estimates:
            if estimate.path == path:
                return estimate
        raise KeyError(path)

    @property
    def failed(self) -> tuple[Check, ...]:
        """The checks that did not hold."""
        return tuple(check for check in self.checks if not check.holds)


def verdict_of(value: float, low: float, high: float, scale: float | None = None, is_capped: bool = False) -> Verdict:
    """Return the verdict on a value and its interval, all in one unit; ``scale`` replaces a value that may be zero.

    ``is_capped`` says that the model does not explain the recordings, so that the value belongs to this model only.
    """
    size = abs(value) if scale is None else scale
    half_width = (high - low) / 2.0
    if not math.isfinite(half_width) or half_width >= WEAK_WITHIN * size:
        return "not identifiable"
    if half_width > IDENTIFIED_WITHIN * size:
        return "weak"
    return "holds for this model only" if is_capped else "identified"


def count_of(number: int, noun: str) -> str:
    """Return a number with its noun, ``1 decay`` or ``3 decays``."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


_ANY = -math.inf
_NOTHING = 1.0e-9
_CAPPED: Verdict = "holds for this model only"
_MISSED = "The law misses the readings by more than they scatter: another law of the same device has another value."


@dataclass(frozen=True, slots=True)
class Number:
    """A fitted number: where it belongs, its SI unit, half the width of its interval, its explanation.

    ``scale`` stands in for the size of a value that may be zero; ``lowest`` is where its interval ends at the latest;
    ``widened`` is how much wider than the scatter's the interval is, because the law misses the readings. ``condition``
    says where the value holds, if the device has another one elsewhere.
    """

    path: str
    unit: str
    value: float
    half_width: float
    explanation: str
    scale: float | None = None
    lowest: float = _ANY
    widened: float = 1.0
    condition: str = ""


@dataclass(frozen=True, slots=True)
class Evidence:
    """Recordings, confidence of the intervals, and the relative uncertainty of the sensors' gain, same confidence [-].

    A gain that is wrong shows in no residual: it can only be stated.
    """

    recordings: tuple[str, ...]
    confidence: float = 0.95
    calibration: float = 0.0

    def with_calibration(self, number: Number) -> Estimate:
        """Return the estimate of a number to which a wrong gain would pass on, with the calibration in its interval."""
        return self.estimate(number, math.hypot(number.half_width, self.calibration * number.value))

    def without_calibration(self, number: Number) -> Estimate:
        """Return the estimate of a number that no gain touches, such as a time constant."""
        return self.estimate(number, number.half_width)

    def at_or_above_zero(self, number: Number) -> Estimate:
        """Return the estimate of a number that the fit could not bring below zero, and whether it stopped there."""
        bounded = replace(number, lowest=0.0)
        if number.value > _NOTHING * (number.value + number.half_width):
            return self.without_calibration(bounded)
        text = f"The fit would put it below zero, so it is held at zero. {number.explanation}"
        return self.estimate(replace(bounded, explanation=text), number.half_width, "at its bound")

    def estimate(self, number: Number, half_width: float, verdict: Verdict | None = None) -> Estimate:
        """Return the estimate of a number with an interval of a half width of its own, in its unit."""
        value, half = float(number.value), float(half_width)
        low, high = value - half, value + half
        is_missed = float(number.widened) >= WORTH_TELLING
        final = verdict or verdict_of(value, low, high, number.scale, is_missed or bool(number.condition))
        missed = f" {_MISSED}" if is_missed and final == _CAPPED else ""
        return Estimate(
            path=number.path,
            value=value,
            unit=number.unit,
            low=max(number.lowest, low),
            high=high,
            verdict=final,
            explanation=f"{number.explanation}{missed}",
            recordings=self.recordings,
            confidence=self.confidence,
            widened=float(number.widened),
            condition=number.condition,
        )

    @property
    def calibration_text(self) -> str:
        """The statement about the calibration, as the end of a sentence."""
        if self.calibration:
            return f"the interval includes {self.calibration:.2%} for the calibration of the sensors"
        return "the interval does not include the calibration of the sensors"


def prospect_of(name: str, half_width: float, size: float, where: str) -> Prospect:
    """Return whether a number can be identified, from half the width [in its unit] that scatter and design alone give.

    Slow disturbances and a law that misses widen an interval later; nothing makes it narrower.
    """
    fraction = float(half_width) / abs(size) if size else math.inf
    width = f"{fraction:.2g} times its size" if fraction >= 0.1 else f"{fraction:.2%}"
    return Prospect(name, fraction < WEAK_WITHIN, f"expected within {width} at best; {where}")


_SIZE = (8.4, 3.7)
_LEFT, _RIGHT, _TOP, _BOTTOM, _BETWEEN = 0.72, 0.15, 0.62, 0.55, 0.85
"""Inches."""

_SHOWN_IN = {
    "Pa_d": ("psi", 1.0 / PASCALS_PER_PSI),
    "Pa": ("kPa", 1.0e-3),
    "rad": ("deg", 180.0 / np.pi),
    "m^2": ("mm$^2$", 1.0e6),
    "kg/s": ("g/s", 1.0e3),
    "kg/(s Pa)": ("g/s per bar", 1.0e8),
    "rad/s^2": ("rad/s$^2$", 1.0),
    "-": ("", 1.0),
}
_LOOKS: dict[Role, dict[str, Any]] = {
    "rising": {"marker": "x", "color": BLUE, "linestyle": "none", "markersize": 5, "markeredgewidth": 1.1},
    "falling": {
        "marker": "o",
        "color": VERMILION,
        "linestyle": "none",
        "markersize": 5,
        "markerfacecolor": "none",
        "markeredgewidth": 1.1,
    },
    "measured": {"marker": ".", "color": BLUE, "linestyle": "none", "markersize": 4},
    "second": {"marker": ".", "color": ORANGE, "linestyle": "none", "markersize": 4},
    "law": {"color": BLACK, "linewidth": 1.4},
    "other law": {"color": ORANGE, "linewidth": 1.4, "linestyle": "--"},
}
_MAXIMUM_POINTS = 1200


def procedure_figure(result: BenchResult) -> "Figure":
    """Return the figure of a procedure: its two panels side by side."""
    return _figure(result.panels, (result.kind,))


def figure_3(results: Sequence[BenchResult]) -> "Figure | None":
    """Return figure 3 of the paper, torque over pressure and damping; None unless both were identified."""
    by_name = {result.procedure: result for result in reversed(results)}
    if not {"static-torque", "free-decay"} <= set(by_name):
        return None
    torque, decay = by_name["static-torque"], by_name["free-decay"]
    return _figure((torque.panels[0], decay.panels[1]), (torque.kind, decay.kind))


def synthetic_figure_3(torque: BenchResult, decay: BenchResult) -> "Figure":
    """Return figure 3 of the paper from synthetic recordings, which each panel says of itself."""
    panels = []
    for panel in (torque.panels[0], decay.panels[1]):
        names = {"measured": "synthetic measurement"}
        series = tuple(replace(item, name=names.get(item.name, item.name)) for item in panel.series)
        panels.append(replace(panel, title=f"{panel.title}, synthetic", series=series))
    return _figure(tuple(panels), (torque.kind, decay.kind))


def _figure(panels: tuple[Panel, ...], kinds: tuple[str, ...]) -> "Figure":
    from matplotlib.figure import Figure

    width, height = _SIZE
    with house_style():
        figure = Figure(figsize=_SIZE)
        panel_width = (width - _LEFT - _RIGHT - _BETWEEN) / 2.0
        figure.subplots_adjust(
            left=_LEFT / width,
            right=1.0 - _RIGHT / width,
            top=1.0 - _TOP / height,
            bottom=_BOTTOM / height,
            wspace=_BETWEEN / panel_width,
        )
        row = figure.subplots(1, len(panels), squeeze=False)[0]
        for letter, axes, panel in zip("AB", row, panels, strict=False):
            _draw(axes, letter, panel)
        if "synthetic" in kinds:
            mark_kind(figure, "synthetic")
        elif "simulated" in kinds:
            mark_kind(figure, "simulated")
        return figure


def _draw(axes: "Axes", letter: str, panel: Panel) -> None:
    (x_unit, x_scale), (y_unit, y_scale) = (_SHOWN_IN.get(unit, (unit, 1.0)) for unit in (panel.x_unit, panel.y_unit))
    drawn = [*(item for item in panel.series if "law" not in item.role), *(i for i in panel.series if "law" in i.role)]
    for item in drawn:
        thin = slice(None, None, 1 if "law" in item.role else max(1, item.x.size // _MAXIMUM_POINTS))
        axes.plot(x_scale * item.x[thin], y_scale * item.y[thin], label=item.name, **_LOOKS[item.role])
    axes.set_title(f"$\\bf{{{letter}}}$   {panel.title}", pad=20)
    axes.set_xlabel(f"{panel.x_name} ({x_unit})" if x_unit else panel.x_name)
    axes.set_ylabel(f"{panel.y_name} ({y_unit})" if y_unit else panel.y_name)
    axes.margins(0.04)
    if panel.y_name.startswith("Measured less"):
        axes.axhline(0.0, color=GREY, linewidth=0.8)
    named = [item for item in panel.series if item.name]
    if len(named) > 1:
        axes.legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.1, handlelength=1.2, columnspacing=1.0
        )
