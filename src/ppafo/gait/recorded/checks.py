"""Whether a mean stride can be true: what is wrong with units, signs and sides shows here, each with its remedy.

The limits are wide enough for impaired walking; they exclude what no leg does.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError
from ppafo.signals.recording import Floats

SHANK_RANGE = (25.0, 120.0)
ANKLE_RANGE = (5.0, 80.0)
ANKLE_LIMITS = (40.0, 150.0)
STANCE_SHARE = (0.45, 0.85)
STRIDE_TIME = (0.5, 3.0)
MOMENT_PEAK = (0.05, 3.5)
FORCE_PEAK = (0.5, 2.5)
FORCE_MEAN = (0.25, 0.75)
MIDSTANCE = slice(15, 41)
"""Percent of the stride in which the foot stands: the ankle then turns as the shank does."""
_LEAST_SHANK_TRAVEL = 8.0
_LARGEST_FOOT_ANGLE = 35.0


@dataclass(frozen=True, slots=True)
class Checked:
    """What is looked at: mean curves (101 samples, SI units, package signs) by name, stance share and stride time."""

    file: Mapping[str, str]
    curves: Mapping[str, Floats]
    stance_share: float
    stride_time: float


def check_plausible(walk: Checked) -> None:
    """Refuse a mean stride that cannot be true; the message names file, curve, number, limits and remedy."""
    for check in _CHECKS:
        check(walk)


def check_force_scale(file: str, force: Floats) -> None:
    """Refuse a vertical force [body weights] in which no heel strike can be found, by its unit or its sign."""
    lowest, highest = (float(value) for value in np.percentile(force, (2.0, 98.0)))
    low, high = FORCE_PEAK
    if -lowest > highest:
        raise DataError(
            f"{file}: vertical_force is {lowest:.3g} body weights at its largest, downwards: its sign is reversed; "
            "change vertical_force.positive in the gait map"
        )
    if not low <= highest <= high:
        raise DataError(
            f"{file}: vertical_force reaches {highest:.3g} body weights, plausible is {low:g} to {high:g}; "
            "is the body mass right, and the unit (N, '-')?"
        )


def _times(walk: Checked) -> None:
    low, high = STRIDE_TIME
    if not low <= walk.stride_time <= high:
        raise DataError(
            f"{walk.file['shank_angle']}: a stride takes {walk.stride_time:.3g} s, plausible is {low:g} to {high:g} s; "
            "is the time in seconds?"
        )
    low, high = STANCE_SHARE
    if not low <= walk.stance_share <= high:
        raise DataError(
            f"{_events_file(walk)}: the foot is on the ground for {100.0 * walk.stance_share:.0f} % of the stride, "
            f"plausible is {100.0 * low:.0f} to {100.0 * high:.0f} %; "
            "is the force of this foot, its sign and unit right?"
        )


def _events_file(walk: Checked) -> str:
    return walk.file.get("vertical_force", walk.file["shank_angle"])


def _shank(walk: Checked) -> None:
    phi = np.degrees(walk.curves["shank_angle"])
    place = f"{walk.file['shank_angle']}: shank_angle"
    travel = float(np.ptp(phi))
    low, high = SHANK_RANGE
    if not low <= travel <= high:
        raise DataError(
            f"{place} moves over {travel:.3g} deg in a stride, plausible is {low:g} to {high:g} deg; "
            f"{_unit_hint(travel, low, high)}"
        )
    if float(np.mean(phi[MIDSTANCE][:5])) < float(np.mean(phi[MIDSTANCE][-5:])):
        raise DataError(
            f"{place} grows while the foot stands: the shank would fall back over it; give shank_angle.positive = "
            "'ankle_behind' (or the other one) in the gait map, or the force is of the other foot: "
            "choose the other side"
        )
    if float(phi[0]) < -10.0 or float(np.mean(phi)) > 10.0 or float(np.mean(phi)) < -50.0:
        raise DataError(
            f"{place} is {phi[0]:.0f} deg at heel strike and {np.mean(phi):.0f} deg on average; plausible is above "
            "-10 and -50 to 10 deg (0 is vertical, above 0 the ankle is in front); its zero or its columns are wrong, "
            "or the force is of the other foot: choose the other side"
        )


def _ankle(walk: Checked) -> None:
    theta, phi = (np.degrees(walk.curves[name]) for name in ("ankle_angle", "shank_angle"))
    place = f"{walk.file['ankle_angle']}: ankle_angle"
    travel = float(np.ptp(theta))
    low, high = ANKLE_RANGE
    if not low <= travel <= high:
        raise DataError(
            f"{place} moves over {travel:.3g} deg in a stride, plausible is {low:g} to {high:g} deg; "
            f"{_unit_hint(travel, low, high)}"
        )
    stand, lean = theta[MIDSTANCE], phi[MIDSTANCE]
    slope = float(np.polyfit(lean, stand, 1)[0]) if np.ptp(lean) > _LEAST_SHANK_TRAVEL else 1.0
    if slope < 0.0:
        raise DataError(
            f"{place} goes into plantarflexion while the shank rotates forward over the standing foot "
            f"({slope:.2g} deg per deg, plausible is about 1): its sign is reversed; "
            "change ankle_angle.positive in the gait map"
        )
    foot = float(np.mean(stand - 90.0 - lean))
    if abs(foot) > _LARGEST_FOOT_ANGLE or float(theta.min()) < ANKLE_LIMITS[0] or float(theta.max()) > ANKLE_LIMITS[1]:
        raise DataError(
            f"{place} would tilt the standing foot by {foot:.0f} deg, plausible is within {_LARGEST_FOOT_ANGLE:g} deg "
            f"(angles from {theta.min():.0f} to {theta.max():.0f} deg, neutral 90); give ankle_angle.neutral in the "
            "gait map: what the file shows when the foot is square to the shank"
        )


def _unit_hint(travel: float, low: float, high: float) -> str:
    """Return which unit would make a range of an angle plausible."""
    if low <= np.degrees(travel) <= high:
        return "the numbers look like radians: give unit = 'rad'"
    if low <= np.radians(travel) <= high:
        return "the numbers look like degrees: give unit = 'deg'"
    return "check unit and columns"


def _moment(walk: Checked) -> None:
    if "ankle_moment" not in walk.curves:
        return
    moment = walk.curves["ankle_moment"]
    place = f"{walk.file['ankle_moment']}: ankle_moment"
    if float(np.mean(moment)) < 0.0 and float(-np.min(moment)) > float(np.max(moment)):
        raise DataError(
            f"{place} is {np.min(moment):.3g} N m/kg at its largest, into dorsiflexion: its sign is reversed; change "
            "ankle_moment.positive in the gait map"
        )
    peak, (low, high) = float(np.max(moment)), MOMENT_PEAK
    if not low <= peak <= high:
        raise DataError(
            f"{place} reaches {peak:.3g} N m/kg, plausible is {low:g} to {high:g} N m/kg; is the unit right "
            "(N m, N m/kg, N mm/kg) and the body mass?"
        )


def _force(walk: Checked) -> None:
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


_CHECKS: tuple[Callable[[Checked], None], ...] = (_times, _shank, _ankle, _moment, _force)
