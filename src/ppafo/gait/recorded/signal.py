"""One signal of a recorded walk, and its low pass."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import DataError
from ppafo.signals.recording import Floats

_MINIMUM_SAMPLES = 20
_ORDER = 2
_DOUBLE_PASS = (2.0**0.5 - 1.0) ** 0.25
"""A filter passed twice has its -3 dB lower by this; so it is designed higher (Winter, Biomechanics, section 2.4)."""


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """Values over time [s], evenly enough sampled, of one file.

    ``is_position``: a position [m], of which the gait has the acceleration.
    ``columns`` are those of the file behind it. ``absent`` tells where a load was not measured, and counts as 0; None
    where it always was.
    """

    file: str
    time: Floats
    values: Floats
    is_position: bool = False
    columns: tuple[str, ...] = ()
    absent: NDArray[np.bool_] | None = None

    @property
    def rate(self) -> float:
        """Samples per second [Hz]."""
        return float((self.time.size - 1) / (self.time[-1] - self.time[0]))


def without_ends(signal: Signal) -> Signal:
    """Return a motion from its first to its last number: a marker that comes into view or leaves it."""
    known = np.flatnonzero(np.isfinite(signal.values))
    inside = slice(int(known[0]), int(known[-1]) + 1)
    return replace(signal, time=signal.time[inside], values=signal.values[inside])


def with_absence(signal: Signal) -> Signal:
    """Return a load that is 0 where it was not measured, and that says so."""
    absent = ~np.isfinite(signal.values)
    return signal if not absent.any() else replace(signal, values=np.where(absent, 0.0, signal.values), absent=absent)


def low_pass(signal: Signal, cut_off: float) -> Signal:
    """Return the signal through a Butterworth filter passed forwards and backwards, -3 dB at ``cut_off`` [Hz].

    DataError where it has too few samples.
    """
    from scipy.signal import butter, sosfiltfilt

    if signal.time.size < _MINIMUM_SAMPLES:
        raise DataError(f"{signal.file}: {signal.time.size} rows are too short for a stride; give a longer recording")
    even = np.linspace(signal.time[0], signal.time[-1], signal.time.size)
    relative = cut_off / _DOUBLE_PASS / (0.5 * signal.rate)
    if relative >= 1.0:
        raise DataError(
            f"{signal.file}: cannot be low-passed at {cut_off:g} Hz: it has {signal.rate:.4g} samples a second; "
            f"choose less than {0.5 * signal.rate * _DOUBLE_PASS:.3g} Hz"
        )
    sections = butter(_ORDER, relative, output="sos")
    values = sosfiltfilt(sections, np.interp(even, signal.time, signal.values))
    return replace(signal, time=even, values=np.asarray(values, dtype=np.float64))
