"""Figure of the mean stride of walks and of the healthy gait: ankle, torques, pressures, toes; mean and deviation."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.gait.gait import clinical_angle
from ppafo.report.kind import Kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import BLACK, BLUE, DASHES, GREY, VERMILION
from ppafo.signals.recording import Floats
from ppafo.walking.motion import walk_of
from ppafo.walking.strides import PHASES, healthy_toe_height

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WITH = BLUE
WITHOUT = VERMILION
HEALTHY = BLACK
OPACITY = MappingProxyType({WITH: 1.0, WITHOUT: 0.5})
"""Opacity of the lines of both walks: without the device they are paler, in greyscale too."""
STRIDE = Kind("Stride", "1", "fraction")
ANGLE = Kind("Ankle angle; 0 neutral, dorsiflexion positive", "rad", "angle")
PRESSURE = Kind("Gauge pressure; dashed: dorsiflexion chamber", "Pa_d", "pressure change")
ONE_PRESSURE = Kind("Gauge pressure", "Pa_d", "pressure change")
TOES = Kind("Toe height above ground; below 0 in mid-swing the toes drag", "m", "body length")
_CHANNELS = {
    ANGLE: ("angle",),
    Kind("Torque on the wearer, $T_{ex}$", "N m", "torque"): ("external_torque",),
    Kind("Actuator torque", "N m", "torque"): ("torque",),
    PRESSURE: ("pressure_1", "pressure_2"),
    TOES: ("toe_height",),
}
"""Panels from top to bottom, each with the channels that are drawn for every walk."""


def walk_figure(walks: Mapping[str, Any]) -> "Figure":
    """Return the figure of the mean stride of one or two walks of the same wearer, beside the healthy gait.

    ``walks`` are objects ``WalkResult`` by name; the method ``plot`` of a result draws this figure.
    """
    first = next(iter(walks.values()))
    gait = walk_of(first.scenario).gait
    ankle = clinical_angle(gait.ankle_angle.values_at(PHASES))
    healthy = {ANGLE: (ankle, gait.ankle_angle.deviation), TOES: (healthy_toe_height(first.scenario), 0.0)}
    has_one_chamber = first.scenario.device.actuator.has_one_chamber
    panels: list[Panel] = []

    def whole_stride(axes: "Axes") -> None:
        axes.set_xlim(0.0, 100.0)
        axes.locator_params(axis="y", nbins=5)

    for kind, channels in _CHANNELS.items():
        thin = {"linewidth": 0.8, "linestyle": "-."}
        marks = [Mark("at", gait.stance_share, label="toe-off", colour=GREY, style=thin)]
        if kind is not PRESSURE:
            marks.append(Mark("level", y=0.0, colour=GREY, style={"linewidth": 0.8}))
        for (name, result), colour in zip(walks.items(), (WITH, WITHOUT), strict=False):
            # The pressures of a device that is switched off stay at the atmosphere.
            if not result.averages or (kind is PRESSURE and not np.any(result.recording["supplied_mass"])):
                continue
            label = f"{name}, mean of {result.metrics['counted_strides'].value:.0f}"
            atmosphere = result.scenario.device.supply.atmospheric_pressure
            for channel, dashes in zip(channels, (DASHES.get(colour, "-"), (0, (4, 2))), strict=False):
                # An actuator may have one chamber.
                if channel not in result.averages:
                    continue
                curves = result.averages[channel]
                mean = curves.mean - atmosphere if kind is PRESSURE else curves.mean
                mean = clinical_angle(mean) if kind is ANGLE else mean
                marks.append(_band(mean, curves.deviation, colour, 0.2))
                style = {"linestyle": dashes, "alpha": OPACITY[colour]}
                marks.append(Mark("line", PHASES, mean, label=label, colour=colour, style=style))
        if kind in healthy:
            mean, deviation = healthy[kind]
            look = {"linewidth": 1.2, "linestyle": (0, (1, 1.2))}
            marks.extend(
                (
                    Mark("line", PHASES, mean, label="healthy gait", colour=HEALTHY, style=look),
                    replace(_band(mean, deviation, GREY, 0.15), label="band: standard deviation"),
                )
            )
        shown = ONE_PRESSURE if kind is PRESSURE and has_one_chamber else kind
        panels.append(Panel(STRIDE, shown, marks, legend="", then=whole_stride, shares_x=True))
    panels[0] = replace(panels[0], legend="figure")
    return draw_panels(
        panels,
        size=(5.4, 1.5),
        title=f"{first.scenario.name}: {gait.name}, {first.metrics['strides'].value:.0f} strides",
        kind=first.recording.kind,
    )


def _band(mean: Floats, deviation: Floats | float, colour: str, alpha: float) -> Mark:
    return Mark("band", PHASES, (mean - deviation, mean + deviation), colour=colour, style={"alpha": alpha})
