"""Faults of recorded numbers, detected in the numbers alone: gaps in time, and sensors at their limit."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ppafo.signals.recording import Floats

GAP_SAMPLES = 10.0
"""Shortest gap, in usual sampling intervals."""

FEWEST_AT_LIMIT = 20
"""Fewest equal samples that indicate a sensor at its limit."""

MINIMUM_SAMPLES = 10
"""Fewest samples for an estimate of the noise."""

_SPREAD_OF_MEDIAN = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation, which is robust to jumps [-]."""
_KEPT = 3.0
"""Largest usual difference, in standard deviations."""
_SHARE_OF_KEPT = 0.98658
"""Standard deviation of a normal distribution truncated at 3 standard deviations, over the whole's [-]."""
_GAIN_OF_DIFFERENCES = math.sqrt(20.0)
"""Standard deviation of the third difference of white noise over the noise's."""
_NOISY_FRACTION = 0.2
"""Fraction of turning points above which a signal is noisy: white noise has 2/3, a smooth curve hardly any."""
_ABRUPT_FRACTION = 0.3
"""Slope into a plateau at a limit, as a fraction of the steepest slope of the signal."""
_BEFORE = 5
"""Samples before a plateau by which its approach is assessed."""
_EXCEPTIONAL = 5
"""Length of a plateau over the next longest one above which it is no converter step [-]."""
_PARTS = 20
"""Parts of a signal whose means show a lasting change."""
_SMOOTH = 1.0e-6
"""Fraction of the range up to which a value's distance from the line between its neighbours is rounding."""


@dataclass(frozen=True, slots=True)
class Gap:
    """Samples missing after the sample with this index: the time [s] between it and the next one."""

    index: int
    duration: float


@dataclass(frozen=True, slots=True)
class Plateau:
    """The longest time at exactly the largest or smallest value: indices of first and last sample, and the value."""

    first: int
    last: int
    value: float
    word: Literal["largest", "smallest"]

    @property
    def count(self) -> int:
        """Number of samples in it."""
        return self.last - self.first + 1


def longest_gap(time: Floats) -> Gap | None:
    """Return the longest gap if it lasts many usual sampling intervals, else None."""
    # Against the median, which one gap does not move.
    intervals = np.diff(time)
    if intervals.size < 2:
        return None
    index = int(np.argmax(intervals))
    longest = float(intervals[index])
    return Gap(index, longest) if longest > GAP_SAMPLES * float(np.median(intervals)) else None


def lasting_change(values: Floats) -> float:
    """Return the range of the means of at most 20 equal parts of a signal."""
    parts = np.array_split(values, min(_PARTS, values.size))
    return float(np.ptp([part.mean() for part in parts]))


def plateaus(values: Floats) -> tuple[Plateau, Plateau]:
    """Return the longest times at exactly the largest and at exactly the smallest value."""
    largest, smallest = float(values.max()), float(values.min())
    return (
        Plateau(*longest_run(values == largest), largest, "largest"),
        Plateau(*longest_run(values == smallest), smallest, "smallest"),
    )


def longest_run(flags: NDArray[np.bool_]) -> tuple[int, int]:
    """Return the first and the last index of the longest run of True; at least one must be."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    starts, ends = edges[::2], edges[1::2]
    longest = int(np.argmax(ends - starts))
    return int(starts[longest]), int(ends[longest] - 1)


def is_at_limit(values: Floats, plateau: Plateau) -> bool:
    """Tell whether a plateau is a sensor at its limit: the noise stops there, or the signal runs into it.

    A signal that comes to rest by itself has noise there too, or slows down before.
    """
    if plateau.count < FEWEST_AT_LIMIT or plateau.count == values.size:
        return False
    # Whether it was still moving fast, for this signal, just before the plateau.
    before = min(plateau.first, _BEFORE)
    steps = np.abs(values[before:] - values[:-before]) if before else np.zeros(1)
    runs_into = float(steps[plateau.first - before]) > _ABRUPT_FRACTION * float(steps.max())
    # Off the plateau, noise goes up and down from sample to sample, as no smooth curve does.
    ways = np.sign(np.diff(values[values != plateau.value]))
    is_noisy = ways.size > 1 and float((ways[1:] * ways[:-1] < 0.0).mean()) > _NOISY_FRACTION
    return is_noisy or runs_into


def scatters(values: Floats) -> bool:
    """Tell whether at least half of the values are off the line between their neighbours, as with noise."""
    return values.size > 2 and float(np.median(np.abs(np.diff(values, 2)))) > _SMOOTH * float(np.ptp(values))


def stands_out(values: Floats, plateau: Plateau) -> bool:
    """Tell whether a plateau lasts far longer than any other, and is no step of a coarse converter."""
    if plateau.count < FEWEST_AT_LIMIT or plateau.count == values.size:
        return False
    # A coarse converter has such plateaus everywhere: they are compared with the longest of the others.
    rest = np.concatenate([values[: plateau.first], values[plateau.last + 1 :]])
    changes = np.flatnonzero(np.diff(rest))
    others = np.diff(np.concatenate(([-1], changes, [rest.size - 1])))
    return plateau.count > _EXCEPTIONAL * int(others.max())


def isolated_samples(values: Floats, noise: float) -> NDArray[np.bool_]:
    """Mark the samples that stand out alone from the four around them; ``noise`` is a standard deviation.

    They are off the median of five by more than 6 times the noise, and more than 3 times what the four range over.
    """
    others = np.ptp(_five_around(values)[:, [0, 1, 3, 4]], axis=1)
    return np.asarray(outlying_samples(values, noise) & (off_neighbours(values) > 3.0 * others))


def outlying_samples(values: Floats, noise: float) -> NDArray[np.bool_]:
    """Mark the outliers of residuals, adjacent ones included; ``noise`` is a standard deviation.

    They are off the median of five by more than 6 times the noise, and more than 3 times what three of the four others
    range over. An event that a model has at another time leaves a longer course, which is none of them.
    """
    others = np.sort(_five_around(values)[:, [0, 1, 3, 4]], axis=1)
    spread = np.minimum(others[:, 2] - others[:, 0], others[:, 3] - others[:, 1])
    away = off_neighbours(values)
    return np.asarray((away > 6.0 * noise) & (away > 3.0 * spread))


def off_neighbours(values: Floats) -> Floats:
    """Return the distance of each value from the median of the five around it, itself included."""
    return np.asarray(np.abs(values - np.median(_five_around(values), axis=1)))


def _five_around(values: Floats) -> Floats:
    """Return each value with the two before and the two after it (values, 5)."""
    # Mirrored at the ends, where an outlier would else be three of its own five neighbours.
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, 2, mode="reflect"), 5)


_ROUNDING = 1.0e-9
"""Fraction of a range [-] below which a step is rounding of a file and not of a converter."""
_SHARE_THAT_DIFFERS = 0.5
"""Largest fraction of distinct values in a signal with a visible converter step."""


def resolution_of(values: Floats) -> float:
    """Return the converter step of the values [their unit], the smallest difference; 0 if none is visible.

    One shows where most values come again, as no noise and no motion makes them.
    """
    steps = np.diff(np.unique(values))
    steps = steps[steps > _ROUNDING * steps.sum()]
    return float(steps.min()) if 0 < steps.size < _SHARE_THAT_DIFFERS * values.size else 0.0


def rounding_of(values: Floats, resolution: float) -> Floats:
    """Return the standard deviation [their unit] of each value by the rounding of its converter.

    It is the resolution over sqrt(12) (GUM, JCGM 100:2008, F.2.2.1). A sensor at rest repeats one value with one error,
    so that a run of n equal values says no more than one: each of them speaks with sqrt(n) times that.
    """
    edges = np.flatnonzero(np.diff(values, prepend=np.nan, append=np.nan))
    lengths = np.diff(edges)
    return np.asarray(resolution / math.sqrt(12.0) * np.sqrt(np.repeat(lengths, lengths)))


def noise_of(values: Floats) -> float:
    """Return the standard deviation of white noise [unit of the signal], from the usual third differences.

    What the signal itself does between four samples counts as noise where it is larger; a few jumps do not matter.
    """
    if values.size < MINIMUM_SAMPLES:
        return 0.0
    differences = _third_differences(values, 1)
    most = _KEPT * _SPREAD_OF_MEDIAN * float(np.median(differences))
    inner = differences[differences <= most]
    return float(np.sqrt(np.mean(inner * inner)) / _SHARE_OF_KEPT / _GAIN_OF_DIFFERENCES)


def _third_differences(values: Floats, lag: int) -> Floats:
    """Return the sizes of third differences of samples ``lag`` apart, each less a fitted parabola."""
    first, second, third, fourth = (values[place * lag : values.size - (3 - place) * lag] for place in range(4))
    return np.asarray(np.abs(fourth - 3.0 * third + 3.0 * second - first))


_SHARE_OF_LAGS = 0.1
"""Largest correlation time of noise, as a fraction of a recording: slower residuals are model error."""

_BY_CHANCE = 8.0
"""Four standard errors of a quarter's size among differences that share samples, times the root of their number."""

_QUARTER = 0.31864
"""Lower quartile of the absolute value of a standard normal deviate."""


def correlated_noise_of(values: Floats) -> float:
    """Return the standard deviation of possibly correlated noise in residuals [their unit].

    Third differences of samples further apart see the noise that neighbours share. A quarter of the recording, where
    they are smallest, speaks for all of it, as a model that is wrong is so while something moves. The spread about the
    median, which a constant error does not move, is never exceeded.
    """
    if values.size < MINIMUM_SAMPLES:
        return 0.0
    lags = [2**power for power in range(values.size.bit_length()) if 3 * 2**power <= _SHARE_OF_LAGS * values.size]
    sizes = [float(np.quantile(_third_differences(values, lag), 0.25)) for lag in lags]
    apart = max(sizes, default=0.0) / (_QUARTER * _GAIN_OF_DIFFERENCES)
    spread = _SPREAD_OF_MEDIAN * float(np.median(np.abs(values - np.median(values))))
    correlated, white = min(apart, spread), noise_of(values)
    return correlated if correlated > (1.0 + _BY_CHANCE / math.sqrt(values.size)) * white else white
