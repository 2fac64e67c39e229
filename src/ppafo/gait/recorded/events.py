"""Heel strikes and toe-offs: from the vertical force on the foot, or from the shank where there is none."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.recorded.signal import Signal, low_pass
from ppafo.signals.recording import Floats

LOADED, UNLOADED = 0.05, 0.03
"""Body weights: above the first the foot is on the ground, below the second it is off it."""

SHORTEST_CONTACT = 0.1
"""Seconds; a shorter contact, or a shorter time off the ground, is noise of the force plate."""

_SMOOTH = 6.0
"""Hz; the shank is smoothed by this before its events are looked for."""
_SHORTEST_STRIDE = 0.5
"""Seconds between two heel strikes of one foot."""
_TOP = 0.35
"""Fraction of the range of the shank angle, from above, in which heel strikes lie."""
_DEEPEST = np.radians(-15.0)
"""Before the swing the shank leans back further than this."""


@dataclass(frozen=True, slots=True)
class Stride:
    """Times [s] of a heel strike, of the toe-off after it and of the next heel strike of the same foot."""

    start: float
    toe_off: float
    end: float

    @property
    def time(self) -> float:
        """Length [s]."""
        return self.end - self.start

    @property
    def stance_share(self) -> float:
        """Fraction [-] of the stride until toe-off."""
        return (self.toe_off - self.start) / self.time


def strides_from_force(force: Signal) -> list[Stride]:
    """Return the whole strides in a vertical force [body weights]; thresholds with hysteresis, interpolated in time."""
    contacts = contacts_of(force)
    strides = []
    for (start, toe_off), (following, _) in pairwise(contacts):
        if start is not None and toe_off is not None and following is not None:
            strides.append(Stride(start, toe_off, following))
    return strides


Contact = tuple[float | None, float | None]


def contacts_of(force: Signal) -> list[Contact]:
    """Return heel strike and toe-off of every contact; None at an end of the record that cuts one."""
    loaded = _with_hysteresis(force.values)
    edges = [0, *(np.flatnonzero(np.diff(loaded.astype(int))) + 1).tolist(), loaded.size]
    stretches = list(pairwise(edges))
    kept = _without_short(force.time, [(first, last) for first, last in stretches if loaded[first]])
    size = loaded.size
    return [
        (
            None if first == 0 else _crossing(force, first, LOADED),
            None if last == size else _crossing(force, last, UNLOADED),
        )
        for first, last in kept
    ]


def _with_hysteresis(values: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return whether the foot is loaded; between both thresholds it is as it was before."""
    decided = np.where(values > LOADED, 1, np.where(values < UNLOADED, 0, -1))
    known = np.flatnonzero(decided >= 0)
    if known.size == 0:
        return np.zeros(values.size, dtype=np.bool_)
    last_known = np.maximum.accumulate(np.where(decided >= 0, np.arange(values.size), known[0]))
    return np.asarray(decided[last_known] == 1, dtype=np.bool_)


def _without_short(time: Floats, contacts: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return the contacts with short breaks closed, and then without short ones."""
    joined: list[tuple[int, int]] = []
    for first, last in contacts:
        if joined and time[first] - time[joined[-1][1]] < SHORTEST_CONTACT:
            joined[-1] = joined[-1][0], last
        else:
            joined.append((first, last))
    final = time.size - 1
    at_an_end = (0, time.size)
    return [
        (first, last)
        for first, last in joined
        if first in at_an_end or last in at_an_end or time[min(last, final)] - time[first] >= SHORTEST_CONTACT
    ]


def _crossing(signal: Signal, index: int, level: float) -> float:
    """Return when a line between the samples before and at ``index`` passes a level [s]."""
    before, after = signal.values[index - 1], signal.values[index]
    fraction = 0.5 if after == before else float(np.clip((level - before) / (after - before), 0.0, 1.0))
    return float(signal.time[index - 1] + fraction * (signal.time[index] - signal.time[index - 1]))


def strides_from_shank(shank: Signal) -> list[Stride]:
    """Return the whole strides in a shank angle phi [rad], above 0 while the ankle is in front.

    Heel strike is where the forward swing of the shank ends, its largest angle. Toe-off is where it leans back fastest
    before the swing, after Aminian et al. 2002, J Biomech 35:689, who find both in a gyroscope on the shank. DataError
    where there is no toe-off.
    """
    smooth = low_pass(shank, _SMOOTH)
    peaks = _heel_strikes(smooth)
    rate = np.gradient(smooth.values, smooth.time)
    return [
        Stride(
            float(smooth.time[first]), float(smooth.time[_toe_off(smooth, rate, first, last)]), float(smooth.time[last])
        )
        for first, last in pairwise(peaks)
    ]


def _heel_strikes(shank: Signal) -> list[int]:
    from scipy.signal import find_peaks

    high, low = float(np.max(shank.values)), float(np.min(shank.values))
    apart = max(1, int(_SHORTEST_STRIDE * shank.rate))
    peaks, _ = find_peaks(shank.values, height=high - _TOP * (high - low), distance=apart)
    return [int(peak) for peak in peaks]


def _toe_off(shank: Signal, rate: Floats, first: int, last: int) -> int:
    """Return the sample of the fastest lean backwards between mid-stride and the start of the swing."""
    lowest = first + int(np.argmin(shank.values[first:last]))
    middle = first + (lowest - first) // 2
    if lowest - middle < 2 or shank.values[lowest] > _DEEPEST:
        raise DataError(
            f"{shank.file}: the shank does not lean back before the swing after {shank.time[first]:g} s, so there is "
            "no toe-off to be found in it; give a vertical force, or correct the sign of the shank angle"
        )
    return middle + int(np.argmin(rate[middle:lowest]))
