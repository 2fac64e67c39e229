"""Acceleration of the knee: turning about the ankle, size, mean and sign."""

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.gait import KNEE
from ppafo.gait.plausible.checked import MeanStride
from ppafo.gait.plausible.turning import check_turning

KNEE_TRAVEL = (0.5, 80.0)
KNEE_MEAN = 1.5

_PARTS = {"knee_forward": ((-0.3, 0.0), (0.3, 0.6)), "knee_up": ((0.0, 0.3), (0.4, 0.7))}
"""Parts of the swing, from toe-off, in which the knee is driven on and up, and in which it is held back and falls."""


def check_knee(walk: MeanStride) -> None:
    """Raise DataError for knee accelerations, where there are some, that no leg has."""
    there = [name for name in KNEE if name in walk.curves]
    if len(there) == 1:
        (missing,) = set(KNEE) - set(there)
        raise DataError(f"{walk.file[there[0]]}: {there[0]} is given without {missing}; give both, or neither")
    check_turning(walk)
    for name in there:
        _check_size(name, walk)
        _check_sign(name, walk)


def _check_size(name: str, walk: MeanStride) -> None:
    values, place = walk.curves[name], f"{walk.file[name]}: {name}"
    travel, mean, (low, high) = float(np.ptp(values)), float(np.mean(values[:-1])), KNEE_TRAVEL
    if abs(mean) > KNEE_MEAN:
        raise DataError(
            f"{place} is {mean:.3g} m/s^2 on average, and a periodic stride has 0 (up to {KNEE_MEAN:g} is accepted); "
            "an accelerometer measures gravity too: subtract it"
        )
    if not low <= travel <= high:
        raise DataError(
            f"{place} covers a range of {travel:.3g} m/s^2 in a stride, plausible is {low:g} to {high:g} m/s^2; "
            "is the unit right (m/s^2, or m for a position)?"
        )


def _check_sign(name: str, walk: MeanStride) -> None:
    values, place = walk.curves[name], f"{walk.file[name]}: {name}"
    swung = (np.linspace(0.0, 1.0, values.size) - walk.stance_share) / (1.0 - walk.stance_share)
    driven, held = (float(np.mean(values[(swung >= low) & (swung <= high)])) for low, high in _PARTS[name])
    if driven < held:
        raise DataError(
            f"{place} is {driven:.3g} m/s^2 about toe-off and {held:.3g} m/s^2 in the middle of the swing, and it is "
            "the other way round in walking: its sign is reversed, or it is of the other knee; "
            f"{walk.other_sign(f'the sign of knee.{name[5:]}')}"
        )
