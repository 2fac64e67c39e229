"""Shank and ankle: range, lean, zero and sign."""

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.gait import Gait
from ppafo.gait.plausible.checked import MeanStride, SignSource
from ppafo.signals.recording import Floats

SHANK_RANGE = (25.0, 120.0)
ANKLE_RANGE = (5.0, 80.0)
ANKLE_LIMITS = (40.0, 150.0)
MIDSTANCE = slice(15, 41)
"""Percent of the stride in which the foot stands: the ankle then turns as the shank does."""
_MINIMUM_SHANK_TRAVEL = 8.0
REMARKED_TILT, REFUSED_TILT = 5.0, 20.0
"""Degrees that the standing foot may be tilted, on average over mid-stance, before it is remarked and refused.

Recorded feet on level ground have 0.5 to 4.6: the sole of a shoe and the placing of markers. Nothing tilts a standing
foot further than 20: a shoe with a heel of 6 cm on a foot of 17 cm from heel to ball, a walk on the toes, or a ramp of
1 in 3. Beyond that the zero is another one.
"""


def check_shank(walk: MeanStride) -> None:
    """Raise DataError for a shank angle that no leg has."""
    phi = np.degrees(walk.curves["shank_angle"])
    place = f"{walk.file['shank_angle']}: shank_angle"
    travel = float(np.ptp(phi))
    low, high = SHANK_RANGE
    if not low <= travel <= high:
        raise DataError(
            f"{place} covers a range of {travel:.3g} deg in a stride, plausible is {low:g} to {high:g} deg; "
            f"{_unit_hint(travel, low, high)}"
        )
    if float(np.mean(phi[MIDSTANCE][:5])) < float(np.mean(phi[MIDSTANCE][-5:])):
        raise DataError(
            f"{place} grows while the foot stands: the shank would rotate backwards over it; "
            f"{walk.other_sign('shank_angle.positive')}{_other_foot(walk)}"
        )
    if float(phi[0]) < -10.0 or float(np.mean(phi)) > 10.0 or float(np.mean(phi)) < -50.0:
        raise DataError(
            f"{place} is {phi[0]:.0f} deg at heel strike and {np.mean(phi):.0f} deg on average; plausible is above "
            "-10 and -50 to 10 deg (0 is vertical, above 0 the ankle is in front); its zero or its columns are wrong"
            f"{_other_foot(walk)}"
        )


def check_ankle(walk: MeanStride) -> None:
    """Raise DataError for an ankle angle that no leg has, or not with this shank."""
    theta, phi = (np.degrees(walk.curves[name]) for name in ("ankle_angle", "shank_angle"))
    place = f"{walk.file['ankle_angle']}: ankle_angle"
    travel = float(np.ptp(theta))
    low, high = ANKLE_RANGE
    if not low <= travel <= high:
        raise DataError(
            f"{place} covers a range of {travel:.3g} deg in a stride, plausible is {low:g} to {high:g} deg; "
            f"{_unit_hint(travel, low, high)}"
        )
    stand, lean = theta[MIDSTANCE], phi[MIDSTANCE]
    slope = float(np.polyfit(lean, stand, 1)[0]) if np.ptp(lean) > _MINIMUM_SHANK_TRAVEL else 1.0
    if slope < 0.0:
        raise DataError(
            f"{place} goes into plantarflexion while the shank rotates forward over the standing foot "
            f"({slope:.2g} deg per deg, plausible is about 1): its sign is reversed; "
            f"{walk.other_sign('ankle_angle.positive', 'the other sign about 90 deg')}"
        )
    foot = standing_tilt(walk.curves["shank_angle"], walk.curves["ankle_angle"])
    if abs(foot) > REFUSED_TILT or float(theta.min()) < ANKLE_LIMITS[0] or float(theta.max()) > ANKLE_LIMITS[1]:
        raise DataError(
            f"{place} would tilt the standing foot by {foot:.0f} deg, plausible is within {REFUSED_TILT:g} deg "
            f"(angles from {theta.min():.0f} to {theta.max():.0f} deg, neutral 90); {_NEUTRAL[walk.signs_from]}"
        )


def standing_tilt(shank: Floats, ankle: Floats) -> float:
    """Return the mean tilt [deg] of the foot from 15 to 40 % of the stride, above 0 with the toes down.

    ``shank`` and ``ankle`` are curves [rad] of 101 samples in the signs of the package.
    """
    foot = np.degrees(ankle - shank)[MIDSTANCE] - 90.0
    return float(np.mean(foot))


def zero_remarks(tilt: float, correction: str) -> list[str]:
    """Return what there is to say of the zero of an ankle whose standing foot is tilted [deg]."""
    if abs(tilt) <= REMARKED_TILT:
        return []
    way = "toes down" if tilt > 0.0 else "toes up"
    return [
        f"the zero of ankle_angle seems to be off by {abs(tilt):.1f} deg: the standing foot would be tilted {way} "
        f"by as much (mean from 15 to 40 % of the stride; up to {REMARKED_TILT:g} is usual); "
        f"on level ground {correction}"
    ]


def gait_file_remarks(gait: Gait) -> list[str]:
    """Return what there is to say of the ankle's zero in a finished gait, with the new mean of its series."""
    percent = np.linspace(0.0, 1.0, 101)
    tilt = standing_tilt(gait.shank_angle.values_at(percent), gait.ankle_angle.values_at(percent))
    mean = float(np.degrees(gait.ankle_angle.mean)) - tilt
    return zero_remarks(tilt, f"the mean of [ankle_angle] in gait '{gait.name}' would be {mean:.1f} deg")


_NEUTRAL: dict[SignSource, str] = {
    "map": "give ankle_angle.neutral in the gait map: the reading of the file when the foot is "
    "perpendicular to the shank",
    "columns": "write it as 90 deg when the foot is perpendicular to the shank, or give a gait map with "
    "ankle_angle.neutral",
    "gait_file": "write its mean so that it is 90 deg when the foot is perpendicular to the shank",
}


def _other_foot(walk: MeanStride) -> str:
    if walk.signs_from == "gait_file" or "vertical_force" not in walk.curves:
        return ""
    return ", or the force is of the other foot: choose the other side, or the column of this foot"


def _unit_hint(travel: float, low: float, high: float) -> str:
    """Return which unit would make a range of an angle plausible."""
    if low <= np.degrees(travel) <= high:
        return "the numbers look like radians: give 'rad' as their unit"
    if low <= np.radians(travel) <= high:
        return "the numbers look like degrees: give 'deg' as their unit"
    return "check unit and columns"
