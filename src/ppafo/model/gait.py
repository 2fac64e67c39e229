"""A measured gait as periodic functions, and the leg that it prescribes at an instant."""

from typing import Annotated, NamedTuple

from ppafo.model.fourier import HARMONICS, Harmonic, Series, acceleration_at, harmonics, rate_at, value_at
from ppafo.model.leg import LegParameters, foot_inertia_about_ankle, torque_of_shank
from ppafo.model.turns import TURNS_OF_RADIAN, sine_and_cosine


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


class GaitPlace(NamedTuple):
    """A place in the stride: phase in turns, cosines and sines of its multiples."""

    phase: float
    at: Annotated[tuple[Harmonic, ...], HARMONICS]


class GaitMeasured(NamedTuple):
    """What was measured of a gait at an instant: the numbers with which ``GaitNow`` begins, as it has them."""

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
    return gait_of(leg, measured_at(gait, timing, leg, place_at(timing, time)))


def place_at(timing: GaitTiming, time: float) -> GaitPlace:
    """The place in the stride at a time [s]."""
    phase = phase_at(timing, time)
    return GaitPlace(phase, harmonics(phase))


def measured_at(gait: GaitSeries, timing: GaitTiming, leg: LegParameters, place: GaitPlace) -> GaitMeasured:
    """What was measured of a gait at a place in the stride, in newtons of this leg."""
    at = place.at
    return GaitMeasured(
        phase=place.phase,
        shank=value_at(gait.shank, at),
        shank_rate=rate_at(gait.shank, at, timing.frequency),
        shank_acceleration=acceleration_at(gait.shank, at, timing.frequency),
        ankle=value_at(gait.ankle, at),
        ankle_rate=rate_at(gait.ankle, at, timing.frequency),
        ankle_acceleration=acceleration_at(gait.ankle, at, timing.frequency),
        moment=leg.body_mass * value_at(gait.moment, at),
        force=max(leg.body_mass * leg.gravity * value_at(gait.force, at), 0.0),
        knee_forward=value_at(gait.knee_forward, at),
        knee_up=value_at(gait.knee_up, at),
    )


def gait_of(leg: LegParameters, now: GaitMeasured) -> GaitNow:
    """What was measured, with what follows of it for this leg."""
    sine_shank, cosine_shank = sine_and_cosine(now.shank * TURNS_OF_RADIAN)
    sine_foot, cosine_foot = sine_and_cosine((now.shank - now.ankle) * TURNS_OF_RADIAN + 0.25)
    carried = torque_of_shank(
        leg,
        sine_shank,
        cosine_shank,
        sine_foot,
        cosine_foot,
        now.shank_rate,
        now.shank_acceleration,
        now.knee_forward,
        now.knee_up,
    )
    moving = foot_inertia_about_ankle(leg) * now.ankle_acceleration + leg.ankle_damping * now.ankle_rate
    return GaitNow(
        phase=now.phase,
        shank=now.shank,
        shank_rate=now.shank_rate,
        shank_acceleration=now.shank_acceleration,
        ankle=now.ankle,
        ankle_rate=now.ankle_rate,
        ankle_acceleration=now.ankle_acceleration,
        moment=now.moment,
        force=now.force,
        knee_forward=now.knee_forward,
        knee_up=now.knee_up,
        sine_shank=sine_shank,
        cosine_shank=cosine_shank,
        sine_healthy_foot=sine_foot,
        healthy_torque=carried + moving,
    )
