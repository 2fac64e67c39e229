"""How the vane moves."""

from typing import NamedTuple

import numpy as np

from ppafo.metrics.metric import LED_SHANK, Floats, MetricKind, Readings
from ppafo.model.columns import root
from ppafo.signals import Recording
from ppafo.signals.meter import Course, MeterKind, Sample

TRAVEL_FRACTION = 0.01
"""A move has begun when this fraction of its travel is done, and has arrived when this fraction is left."""

# Travel [rad] below which nothing has moved: fractions of it would be rounding over rounding.
_STANDSTILL = 1.0e-6


def angle_range(recording: Recording) -> float:
    """Largest angle less smallest angle [rad]."""
    return float(np.ptp(recording["angle"]))


def largest_speed(recording: Recording) -> float:
    """Largest absolute angular velocity [rad/s]."""
    return float(np.max(np.abs(recording["angular_velocity"])))


def _time_of_fraction(recording: Recording, fraction: float) -> float | None:
    """Return the time [s] at which a fraction of the way from the first to the last angle is first done, by a line."""
    travelled = recording["angle"] - recording["angle"][0]
    if abs(travelled[-1]) < _STANDSTILL:
        return None
    # By a line between two samples; at the first one nothing is done, so that there is one before.
    done = travelled / travelled[-1]
    after = int(np.flatnonzero(done >= fraction)[0])
    return float(np.interp(fraction, done[after - 1 : after + 1], recording.time[after - 1 : after + 1]))


def departure_time(recording: Recording) -> float | None:
    """Time [s] at which 1 % of the way from the first to the last angle is done; None without a move."""
    return _time_of_fraction(recording, TRAVEL_FRACTION)


def arrival_time(recording: Recording) -> float | None:
    """Time [s] at which 99 % of the way from the first to the last angle is done; None without a move."""
    return _time_of_fraction(recording, 1.0 - TRAVEL_FRACTION)


class AngleRange(NamedTuple):
    """Smallest and largest angle [rad]."""

    smallest: float
    largest: float


def start_angle_range(course: Course, sample: Sample) -> AngleRange:
    """The angle of the first sample, twice."""
    return AngleRange(sample.angle, sample.angle)


def update_angle_range(state: AngleRange, course: Course, sample: Sample) -> AngleRange:
    """The range with the next sample in it."""
    return AngleRange(min(state.smallest, sample.angle), max(state.largest, sample.angle))


ANGLE_RANGE = MeterKind("angle_range", AngleRange, start_angle_range, update_angle_range, of_motion=True)


class LargestSpeed(NamedTuple):
    """Largest absolute angular velocity [rad/s]."""

    speed: float


def start_largest_speed(course: Course, sample: Sample) -> LargestSpeed:
    """The speed of the first sample."""
    return LargestSpeed(abs(sample.angular_velocity))


def update_largest_speed(state: LargestSpeed, course: Course, sample: Sample) -> LargestSpeed:
    """The larger one of that and the speed of the next sample."""
    return LargestSpeed(max(state.speed, abs(sample.angular_velocity)))


LARGEST_SPEED = MeterKind("largest_speed", LargestSpeed, start_largest_speed, update_largest_speed, of_motion=True)


def read_angle_range(readings: Readings) -> Floats:
    """``angle_range`` [rad]."""
    state = readings.meters[ANGLE_RANGE.name]
    span: Floats = state.largest - state.smallest
    return span


def read_largest_speed(readings: Readings) -> Floats:
    """``largest_speed`` [rad/s]."""
    speed: Floats = readings.meters[LARGEST_SPEED.name].speed
    return speed


def _read_time_of_fraction(readings: Readings, fraction: float) -> Floats:
    """As ``_time_of_fraction``, of traces (samples, runs): the first angle is judged by the last."""
    travelled = readings.traces["angle"] - readings.traces["angle"][0]
    moves = np.abs(travelled[-1]) >= _STANDSTILL
    done = travelled / np.where(moves, travelled[-1], np.nan)
    # The first True of each run; where nothing moves all are nan, and so is the time.
    after = np.argmax(done >= fraction, axis=0)
    runs = np.arange(after.size)
    before, reached = done[after - 1, runs], done[after, runs]
    part = (fraction - before) / (reached - before)
    return np.asarray((after - 1 + part) * readings.interval)


def read_departure_time(readings: Readings) -> Floats:
    """``departure_time`` [s]."""
    return _read_time_of_fraction(readings, TRAVEL_FRACTION)


def read_arrival_time(readings: Readings) -> Floats:
    """``arrival_time`` [s]."""
    return _read_time_of_fraction(readings, 1.0 - TRAVEL_FRACTION)


def foot_angle_error(recording: Recording) -> float:
    """Root of the time average of the foot's angle less the measured one, squared [rad], by the trapezoidal rule."""
    error = recording["foot_angle"] - recording["measured_foot_angle"]
    return float(np.sqrt(np.trapezoid(error**2, recording.time) / recording.duration))


def toe_clearance_error(recording: Recording) -> float:
    """Lowest height of the toes against the measured ones at the same instant [m]; below 0 where they hang lower."""
    return float(np.min(recording["toe_difference"]))


class FootError(NamedTuple):
    """Squared error of the foot's angle at the last sample [rad^2], trapezoidal sum of it, and lowest toes [m]."""

    last: float
    total: float
    lowest: float


def start_foot_error(course: Course, sample: Sample) -> FootError:
    """The error of the first sample."""
    error = sample.foot.angle - sample.foot.measured_angle
    return FootError(error * error, 0.0, sample.foot.toe_difference)


def update_foot_error(state: FootError, course: Course, sample: Sample) -> FootError:
    """One interval more."""
    error = sample.foot.angle - sample.foot.measured_angle
    square = error * error
    return FootError(square, state.total + 0.5 * (state.last + square), min(state.lowest, sample.foot.toe_difference))


FOOT_ERROR = MeterKind("foot_error", FootError, start_foot_error, update_foot_error)


# The interval is the same between all samples, so that it cancels in a mean over time.


def read_foot_angle_error(readings: Readings) -> Floats:
    """``foot_angle_error`` [rad]."""
    return root(readings.meters[FOOT_ERROR.name].total / (readings.samples - 1))


def read_toe_clearance_error(readings: Readings) -> Floats:
    """``toe_clearance_error`` [m]."""
    lowest: Floats = readings.meters[FOOT_ERROR.name].lowest
    return lowest


METRICS = (
    MetricKind(
        "foot_angle_error",
        "rad",
        "RMS difference between the angle of the foot and the measured one",
        ("foot_angle", "measured_foot_angle"),
        foot_angle_error,
        read_foot_angle_error,
        (FOOT_ERROR,),
        needs=(LED_SHANK,),
    ),
    MetricKind(
        "toe_clearance_error",
        "m",
        "lowest height of the toes over the measured gait's, below 0 where lower",
        ("toe_difference",),
        toe_clearance_error,
        read_toe_clearance_error,
        (FOOT_ERROR,),
        needs=(LED_SHANK,),
    ),
    MetricKind(
        "angle_range",
        "rad",
        "largest angle less smallest angle",
        ("angle",),
        angle_range,
        read_angle_range,
        (ANGLE_RANGE,),
    ),
    MetricKind(
        "largest_speed",
        "rad/s",
        "largest absolute angular velocity",
        ("angular_velocity",),
        largest_speed,
        read_largest_speed,
        (LARGEST_SPEED,),
    ),
    MetricKind(
        "departure_time",
        "s",
        "time at which 1 % of the move is done",
        ("angle",),
        departure_time,
        read_departure_time,
        traced=("angle",),
    ),
    MetricKind(
        "arrival_time",
        "s",
        "time at which 99 % of the move is done",
        ("angle",),
        arrival_time,
        read_arrival_time,
        traced=("angle",),
    ),
)
