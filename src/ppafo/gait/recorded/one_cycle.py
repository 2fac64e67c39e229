"""One cycle that wraps around: a record little longer than a stride, which begins anywhere in it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ppafo.gait.gait import REQUIRED
from ppafo.gait.recorded.columns import LOADS
from ppafo.gait.recorded.signal import Signal
from ppafo.signals.recording import Floats

_RATE = 200.0
_SHORTEST = 0.5
"""Seconds of a stride."""

LONGEST = 1.5
"""Strides that a record of one cycle has at most; a longer one has strides to count."""

_MISFIT = 0.06
"""Root mean square of what start and end may differ by where they overlap, values and rates, over their ranges; two
strides of one healthy walk differ by 0.03."""


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """Three times the same cycle, its ``period`` [s], and what its ends differ by as a share of the ranges."""

    walk: Mapping[str, Signal]
    period: float
    misfit: float


def wrap_cycle(walk: Mapping[str, Signal]) -> Cycle | None:
    """Return a record of one cycle three times over, None where its start and end are not the same motion."""
    start = max(walk[name].time[0] for name in REQUIRED)
    end = min(walk[name].time[-1] for name in REQUIRED)
    time = np.arange(start, end, 1.0 / _RATE)
    shortest = max(_SHORTEST, (end - start) / LONGEST)
    first = int(np.ceil(shortest * _RATE))
    if time.size <= max(first, 3):
        return None
    curves = np.array([_scale(walk[name], time) for name in REQUIRED])
    features = np.concatenate([curves, _rates(curves)])
    shifts = np.arange(first, time.size)
    misfits = np.array(
        [np.sqrt(np.mean((features[:, shift:] - features[:, : time.size - shift]) ** 2)) for shift in shifts]
    )
    best = int(np.argmin(misfits))
    if misfits[best] > _MISFIT:
        return None
    period = float(shifts[best]) / _RATE
    covering = {name: signal for name, signal in walk.items() if _covers(signal, start, period)}
    wrapped = {name: _repeat(signal, (start, float(end)), period, name in LOADS) for name, signal in covering.items()}
    return Cycle(wrapped, period, float(misfits[best]))


def _scale(signal: Signal, time: Floats) -> Floats:
    values = np.interp(time, signal.time, signal.values)
    return values / np.ptp(signal.values)


def _rates(curves: Floats) -> Floats:
    rates = np.gradient(curves, axis=1)
    return np.asarray(rates / np.ptp(rates, axis=1, keepdims=True))


def _covers(signal: Signal, start: float, period: float) -> bool:
    slack = 1.0 / signal.rate
    return bool(signal.time[0] <= start + slack and signal.time[-1] >= start + period - slack)


def _repeat(signal: Signal, span: tuple[float, float], period: float, is_load: bool) -> Signal:
    """Return three periods of what lies within a span [s]; where its start and end overlap one fades into the other.

    A load is taken from where the plate carried it, and a position goes on by its way.
    """
    start, end = span
    count = max(2, round(period * signal.rate))
    one = start + period * np.arange(count) / count
    values, later = (np.interp(one + shift, signal.time, signal.values) for shift in (0.0, period))
    overlap = min(end, float(signal.time[-1])) - start - period
    inside = one <= start + max(overlap, 0.0)
    way = float(np.mean((later - values)[inside])) if signal.is_position else 0.0
    weight = np.clip((one - start) / overlap, 0.0, 1.0) if overlap > 0.0 else np.ones(count)
    blend = weight * values + (1.0 - weight) * (later - way)
    if is_load:
        blend = np.where(np.abs(later) > np.abs(values), later, values)
    turns = np.arange(3)
    time = (turns[:, None] * period + one[None, :]).ravel()
    whole = (turns[:, None] * way + np.where(inside, blend, values)[None, :]).ravel()
    return replace(signal, time=time, values=np.asarray(whole, dtype=np.float64), columns=(), absent=None)
