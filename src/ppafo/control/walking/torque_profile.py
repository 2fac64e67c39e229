"""The torque profile of four parameters that the exoskeleton literature uses: zero, a smooth rise, a smooth fall, zero.

J. Zhang et al., Science 356 (2017) 1280: peak, its time, and the times of rise and fall; cubic with level ends.
"""

from typing import NamedTuple


class TorqueProfile(NamedTuple):
    """Peak [N m], its time, and the times of rise and fall, in turns from the heel strike."""

    peak_torque: float
    peak_time: float
    rise_time: float
    fall_time: float


def smooth(fraction: float) -> float:
    """A cubic from 0 to 1 with level ends, at a fraction [-] from 0 to 1."""
    inside = max(0.0, min(1.0, fraction))
    return inside * inside * (3.0 - 2.0 * inside)


def profile_torque(profile: TorqueProfile, phase: float) -> float:
    """Requested torque [N m] at a phase in turns from the heel strike."""
    rise = smooth((phase - profile.peak_time + profile.rise_time) / profile.rise_time)
    fall = smooth((phase - profile.peak_time) / profile.fall_time)
    return profile.peak_torque * (rise - fall)
