"""Shared elements of figures over the time of a walk: axis quantities, line styles."""

from ppafo.report.kind import Kind
from ppafo.report.panels import Mark
from ppafo.report.style import GREY

GAS = Kind("Gas taken", "kg", "gas mass")
TOES = Kind("Toe height above ground", "m", "body length")
GROUND = Mark("level", y=0.0, colour=GREY, style={"linewidth": 0.8})
"""Line at the height of the ground."""
THIN = {"linewidth": 0.8}
"""Style of a curve that oscillates in every stride."""
