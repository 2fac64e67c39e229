"""Figures of the bench procedures in the paper's style; figure 3 is the static torque beside the free decay."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.answers.style import BLACK, BLUE, GREY, ORANGE, VERMILION, house_style, mark_kind
from ppafo.constants import PASCALS_PER_PSI
from ppafo.identification.bench.result import BenchResult, Panel, Role

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
    panels = (torque.panels[0], decay.panels[1])
    return _figure(tuple(_label_synthetic(panel) for panel in panels), (torque.kind, decay.kind))


def _label_synthetic(panel: Panel) -> Panel:
    series = tuple(
        replace(item, name="synthetic measurement") if item.name == "measured" else item for item in panel.series
    )
    return replace(panel, title=f"{panel.title}, synthetic", series=series)


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
    axes.set_xlabel(_axis(panel.x_name, x_unit))
    axes.set_ylabel(_axis(panel.y_name, y_unit))
    axes.margins(0.04)
    if panel.y_name.startswith("Measured less"):
        axes.axhline(0.0, color=GREY, linewidth=0.8)
    named = [item for item in panel.series if item.name]
    if len(named) > 1:
        axes.legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.1, handlelength=1.2, columnspacing=1.0
        )


def _axis(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit else name
