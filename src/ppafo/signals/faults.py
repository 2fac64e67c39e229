"""Faults of recorded numbers, detected in the numbers alone: gaps in time, and sensors at their limit."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ppafo.signals.recording import Floats

GAP_SAMPLES = 10.0
"""Usual times between samples that a gap has at least."""

FEWEST_AT_LIMIT = 20
"""Samples at exactly the same value from which a sensor may be at its limit."""

MINIMUM_SAMPLES = 10
"""Fewer do not show how large their noise is."""

_SPREAD_OF_MEDIAN = 1.4826
"""Standard deviation of a normal distribution over the median of its sizes, which a few jumps do not move."""
_KEPT = 3.0
"""Standard deviations up to which a difference counts as usual."""
_SHARE_OF_KEPT = 0.98658
"""Standard deviation of a normal distribution cut at 3 standard deviations, over the whole's."""
_GAIN_OF_DIFFERENCES = math.sqrt(20.0)
"""Standard deviation of the third difference of white noise over the noise's."""
_NOISY_FRACTION = 0.2
"""Fraction of turns from which a signal is noisy: white noise turns at two of three samples, a smooth curve hardly."""
_ABRUPT_FRACTION = 0.3
"""Fraction of the fastest movement of a signal from which it runs into a plateau."""
_BEFORE = 5
"""Samples over which a movement is looked at."""
_EXCEPTIONAL = 5
"""Lengths of the next longest plateau that one lasts which is no step of a coarse converter."""
_PARTS = 20
"""Parts of a signal whose means show what lasts."""
_SMOOTH = 1.0e-6
"""Fraction of the range of a signal up to which rounding alone puts a value off the line between its neighbours."""


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
    """Return the longest time without samples [s] where it is one of many usual intervals, else None."""
    # Against the median, which one gap does not move.
    intervals = np.diff(time)
    if intervals.size < 2:
        return None
    index = int(np.argmax(intervals))
    longest = float(intervals[index])
    return Gap(index, longest) if longest > GAP_SAMPLES * float(np.median(intervals)) else None


def lasting_change(values: Floats) -> float:
    """Return how far the values go in what lasts: largest less smallest mean of at most 20 equal parts."""
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
    """Return whether a plateau comes from a sensor at its limit: noise stops there, or the signal runs into it.

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
    """Return whether at least half of the values are off the line between their neighbours, as noise makes them."""
    return values.size > 2 and float(np.median(np.abs(np.diff(values, 2)))) > _SMOOTH * float(np.ptp(values))


def stands_out(values: Floats, plateau: Plateau) -> bool:
    """Return whether a plateau lasts far longer than any other value does: it is no step of a coarse converter."""
    if plateau.count < FEWEST_AT_LIMIT or plateau.count == values.size:
        return False
    # A coarse converter has such plateaus everywhere: they are compared with the longest of the others.
    rest = np.concatenate([values[: plateau.first], values[plateau.last + 1 :]])
    changes = np.flatnonzero(np.diff(rest))
    others = np.diff(np.concatenate(([-1], changes, [rest.size - 1])))
    return plateau.count > _EXCEPTIONAL * int(others.max())


def isolated_samples(values: Floats, noise: float) -> NDArray[np.bool_]:
    """Return which samples stand out by themselves, far off the four around them; ``noise`` is a standard deviation.

    They are off the median of five by more than 6 times the noise, and more than 3 times what the four range over.
    """
    others = np.ptp(_five_around(values)[:, [0, 1, 3, 4]], axis=1)
    return np.asarray(outlying_samples(values, noise) & (off_neighbours(values) > 3.0 * others))


def outlying_samples(values: Floats, noise: float) -> NDArray[np.bool_]:
    """Return which samples of what a model leaves stand out, though one beside them may: ``noise`` as above.

    They are off the median of five by more than 6 times the noise, and more than 3 times what three of the four others
    range over. An event that a model has at another time leaves a longer course, which is none of them.
    """
    others = np.sort(_five_around(values)[:, [0, 1, 3, 4]], axis=1)
    spread = np.minimum(others[:, 2] - others[:, 0], others[:, 3] - others[:, 1])
    away = off_neighbours(values)
    return np.asarray((away > 6.0 * noise) & (away > 3.0 * spread))


def off_neighbours(values: Floats) -> Floats:
    """Return how far each value is off the median of the five around it, its own among them."""
    return np.asarray(np.abs(values - np.median(_five_around(values), axis=1)))


def _five_around(values: Floats) -> Floats:
    """Return each value with the two before and the two behind it (values, 5)."""
    # Mirrored at the ends, where an outlier would else be three of its own five neighbours.
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, 2, mode="reflect"), 5)


_ROUNDING = 1.0e-9
"""Fraction of a range [-] that is no step of a converter but how a file rounds."""
_SHARE_THAT_DIFFERS = 0.5
"""Share of the values that may differ from all others, where a converter's step shows."""


def resolution_of(values: Floats) -> float:
    """Return the step of the converter that made the values [their unit], the least between two; 0 where none shows.

    One shows where most values come again, as no noise and no motion makes them.
    """
    steps = np.diff(np.unique(values))
    steps = steps[steps > _ROUNDING * steps.sum()]
    return float(steps.min()) if 0 < steps.size < _SHARE_THAT_DIFFERS * values.size else 0.0


def rounding_of(values: Floats, resolution: float) -> Floats:
    """Return the standard deviation [their unit] with which each value speaks, for what its converter rounds.

    It is the resolution over sqrt(12) (GUM, JCGM 100:2008, F.2.2.1). A sensor at rest repeats one value with one error,
    so that a run of n equal values says no more than one: each of them speaks with sqrt(n) times that.
    """
    edges = np.flatnonzero(np.diff(values, prepend=np.nan, append=np.nan))
    lengths = np.diff(edges)
    return np.asarray(resolution / math.sqrt(12.0) * np.sqrt(np.repeat(lengths, lengths)))


def noise_of(values: Floats) -> float:
    """Return the standard deviation of white noise [unit of the signal], from third differences that are not unusual.

    What the signal itself does between four samples counts as noise where it is larger; a few jumps do not matter.
    """
    if values.size < MINIMUM_SAMPLES:
        return 0.0
    differences = _third_differences(values, 1)
    most = _KEPT * _SPREAD_OF_MEDIAN * float(np.median(differences))
    inner = differences[differences <= most]
    return float(np.sqrt(np.mean(inner * inner)) / _SHARE_OF_KEPT / _GAIN_OF_DIFFERENCES)


def _third_differences(values: Floats, lag: int) -> Floats:
    """Return sizes of third differences of samples ``lag`` apart, without what a parabola through them explains."""
    first, second, third, fourth = (values[place * lag : values.size - (3 - place) * lag] for place in range(4))
    return np.asarray(np.abs(fourth - 3.0 * third + 3.0 * second - first))


_SHARE_OF_LAGS = 0.1
"""Share of a recording over which noise may remember at most: beyond it, what a model lacks looks like noise."""

_BY_CHANCE = 8.0
"""Four standard errors of a quarter's size among differences that share samples, times the root of their number."""

_QUARTER = 0.31864
"""Size below which a quarter of normal deviates lie."""


def correlated_noise_of(values: Floats) -> float:
    """Return the standard deviation of noise that may be correlated, in what a model leaves [its unit].

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
