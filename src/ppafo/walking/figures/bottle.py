"""Figure of a walk on a gas bottle over time: pressures, temperatures, peak torques and remaining gas."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ppafo.report.kind import Kind, duration_kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILION
from ppafo.signals.recording import Floats
from ppafo.walking.result import WalkResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DASHED = {"linestyle": "--", "linewidth": 1.2}
_TEMPERATURES = (
    ("bottle_temperature", "bottle", BLUE),
    ("regulator_temperature", "regulator", BLACK),
    ("outlet_temperature", "gas behind it", ORANGE),
    ("gas_temperature", "gas at the device", GREEN),
)
"""Series of the supply, with legend label and colour."""
_MASSES = (("bottle_mass", "total gas", BLUE), ("liquid_mass", "liquid", GREEN))
"""Series of the supply, with legend label and colour; a gas without a liquid phase has no liquid series."""
_LEAST_TORQUE = 0.1
"""Smallest upper limit of the torque axis [N m]."""


def bottle_figure(result: WalkResult) -> "Figure":
    """Return the figure of a walk on a bottle, with the reason of the end below the panels."""
    supply = result.supply
    recording = result.recording
    peaks = result.peak_torques
    assert supply is not None, "drawn for a walk on a bottle"
    times = supply.times
    values = supply.values
    end = float(recording.time[-1])
    dots = {"marker": ".", "markersize": 2.5, "linewidth": 0.8}
    torque = [Mark("line", recording.time[result.starts[:-1]] if peaks.size else peaks, peaks, style=dots)]
    left = [Mark("line", times, values[name], (), label, colour) for name, label, colour in _MASSES if name in values]
    first = np.unique(np.searchsorted(times, recording.time[result.starts]))

    def over_strides(series: Floats) -> Floats:
        """Means over strides: with each pulse of flow the gas in the bottle cools, and warms again until the next."""
        return np.add.reduceat(series, first)[:-1] / np.diff(first) if first.size > 1 else series

    temperatures = [
        Mark("line", over_strides(times), over_strides(values[name]), (), label, colour)
        for name, label, colour in _TEMPERATURES
    ]
    if supply.supply.line.freezes > 0.5:
        dry_ice = supply.supply.line.temperatures[0]
        temperatures.append(Mark("level", y=dry_ice, label="dry ice", colour=VERMILION, style=_DASHED))
    # The regulator's largest outlet pressure, and the pressure range of the line in each stride.
    delivered = values["regulated_pressure"]
    behind = [Mark("line", times, delivered, label="delivered at most", colour=GREY, style=_DASHED)]
    if result.starts.size > 1:
        line = recording["line_pressure_1"]
        strikes = recording.time[result.starts[:-1]]
        span = tuple(pick.reduceat(line, result.starts)[:-1] for pick in (np.minimum, np.maximum))
        behind.append(Mark("band", strikes, span, label="line, in a stride", style={"alpha": 0.3}))
    regulator = supply.supply.bottle.regulator
    needed = regulator.set_pressure + regulator.pressure_margin
    ended = Mark("at", supply.ending.time, label="end", colour=VERMILION, style={"linewidth": 1.0})
    axis = duration_kind(end)

    def panel(kind: Kind, marks: Sequence[Mark], largest: float | None = None) -> Panel:
        """Panel up to the end of the walk; with ``largest`` [SI], its axis starts at 0 and includes this value."""

        def set_limits(axes: "Axes") -> None:
            axes.set_xlim(0.0, 1.005 * float(axis.values(end)))
            axes.locator_params(axis="y", nbins=5)
            if largest is not None:
                axes.set_ylim(0.0, 1.08 * kind.shown(largest))

        return Panel(axis, kind, [*marks, ended], then=set_limits, shares_x=True)

    needs = Mark("level", y=needed, label="needed", colour=VERMILION, style=_DASHED)
    held = values["bottle_pressure"]
    return draw_panels(
        [
            panel(Kind("Pressure behind the regulator", "Pa_a", "pressure"), behind),
            panel(
                Kind("Pressure in the bottle", "Pa_a", "pressure"),
                [needs, Mark("line", times, held, label="bottle")],
                float(np.max(held)),
            ),
            panel(Kind("Temperature, mean of a stride", "K", "temperature"), temperatures),
            panel(Kind("Peak torque of each stride", "N m", "torque"), torque, float(peaks.max(initial=_LEAST_TORQUE))),
            panel(Kind("Left in the bottle", "kg", "gas mass"), left, supply.supply.mass),
        ],
        size=(5.4, 1.6),
        title=f"{result.scenario.name} on {supply.supply.bottle.label}",
        note=f"End: {supply.ending.message}.",
        kind=recording.kind,
    )
