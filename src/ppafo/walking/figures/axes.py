"""Shared elements of figures over the time of a walk: time axis, kinds of numbers, line styles."""

from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark
from ppafo.report.style import GREY

GAS = Kind("Gas taken", "kg", "gas mass")
TOES = Kind("Toe height above ground", "m", "body length")
GROUND = Mark("level", y=0.0, colour=GREY, style={"linewidth": 0.8})
"""Line at the height of the ground."""
THIN = {"linewidth": 0.8}
"""Style of a curve that oscillates in every stride."""
_LONG = 120.0
"""Duration [s] above which the time axis is in minutes."""


def time_axis(end: float) -> Kind:
    """Return the kind of the time axis of a walk that ends at a time [s]: in seconds, or in minutes for a long walk."""
    return Kind("Time", "s", "duration") if end > _LONG else TIME
