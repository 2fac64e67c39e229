"""Cycle of a walk: a record slightly longer than a stride, whose end is the same motion as its start."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ppafo.gait.gait import REQUIRED
from ppafo.gait.recorded.columns import LOADS
from ppafo.gait.recorded.signal import Signal

_RATE = 200.0
"""Sampling rate [Hz] for the comparison of the ends of a cycle."""
_SHORTEST = 0.5
"""Shortest plausible stride time [s]."""
LONGEST = 1.5
"""Largest length of a record of one cycle [strides]; strides are counted in a longer record."""
_MISFIT = 0.06
"""Largest RMS difference between start and end in their overlap, of values and rates relative to their ranges [-]; two
strides of one healthy walk differ by 0.03."""


def wrap_cycle(walk: Mapping[str, Signal]) -> tuple[dict[str, Signal], float, float] | None:
    """Return one cycle repeated three times, its period [s], and the misfit of its ends relative to the ranges [-].

    None is returned if start and end of the record are not the same motion.
    """
    start = max(walk[name].time[0] for name in REQUIRED)
    end = min(walk[name].time[-1] for name in REQUIRED)
    # One even clock for both curves, whatever the rates of their files.
    time = np.arange(start, end, 1.0 / _RATE)
    shortest = max(_SHORTEST, (end - start) / LONGEST)
    first = int(np.ceil(shortest * _RATE))
    if time.size <= max(first, 3):
        return None
    curves = np.array(
        [np.interp(time, walk[name].time, walk[name].values) / np.ptp(walk[name].values) for name in REQUIRED]
    )
    rates = np.gradient(curves, axis=1)
    features = np.concatenate([curves, rates / np.ptp(rates, axis=1, keepdims=True)])
    # Every length of a cycle that leaves an overlap is tried; the best overlap is the period.
    shifts = np.arange(first, time.size)
    misfits = np.array(
        [np.sqrt(np.mean((features[:, shift:] - features[:, : time.size - shift]) ** 2)) for shift in shifts]
    )
    best = int(np.argmin(misfits))
    # Start and end are not the same motion: the record is no whole cycle, or the walk is not steady.
    if misfits[best] > _MISFIT:
        return None
    period = float(shifts[best]) / _RATE
    wrapped = {}
    for name, signal in walk.items():
        slack = 1.0 / signal.rate
        if signal.time[0] <= start + slack and signal.time[-1] >= start + period - slack:
            wrapped[name] = _repeat(signal, start, float(end), period, name in LOADS)
    return wrapped, period, float(misfits[best])


def _repeat(signal: Signal, start: float, end: float, period: float, is_load: bool) -> Signal:
    """Return three periods of the signal from ``start`` to ``end`` [s], blended where both ends overlap.

    For a load, the overlap uses the value of larger magnitude, because the other may be off the plate. A position
    advances by the distance walked in each cycle.
    """
    count = max(2, round(period * signal.rate))
    instants = start + period * np.arange(count) / count
    values, later = (np.interp(instants + shift, signal.time, signal.values) for shift in (0.0, period))
    overlap = min(end, float(signal.time[-1])) - start - period
    inside = instants <= start + max(overlap, 0.0)
    # A position goes on by the distance walked in a cycle.
    distance = float(np.mean((later - values)[inside])) if signal.is_position else 0.0
    weight = np.clip((instants - start) / overlap, 0.0, 1.0) if overlap > 0.0 else np.ones(count)
    blend = weight * values + (1.0 - weight) * (later - distance)
    if is_load:
        blend = np.where(np.abs(later) > np.abs(values), later, values)
    turns = np.arange(3)
    time = (turns[:, None] * period + instants[None, :]).ravel()
    repeated = (turns[:, None] * distance + np.where(inside, blend, values)[None, :]).ravel()
    return replace(signal, time=time, values=np.asarray(repeated, dtype=np.float64), columns=(), absent=None)
