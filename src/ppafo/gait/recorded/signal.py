"""Signals over time from one file: gaps in motions, loads that were not measured, and low-pass filter."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import DataError
from ppafo.signals.recording import Floats

_MINIMUM_SAMPLES = 20
"""Least number of samples for the low pass."""
_ORDER = 2
"""Order of the Butterworth low pass, which is applied twice."""
_DOUBLE_PASS = (2.0**0.5 - 1.0) ** 0.25
"""Ratio of the -3 dB frequencies of two passes and of a single pass (Winter, Biomechanics, section 2.4)."""


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """Signal over time [s] from one file, with nearly uniform sampling.

    ``is_position`` marks a position [m], whose acceleration is a curve of the gait. ``columns`` are the columns of the
    file that were used. ``absent`` marks samples of a load that were not measured and are set to 0, None if complete.
    ``lost`` marks samples of a motion that were not recorded and are interpolated linearly, None if complete.
    """

    file: str
    time: Floats
    values: Floats
    is_position: bool = False
    columns: tuple[str, ...] = ()
    absent: NDArray[np.bool_] | None = None
    lost: NDArray[np.bool_] | None = None

    @property
    def rate(self) -> float:
        """Sampling rate [Hz]."""
        return float((self.time.size - 1) / (self.time[-1] - self.time[0]))


def without_ends(signal: Signal) -> Signal:
    """Return a motion from its first to its last valid sample, with gaps interpolated linearly and marked as lost."""
    valid = np.flatnonzero(np.isfinite(signal.values))
    inside = slice(int(valid[0]), int(valid[-1]) + 1)
    time, values = signal.time[inside], signal.values[inside]
    gaps = ~np.isfinite(values)
    if not gaps.any():
        return replace(signal, time=time, values=values)
    return replace(signal, time=time, values=np.interp(time, time[~gaps], values[~gaps]), lost=gaps)


def with_absence(signal: Signal) -> Signal:
    """Return a load set to 0 where it was not measured, with these samples marked as absent."""
    absent = ~np.isfinite(signal.values)
    return signal if not absent.any() else replace(signal, values=np.where(absent, 0.0, signal.values), absent=absent)


def low_pass(signal: Signal, cut_off: float) -> Signal:
    """Return the signal filtered forwards and backwards by a Butterworth low pass, -3 dB at ``cut_off`` [Hz].

    Raises DataError for a signal with too few samples.
    """
    from scipy.signal import butter, sosfiltfilt

    if signal.time.size < _MINIMUM_SAMPLES:
        raise DataError(f"{signal.file}: {signal.time.size} rows are too few for a stride")
    # A filter needs even samples; the jitter of a clock is small beside a stride.
    even = np.linspace(signal.time[0], signal.time[-1], signal.time.size)
    relative = cut_off / _DOUBLE_PASS / (0.5 * signal.rate)
    if relative >= 1.0:
        raise DataError(
            f"{signal.file}: has {signal.rate:.4g} samples per second, so a cut-off frequency must be below "
            f"{0.5 * signal.rate * _DOUBLE_PASS:.3g} Hz, not {cut_off:g} Hz"
        )
    sections = butter(_ORDER, relative, output="sos")
    values = sosfiltfilt(sections, np.interp(even, signal.time, signal.values))
    return replace(signal, time=even, values=np.asarray(values, dtype=np.float64))
