"""All checks of a stride, each with the remedy for what is wrong with units, signs and sides."""

from collections.abc import Callable

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.gait import Gait
from ppafo.gait.plausible.angles import check_ankle, check_shank
from ppafo.gait.plausible.checked import MeanStride
from ppafo.gait.plausible.knee import check_knee
from ppafo.gait.plausible.loads import check_force, check_moment

STANCE_FRACTION = (0.45, 0.85)
STRIDE_TIME = (0.5, 3.0)


def check_gait(gait: Gait, file: str) -> None:
    """Raise DataError for a gait file whose stride is not plausible, as ``check_plausible`` does."""
    percent = np.linspace(0.0, 1.0, 101)
    curves = {name: curve.values_at(percent) for name, curve in gait.curves.items()}
    check_plausible(MeanStride(dict.fromkeys(curves, file), curves, gait.stance_share, gait.stride_time, "gait_file"))


def check_plausible(walk: MeanStride) -> None:
    """Raise DataError for a mean stride that is not plausible; names file, curve, number, limits and remedy."""
    for check in _CHECKS:
        check(walk)


def _times(walk: MeanStride) -> None:
    low, high = STRIDE_TIME
    if not low <= walk.stride_time <= high:
        raise DataError(
            f"{walk.file['shank_angle']}: a stride takes {walk.stride_time:.3g} s, plausible is {low:g} to {high:g} s; "
            "is the time in seconds?"
        )
    low, high = STANCE_FRACTION
    if not low <= walk.stance_share <= high:
        raise DataError(
            f"{_events_file(walk)}: the foot is on the ground for {100.0 * walk.stance_share:.0f} % of the stride, "
            f"plausible is {100.0 * low:.0f} to {100.0 * high:.0f} %; {_stance_hint(walk)}"
        )


def _stance_hint(walk: MeanStride) -> str:
    if walk.signs_from == "gait_file":
        return "give stride.stance_share from heel strike to toe-off"
    if "vertical_force" in walk.curves:
        return "is the force of this foot, its sign and unit right?"
    return f"it comes from shank_angle: where its sign is reversed, {walk.other_sign('shank_angle.positive')}"


def _events_file(walk: MeanStride) -> str:
    return walk.file.get("vertical_force", walk.file["shank_angle"])


_CHECKS: tuple[Callable[[MeanStride], None], ...] = (
    _times,
    check_shank,
    check_ankle,
    check_moment,
    check_force,
    check_knee,
)
