"""Gait that drives the leg: a measured stride as Fourier series, repeated.

First the series, then the gait phase and the measured quantities there.
"""

from typing import Annotated, NamedTuple

from ppafo.model.elementary import QUARTER_TURN, TURN, TURNS_OF_RADIAN, sine_and_cosine_of_turns
from ppafo.model.leg import LegParameters, ShankNow, foot_load, torque_of_shank

HARMONICS = 8
"""Number of harmonics in the engine; higher ones of the built-in gait are below 0.04 deg and 0.4 % of body weight."""


class Harmonic(NamedTuple):
    """Cosine and sine of a multiple of an angle, or the coefficients of both."""

    cosine: float
    sine: float


class Series(NamedTuple):
    """Mean and Fourier coefficients from the first harmonic on, all in the unit of the function."""

    mean: float
    harmonics: Annotated[tuple[Harmonic, ...], HARMONICS]


def harmonics(turns: float) -> tuple[Harmonic, ...]:
    """Cosines and sines of 1 to 8 times an angle [turns]."""
    s1, c1 = sine_and_cosine_of_turns(turns)
    # One sine and cosine, and sums of angles: no result waits for more than three products in a row.
    c2 = c1 * c1 - s1 * s1
    s2 = 2.0 * s1 * c1
    c3 = c2 * c1 - s2 * s1
    s3 = s2 * c1 + c2 * s1
    c4 = c2 * c2 - s2 * s2
    s4 = 2.0 * s2 * c2
    c5 = c4 * c1 - s4 * s1
    s5 = s4 * c1 + c4 * s1
    c6 = c3 * c3 - s3 * s3
    s6 = 2.0 * s3 * c3
    c7 = c4 * c3 - s4 * s3
    s7 = s4 * c3 + c4 * s3
    c8 = c4 * c4 - s4 * s4
    s8 = 2.0 * s4 * c4
    return (
        Harmonic(cosine=c1, sine=s1),
        Harmonic(cosine=c2, sine=s2),
        Harmonic(cosine=c3, sine=s3),
        Harmonic(cosine=c4, sine=s4),
        Harmonic(cosine=c5, sine=s5),
        Harmonic(cosine=c6, sine=s6),
        Harmonic(cosine=c7, sine=s7),
        Harmonic(cosine=c8, sine=s8),
    )


def value_at(series: Series, at: tuple[Harmonic, ...]) -> float:
    """Value of a periodic series at a point of the stride, in the unit of the series."""
    by = series.harmonics
    # Two sums that do not wait for each other, each without a loop.
    low = term_value(by[0], at[0]) + term_value(by[1], at[1]) + term_value(by[2], at[2]) + term_value(by[3], at[3])
    high = term_value(by[4], at[4]) + term_value(by[5], at[5]) + term_value(by[6], at[6]) + term_value(by[7], at[7])
    return series.mean + low + high


def rate_at(series: Series, at: tuple[Harmonic, ...], frequency: float) -> float:
    """Time derivative of a series, in its unit per second; ``frequency`` [Hz] of the first harmonic."""
    by = series.harmonics
    low = (
        term_rate(by[0], at[0])
        + 2.0 * term_rate(by[1], at[1])
        + 3.0 * term_rate(by[2], at[2])
        + 4.0 * term_rate(by[3], at[3])
    )
    high = (
        5.0 * term_rate(by[4], at[4])
        + 6.0 * term_rate(by[5], at[5])
        + 7.0 * term_rate(by[6], at[6])
        + 8.0 * term_rate(by[7], at[7])
    )
    return TURN * frequency * (low + high)


def acceleration_at(series: Series, at: tuple[Harmonic, ...], frequency: float) -> float:
    """Second time derivative of a series, in its unit per second squared; ``frequency`` as in ``rate_at``."""
    by = series.harmonics
    low = (
        term_value(by[0], at[0])
        + 4.0 * term_value(by[1], at[1])
        + 9.0 * term_value(by[2], at[2])
        + 16.0 * term_value(by[3], at[3])
    )
    high = (
        25.0 * term_value(by[4], at[4])
        + 36.0 * term_value(by[5], at[5])
        + 49.0 * term_value(by[6], at[6])
        + 64.0 * term_value(by[7], at[7])
    )
    angular = TURN * frequency
    return -angular * angular * (low + high)


def term_value(one: Harmonic, at: Harmonic) -> float:
    """Value of a harmonic with the coefficients ``one`` at an angle with the cosine and sine ``at``."""
    return one.cosine * at.cosine + one.sine * at.sine


def term_rate(one: Harmonic, at: Harmonic) -> float:
    """Derivative of ``term_value`` with respect to the angle."""
    return one.sine * at.cosine - one.cosine * at.sine


class GaitSeries(NamedTuple):
    """Fourier series of one stride from heel strike to heel strike.

    Shank angle and ankle angle [rad] with the signs of ``model.leg``, ankle moment per body mass [N m/kg], positive in
    plantarflexion, vertical ground force in body weights [-], acceleration of the knee forward and up [m/s^2].
    """

    shank: Series
    ankle: Series
    moment: Series
    force: Series
    knee_forward: Series
    knee_up: Series


class ShankSeries(NamedTuple):
    """Shank in a gait without ground contact: stride frequency [Hz], phase [turns] at time 0, and Fourier series.

    Measured angles of shank and ankle [rad], and acceleration of the knee forward and up [m/s^2], as in ``GaitSeries``.
    ``toe_lever`` [m] is the distance from the ankle forward to the toes.
    """

    frequency: float
    start: float
    toe_lever: float
    shank: Series
    ankle: Series
    knee_forward: Series
    knee_up: Series


class GaitTiming(NamedTuple):
    """Stride frequency [Hz]; phases in turns from the heel strike; angle of the flat foot [rad].

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
    """Point of the stride: phase [turns], cosines and sines of its multiples."""

    phase: float
    at: Annotated[tuple[Harmonic, ...], HARMONICS]


class GaitMeasured(NamedTuple):
    """Measured quantities of a gait at an instant: the first fields of ``GaitNow``, in the same order."""

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
    """Gait at an instant: phase [turns], angles [rad] with their derivatives, moment [N m], force [N].

    Accelerations of the knee forward and up [m/s^2]; sine and cosine of the shank angle; sine of the measured foot's
    angle to the horizontal; torque [N m] that moves the measured foot, by equation (11).
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


def gait_at(gait: GaitSeries, timing: GaitTiming, leg: LegParameters, time: float) -> GaitNow:
    """Gait of a person with this leg at a time [s]; body mass and gravity convert body weights to newtons."""
    return gait_of(leg, measured_at(gait, timing, leg, place_at(timing, time)))


def place_at(timing: GaitTiming, time: float) -> GaitPlace:
    """Point of the stride at a time [s] since a heel strike, with the phase from 0 to 1."""
    # Times are 0 or more, so int() is the floor; math.floor is a call in vector code.
    turns = timing.start + timing.frequency * time
    phase = turns - float(int(turns))
    return GaitPlace(phase, harmonics(phase))


def measured_at(gait: GaitSeries, timing: GaitTiming, leg: LegParameters, place: GaitPlace) -> GaitMeasured:
    """Measured quantities of a gait at a point of the stride, with forces [N] scaled to this leg."""
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


def shank_in_gait(gait: ShankSeries, time: float) -> ShankNow:
    """Shank motion prescribed by a gait at a time [s]."""
    at = harmonics(gait.start + gait.frequency * time)
    return ShankNow(
        angle=value_at(gait.shank, at),
        rate=rate_at(gait.shank, at, gait.frequency),
        acceleration=acceleration_at(gait.shank, at, gait.frequency),
        knee_forward=value_at(gait.knee_forward, at),
        knee_up=value_at(gait.knee_up, at),
    )


def foot_in_gait(gait: ShankSeries, time: float, angle: float) -> tuple[float, float, float]:
    """Angles of a foot and of the measured foot to the horizontal [rad], and height difference of their toes [m].

    The foot is on the shank of a gait, with an ankle angle [rad] at a time [s]; the height is positive if its toes are
    higher than the measured ones.
    """
    at = harmonics(gait.start + gait.frequency * time)
    shank = value_at(gait.shank, at)
    own = shank - angle
    measured = shank - value_at(gait.ankle, at)
    sine, _ = sine_and_cosine_of_turns(own * TURNS_OF_RADIAN + 0.25)
    measured_sine, _ = sine_and_cosine_of_turns(measured * TURNS_OF_RADIAN + 0.25)
    return own + QUARTER_TURN, measured + QUARTER_TURN, gait.toe_lever * (sine - measured_sine)


def gait_of(leg: LegParameters, now: GaitMeasured) -> GaitNow:
    """Measured gait with the derived quantities for this leg."""
    sine_shank, cosine_shank = sine_and_cosine_of_turns(now.shank * TURNS_OF_RADIAN)
    sine_foot, cosine_foot = sine_and_cosine_of_turns((now.shank - now.ankle) * TURNS_OF_RADIAN + 0.25)
    load = foot_load(leg)
    rate = now.shank_rate
    acceleration = now.shank_acceleration
    carried = torque_of_shank(
        load, sine_shank, cosine_shank, sine_foot, cosine_foot, rate, acceleration, now.knee_forward, now.knee_up
    )
    # Torque of the measured motion itself, with the wearer's own damping.
    moving = load.inertia * now.ankle_acceleration + leg.ankle_damping * now.ankle_rate
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
