"""Metrics of the tracking error between controlled quantity and reference."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from ppafo.metrics.metric import Floats, MetricKind, Readings, followed, for_each_reference, hold, metered, ramp, spans
from ppafo.model.columns import root
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.signals import Recording
from ppafo.signals.meter import MeterKind, ReferenceSummary, Sample

_NEEDED = ("torque", "reference")

ONE_INSTANT = frozenset(
    f"final_{name}error" for name in ("" if controlled == TORQUE else f"{controlled}_" for controlled in CONTROLLED)
)
"""Metrics of a single instant, which are arbitrary while the controlled quantity oscillates."""
_RMS = "root-mean-square torque error"
_PEAK = "largest absolute torque error of the whole run"


def error_of(recording: Recording) -> Floats:
    """Return the tracking error, reference minus controlled quantity [unit of the reference]."""
    reference, value = followed(recording)
    return reference - value


def rms_error(recording: Recording, part_of: Callable[[Recording], slice | None] | None = None) -> float | None:
    """RMS tracking error over time, in a recording or a part of it; None without that part.

    The integral is by the trapezoidal rule, valid for any sampling.
    """
    part = slice(None) if part_of is None else part_of(recording)
    if part is None:
        return None
    # Over time and not over samples: a recording may have more of them where more happens.
    time = recording.time[part]
    error = error_of(recording)[part]
    return float(np.sqrt(np.trapezoid(error**2, time) / float(time[-1] - time[0])))


def peak_error(recording: Recording) -> float:
    """Largest absolute tracking error [unit of the reference]."""
    return float(np.max(np.abs(error_of(recording))))


def final_error(recording: Recording) -> float:
    """Absolute tracking error at the last sample [unit of the reference]."""
    return float(abs(error_of(recording)[-1]))


class _SquaredError(NamedTuple):
    """State of the error meter: last and largest squared error, trapezoidal sums before and on the hold, in intervals.

    The root of a square is the absolute error to the last bit.
    """

    last: float
    largest: float
    before_hold: float
    on_hold: float


def start_squared_error(course: ReferenceSummary, sample: Sample) -> _SquaredError:
    """Start the squared-error meter at the first sample."""
    error = sample.reference - sample.value
    return _SquaredError(error * error, error * error, 0.0, 0.0)


def update_squared_error(state: _SquaredError, course: ReferenceSummary, sample: Sample) -> _SquaredError:
    """Update the squared-error meter with a sample."""
    error = sample.reference - sample.value
    square = error * error
    # In intervals: all have one length, which cancels where the sum is read.
    piece = 0.5 * (state.last + square)
    # The reference did not rest yet at the sample before this one.
    is_before = course.hold_start >= sample.number
    return _SquaredError(
        square,
        max(state.largest, square),
        state.before_hold + (piece if is_before else 0.0),
        state.on_hold + (0.0 if is_before else piece),
    )


SQUARED_ERROR = MeterKind("squared_error", _SquaredError, start_squared_error, update_squared_error, True)


def read_rms_error(readings: Readings) -> Floats:
    """Metric ``rms_error`` of runs without recording [N m]."""
    squares = readings.meters[SQUARED_ERROR.name]
    return root((squares.before_hold + squares.on_hold) / (readings.samples - 1))


def read_rms_error_ramp(readings: Readings) -> Floats:
    """Metric ``rms_error_ramp`` of runs without recording [N m], before the hold."""
    start, _ = spans(readings)
    return root(readings.meters[SQUARED_ERROR.name].before_hold / start)


def read_rms_error_hold(readings: Readings) -> Floats:
    """Metric ``rms_error_hold`` of runs without recording [N m]."""
    _, length = spans(readings)
    return root(readings.meters[SQUARED_ERROR.name].on_hold / length)


_OF_TORQUE = (
    *(
        MetricKind(
            f"rms_error{part}",
            "N m",
            f"{_RMS} {words}",
            _NEEDED,
            partial(rms_error, part_of=part_of),
            read,
            (SQUARED_ERROR,),
            better=-1,
        )
        for part, words, part_of, read in (
            ("", "over the whole run", None, read_rms_error),
            ("_ramp", "on the ramp", ramp, read_rms_error_ramp),
            ("_hold", "on the hold", hold, read_rms_error_hold),
        )
    ),
    metered(peak_error, "N m", _PEAK, _NEEDED, (SQUARED_ERROR, "largest"), function=root, better=-1),
    metered(final_error, "N m", "absolute torque error at the end", _NEEDED, (SQUARED_ERROR, "last"), function=root),
)

METRICS = for_each_reference(_OF_TORQUE, lambda name, controlled: name.replace("error", f"{controlled}_error"))

TRACKING = tuple(kind.name for kind in METRICS)
"""Names of the tracking error metrics, for all controlled quantities."""
