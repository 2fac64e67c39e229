"""Faults of recorded data, detected from the samples: gaps in time, saturated sensors, outliers; noise estimates."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.signals.recording import Floats

GAP_SAMPLES = 10.0
"""Shortest gap, in median sampling intervals [-]."""

FEWEST_AT_LIMIT = 20
"""Fewest equal samples that indicate a saturated sensor."""

MINIMUM_SAMPLES = 10
"""Fewest samples for an estimate of the noise."""

_SPREAD_OF_MEDIAN = 1.4826
"""Ratio of standard deviation to median absolute deviation of a normal distribution [-]."""
_KEPT = 3.0
"""Largest third difference used for the noise, in standard deviations [-]."""
_SHARE_OF_KEPT = 0.98658
"""Standard deviation of a standard normal distribution truncated at 3 standard deviations [-]."""
_GAIN_OF_DIFFERENCES = math.sqrt(20.0)
"""Ratio of standard deviations of third difference and white noise [-]."""
_NOISY_FRACTION = 0.2
"""Least fraction of turning points in a noisy signal [-]: white noise has 2/3, a smooth curve hardly any."""
_ABRUPT_FRACTION = 0.3
"""Least slope into a plateau at a sensor limit, relative to the steepest slope of the signal [-]."""
_BEFORE = 5
"""Number of samples before a plateau over which its approach is measured."""
_EXCEPTIONAL = 5
"""Least ratio of a plateau to the next longest [-] for it to be no converter step."""
_PARTS = 20
"""Number of parts of a signal, whose means show a lasting change."""
_SMOOTH = 1.0e-6
"""Deviation from the line between neighbours, relative to the range [-], that counts as rounding."""
_ROUNDING = 1.0e-9
"""Smallest difference of values, relative to their range [-], that is a converter step and not file rounding."""
_SHARE_THAT_DIFFERS = 0.5
"""Largest fraction of distinct values [-] in a signal with a visible converter step."""
_BY_CHANCE = 8.0
"""Significance of correlated noise: four standard errors of the quartile of differences, times root of count."""
# Longest windows for the noise, as parts of a recording, and the shortest [samples].
_LONGEST_WINDOW = 4
_SHORTEST_WINDOW = 12
# Fraction of the spread in a window that noise has in one of half the length, usual growth from there, and largest
# growth by the memory of noise [-].
_LASTING = 0.3
_GROWING = 1.25
_MOST_MEMORY = 1.4


@dataclass(frozen=True, slots=True)
class _Plateau:
    """Longest run at exactly the largest or smallest value: first and last sample index, value, and ``word``."""

    first: int
    last: int
    value: float
    word: str

    @property
    def count(self) -> int:
        """Number of samples in the plateau."""
        return self.last - self.first + 1


def longest_gap(time: Floats) -> tuple[int, float] | None:
    """Return the longest gap, as index of the sample before it and duration [s]; None up to ten median intervals."""
    # Against the median, which one gap does not move.
    intervals = np.diff(time)
    if intervals.size < 2:
        return None
    index = int(np.argmax(intervals))
    longest = float(intervals[index])
    return (index, longest) if longest > GAP_SAMPLES * float(np.median(intervals)) else None


def lasting_change(values: Floats) -> float:
    """Return the range of the means of up to 20 equal parts of a signal [unit of the signal]."""
    parts = np.array_split(values, min(_PARTS, values.size))
    return float(np.ptp([part.mean() for part in parts]))


def plateaus(values: Floats) -> tuple[_Plateau, _Plateau]:
    """Return the longest runs at exactly the largest and exactly the smallest value."""
    found = []
    for value, word in ((values.max(), "largest"), (values.min(), "smallest")):
        edges = np.flatnonzero(np.diff(np.concatenate(([0], (values == value).astype(np.int8), [0]))))
        starts = edges[::2]
        ends = edges[1::2]
        longest = int(np.argmax(ends - starts))
        found.append(_Plateau(int(starts[longest]), int(ends[longest] - 1), float(value), word))
    return found[0], found[1]


def is_at_limit(values: Floats, plateau: _Plateau) -> bool:
    """Return whether a plateau is a saturated sensor: noise stops there, or the signal runs into it at speed.

    A signal that comes to rest by itself keeps its noise, or slows down before.
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
    """Return whether at least half of the values deviate from the line between their neighbours, as noise does."""
    return values.size > 2 and float(np.median(np.abs(np.diff(values, 2)))) > _SMOOTH * float(np.ptp(values))


def stands_out(values: Floats, plateau: _Plateau) -> bool:
    """Return whether a plateau is far longer than any other, hence no step of a coarse converter."""
    if plateau.count < FEWEST_AT_LIMIT or plateau.count == values.size:
        return False
    # A coarse converter has such plateaus everywhere: they are compared with the longest of the others.
    rest = np.concatenate([values[: plateau.first], values[plateau.last + 1 :]])
    changes = np.flatnonzero(np.diff(rest))
    others = np.diff(np.concatenate(([-1], changes, [rest.size - 1])))
    return plateau.count > _EXCEPTIONAL * int(others.max())


def isolated_samples(values: Floats, noise: float) -> NDArray[np.bool_]:
    """Mark isolated outliers among four regular neighbours; ``noise`` is a standard deviation.

    Their distance from the median of five is more than 6 times the noise and more than 3 times the range of the four
    other samples.
    """
    others = np.ptp(_five_around(values)[:, [0, 1, 3, 4]], axis=1)
    return np.asarray(outlying_samples(values, noise) & (off_neighbours(values) > 3.0 * others))


def outlying_samples(values: Floats, noise: float) -> NDArray[np.bool_]:
    """Mark the outliers of residuals, including adjacent ones; ``noise`` is a standard deviation.

    Their distance from the median of five is more than 6 times the noise and more than 3 times the range of the closest
    three of the four other samples. An event at a different time in the model leaves a longer deviation, which is not
    marked.
    """
    others = np.sort(_five_around(values)[:, [0, 1, 3, 4]], axis=1)
    spread = np.minimum(others[:, 2] - others[:, 0], others[:, 3] - others[:, 1])
    away = off_neighbours(values)
    return np.asarray((away > 6.0 * noise) & (away > 3.0 * spread))


def off_neighbours(values: Floats) -> Floats:
    """Return the distance of each value from the median of five values around it."""
    return np.asarray(np.abs(values - np.median(_five_around(values), axis=1)))


def _five_around(values: Floats) -> Floats:
    """Return each value with two values before and two after it (values, 5)."""
    # Mirrored at the ends, where an outlier would else be three of its own five neighbours.
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, 2, mode="reflect"), 5)


def resolution_of(values: Floats) -> float:
    """Return the converter resolution [unit of the values], the smallest difference; 0 if none is visible.

    A resolution is visible if most values occur repeatedly, which neither noise nor motion causes.
    """
    steps = np.diff(np.unique(values))
    steps = steps[steps > _ROUNDING * steps.sum()]
    return float(steps.min()) if 0 < steps.size < _SHARE_THAT_DIFFERS * values.size else 0.0


def rounding_of(values: Floats, resolution: float) -> Floats:
    """Return the standard deviation of each value due to converter rounding [unit of the values].

    It is the resolution divided by sqrt(12) (GUM, JCGM 100:2008, F.2.2.1). A sensor at rest repeats one value with the
    same error, so that a run of n equal values has the weight of one: each has sqrt(n) times the standard deviation.
    """
    edges = np.flatnonzero(np.diff(values, prepend=np.nan, append=np.nan))
    lengths = np.diff(edges)
    return np.asarray(resolution / math.sqrt(12.0) * np.sqrt(np.repeat(lengths, lengths)))


def noise_of(values: Floats) -> float:
    """Return the standard deviation of white noise [unit of the signal], from the median third difference.

    Changes of the signal itself within four samples count as noise if they are larger; a few steps have no effect.
    """
    if values.size < MINIMUM_SAMPLES:
        return 0.0
    differences = np.abs(np.diff(values, n=3))
    most = _KEPT * _SPREAD_OF_MEDIAN * float(np.median(differences))
    inner = differences[differences <= most]
    return float(np.sqrt(np.mean(inner * inner)) / _SHARE_OF_KEPT / _GAIN_OF_DIFFERENCES)


def lasting_noise_of(values: Floats, most: float = math.inf) -> float:
    """Return the standard deviation of possibly correlated noise in a signal [unit of the signal].

    It is the spread about a cubic over windows, of which the quarter with the smallest is used: where the signal is
    smooth or at rest. Of noise the spread lasts as a window is halved, of a smooth signal hardly any is left; the
    longest windows in which it lasts show noise that neighbouring samples share; more than ``most`` is the signal's.
    """
    white = noise_of(values)
    length = values.size // _LONGEST_WINDOW
    while length >= 2 * _SHORTEST_WINDOW:
        spread, half, quarter = (_spread_about_cubics(values, length // part) for part in (1, 2, 4))
        if half > _LASTING * spread and spread < most:
            # What grows alike twice has a memory longer than the window; of a curve the last growth is larger.
            memory = min(spread / half, half / max(quarter, white), _MOST_MEMORY)
            lasting = min(spread, _GROWING * half) * max(memory, 1.0) ** 2
            return lasting if lasting > (1.0 + _BY_CHANCE / math.sqrt(values.size)) * white else white
        length //= 2
    return white


def _spread_about_cubics(values: Floats, length: int) -> float:
    """Return the lower quartile of the standard deviations about a cubic over half-overlapping windows of a length."""
    windows = np.lib.stride_tricks.sliding_window_view(values, length)[:: max(length // 2, 1)]
    basis, _ = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, length), 4))
    about = windows - (windows @ basis) @ basis.T
    return float(np.quantile(np.sqrt(np.square(about).sum(axis=1) / max(length - 4, 1)), 0.25))
