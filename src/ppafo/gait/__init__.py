"""Gaits: one periodic stride of a wearer, built in, imported from recordings, or loaded from a gait file."""

from ppafo.gait.document import NORMATIVE, list_gaits, load_gait
from ppafo.gait.gait import CURVES, Gait, GaitCurve, at_speed, series_of, speed_range, walk_recording

__all__ = [
    "CURVES",
    "NORMATIVE",
    "Gait",
    "GaitCurve",
    "at_speed",
    "list_gaits",
    "load_gait",
    "series_of",
    "speed_range",
    "walk_recording",
]
