"""A measured gait as periodic functions, and the leg that it prescribes at an instant."""

from typing import NamedTuple

from ppafo.model.fourier import Series, acceleration_at, harmonics, rate_at, value_at
from ppafo.model.turns import TURN, sine_and_cosine


class GaitSeries(NamedTuple):
    """One stride from heel strike to heel strike.

    Shank angle and ankle angle [rad] with the signs of ``model.leg``, ankle moment per body mass [N m/kg], positive in
    plantarflexion, vertical ground force in body weights [-], acceleration of the knee forward and up [m/s^2].
    """

    shank: Series
    ankle: Series
    moment: Series
    force: Series
    knee_forward: Series
    knee_up: Series


class GaitTiming(NamedTuple):
    """Strides per second [Hz]; phases in turns from the heel strike; the foot's angle [rad] where it stands flat.

    ``start`` is the phase at time 0. ``clearance_from`` and ``clearance_to`` bound the part of the swing in which the
    toes must not touch the ground.
    """

    frequency: float
    start: float
    heel_off: float
    toe_off: float
    clearance_from: float
    clearance_to: float
    ground_angle: float


class GaitNow(NamedTuple):
    """The gait at an instant: phase in turns, angles [rad] with their derivatives, moment [N m], force [N].

    Accelerations of the knee forward and up [m/s^2]; sine and cosine of the shank angle, and sine of the angle of the
    measured foot over the horizontal.
    """

    phase: float
    shank: float
    shank_rate: float
    shank_acceleration: float
    ankle: float
    ankle_rate: float
    ankle_acceleration: float
    moment: float
    force: float
    knee_forward: float
    knee_up: float
    sine_shank: float
    cosine_shank: float
    sine_healthy_foot: float


def phase_at(timing: GaitTiming, time: float) -> float:
    """Phase in turns since the last heel strike, 0 to 1, at a time [s] of 0 or more."""
    turns = timing.start + timing.frequency * time
    return turns - float(int(turns))


def gait_at(gait: GaitSeries, timing: GaitTiming, body_mass: float, gravity: float, time: float) -> GaitNow:
    """The gait of a person of a mass [kg] at a time [s]; ``gravity`` [m/s^2] makes newtons of body weights."""
    phase = phase_at(timing, time)
    at = harmonics(phase)
    shank = value_at(gait.shank, at)
    ankle = value_at(gait.ankle, at)
    sine_shank, cosine_shank = sine_and_cosine(shank / TURN)
    sine_foot, _ = sine_and_cosine((shank - ankle) / TURN + 0.25)
    return GaitNow(
        phase,
        shank,
        rate_at(gait.shank, at, timing.frequency),
        acceleration_at(gait.shank, at, timing.frequency),
        ankle,
        rate_at(gait.ankle, at, timing.frequency),
        acceleration_at(gait.ankle, at, timing.frequency),
        body_mass * value_at(gait.moment, at),
        max(body_mass * gravity * value_at(gait.force, at), 0.0),
        value_at(gait.knee_forward, at),
        value_at(gait.knee_up, at),
        sine_shank,
        cosine_shank,
        sine_foot,
    )
