"""Plausibility of shank and ankle angles: range, zero, and sign, checked by the standing foot in mid-stance."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError, PpafoError, noted_in, raise_noted
from ppafo.gait.gait import Gait
from ppafo.signals.recording import Floats

SHANK_RANGE = (25.0, 120.0)
ANKLE_RANGE = (5.0, 80.0)
ANKLE_LIMITS = (40.0, 150.0)
MIDSTANCE = slice(15, 41)
"""Mid-stance samples [percent of the stride], in which the foot stands and the ankle rotates with the shank."""
_TURNS = 2.0
"""Least rotation of a standing foot [deg, RMS] that shows a wrong sign; recorded feet rotate by 0.5 to 1.5 deg."""
_TURNED_BACK = 0.1
"""Backward rotation of the shank over the standing foot, relative to its range [-], that shows a reversed sign.

Recorded shanks rotate forward by 0.15 to 0.25 of the range.
"""
REMARKED_TILT, REFUSED_TILT = 5.0, 20.0
"""Limits of the mean tilt of the standing foot in mid-stance [deg] for a remark, and for an error.

Recorded feet on level ground have 0.5 to 4.6 deg, from the sole of the shoe and the placement of markers. A standing
foot is not tilted by more than 20 deg: this is a heel of 6 cm on a foot of 17 cm from heel to ball, walking on the
toes, or a ramp of 1 in 3. A larger tilt shows a wrong zero.
"""
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


def check_shank(walk: MeanStride) -> None:
    """Raise DataError for a shank angle that no leg can have."""
    phi = np.degrees(walk.curves["shank_angle"])
    where = f"{walk.file['shank_angle']}: shank_angle"
    # The range is free of the zero, so that a wrong unit shows before a wrong zero.
    travel = float(np.ptp(phi))
    check_angle_range(where, travel, SHANK_RANGE)
    # Means of five samples at both ends: a single one may lie on a tremor.
    growth = float(np.mean(phi[MIDSTANCE][-5:]) - np.mean(phi[MIDSTANCE][:5]))
    if growth > _TURNED_BACK * travel:
        raise DataError(
            f"{where} increases by {growth:.2g} deg in mid-stance, so the shank would rotate backwards over the foot: "
            "its sign is reversed, or a vertical force is of the other foot"
        )
    if float(phi[0]) < -10.0 or float(np.mean(phi)) > 10.0 or float(np.mean(phi)) < -50.0:
        raise DataError(
            f"{where} is {phi[0]:.0f} deg at heel strike and {np.mean(phi):.0f} deg on average (plausible: above -10 "
            "deg at heel strike, and -50 to 10 deg on average; 0 is vertical, positive with the ankle in front of the "
            "knee)"
        )


def check_angle_range(where: str, travel: float, limits: tuple[float, float], is_whole: bool = False) -> None:
    """Raise DataError for an angle with an implausible range [deg]; a whole record has no upper limit."""
    low, high = limits
    if low <= travel and (is_whole or travel <= high):
        return
    likely = [
        unit
        for unit, number in (("radians", np.degrees(travel)), ("degrees", np.radians(travel)))
        if low <= number <= high
    ]
    hint = "".join(f"; the numbers look like {unit}" for unit in likely)
    raise DataError(f"{where} has a range of {travel:.3g} deg (plausible in a stride: {low:g} to {high:g} deg){hint}")


def check_ankle_range(walk: MeanStride) -> None:
    """Raise DataError for an ankle angle with an implausible range."""
    travel = float(np.ptp(np.degrees(walk.curves["ankle_angle"])))
    check_angle_range(f"{walk.file['ankle_angle']}: ankle_angle", travel, ANKLE_RANGE)


def check_ankle(walk: MeanStride) -> None:
    """Raise DataError for an ankle angle that is implausible together with the shank angle."""
    where = f"{walk.file['ankle_angle']}: ankle_angle"
    turned, reversed_turned = standing_turns(walk.curves["shank_angle"], walk.curves["ankle_angle"])
    wrong: list[PpafoError] = []
    is_reversed = turned > CLEARLY_BETTER * reversed_turned and turned > _TURNS
    if is_reversed:
        wrong.append(
            DataError(
                f"{where} moves into plantarflexion while the shank rotates forward: the flat foot would rotate by "
                f"{turned:.2g} deg (RMS), but only by {reversed_turned:.2g} deg with the opposite sign, so the sign is "
                "reversed"
            )
        )
    # A reversed sign turns the angle about 90 deg: the zero is wrong, too, where the foot is tilted even then.
    ankle = np.pi - walk.curves["ankle_angle"] if is_reversed else walk.curves["ankle_angle"]
    foot = standing_tilt(walk.curves["shank_angle"], ankle)
    with noted_in(wrong):
        _check_ankle_zero(walk, np.degrees(ankle), foot)
    raise_noted(wrong)


def check_ankle_alone(walk: MeanStride) -> None:
    """Raise DataError for an ankle angle, if there is one, whose range or zero is implausible beside any shank."""
    if "ankle_angle" in walk.curves:
        check_ankle_range(walk)
        _check_ankle_zero(walk, np.degrees(walk.curves["ankle_angle"]), 0.0)


def _check_ankle_zero(walk: MeanStride, theta: Floats, foot: float) -> None:
    """Raise DataError for an ankle angle ``theta`` [deg] out of its limits, or a standing foot with a tilt [deg]."""
    low, high = ANKLE_LIMITS
    if abs(foot) <= REFUSED_TILT and low <= float(theta.min()) and float(theta.max()) <= high:
        return
    as_read = np.degrees(walk.curves["ankle_angle"])
    tilt = f"implies a foot tilted by {foot:.0f} deg in mid-stance (plausible: up to {REFUSED_TILT:g} deg) and "
    raise DataError(
        f"{walk.file['ankle_angle']}: ankle_angle {tilt if foot else ''}ranges from {as_read.min():.0f} to "
        f"{as_read.max():.0f} deg (neutral: 90 deg)"
    )


def standing_tilt(shank: Floats, ankle: Floats) -> float:
    """Return the mean tilt [deg] of the foot from 15 to 40 % of the stride, positive with the toes down.

    ``shank`` and ``ankle`` are curves [rad] of 101 samples in the signs of the package.
    """
    # On level ground the ankle is 90 deg plus the shank angle while the foot is flat.
    foot = np.degrees(ankle - shank)[MIDSTANCE] - 90.0
    return float(np.mean(foot))


def standing_turns(shank: Floats, ankle: Floats) -> tuple[float, float]:
    """Return the rotation of the foot [deg, RMS] from 15 to 40 % of the stride, as given and with the ankle reversed.

    ``shank`` and ``ankle`` are curves [rad] of 101 samples in the signs of the package. A foot flat on the ground has a
    rotation of 0.
    """
    # A flat foot stands still while the shank leans: the ankle then follows the shank, with the sign as it is or
    # reversed.
    lean, stand = np.degrees(shank)[MIDSTANCE], np.degrees(ankle)[MIDSTANCE]
    return float(np.std(stand - lean)), float(np.std(stand + lean))


def sign_remarks(shank: Floats, ankle: Floats) -> list[str]:
    """Return a remark on an ankle angle whose sign cannot be verified while the foot stands."""
    turned, reversed_turned = standing_turns(shank, ankle)
    if CLEARLY_BETTER * turned <= reversed_turned:
        return []
    return [
        f"the sign of ankle_angle is uncertain: in mid-stance the flat foot rotates by {turned:.2g} deg (RMS), and by "
        f"{reversed_turned:.2g} deg with the opposite sign"
    ]


def zero_remarks(shank: Floats, ankle: Floats) -> list[str]:
    """Return a remark on the zero of an ankle angle if the standing foot appears tilted; curves [rad]."""
    tilt = standing_tilt(shank, ankle)
    if abs(tilt) <= REMARKED_TILT:
        return []
    way = "toes down" if tilt > 0.0 else "toes up"
    return [
        f"the zero of ankle_angle seems to be off: the flat foot appears tilted by {abs(tilt):.1f} deg, {way} (mean "
        f"from 15 to 40 % of the stride, usual on level ground: up to {REMARKED_TILT:g} deg)"
    ]


def gait_file_remarks(gait: Gait) -> list[str]:
    """Return a remark on the ankle zero of a finished gait."""
    percent = np.linspace(0.0, 1.0, 101)
    return zero_remarks(gait.shank_angle.values_at(percent), gait.ankle_angle.values_at(percent))
