"""Mean stride of a recording or a gait file, as input of the plausibility checks."""

from collections.abc import Mapping
from dataclasses import dataclass

from ppafo.signals.recording import Floats

CLEARLY_BETTER = 2.0
"""Factor by which the opposite sign of a curve must fit better, or give a larger value, to reject the given sign."""


@dataclass(frozen=True, slots=True)
class MeanStride:
    """Mean stride: files and curves (101 samples, SI) by curve name, stance fraction [-] and stride time [s].

    ``is_knee_one_marker`` is True if both coordinates of the knee are from one marker, whose scales cannot differ.
    """

    file: Mapping[str, str]
    curves: Mapping[str, Floats]
    stance_share: float
    stride_time: float
    is_knee_one_marker: bool = False
