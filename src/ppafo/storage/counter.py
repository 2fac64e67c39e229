"""Times of loggers that count microseconds or milliseconds in 32 bits, as ``micros()`` and ``millis()`` do."""

import numpy as np

from ppafo.signals.recording import Floats

_PERIODS = (2.0**32 * 1.0e-6, 2.0**32 * 1.0e-3)
"""Seconds after which a counter of 32 bits begins again, of microseconds and of milliseconds."""
_LARGEST_STEP = 10.0
"""Usual intervals [-] across a fall; a longer one is a clock that was set back, and no counter."""


def counted_on(time: Floats) -> Floats:
    """Return a time [s] without the falls of a counter of 32 bits, ``micros()`` or ``millis()``; any other as it is."""
    steps = np.diff(time)
    falls = steps < 0.0
    if not falls.any() or not (steps > 0.0).any():
        return time
    usual_step = float(np.median(steps[steps > 0.0]))
    for period in _PERIODS:
        across_falls = steps[falls] + period
        if (across_falls > 0.0).all() and (across_falls <= _LARGEST_STEP * usual_step).all():
            return np.asarray(time + period * np.concatenate(([0.0], np.cumsum(falls))))
    return time
