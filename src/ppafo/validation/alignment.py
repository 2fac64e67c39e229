"""How much later a measurement is than the model: the shift in time that leaves the smallest squares."""

from dataclasses import dataclass, replace

import numpy as np

from ppafo.signals.recording import Floats

DEFAULT_LIMIT = 0.02
"""Largest delay [s] that is looked for; sensors, filters and valves are late by less, and a model by more is wrong."""

_SHIFTS = 81
_MAXIMUM_SAMPLES = 4000
_MINIMUM_GAIN = 25.0
"""In variances of one sample: five standard deviations of white noise. Less is noise and no delay."""
_SMALLEST_GAIN = 1.0e-12
"""Gain below which two curves are the same to the accuracy of the engine."""
_RESOLUTION = 0.02
"""Fraction of a sample below which a delay counts as none."""
_GOLDEN = 0.6180339887498949
_REFINEMENTS = 30
_AT_LIMIT = 0.99


@dataclass(frozen=True, slots=True)
class Curve:
    """One channel of both: measured values at their times, the model's at its own, and the full range."""

    times: Floats
    values: Floats
    model_times: Floats
    model_values: Floats
    full_range: float

    def shift(self, delay: float, times: Floats) -> Floats:
        """The model, ``delay`` [s] later, at some times; before its first and after its last value it stands still."""
        return np.interp(times - delay, self.model_times, self.model_values)


@dataclass(frozen=True, slots=True)
class Delay:
    """Time [s] by which the measurement is later than the model, 0 where none can be seen; True at its limit."""

    value: float
    is_at_limit: bool

    @property
    def correction(self) -> float:
        """The delay [s] to correct for; 0 at the limit, where the best fit is no delay of a sensor any more."""
        return 0.0 if self.is_at_limit else self.value


def estimate_delay(curves: "list[Curve]", limit: float) -> Delay:
    """The delay, at most ``limit`` [s] either way, that brings the channels together best, each in its full range."""
    if limit <= 0.0 or not curves:
        return Delay(0.0, is_at_limit=False)
    thinned = [_thin(curve) for curve in curves]
    shifts = np.linspace(-limit, limit, _SHIFTS).tolist()
    best = int(np.argmin([_cost(thinned, shift) for shift in shifts]))
    value = _minimum(thinned, shifts[max(0, best - 1)], shifts[min(_SHIFTS - 1, best + 1)])
    if abs(value) < _RESOLUTION * float(np.median(np.diff(curves[0].times))) or not _is_significant(thinned, value):
        return Delay(0.0, is_at_limit=False)
    return Delay(value, abs(value) > _AT_LIMIT * limit)


def _thin(curve: Curve) -> Curve:
    """The curve with no more measured samples than the search needs."""
    step = -(-curve.times.size // _MAXIMUM_SAMPLES)
    return replace(curve, times=curve.times[::step], values=curve.values[::step])


def _cost(curves: "list[Curve]", delay: float) -> float:
    """Mean squared error over all samples and channels, in full ranges [-]."""
    means = [
        float((((curve.shift(delay, curve.times) - curve.values) / curve.full_range) ** 2).mean()) for curve in curves
    ]
    return sum(means) / len(means)


def _is_significant(curves: "list[Curve]", delay: float) -> bool:
    """True where the delay explains more than noise and the accuracy of the engine could."""
    shifted = _cost(curves, delay)
    gain = _cost(curves, 0.0) - shifted
    samples = sum(curve.times.size for curve in curves)
    return gain > _SMALLEST_GAIN and gain * samples > _MINIMUM_GAIN * shifted


def _minimum(curves: "list[Curve]", low: float, high: float) -> float:
    """The delay [s] of the smallest cost between two delays, by golden section."""
    inner = [high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)]
    costs = [_cost(curves, delay) for delay in inner]
    for _ in range(_REFINEMENTS):
        if costs[0] <= costs[1]:
            high, inner[1], costs[1] = inner[1], inner[0], costs[0]
            inner[0] = high - _GOLDEN * (high - low)
            costs[0] = _cost(curves, inner[0])
        else:
            low, inner[0], costs[0] = inner[0], inner[1], costs[1]
            inner[1] = low + _GOLDEN * (high - low)
            costs[1] = _cost(curves, inner[1])
    return 0.5 * (low + high)
