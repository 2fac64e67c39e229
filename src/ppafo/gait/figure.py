"""The figure of a gait: its curves over the stride, in the units of the field, with band, events and single strides."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.layout import Margins, figure_of_panels
from ppafo.answers.style import BLACK, BLUE, GREY, ORANGE, house_style, mark_kind
from ppafo.gait.gait import Gait, clinical_angle
from ppafo.gait.recorded.importing import ImportedGait
from ppafo.gait.recorded.strides import phases
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _PANEL = 7.2, 1.45
_MARGINS = Margins(left=0.82, right=0.25, top=0.72, bottom=0.52, row_gap=0.42, label=0.58)
_STANCE = "#f1f1f1"


@dataclass(frozen=True, slots=True)
class _CurvePanel:
    """Title, what one SI unit is in that of the title, and where the level line lies."""

    title: str
    factor: float
    level: float


_DEGREES = float(np.degrees(1.0))
_PANELS: dict[str, _CurvePanel] = {
    "shank_angle": _CurvePanel("Shank angle (deg, above 0: ankle in front of the knee)", _DEGREES, 0.0),
    "ankle_angle": _CurvePanel("Ankle angle (deg, 0 neutral, dorsiflexion positive)", _DEGREES, 0.0),
    "ankle_moment": _CurvePanel("Ankle moment (N m/kg, above 0: plantarflexion)", 1.0, 0.0),
    "vertical_force": _CurvePanel("Vertical ground reaction (body weights)", 1.0, 0.0),
    "centre_of_pressure": _CurvePanel("Centre of pressure (cm in front of the ankle)", 100.0, 0.0),
    "knee_forward": _CurvePanel("Acceleration of the knee forward (m/s$^2$)", 1.0, 0.0),
    "knee_up": _CurvePanel("Acceleration of the knee upwards (m/s$^2$, without gravity)", 1.0, 0.0),
}


def gait_figure(gait: Gait, imported: ImportedGait | None = None) -> "Figure":
    """Return the curves of a gait over the stride; with the strides behind it where it was just imported."""
    names = list(gait.curves)
    height = len(names) * _PANEL + (len(names) - 1) * _MARGINS.row_gap + _MARGINS.top + _MARGINS.bottom
    with house_style():
        figure, grid = figure_of_panels((_WIDTH, height), _MARGINS, len(names))
        for name, (axes,) in zip(names, grid, strict=True):
            _draw(axes, gait, name, imported)
        bottom = grid[-1][0]
        bottom.set_xlabel("Stride (%)")
        bottom.set_xlim(0.0, 100.0)
        _name_events(grid[0][0], gait)
        inch = 1.0 / height
        figure.text(0.12 / _WIDTH, 1.0 - 0.12 * inch, _headline(gait), ha="left", va="top", fontweight="bold")
        _legend(grid[0][0], figure, height)
        mark_kind(figure, gait.origin)
        return figure


def _headline(gait: Gait) -> str:
    speed = f", {gait.walking_speed:.3g} m/s" if gait.walking_speed is not None else ""
    return f"{gait.name}: {gait.body_mass:.4g} kg{speed}, stride {gait.stride_time:.3g} s"


def _draw(axes: "Axes", gait: Gait, name: str, imported: ImportedGait | None) -> None:
    shown, curve, percent = _PANELS[name], gait.curves[name], 100.0 * phases()
    axes.axvspan(0.0, 100.0 * gait.stance_share, color=_STANCE, zorder=0, linewidth=0.0)
    axes.axhline(shown.level, color=GREY, linewidth=0.8)
    axes.axvline(100.0 * gait.stance_share, color=ORANGE, linewidth=1.0)
    series = _shown_values(name, curve.values_at(phases()))
    if imported is None:
        mean, band = series, np.full(series.size, shown.factor * curve.deviation)
        label = "standard deviation, mean over the stride"
    else:
        found = imported.curves[name]
        mean, band = _shown_values(name, found.mean), shown.factor * found.deviation
        label = "standard deviation"
        axes.plot(percent, _shown_values(name, found.curves).T, color=GREY, linewidth=0.6, alpha=0.5)
    axes.fill_between(percent, mean - band, mean + band, color=BLUE, alpha=0.2, linewidth=0.0, label=label)
    axes.plot(percent, mean, color=BLUE, label="mean of the strides" if imported is not None else "series")
    if imported is not None:
        axes.plot(percent, series, color=BLACK, linewidth=1.0, linestyle=(0, (4, 2)), label="series")
    axes.set_title(shown.title)


def _shown_values(name: str, values: Floats) -> Floats:
    """Return values of a curve in the unit and the sign of its panel."""
    return _PANELS[name].factor * (clinical_angle(values) if name == "ankle_angle" else values)


def _name_events(axes: "Axes", gait: Gait) -> None:
    """Write where the shank's curve is not: low at heel strike, high at toe-off."""
    for at, height, text in ((0.0, 0.05, "heel strike"), (100.0 * gait.stance_share, 0.85, "toe-off")):
        place, offset = ("data", "axes fraction"), "offset points"
        axes.annotate(text, (at, height), xycoords=place, xytext=(3, 0), textcoords=offset, color=GREY, fontsize=8.5)


def _legend(axes: "Axes", figure: "Figure", height: float) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="upper left",
        bbox_to_anchor=(0.09 / _WIDTH, 1.0 - 0.28 / height),
        ncols=3,
        borderaxespad=0.0,
        handlelength=1.6,
    )
