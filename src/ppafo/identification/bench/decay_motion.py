"""Motion of a vane that decays freely, in closed form: equation (1) without pressure and gravity.

I w' = -beta w - T_c sign(w). With b = beta/I and d = T_c/I, w(t) = (w_0 + d/b) exp(-b t) - d/b until w reaches zero.
"""

import math

import numpy as np

from ppafo.signals.recording import Floats

_SLOW = 1.0e-9


def angle_of_decay(
    times: Floats, start_angle: float, start_velocity: float, damping_rate: float, deceleration: float
) -> Floats:
    """Return the angle [rad] after times [s] for beta/I [1/s] and T_c/I [rad/s^2]; start velocity above 0; eq. (1)."""
    stop = stop_time(start_velocity, damping_rate, deceleration)
    moving = np.minimum(times, stop)
    run, creep = _decay_integrals(moving, damping_rate)
    return np.asarray(start_angle + start_velocity * run - deceleration * creep)


def velocity_of_decay(times: Floats, start_velocity: float, damping_rate: float, deceleration: float) -> Floats:
    """Return the angular velocity [rad/s] after times [s], 0 from the stop on; arguments as for the angle; eq. (1)."""
    moving = np.minimum(times, stop_time(start_velocity, damping_rate, deceleration))
    run, _ = _decay_integrals(moving, damping_rate)
    return np.asarray(start_velocity * (1.0 - damping_rate * run) - deceleration * run)


def stop_time(start_velocity: float, damping_rate: float, deceleration: float) -> float:
    """Return when the decay ends [s], infinite without Coulomb friction: ln(1 + w_0 b / d) / b."""
    if deceleration <= 0.0:
        return math.inf
    if damping_rate < _SLOW:
        return start_velocity / deceleration
    return math.log1p(start_velocity * damping_rate / deceleration) / damping_rate


def _decay_integrals(times: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return the integral of exp(-b t), and the integral of that; series where b t is small."""
    product = rate * times
    small = product < 1.0e-4
    safe_rate = max(rate, _SLOW)
    run = np.where(small, times * (1.0 - product / 2.0 + product**2 / 6.0), -np.expm1(-product) / safe_rate)
    creep = np.where(small, times**2 * (0.5 - product / 6.0 + product**2 / 24.0), (times - run) / safe_rate)
    return run, creep
