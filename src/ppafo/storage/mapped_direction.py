"""The direction of a movement, up or down, from how fast a recorded channel moves, as a column map asks for it."""

import numpy as np

from ppafo.errors import DataError, UnitError, refused_as
from ppafo.signals import Recording
from ppafo.signals.recording import PLAIN_NUMBER, TIME_UNIT, Floats
from ppafo.storage.column_map import MappedDirection

_SHORTEST = 1e-12
"""Time [s] between two means of samples below which their slope is not asked for: rounding."""


def with_direction(recording: Recording, wanted: MappedDirection) -> Recording:
    """Return a recording with the channel ``direction``: 1 up, -1 down, 0 for slower than the threshold.

    A channel ``repetition`` numbers the sweeps one way from 1, 0 where it is slower, unless the recording has its own.
    DataError for a channel that is not there or never moves, a threshold or a window that cannot be read.
    """
    from ppafo.units import parse_quantity

    with refused_as(DataError, f"direction.of = {wanted.of!r}", DataError):
        unit = recording.unit(wanted.of)
    rate_unit = "1/s" if unit == PLAIN_NUMBER else f"{unit.removesuffix('_d')}/s"
    with refused_as(DataError, f"direction.threshold = {wanted.threshold!r}", UnitError):
        threshold = parse_quantity(wanted.threshold, rate_unit)
    with refused_as(DataError, f"direction.window = {wanted.window!r}", UnitError):
        window = parse_quantity(wanted.window, TIME_UNIT)
    rate = wanted.sign * _smoothed_rate(recording.time, recording[wanted.of], window)
    direction = np.where(rate > threshold, 1.0, np.where(rate < -threshold, -1.0, 0.0))
    moving = np.flatnonzero(direction)
    if moving.size == 0:
        raise DataError(f"direction.threshold: '{wanted.of}' never moves faster than {wanted.threshold}")
    directed = recording.with_channel("direction", direction, PLAIN_NUMBER)
    if "repetition" in recording:
        return directed
    sweeps = np.zeros(direction.size)
    is_reversed = np.diff(direction[moving]) != 0.0
    sweeps[moving] = np.concatenate(([1], 1 + np.cumsum(is_reversed)))
    return directed.with_channel("repetition", sweeps, PLAIN_NUMBER)


def _smoothed_rate(time: Floats, values: Floats, window: float) -> Floats:
    """Return the slope [1/s] between the means of the half windows [s] before and after each sample."""
    sum_of_values = np.concatenate(([0.0], np.cumsum(values)))
    sum_of_times = np.concatenate(([0.0], np.cumsum(time)))
    here = np.arange(time.size)
    # At least the sample itself on either side, where the window is shorter than a sample.
    first = np.minimum(np.searchsorted(time, time - 0.5 * window), here)
    end = np.maximum(np.searchsorted(time, time + 0.5 * window, side="right"), here + 1)
    count_before, count_after = here - first + 1, end - here
    mean_before = (sum_of_values[here + 1] - sum_of_values[first]) / count_before
    mean_after = (sum_of_values[end] - sum_of_values[here]) / count_after
    time_before = (sum_of_times[here + 1] - sum_of_times[first]) / count_before
    time_after = (sum_of_times[end] - sum_of_times[here]) / count_after
    return np.asarray((mean_after - mean_before) / np.maximum(time_after - time_before, _SHORTEST))
