"""Metrics of the motion of the vane: range, speed, travel times, foot errors."""

from functools import partial
from typing import NamedTuple

import numpy as np

from ppafo.metrics.metric import Floats, MetricKind, Readings, less, metered
from ppafo.model.columns import root
from ppafo.signals import Recording
from ppafo.signals.meter import LED_SHANK, MeterKind, ReferenceSummary, Sample

TRAVEL_FRACTION = 0.01
"""Fraction of the travel [-] after which a move has started, and remaining fraction at arrival."""

# Travel [rad] below which nothing has moved: fractions of it would be rounding over rounding.
_STANDSTILL = 1.0e-6
_RETURNED = 0.1
"""Least distance between start and end of a move, relative to the angle range [-]."""


def angle_range(recording: Recording) -> float:
    """Largest angle minus smallest angle [rad]."""
    return float(np.ptp(recording["angle"]))


def largest_speed(recording: Recording) -> float:
    """Largest absolute angular velocity [rad/s]."""
    return float(np.max(np.abs(recording["angular_velocity"])))


def time_of_fraction(recording: Recording, fraction: float) -> float | None:
    """Time at which a fraction of the travel is first reached [s]; None without a move.

    A motion that ends near its start does not count as a move.
    """
    travelled = recording["angle"] - recording["angle"][0]
    if abs(travelled[-1]) < max(_STANDSTILL, _RETURNED * float(np.ptp(travelled))):
        return None
    # By a line between two samples; at the first one nothing is done, so that there is one before.
    done = travelled / travelled[-1]
    after = int(np.flatnonzero(done >= fraction)[0])
    return float(np.interp(fraction, done[after - 1 : after + 1], recording.time[after - 1 : after + 1]))


class _Motion(NamedTuple):
    """State of the motion meter: torque [N m] and angle [rad] at the last sample, work so far [J], extremes.

    These are smallest and largest angle [rad], and largest absolute angular velocity [rad/s].
    """

    torque: float
    angle: float
    work: float
    smallest: float
    largest: float
    speed: float


def start_motion(course: ReferenceSummary, sample: Sample) -> _Motion:
    """Start the motion meter at the first sample."""
    return _Motion(sample.torque, sample.angle, 0.0, sample.angle, sample.angle, abs(sample.angular_velocity))


def update_motion(state: _Motion, course: ReferenceSummary, sample: Sample) -> _Motion:
    """Update the motion meter with a sample; work by the trapezoidal rule over the angle."""
    return _Motion(
        torque=sample.torque,
        angle=sample.angle,
        work=state.work + 0.5 * (state.torque + sample.torque) * (sample.angle - state.angle),
        smallest=min(state.smallest, sample.angle),
        largest=max(state.largest, sample.angle),
        speed=max(state.speed, abs(sample.angular_velocity)),
    )


# A locked vane does no work: the engine leaves the meter as it started.
MOTION = MeterKind("motion", _Motion, start_motion, update_motion, of_motion=True)


def read_time_of_fraction(readings: Readings, fraction: float) -> Floats:
    """Time at which a fraction of the travel is reached [s] (runs,), from traces (samples, runs); nan at rest."""
    travelled = readings.traces["angle"] - readings.traces["angle"][0]
    moves = np.abs(travelled[-1]) >= np.maximum(_STANDSTILL, _RETURNED * np.ptp(travelled, axis=0))
    done = travelled / np.where(moves, travelled[-1], np.nan)
    # The first True of each run; where nothing moves all are nan, and so is the time.
    after = np.argmax(done >= fraction, axis=0)
    runs = np.arange(after.size)
    before = done[after - 1, runs]
    reached = done[after, runs]
    part = (fraction - before) / (reached - before)
    return np.asarray((after - 1 + part) * readings.interval)


def foot_angle_error(recording: Recording) -> float:
    """RMS over time of foot angle minus measured foot angle [rad], by the trapezoidal rule."""
    error = recording["foot_angle"] - recording["measured_foot_angle"]
    return float(np.sqrt(np.trapezoid(error**2, recording.time) / recording.duration))


def toe_clearance_error(recording: Recording) -> float:
    """Smallest toe height minus measured toe height at the same instant [m]; negative for toes too low."""
    return float(np.min(recording["toe_difference"]))


class _FootError(NamedTuple):
    """State of the foot meter: last squared angle error [rad^2], its trapezoidal sum, lowest toe difference [m]."""

    last: float
    total: float
    lowest: float


def start_foot_error(course: ReferenceSummary, sample: Sample) -> _FootError:
    """Start the foot meter at the first sample."""
    error = sample.foot.angle - sample.foot.measured_angle
    return _FootError(error * error, 0.0, sample.foot.toe_difference)


def update_foot_error(state: _FootError, course: ReferenceSummary, sample: Sample) -> _FootError:
    """Update the foot meter with a sample."""
    error = sample.foot.angle - sample.foot.measured_angle
    square = error * error
    return _FootError(square, state.total + 0.5 * (state.last + square), min(state.lowest, sample.foot.toe_difference))


FOOT_ERROR = MeterKind("foot_error", _FootError, start_foot_error, update_foot_error)


# The interval is the same between all samples, so that it cancels in a mean over time.


def read_foot_angle_error(readings: Readings) -> Floats:
    """Metric ``foot_angle_error`` of runs without recording [rad]."""
    return root(readings.meters[FOOT_ERROR.name].total / (readings.samples - 1))


def _time(name: str, fraction: float, summary: str) -> MetricKind:
    """Declare a metric of the time at which a fraction of the travel is reached."""
    compute = partial(time_of_fraction, fraction=fraction)
    read = partial(read_time_of_fraction, fraction=fraction)
    return MetricKind(name, "s", summary, ("angle",), compute, read, traced=("angle",))


_TOES = "lowest height of the toes over the measured gait's, below 0 where lower"
_SPEED = "largest absolute angular velocity of the samples"
_ENDS = (MOTION, "largest"), (MOTION, "smallest")
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
    metered(toe_clearance_error, "m", _TOES, ("toe_difference",), (FOOT_ERROR, "lowest"), needs=(LED_SHANK,)),
    metered(angle_range, "rad", "largest angle less smallest angle", ("angle",), *_ENDS, function=less),
    metered(largest_speed, "rad/s", _SPEED, ("angular_velocity",), (MOTION, "speed")),
    _time("departure_time", TRAVEL_FRACTION, "time at which 1 % of the move is done"),
    _time("arrival_time", 1.0 - TRAVEL_FRACTION, "time at which 99 % of the move is done"),
)
