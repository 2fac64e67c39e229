"""The stride that is checked, and how the reader of a message reverses a curve."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from ppafo.signals.recording import Floats

SignSource = Literal["map", "columns", "gait_file"]
"""What says how the numbers count: a gait map, the columns of the file by convention, or a gait file."""


@dataclass(frozen=True, slots=True)
class MeanStride:
    """The stride that is checked: mean curves (101 samples, SI) by name, stance fraction [-] and stride time [s]."""

    file: Mapping[str, str]
    curves: Mapping[str, Floats]
    stance_share: float
    stride_time: float
    signs_from: SignSource

    def other_sign(self, key: str, turned: str = "the other sign") -> str:
        """Return how to reverse a curve, by its key in a gait map."""
        return other_sign(self.signs_from, key, turned)


def other_sign(signs_from: SignSource, key: str, turned: str = "the other sign") -> str:
    """Return how to reverse a curve: by its key in a gait map, or in the file."""
    return {
        "map": f"change {key} in the gait map",
        "columns": f"correct it in the file, or change {key} in a gait map",
        "gait_file": f"write mean, cosine and sine with {turned}",
    }[signs_from]
