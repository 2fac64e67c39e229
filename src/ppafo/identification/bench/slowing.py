"""How a vane slows down without pressure: equation (1) as angle and speed over time, from a push to standstill.

    w' = -b w - d (1 + q / (1 + (w / w_s)^2))                                                   equations (1), (10)

w is the angular velocity [rad/s] in the direction of the push, b the damping over the inertia [1/s], d the dynamic
friction over the inertia [rad/s^2]; q and w_s say by how much and below which velocity a seal grips harder near
standstill (Stribeck; Hess and Soom, J. Tribology 112, 1990).
"""

from typing import NamedTuple

import numpy as np

from ppafo.signals.recording import Floats

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
"""Gauss's rule of three nodes, for each step of the speed."""
_STEPS = 240
"""Steps of the speed from the start to standstill."""
_SLOWEST = 1.0e-9
"""Deceleration, over that at the start, below which none counts: without Coulomb friction there is no standstill."""


class Slowing(NamedTuple):
    """Damping over the inertia [1/s], dynamic friction over the inertia [rad/s^2], and its rise near standstill.

    ``rise`` is the friction at rest over the dynamic one, less 1 [-]; at ``rise_velocity`` [rad/s] half of it is left,
    and at a velocity of 0 there is none.
    """

    damping_rate: float
    deceleration: float
    rise: float = 0.0
    rise_velocity: float = 0.0

    def at(self, speed: Floats) -> Floats:
        """Return the deceleration [rad/s^2] at speeds [rad/s]; equation (1)."""
        if self.rise_velocity > 0.0:
            grip = self.rise / (1.0 + np.square(speed / self.rise_velocity))
        else:
            grip = np.zeros_like(speed)
        return self.damping_rate * speed + self.deceleration * (1.0 + grip)


class Course(NamedTuple):
    """Times [s], angle swept [rad] and speed [rad/s] from the start to standstill."""

    time: Floats
    swept: Floats
    speed: Floats


def course_to_standstill(speed: float, slowing: Slowing) -> Course:
    """Return the course from a speed [rad/s] to standstill, of dt = -dw / deceleration by Gauss's rule over w."""
    # Cubed, for the slowing near standstill, where a seal grips, needs the shortest steps.
    speeds = speed * np.linspace(1.0, 0.0, _STEPS + 1) ** 3
    middle, half = 0.5 * (speeds[1:] + speeds[:-1]), 0.5 * (speeds[:-1] - speeds[1:])
    nodes = middle[:, None] + half[:, None] * _NODES
    decelerations = slowing.at(nodes)
    # Without any friction the time would be infinite.
    decelerations = np.maximum(decelerations, _SLOWEST * float(decelerations.max()) + 1e-300)
    times = half * ((1.0 / decelerations) @ _WEIGHTS)
    swept = half * ((nodes / decelerations) @ _WEIGHTS)
    return Course(np.concatenate(([0.0], np.cumsum(times))), np.concatenate(([0.0], np.cumsum(swept))), speeds)


def course(times: Floats, speed: float, slowing: Slowing) -> Course:
    """Return the course at times [s] after a start at a speed [rad/s]; after standstill the vane stays."""
    from scipy.interpolate import CubicHermiteSpline

    known = course_to_standstill(speed, slowing)
    rising = np.concatenate(([True], np.diff(known.time) > 0.0))
    inside = np.minimum(times, known.time[-1])
    angle = CubicHermiteSpline(known.time[rising], known.swept[rising], known.speed[rising])
    return Course(times, np.asarray(angle(inside)), np.asarray(angle.derivative()(inside)))
