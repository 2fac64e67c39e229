"""The mean stride of walks beside the healthy gait: ankle, torques, pressures and toes, mean with band."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.gait.gait import clinical_angle
from ppafo.metrics import Metric
from ppafo.report.style import BLACK, BLUE, GREY, VERMILION, Margins, figure_of_panels, house_style, mark_kind
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.walking.motion import walk_of
from ppafo.walking.strides import PHASES, Curves, healthy_toe_height

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WITH, WITHOUT, HEALTHY = BLUE, VERMILION, BLACK
STANCE = "#f1f1f1"
_WIDTH = 7.4
_MARGINS = Margins(left=0.68, right=0.2, top=0.78, bottom=0.52, row_gap=0.4, label=0.5)
_PANEL = 1.3
_PERCENT = 100.0 * PHASES


@dataclass(frozen=True, slots=True)
class _Panel:
    """One panel: channels drawn for every walk, and one SI unit in the unit of the title; a level to mark."""

    title: str
    channels: tuple[str, ...]
    factor: float = 1.0
    level: float | None = None


_DEGREES = float(np.degrees(1.0))
_PANELS = (
    _Panel("Ankle angle (deg, 0 neutral, dorsiflexion positive)", ("angle",), _DEGREES, 0.0),
    _Panel("Torque on the wearer, $T_{ex}$ (N m)", ("external_torque",), 1.0, 0.0),
    _Panel("Actuator torque (N m)", ("torque",), 1.0, 0.0),
    _Panel("Chamber pressures (psig; solid: plantarflexion, dashed: dorsiflexion)", ("pressure_1", "pressure_2")),
    _Panel("Toe height above ground (cm; the toes drag below -1)", ("toe_height",), 100.0, 0.0),
)


class Strides(Protocol):
    """What is drawn of a walk."""

    @property
    def scenario(self) -> Scenario:
        """Who walks with what."""

    @property
    def recording(self) -> Recording:
        """Every sample."""

    @property
    def averages(self) -> Mapping[str, Curves]:
        """Mean and deviation of each channel over the stride."""

    @property
    def metrics(self) -> Mapping[str, Metric]:
        """Numbers of the whole walk."""


def walk_figure(walks: Mapping[str, Strides]) -> "Figure":
    """Return the mean stride of one or two walks of the same wearer by name, and the healthy gait beside them."""
    height = len(_PANELS) * _PANEL + (len(_PANELS) - 1) * _MARGINS.row_gap + _MARGINS.top + _MARGINS.bottom
    first = next(iter(walks.values()))
    with house_style():
        figure, grid = figure_of_panels((_WIDTH, height), _MARGINS, len(_PANELS))
        for panel, (axes,) in zip(_PANELS, grid, strict=True):
            fraction = 100.0 * walk_of(first.scenario).gait.stance_share
            axes.axvspan(0.0, fraction, color=STANCE, zorder=0, linewidth=0.0)
            if panel.level is not None:
                axes.axhline(panel.level, color=GREY, linewidth=0.8)
            axes.set_title(panel.title)
            axes.locator_params(axis="y", nbins=5)
            for (name, result), colour in zip(walks.items(), (WITH, WITHOUT), strict=False):
                counted = result.metrics["counted_strides"].value
                _draw(axes, panel, result, f"{name}, mean of {counted:.0f}", colour)
        angle = grid[0][0]
        gait = walk_of(first.scenario).gait
        look: dict[str, Any] = {"color": HEALTHY, "linewidth": 1.2, "linestyle": (0, (1, 1.2)), "label": "healthy gait"}
        curve = _DEGREES * clinical_angle(gait.ankle_angle.values_at(PHASES))
        angle.plot(_PERCENT, curve, **look)
        band = _DEGREES * gait.ankle_angle.deviation
        angle.fill_between(_PERCENT, curve - band, curve + band, color=GREY, alpha=0.15, linewidth=0.0)
        grid[-1][0].plot(_PERCENT, 100.0 * healthy_toe_height(first.scenario), **look)
        grid[-1][0].set_xlabel("Stride (%)")
        grid[-1][0].set_xlim(0.0, 100.0)
        _head(figure, grid[0][0], first, height)
        mark_kind(figure, first.recording.kind)
        return figure


def _draw(axes: "Axes", panel: _Panel, result: Strides, name: str, colour: str) -> None:
    """Draw mean and band; pressures of a device that is switched off stay at the atmosphere and are left out."""
    pressures = len(panel.channels) > 1
    if not result.averages or (pressures and not np.any(result.recording["supplied_mass"])):
        return
    atmosphere = result.scenario.device.supply.atmospheric_pressure
    for channel, style in zip(panel.channels, ("-", (0, (4, 2))), strict=False):
        curves = result.averages[channel]
        factor, zero = (1.0 / PASCALS_PER_PSI, atmosphere) if pressures else (panel.factor, 0.0)
        values = clinical_angle(curves.mean) if channel == "angle" else curves.mean - zero
        mean, band = factor * values, factor * curves.deviation
        axes.fill_between(_PERCENT, mean - band, mean + band, color=colour, alpha=0.2, linewidth=0.0)
        axes.plot(_PERCENT, mean, color=colour, linestyle=style, label=name)


def _head(figure: "Figure", axes: "Axes", result: Strides, height: float) -> None:
    configuration = result.scenario
    strides = f"{result.metrics['strides'].value:.0f}"
    title = f"{configuration.name}: {walk_of(configuration).gait.name}, {strides} strides"
    figure.text(0.12 / _WIDTH, 1.0 - 0.12 / height, title, ha="left", va="top", fontweight="bold")
    handles, labels = axes.get_legend_handles_labels()
    place = (0.1 / _WIDTH, 1.0 - 0.3 / height)
    figure.legend(handles, labels, loc="upper left", bbox_to_anchor=place, ncols=3, borderaxespad=0.0, handlelength=1.8)
    remark = "band: standard deviation; grey: stance"
    figure.text(1.0 - 0.2 / _WIDTH, 0.1 / height, remark, ha="right", va="bottom", fontsize=8.5, color=GREY)
