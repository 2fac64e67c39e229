"""Mean stride of a recording or a gait file, as input of the plausibility checks."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from ppafo.signals.recording import Floats

SignSource = Literal["map", "columns", "gait_file"]
"""Source of the sign convention: a gait map, the file's own convention, or a gait file."""


@dataclass(frozen=True, slots=True)
class MeanStride:
    """Mean stride: files and curves (101 samples, SI) by curve name, stance fraction [-] and stride time [s]."""

    file: Mapping[str, str]
    curves: Mapping[str, Floats]
    stance_share: float
    stride_time: float
    signs_from: SignSource
    is_knee_one_marker: bool = False
    """True if both coordinates of the knee are from one marker, so that their scales cannot differ."""
    is_toe_off_guessed: bool = False
    """True if toe-off was found in the shank angle, without a vertical force and without events of the file."""


_DIRECTIONS = {
    "shank_angle.positive": "ankle_in_front or ankle_behind",
    "ankle_angle.positive": "plantarflexion or dorsiflexion",
    "ankle_moment.positive": "plantarflexion or dorsiflexion",
    "vertical_force.positive": "up or down",
}
"""Values of each direction in a gait map."""


def other_sign(signs_from: SignSource, key: str, turned: str = "the opposite sign") -> str:
    """Return the remedy for a curve with a wrong sign: the key in a gait map, or a correction of the file."""
    either = f" ({_DIRECTIONS[key]})" if key in _DIRECTIONS else ""
    return {
        "map": f"change {key} in the gait map{either}",
        "columns": f"correct the sign in the file, or change {key} in a gait map{either}",
        "gait_file": f"write mean, cosine and sine with {turned}",
    }[signs_from]


CLEARLY_BETTER = 2.0
"""Factor by which the opposite sign of a curve must fit better, or give a larger value, to reject the given sign."""
