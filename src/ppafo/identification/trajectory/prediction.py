"""Which of several sets predicts recordings best: log predictive densities, their differences, and errors of these.

A set predicts the samples of a recording in turn: what the model leaves is noise of a sensor, whose shape is estimated
for each set anew, and a sample is expected where model and noise before it say. A block's density is that of its
samples given those before, so that blocks are independent where the noise is right (Vehtari, Gelman, Gabry 2017,
Statistics and Computing 27, equations 22 to 24, for blocks instead of samples).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.identification.noise.choice import sensor_noise
from ppafo.identification.noise.sensor_noise import SensorNoise
from ppafo.identification.noise.shapes import Drift, errors_of
from ppafo.identification.noise.t_distribution import t_likelihood
from ppafo.identification.trajectory.residuals import Floats, Indices

BLOCKS = 40
"""Blocks of all recordings together, or one a recording where there are more."""
CERTAIN = 2.0
"""Errors by which two sets differ for certain."""
_LEAST_DIFFERENCE = 4.0
"""Differences below this are no preference whatever their error (Sivula, Magnusson, Vehtari 2020, section 5)."""
_EVEN = 0.3
"""Fraction of the blocks that is spread evenly over time; the others where two predictions differ."""


@dataclass(frozen=True, slots=True)
class Left:
    """What a set leaves of one channel of one recording, measured less model, in units of the least noise [-]."""

    channel: str
    recording: int
    values: Floats


@dataclass(frozen=True, slots=True)
class Density:
    """Log predictive density [-] of all recordings under a set, and its standard error; samples in least noises."""

    name: str
    value: float
    error: float


@dataclass(frozen=True, slots=True)
class Difference:
    """By how much [-] the log predictive density of ``better`` is above that of ``worse``, and its error.

    The error is widened for few blocks so that twice it is exceeded by chance as seldom as twice that of many.
    """

    better: str
    worse: str
    value: float
    error: float

    @property
    def is_certain(self) -> bool:
        """Whether it is more than twice its error, and large enough to matter."""
        return self.value > max(CERTAIN * self.error, _LEAST_DIFFERENCE)


@dataclass(frozen=True, slots=True)
class Ranking:
    """Sets from the best to the worst prediction, and the differences of all pairs."""

    densities: tuple[Density, ...]
    differences: tuple[Difference, ...]
    samples: int
    recordings: int

    def between(self, first: str, second: str) -> Difference:
        """Return the difference of two sets, in whichever order."""
        return next(one for one in self.differences if {one.better, one.worse} == {first, second})

    @property
    def alike(self) -> tuple[str, ...]:
        """The best set and those that cannot be distinguished from it."""
        best = self.densities[0].name
        others = [one.name for one in self.densities[1:] if not self.between(best, one.name).is_certain]
        return (best, *others)


@dataclass(frozen=True, slots=True)
class _Predicted:
    """A set by its name with what it leaves, and the noise of each channel by the place of each of its recordings."""

    name: str
    left: Sequence[Left]
    noises: Sequence[tuple[SensorNoise, int]]
    numbers: int


def rank(names: Sequence[str], left: Sequence[Sequence[Left]]) -> Ranking:
    """Return which of several sets predicts recordings best; ``left`` has the same channels for each of them."""
    sets = [_predicted(name, one) for name, one in zip(names, left, strict=True)]
    densities = []
    for one in sets:
        cuts, weights, _ = _cuts(one, None)
        blocks = _block_densities(one, cuts)
        densities.append(Density(one.name, float(blocks.sum()) - one.numbers, _error_of_sum(blocks, weights)))
    differences = []
    for number, first in enumerate(sets):
        for second in sets[number + 1 :]:
            cuts, weights, information = _cuts(first, second)
            blocks = _block_densities(first, cuts) - _block_densities(second, cuts)
            # Estimating the noise on the samples that are judged raises a density by one for each number (Akaike).
            value = float(blocks.sum()) - (first.numbers - second.numbers)
            pair = (first.name, second.name) if value >= 0.0 else (second.name, first.name)
            # Blocks can be alike by chance; the noise alone moves a difference by the root of the information.
            differences.append(
                Difference(*pair, abs(value), max(_error_of_sum(blocks, weights), math.sqrt(information)))
            )
    lengths = {one.recording: one.values.size for one in left[0]}
    return Ranking(
        tuple(sorted(densities, key=lambda one: -one.value)),
        tuple(sorted(differences, key=lambda one: -one.value)),
        sum(one.values.size for one in left[0]),
        len(lengths),
    )


def _predicted(name: str, left: Sequence[Left]) -> _Predicted:
    noises: dict[int, tuple[SensorNoise, int]] = {}
    numbers = 0
    for channel in dict.fromkeys(one.channel for one in left):
        places = [place for place, one in enumerate(left) if one.channel == channel]
        noise = sensor_noise([left[place].values for place in places], is_given=True)
        numbers += 0 if noise.is_fixed else noise.numbers
        noises |= {place: (noise, part) for part, place in enumerate(places)}
    return _Predicted(name, left, [noises[place] for place in range(len(left))], numbers)


def _cuts(first: _Predicted, second: _Predicted | None) -> tuple[dict[int, Indices], Floats, float]:
    """Return where each recording is cut into blocks, the weight of each block [-], and how far two sets differ [-].

    Of one set, cuts are even in time. Of two, weights are for the most part the squares of the difference of their
    predictions, whitened, in which the measured noise does not appear, and cuts make them as alike as samples allow:
    nearly all that two sets differ by is often in a few samples. The sum of these squares is the last number.
    """
    lengths = {one.recording: one.values.size for one in first.left}
    information = {recording: np.zeros(count) for recording, count in lengths.items()}
    if second is None:
        information = {recording: np.ones(count) for recording, count in lengths.items()}
    else:
        for place, (one, other) in enumerate(zip(first.left, second.left, strict=True)):
            apart = one.values - other.values
            found = []
            for noise, part in (first.noises[place], second.noises[place]):
                squares = np.square(errors_of(noise.shape, apart) / noise.levels[part])
                # Heavy tails make less of what is far away.
                freedom = noise.freedom
                found.append((freedom + 1.0) * np.log1p(squares / freedom) if noise.is_heavy else squares)
            information[one.recording] += np.minimum(*found)
    whole, samples = sum(float(one.sum()) for one in information.values()), sum(lengths.values())
    cuts, weights = {}, []
    for recording, count in lengths.items():
        share = information[recording] / whole if whole > 0.0 else np.full(count, 1.0 / samples)
        shares = (1.0 - _EVEN) * share + _EVEN / samples
        grown = np.cumsum(shares)
        blocks = max(1, round(BLOCKS * float(grown[-1])))
        levels = grown[-1] * np.arange(1, blocks) / blocks
        places = np.unique(np.concatenate([np.searchsorted(grown, levels) + 1, [count]]))
        cuts[recording] = places[places <= count]
        weights.append(np.add.reduceat(shares, np.insert(cuts[recording][:-1], 0, 0)))
    return cuts, np.concatenate(weights), whole


def _block_densities(one: _Predicted, cuts: dict[int, Indices]) -> Floats:
    """Return the log density [-] of each block of all recordings, given the samples before it, over all channels."""
    blocks = {recording: np.zeros(len(places)) for recording, places in cuts.items()}
    for left, (noise, part) in zip(one.left, one.noises, strict=True):
        until = [log_density(noise, left.values[:place], part) for place in cuts[left.recording]]
        blocks[left.recording] += np.diff(until, prepend=0.0)
    return np.concatenate(list(blocks.values()))


def log_density(noise: SensorNoise, values: Floats, part: int) -> float:
    """Return the log density [-] of the first samples of a recording, the ``part`` of those the noise has levels of."""
    level, count, ones = float(noise.levels[part]), len(values), np.ones(len(values))
    if noise.is_heavy and isinstance(noise.shape, Drift):
        return noise.shape.heavy_likelihood(values, level, noise.freedom)
    if noise.is_heavy:
        rows, spread = noise.rows(values[:, None], ones, part)
        density = float(t_likelihood(rows[:, 0] / level, np.array([noise.freedom]))[0])
        return density - count * math.log(level) - spread
    square, spread = noise.square(values, ones, part)
    return -0.5 * square / level**2 - count * (math.log(level) + 0.5 * math.log(2.0 * math.pi)) - spread


def _error_of_sum(blocks: Floats, weights: Floats) -> float:
    """Return the standard error [-] of a sum of blocks, widened by Student's t for few of them.

    What a block is expected to hold is in proportion to its weight, so that blocks scatter about that (ratio estimator;
    Cochran 1977, Sampling Techniques, section 6.3), each deviation corrected for the block's part in the ratio.
    """
    from scipy.stats import norm, t

    count = len(blocks)
    if count < 2:
        return math.inf
    shares = weights / weights.sum()
    deviations = np.square(blocks - float(blocks.sum()) * shares) / np.maximum(1.0 - shares, 1.0 / count)
    widened = float(t.ppf(norm.cdf(CERTAIN), count - 1)) / CERTAIN
    return widened * math.sqrt(float(deviations.sum()))
