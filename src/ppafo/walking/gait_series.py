"""Kinematics of a gait on a leg: harmonics and events for the engine, heel rocker, and positions of shank and foot.

A gait file contains angles only, and the path of the ankle is derived from them. In stance the healthy foot rolls over
heel and toes without sliding; in swing the ankle moves to the next foothold with the healthy toes above the ground. The
foot follows the same path with and without the device; toes computed below the ground would drag.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.gait import Gait, series_of
from ppafo.gait.gait import GaitCurve
from ppafo.model.columns import over_runs
from ppafo.model.contact import NEARLY_FLAT
from ppafo.model.gait import HARMONICS, GaitSeries, GaitTiming
from ppafo.signals.recording import Floats
from ppafo.walking.preparation import rocker_on_heel
from ppafo.walking.wearer import HeelRocker, Wearer

# Phases [strides] between which the foot stands flat; the angle of the flat foot is taken from this interval.
FLAT_FROM = 0.15
FLAT_TO = 0.35

# Fraction of the stance at which the heel rises: default if the angles do not show it, and upper limit.
USUAL_HEEL_RISE = 0.6
LATEST_HEEL_RISE = 0.95

EVENT_PHASES = np.linspace(0.0, 1.0, 1001)[150:]
"""Phases [strides] at which events are searched, from the first flat foot on."""

# Fractions of the swing between which the toes must clear the ground.
CLEARANCE_FROM = 0.2
CLEARANCE_TO = 0.9

ANKLE_HEIGHT_FRACTION = 0.039 / 0.246
"""Ankle height above the sole divided by shank length; both are given as fractions of the stature in figure 4.1 of
Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009."""

MID_SWING_CLEARANCE = 0.015
"""Healthy toe clearance in mid-swing [m]; 1 to 2 cm (Winter 1992, Phys Ther 72:45)."""

HAND_OVER = 0.02
"""Largest difference of height [m] over which the ankle path in swing is blended between toes and heel. Assumed: it
avoids a kink of the ankle path; the ankle is 0.9 cm higher than needed where both would touch."""

DEFAULT_SPEED = 1.3
"""Walking speed [m/s] of a gait without a speed; used for the stride length in figures only."""

_GRID = np.linspace(0.0, 1.0, 1001)

ROLL_ANGLES = tuple(math.radians(degrees) for degrees in range(2, 16))
"""Candidate foot tilts [rad] in the heel-rocker fit at which the lever has reached half of its increase."""


LONGER_THAN_A_FOOT = 1.0e3
"""Placeholder for an unmeasured lever of the ground force [m]; the heel lever of the wearer then limits it."""


_SERIES = {
    "shank": "shank_angle",
    "ankle": "ankle_angle",
    "moment": "ankle_moment",
    "force": "vertical_force",
    "knee_forward": "knee_forward",
    "knee_up": "knee_up",
}
"""Curves used by the engine, by field of ``GaitSeries``."""


def gait_series(gait: Gait) -> GaitSeries:
    """Return the curves of a gait for the engine; a moment, force or knee motion that was not measured is 0."""
    return GaitSeries(**{field: series_of(gait, name) for field, name in _SERIES.items()})


def truncate(curve: GaitCurve) -> GaitCurve:
    """Return the curve with its first eight harmonics, as used by the engine."""
    return replace(curve, cosines=curve.cosines[:HARMONICS], sines=curve.sines[:HARMONICS])


def landing_phase(gait: Gait) -> float:
    """Return the phase [strides] at which the measured foot first comes within ``NEARLY_FLAT`` of the flat foot.

    The last degrees come from the compression of heel pad and shoe, which the engine does not model: its foot is flat
    at once.
    """
    phases = np.linspace(0.0, FLAT_FROM, 151)
    down = foot_angles(gait, phases) < gait_timing(gait).ground_angle + NEARLY_FLAT
    return float(phases[np.argmax(down)]) if down.any() else FLAT_FROM


def foot_angles(gait: Gait, phases: Floats) -> Floats:
    """Return the angles [rad] of the measured foot from the horizontal at these phases [strides]."""
    shank = truncate(gait.shank_angle)
    ankle = truncate(gait.ankle_angle)
    return shank.values_at(phases) - ankle.values_at(phases) + 0.5 * math.pi


def gait_timing(gait: Gait) -> GaitTiming:
    """Return stride frequency [Hz], events [strides] and angle of the flat foot [rad].

    Heel rise and angle of the flat foot are determined from the curves.
    """
    foot = foot_angles(gait, EVENT_PHASES)
    stance_share = gait.stance_share
    ground_angle = float(np.median(foot[(EVENT_PHASES >= FLAT_FROM) & (EVENT_PHASES <= FLAT_TO)]))
    steep = (foot < ground_angle - NEARLY_FLAT) & (EVENT_PHASES > FLAT_TO)
    heel_off = float(EVENT_PHASES[np.argmax(steep)]) if steep.any() else USUAL_HEEL_RISE * stance_share
    swing = 1.0 - stance_share
    return GaitTiming(
        frequency=1.0 / gait.stride_time,
        start=0.0,
        heel_off=min(heel_off, LATEST_HEEL_RISE * stance_share),
        toe_off=stance_share,
        clearance_from=stance_share + CLEARANCE_FROM * swing,
        clearance_to=stance_share + CLEARANCE_TO * swing,
        ground_angle=ground_angle,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
    """Positions of the joints in the sagittal plane [m], each (samples, 2): x forward, y up from the ground."""

    knee: Floats
    ankle: Floats
    heel: Floats
    toe: Floats


@dataclass(frozen=True, slots=True, eq=False)
class AnklePath:
    """Path of the ankle [m] over the phases of one stride, and the dimensions of shank and foot.

    ``forward`` and ``up`` [m] are the path, ``stride_length`` is in [m], and ``ground_angle`` [rad] is the angle of the
    flat foot. ``shank_length``, ``heel_lever``, ``toe_lever`` and ``height`` (of the ankle above the sole) are in [m].
    """

    forward: Floats
    up: Floats
    stride_length: float
    ground_angle: float
    shank_length: float
    heel_lever: float
    toe_lever: float
    height: float

    def posture(self, turns: Floats, shank: Floats, ankle: Floats) -> Posture:
        """Return the positions of the joints at a running phase [strides], for shank and ankle angles [rad]."""
        phase = turns % 1.0
        x = np.interp(phase, _GRID, self.forward) + self.stride_length * np.floor(turns)
        joint = np.stack([x, np.interp(phase, _GRID, self.up)], axis=1)
        knee = joint + self.shank_length * np.stack([-np.sin(shank), np.cos(shank)], axis=1)
        tilt = shank - ankle + 0.5 * np.pi - self.ground_angle
        return Posture(
            knee, joint, joint + self._sole(tilt, -self.heel_lever), joint + self._sole(tilt, self.toe_lever)
        )

    def toe_height(self, phase: Floats, shank: Floats, ankle: Floats) -> Floats:
        """Return the toe clearance above the ground [m] at phases from 0 to 1; negative if the toes would drag."""
        tilt = shank - ankle + 0.5 * np.pi - self.ground_angle
        over_ankle = self.toe_lever * np.sin(tilt) - self.height * np.cos(tilt)
        return np.asarray(np.interp(phase % 1.0, _GRID, self.up) + over_ankle)

    def _sole(self, tilt: Floats, lever: float) -> Floats:
        along = np.cos(tilt)
        up = np.sin(tilt)
        return np.stack([lever * along + self.height * up, lever * up - self.height * along], axis=1)


def ankle_path(gait: Gait, timing: GaitTiming, wearer: Wearer) -> AnklePath:
    """Return the path of the ankle over one stride of a gait, for the segment lengths of a wearer."""
    height = ANKLE_HEIGHT_FRACTION * wearer.shank_length
    foot = foot_angles(gait, _GRID) - timing.ground_angle
    toes_down = height * np.cos(foot) - wearer.toe_lever * np.sin(foot)
    heel_down = height * np.cos(foot) + wearer.heel_lever * np.sin(foot)
    swing = np.clip((_GRID - timing.toe_off) / (1.0 - timing.toe_off), 0.0, 1.0)
    # The higher of toes and heel is on the ground; late in the swing one goes over to the other.
    width = HAND_OVER * swing**4 * (1.0 - swing) / (0.8**4 * 0.2)
    above = 0.5 * (toes_down + heel_down + np.hypot(toes_down - heel_down, width))
    up = above + MID_SWING_CLEARANCE * np.sin(np.pi * swing) ** 2
    length = (gait.walking_speed or DEFAULT_SPEED) * gait.stride_time
    # Rolling over heel and toes in stance; in the swing a smooth way to the next foothold with equal speeds.
    on_heel = wearer.heel_lever * (np.cos(foot) - 1.0) - height * np.sin(foot)
    on_toes = wearer.toe_lever * (1.0 - np.cos(foot)) - height * np.sin(foot)
    rolled = np.where(foot > 0.0, on_heel, on_toes)
    last = int(np.searchsorted(_GRID, timing.toe_off)) - 1
    speed = (rolled[last] - rolled[last - 10]) / (_GRID[last] - _GRID[last - 10])
    way = rolled[0] + length - rolled[last]
    span = 1.0 - _GRID[last]
    fraction = np.clip((_GRID - _GRID[last]) / span, 0.0, 1.0)
    start = speed * span
    cubic = start * fraction + (3.0 * way - 2.0 * start) * fraction**2 + (start - 2.0 * way) * fraction**3
    forward = np.asarray(np.where(np.arange(_GRID.size) <= last, rolled, rolled[last] + cubic))
    levers = wearer.heel_lever, wearer.toe_lever
    return AnklePath(forward, np.asarray(up), length, timing.ground_angle, wearer.shank_length, *levers, height)


def heel_rocker(gait: Gait, wearer: Wearer) -> HeelRocker:
    """Return the heel rocker fitted to a gait, bounded by the heel lever of the wearer."""
    return over_runs(rocker_on_heel, *fit_rocker(gait), wearer.heel_lever)


def fit_rocker(gait: Gait) -> tuple[float, float, float]:
    """Return the heel lever as a function of foot tilt, fitted by least squares to the landing on the heel alone.

    The result is the lever of the nearly flat foot [m], the increase of the lever for a raised foot [m], and the tilt
    at half of the increase [rad]. The lever is the measured ankle moment, which includes horizontal forces, divided by
    the vertical force, or else the centre of pressure. If the heel is still raised when the toes of the measured foot
    take over the load, the last lever remains. Without a measurement the lever is ``LONGER_THAN_A_FOOT``, to be
    bounded by the heel lever of the wearer.
    """
    not_measured = LONGER_THAN_A_FOOT, 0.0, ROLL_ANGLES[0]
    if gait.vertical_force is None:
        return not_measured
    phases = np.linspace(0.0, landing_phase(gait), 151)
    force = truncate(gait.vertical_force).values_at(phases)
    if gait.ankle_moment is not None:
        levers = -truncate(gait.ankle_moment).values_at(phases) / np.maximum(force * STANDARD_GRAVITY, 1.0)
    elif gait.centre_of_pressure is not None:
        levers = -truncate(gait.centre_of_pressure).values_at(phases)
    else:
        return not_measured
    tilt = np.maximum(foot_angles(gait, phases) - gait_timing(gait).ground_angle, 0.0)
    force = np.maximum(force, 0.0)
    flat = max(float(levers[-1]), 0.0)
    fits = []
    for half in ROLL_ANGLES:
        shape = force * tilt / (tilt + half)
        # Exact sums: the fit must have the same bits on every computer, and NumPy adds in an order of its own.
        rise = math.fsum(shape * force * (levers - flat)) / max(math.fsum(shape * shape), 1.0e-12)
        left = force * (levers - flat) - rise * shape
        fits.append((math.fsum(left * left), rise, half))
    _, rise, half = min(fits)
    return flat, rise, half
