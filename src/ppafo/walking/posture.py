"""Where shank and foot are in the sagittal plane: the leg that the gait prescribes, with any ankle angle.

A gait file has angles only. The ankle's path follows from them: in stance the healthy foot rolls over heel and toes
without sliding, in the swing the ankle goes over to the next foothold with the healthy toes above the ground.
The same path carries the foot with and without the device; toes that come out below the ground would drag.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.gait import Gait
from ppafo.model.gait import GaitTiming
from ppafo.signals.recording import Floats
from ppafo.walking.gait_series import truncate
from ppafo.walking.wearer import Wearer

ANKLE_HEIGHT_FRACTION = 0.039 / 0.246
"""Height of the ankle over the sole as a fraction of the shank's length: both as fractions of the stature in figure
4.1 of Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009."""

MID_SWING_CLEARANCE = 0.015
"""Healthy toes over the ground in mid-swing [m]; 1 to 2 cm (Winter 1992, Phys Ther 72:45)."""

HAND_OVER = 0.02
"""Difference of height [m] within which toes and heel both tell how high the ankle is in the swing, at most. Assumed:
the ankle of a person has no kink; it is 0.9 cm higher than needed where both would touch."""

DEFAULT_SPEED = 1.3
"""Walking speed [m/s] where the gait has none; only for the length of the strides in pictures."""

_GRID = np.linspace(0.0, 1.0, 1001)


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
    """Joints in the plane [m], each (samples, 2), x forward and y up from the ground."""

    knee: Floats
    ankle: Floats
    heel: Floats
    toe: Floats


@dataclass(frozen=True, slots=True, eq=False)
class AnklePath:
    """Path of the ankle [m] over the phases of one stride, and what it takes to place shank and foot on it."""

    forward: Floats
    up: Floats
    stride_length: float
    ground_angle: float
    shank_length: float
    heel_lever: float
    toe_lever: float
    height: float

    def posture(self, turns: Floats, shank: Floats, ankle: Floats) -> Posture:
        """Joints at a running phase [strides], for shank and ankle angles [rad]."""
        phase = turns % 1.0
        x = np.interp(phase, _GRID, self.forward) + self.stride_length * np.floor(turns)
        joint = np.stack([x, np.interp(phase, _GRID, self.up)], axis=1)
        knee = joint + self.shank_length * np.stack([-np.sin(shank), np.cos(shank)], axis=1)
        tilt = shank - ankle + 0.5 * np.pi - self.ground_angle
        return Posture(
            knee, joint, joint + self._sole(tilt, -self.heel_lever), joint + self._sole(tilt, self.toe_lever)
        )

    def toe_height(self, phase: Floats, shank: Floats, ankle: Floats) -> Floats:
        """Toes over the ground [m] at phases from 0 to 1; below 0 they would drag."""
        return np.asarray(np.interp(phase % 1.0, _GRID, self.up) + self.toes_over_ankle(shank, ankle))

    def toes_over_ankle(self, shank: Floats, ankle: Floats) -> Floats:
        """Height of the toes over the ankle [m], below 0 with a flat foot."""
        tilt = shank - ankle + 0.5 * np.pi - self.ground_angle
        return np.asarray(self.toes_at(np.sin(tilt), np.cos(tilt)))

    def toes_at(self, sine: Any, cosine: Any) -> Any:
        """Height of the toes over the ankle [m], for sine and cosine of the sole's tilt: numbers or expressions."""
        return self.toe_lever * sine - self.height * cosine

    def ankle_height(self, phase: float) -> float:
        """Height of the ankle over the ground [m] at a phase from 0 to 1."""
        return float(np.interp(phase % 1.0, _GRID, self.up))

    def _sole(self, tilt: Floats, lever: float) -> Floats:
        along, up = np.cos(tilt), np.sin(tilt)
        return np.stack([lever * along + self.height * up, lever * up - self.height * along], axis=1)


def ankle_path(gait: Gait, timing: GaitTiming, wearer: Wearer) -> AnklePath:
    """The path of the ankle [m] over one stride of a gait, for the segments of a wearer."""
    height = ANKLE_HEIGHT_FRACTION * wearer.shank_length
    shank, ankle = truncate(gait.shank_angle), truncate(gait.ankle_angle)
    foot = shank.values_at(_GRID) - ankle.values_at(_GRID) + 0.5 * np.pi - timing.ground_angle
    toes_down = height * np.cos(foot) - wearer.toe_lever * np.sin(foot)
    heel_down = height * np.cos(foot) + wearer.heel_lever * np.sin(foot)
    swing = np.clip((_GRID - timing.toe_off) / (1.0 - timing.toe_off), 0.0, 1.0)
    up = _above(toes_down, heel_down, swing) + MID_SWING_CLEARANCE * np.sin(np.pi * swing) ** 2
    length = (gait.walking_speed or DEFAULT_SPEED) * gait.stride_time
    forward = _forward(foot, wearer, height, timing.toe_off, length)
    levers = wearer.heel_lever, wearer.toe_lever
    return AnklePath(forward, up, length, timing.ground_angle, wearer.shank_length, *levers, height)


def _above(toes_down: Floats, heel_down: Floats, swing: Floats) -> Floats:
    """Height of the ankle [m] that keeps toes and heel off the ground; late in the swing one goes over to the other.

    In stance, at toe-off and at heel strike it is the higher of both.
    """
    width = HAND_OVER * swing**4 * (1.0 - swing) / (0.8**4 * 0.2)
    return np.asarray(0.5 * (toes_down + heel_down + np.hypot(toes_down - heel_down, width)))


def _forward(foot: Floats, wearer: Wearer, height: float, toe_off: float, length: float) -> Floats:
    """Rolling over heel and toes in stance; in the swing a smooth way to the next foothold with equal speeds."""
    on_heel = wearer.heel_lever * (np.cos(foot) - 1.0) - height * np.sin(foot)
    on_toes = wearer.toe_lever * (1.0 - np.cos(foot)) - height * np.sin(foot)
    rolled = np.where(foot > 0.0, on_heel, on_toes)
    last = int(np.searchsorted(_GRID, toe_off)) - 1
    speed = (rolled[last] - rolled[last - 10]) / (_GRID[last] - _GRID[last - 10])
    way, span = rolled[0] + length - rolled[last], 1.0 - _GRID[last]
    fraction = np.clip((_GRID - _GRID[last]) / span, 0.0, 1.0)
    start = speed * span
    cubic = start * fraction + (3.0 * way - 2.0 * start) * fraction**2 + (start - 2.0 * way) * fraction**3
    return np.asarray(np.where(np.arange(_GRID.size) <= last, rolled, rolled[last] + cubic))
