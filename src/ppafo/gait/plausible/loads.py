"""Ankle moment and vertical force: size, sign and time."""

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.plausible.checked import MeanStride, SignSource, other_sign
from ppafo.signals.recording import Floats

MOMENT_PEAK = (0.05, 3.5)
FORCE_PEAK = (0.5, 2.5)
FORCE_MEAN = (0.25, 0.75)
USUAL_FORCE_MEAN = (0.42, 0.58)
"""Body weights: over steady strides both legs carry 1 together, half each in a symmetric walk."""

_ON_GROUND = 0.05
"""Body weights, either way; a plate with no foot on it shows less."""
_AFTER_TOE_OFF = 0.03
"""Of the stride; a toe-off found in the shank is no nearer than this."""
_LEFT_IN_SWING = 0.25
"""Of the peak; the swinging foot needs a few hundredths."""
_FOOT_ALONE = 0.05
"""N m/kg that a swinging foot may need, however weak the push-off."""


def check_force_scale(file: str, force: Floats, signs_from: SignSource) -> None:
    """Raise DataError for a vertical force [body weights] whose unit or sign leaves no heel strike to find."""
    # One contact in a long record is less than 2 % of it.
    loaded = force[np.abs(force) > _ON_GROUND]
    lowest, highest = np.percentile(loaded if loaded.size else force, (2.0, 98.0)).tolist()
    low, high = FORCE_PEAK
    if -lowest > highest:
        raise DataError(
            f"{file}: vertical_force is {lowest:.3g} body weights at its largest, downwards: its sign is reversed; "
            f"{other_sign(signs_from, 'vertical_force.positive')}"
        )
    if not low <= highest <= high:
        raise DataError(
            f"{file}: vertical_force reaches {highest:.3g} body weights, plausible is {low:g} to {high:g}; "
            "is the body mass right, and the unit (N, '-')?"
        )


def check_moment(walk: MeanStride) -> None:
    """Raise DataError for an ankle moment, where there is one, that no leg has."""
    if "ankle_moment" not in walk.curves:
        return
    moment = walk.curves["ankle_moment"]
    place = f"{walk.file['ankle_moment']}: ankle_moment"
    if float(np.mean(moment)) < 0.0 and float(-np.min(moment)) > float(np.max(moment)):
        raise DataError(
            f"{place} is {np.min(moment):.3g} N m/kg at its largest, into dorsiflexion: its sign is reversed; "
            f"{walk.other_sign('ankle_moment.positive')}"
        )
    peak, (low, high) = float(np.max(moment)), MOMENT_PEAK
    if not low <= peak <= high:
        raise DataError(
            f"{place} reaches {peak:.3g} N m/kg, plausible is {low:g} to {high:g} N m/kg; is the unit right "
            "(N m, N m/kg, N mm/kg) and the body mass?"
        )
    _check_moment_time(walk)


def _check_moment_time(walk: MeanStride) -> None:
    """Refuse a moment that works while the foot is off the ground."""
    moment, fraction = walk.curves["ankle_moment"], walk.stance_share
    phase = np.linspace(0.0, 1.0, moment.size)
    peak, at = float(np.max(moment)), float(phase[np.argmax(moment)])
    swing = float(np.max(moment[phase > fraction + _AFTER_TOE_OFF]))
    if at < fraction and swing < max(_LEFT_IN_SWING * peak, _FOOT_ALONE):
        return
    where = f"peaks at {100.0 * at:.0f} % of the stride" + (
        "" if at >= fraction else f" and is {swing:.2g} N m/kg in swing"
    )
    raise DataError(
        f"{walk.file['ankle_moment']}: ankle_moment {where}, but the foot is off the ground "
        f"from {100.0 * fraction:.0f} % on; {_OTHER_TIME[walk.signs_from]}"
    )


_OTHER_TIME: dict[SignSource, str] = {
    "map": "it is of the other foot or on another clock: choose the other side, or the column of this foot",
    "columns": "it is of the other foot or on another clock: choose the other side, or the column of this foot",
    "gait_file": "write the moment of this foot, counted from its heel strike",
}


def check_force(walk: MeanStride) -> None:
    """Raise DataError for a vertical force, where there is one, that no walk has."""
    if "vertical_force" not in walk.curves:
        return
    force = walk.curves["vertical_force"]
    place = f"{walk.file['vertical_force']}: vertical_force"
    peak, mean = float(np.max(force)), float(np.mean(force))
    if not FORCE_PEAK[0] <= peak <= FORCE_PEAK[1] or not FORCE_MEAN[0] <= mean <= FORCE_MEAN[1]:
        raise DataError(
            f"{place} is {mean:.3g} body weights on average and {peak:.3g} at its peak, plausible is "
            f"{FORCE_MEAN[0]:g} to {FORCE_MEAN[1]:g} and {FORCE_PEAK[0]:g} to {FORCE_PEAK[1]:g}; "
            "is the body mass right, and the unit (N, '-')?"
        )


def force_remarks(force: Floats) -> list[str]:
    """Return what is unusual about the mean of a vertical force [body weights] over a stride, both ends counted."""
    mean, (low, high) = float(np.mean(force[:-1])), USUAL_FORCE_MEAN
    if low <= mean <= high:
        return []
    return [
        f"the vertical force is {mean:.3g} body weights on average, and one leg of a steady walk carries about 0.5 "
        f"(usually {low:g} to {high:g}): check the body mass, {2.0 * mean:.2g} times as much would make it 0.5, and "
        "the scale of the force"
    ]
