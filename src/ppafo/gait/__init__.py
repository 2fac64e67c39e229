"""Gaits: one periodic stride of a wearer, built in, imported from recordings, or read from a gait file."""

from ppafo.gait.gait import CURVES, Curve, Gait
from ppafo.gait.loading import NORMATIVE, list_gaits, load_gait
from ppafo.gait.scaling import at_speed, speed_range
from ppafo.gait.walking import walk_recording

__all__ = [
    "CURVES",
    "NORMATIVE",
    "Curve",
    "Gait",
    "at_speed",
    "list_gaits",
    "load_gait",
    "speed_range",
    "walk_recording",
]
