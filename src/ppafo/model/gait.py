"""A measured gait as periodic functions, and the leg that it prescribes at an instant."""

from typing import NamedTuple

from ppafo.model.fourier import Series, acceleration_at, harmonics, rate_at, value_at
from ppafo.model.leg import LegParameters, foot_inertia_about_ankle, torque_of_shank
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
    measured foot over the horizontal; torque [N m] that moves the measured foot, by equation (11).
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
    healthy_torque: float


def phase_at(timing: GaitTiming, time: float) -> float:
    """Phase in turns since the last heel strike, 0 to 1, at a time [s] of 0 or more."""
    turns = timing.start + timing.frequency * time
    return turns - float(int(turns))


def gait_at(gait: GaitSeries, timing: GaitTiming, leg: LegParameters, time: float) -> GaitNow:
    """The gait of a person with this leg at a time [s]; body mass and gravity make newtons of body weights."""
    phase = phase_at(timing, time)
    at = harmonics(phase)
    shank = value_at(gait.shank, at)
    shank_rate = rate_at(gait.shank, at, timing.frequency)
    shank_acceleration = acceleration_at(gait.shank, at, timing.frequency)
    ankle = value_at(gait.ankle, at)
    ankle_rate = rate_at(gait.ankle, at, timing.frequency)
    ankle_acceleration = acceleration_at(gait.ankle, at, timing.frequency)
    forward, up = value_at(gait.knee_forward, at), value_at(gait.knee_up, at)
    sine_shank, cosine_shank = sine_and_cosine(shank / TURN)
    sine_foot, cosine_foot = sine_and_cosine((shank - ankle) / TURN + 0.25)
    carried = torque_of_shank(
        leg, sine_shank, cosine_shank, sine_foot, cosine_foot, shank_rate, shank_acceleration, forward, up
    )
    return GaitNow(
        phase=phase,
        shank=shank,
        shank_rate=shank_rate,
        shank_acceleration=shank_acceleration,
        ankle=ankle,
        ankle_rate=ankle_rate,
        ankle_acceleration=ankle_acceleration,
        moment=leg.body_mass * value_at(gait.moment, at),
        force=max(leg.body_mass * leg.gravity * value_at(gait.force, at), 0.0),
        knee_forward=forward,
        knee_up=up,
        sine_shank=sine_shank,
        cosine_shank=cosine_shank,
        sine_healthy_foot=sine_foot,
        healthy_torque=carried + foot_inertia_about_ankle(leg) * ankle_acceleration + leg.ankle_damping * ankle_rate,
    )
