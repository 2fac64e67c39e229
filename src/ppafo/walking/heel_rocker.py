"""How the heel rolls: the lever of the ground force about the ankle over the tilt of the foot, fitted to a gait."""

import math
from typing import NamedTuple

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.gait import Gait
from ppafo.model.columns import over_runs
from ppafo.signals.recording import Floats
from ppafo.walking.gait_series import foot_angles, gait_timing, landing_phase, truncate
from ppafo.walking.preparation import rocker_on_heel
from ppafo.walking.wearer import HeelRocker, Wearer

ROLL_ANGLES = tuple(math.radians(degrees) for degrees in range(2, 16))
"""Tilts [rad] at which the lever of the ground force may have risen half of the way."""


LONGER_THAN_A_FOOT = 1.0e3
"""Lever [m] where nothing was measured: that of the heel bounds it."""


class RockerFit(NamedTuple):
    """What a gait tells of its heel: lever [m] nearly flat, what it gains far up, the tilt [rad] half way up."""

    flat: float
    rise: float
    half: float


def heel_rocker(gait: Gait, wearer: Wearer) -> HeelRocker:
    """The lever over the tilt of the foot, as fitted to the gait and bounded by the heel of a wearer."""
    return over_runs(rocker_on_heel, *fit_rocker(gait), wearer.heel_lever)


def fit_rocker(gait: Gait) -> RockerFit:
    """The lever over the tilt of the measured foot while it comes down on its heel alone, by least squares.

    From the measured moment, which horizontal forces are part of, or without one from the centre of pressure. A heel
    that is still up when the toes of the measured foot take over keeps the last lever. The lever of the heel itself
    bounds it, and stands in where nothing was measured.
    """
    phases = np.linspace(0.0, landing_phase(gait), 151)
    levers = _measured_levers(gait, phases)
    if levers is None or gait.vertical_force is None:
        return RockerFit(LONGER_THAN_A_FOOT, 0.0, ROLL_ANGLES[0])
    tilt = np.maximum(foot_angles(gait, phases) - gait_timing(gait).ground_angle, 0.0)
    force = np.maximum(truncate(gait.vertical_force).values_at(phases), 0.0)
    flat = max(float(levers[-1]), 0.0)
    _, rise, half = min(_rise(half, tilt, levers - flat, force) for half in ROLL_ANGLES)
    return RockerFit(flat, rise, half)


def _measured_levers(gait: Gait, phases: Floats) -> Floats | None:
    if gait.ankle_moment is not None and gait.vertical_force is not None:
        force = np.maximum(truncate(gait.vertical_force).values_at(phases) * STANDARD_GRAVITY, 1.0)
        return np.asarray(-truncate(gait.ankle_moment).values_at(phases) / force)
    return None if gait.centre_of_pressure is None else -truncate(gait.centre_of_pressure).values_at(phases)


def _rise(half: float, tilt: Floats, levers: Floats, force: Floats) -> tuple[float, float, float]:
    """Squares left over, the rise [m] of the lever far up, and the angle [rad] of half of it; weighted by the force."""
    shape = force * tilt / (tilt + half)
    rise = math.fsum(shape * force * levers) / max(math.fsum(shape * shape), 1.0e-12)
    left = force * levers - rise * shape
    return math.fsum(left * left), rise, half
