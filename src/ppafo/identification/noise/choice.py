"""The noise of one sensor, from what its recordings leave unexplained: level, memory, drift, heavy tails.

Autoregressions of up to 30 samples, their order by the corrected criterion of Akaike, and white noise upon an
Ornstein-Uhlenbeck drift compete; each may have innovations with a t distribution. White noise and drifts may grow with
the slope, as where time stamps are off, and the drift with the level, as that of a gain. The least criterion wins.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ppafo.identification.noise.growing import (
    JITTER,
    LEAST_JITTER,
    gain_noises,
    jitter_noises,
    score_of_jitter,
)
from ppafo.identification.noise.heavy_tails import gain_of_tails, heavy_autoregression, heavy_drift
from ppafo.identification.noise.sensor_noise import (
    SAMPLES_FOR_EACH,
    Course,
    SensorNoise,
    at_best_level,
    best_from,
    criterion,
    unscaled,
)
from ppafo.identification.noise.shapes import AutoRegression, Drift, errors_of, from_reflections, reflections_of
from ppafo.identification.noise.t_distribution import LEAST
from ppafo.signals.recording import Floats

MAXIMUM_ORDER = 30
_HEAVY = 4.0
"""Log likelihood that a t distribution must gain before tails are called heavy."""
_NUMBERS_OF_DRIFT = 2
_UNEQUAL = 5.0
"""Standard errors by which the levels of two recordings differ before each gets its own."""
_ERROR_OF_LEVEL = 1.2


def sensor_noise(segments: Sequence[Floats], is_given: bool = False, courses: Sequence[Course] = ()) -> SensorNoise:
    """Return the noise [-] that explains a sensor's residuals best; ``is_given`` says that its size is at least 1.

    With the ``courses`` of its recordings it may grow with slope and level.
    """
    return sensor_noises([Left(segments, is_given, courses)])[0]


class Left(NamedTuple):
    """What is left [-] of a sensor's recordings, whether its noise was given, and what it should show in each."""

    segments: Sequence[Floats]
    is_given: bool = False
    courses: Sequence[Course] = ()


def sensor_noises(sensors: Sequence[Left]) -> tuple[SensorNoise, ...]:
    """Return the noise of sensors that one clock stamps, so that time stamps are off for all of them or for none."""
    drafts = [_Draft.of(one) for one in sensors]
    chosen, late = [one.normal for one in drafts], _late(drafts)
    is_late = late is not None and _sum(drafts, late) < _sum(drafts, chosen)
    if late is None or not is_late or any(map(_Draft.has_tails, drafts, late)):
        chosen = [draft.with_tails(one) for draft, one in zip(drafts, chosen, strict=True)]
    if late is not None and is_late and _sum(drafts, late) < _sum(drafts, chosen):
        chosen = late
    return tuple(draft.finish(one) for draft, one in zip(drafts, chosen, strict=True))


@dataclass(frozen=True, slots=True)
class _Draft:
    """What is left of a sensor over the ``levels`` of its recordings, and normal noise for it, the likeliest last."""

    given: Left
    levels: Floats
    scaled: list[Floats]
    plain: tuple[SensorNoise, ...]
    gains: tuple[SensorNoise, ...]
    courses: tuple[Course, ...]

    @classmethod
    def of(cls, one: Left) -> "_Draft":
        """Estimate normal noise whose stamps are right; noise that was given and is not exceeded stays as it is."""
        whole = np.concatenate(one.segments)
        if float(np.mean(whole * whole)) < max(LEAST, 1.0 if one.is_given else 0.0):
            white, level = from_reflections(np.zeros(0)), 1.0 if one.is_given else math.sqrt(LEAST)
            spread = math.log(level) + 0.5 * math.log(2.0 * math.pi)
            likelihood = -0.5 * float(whole @ whole) / level**2 - len(whole) * spread
            count = len(one.segments)
            fixed = SensorNoise(white, np.full(count, level), is_fixed=True, likelihood=likelihood)
            return cls(one, np.ones(count), [*one.segments], (fixed,), (), ())
        levels = _relative_levels(one.segments)
        scaled = [each / level for each, level in zip(one.segments, levels, strict=True)]
        drift = max((_drift(scaled, is_zeroed) for is_zeroed in (False, True)), key=lambda each: each.likelihood)
        plain = (_autoregression(scaled), drift)
        courses = tuple(
            Course(each.level / level, each.slope / level, each.first)
            for each, level in zip(one.courses, levels, strict=False)
        )
        return cls(one, levels, scaled, plain, tuple(gain_noises(scaled, courses, plain)), courses)

    @property
    def normal(self) -> SensorNoise:
        """The likeliest normal noise whose stamps are right."""
        return min((*self.plain, *self.gains), key=self.criterion)

    def criterion(self, one: SensorNoise) -> float:
        """Return the criterion of a noise [-]; less is better.

        The best of so many orders is now and then better than a drift that is there, by chance, and intervals are then
        too narrow: a number that an autoregression has more than a drift costs what Schwarz's criterion takes.
        """
        count = sum(len(each) for each in self.scaled)
        more = max(0, one.shape.order - _NUMBERS_OF_DRIFT) if isinstance(one.shape, AutoRegression) else 0
        return criterion(one.likelihood, one.numbers, count) + (math.log(count) - 2.0) * more

    def has_tails(self, one: SensorNoise) -> bool:
        """Return whether a noise leaves samples that are thrown too far for normal tails."""
        return not one.is_fixed and gain_of_tails(one, self.scaled) > _HEAVY

    def with_tails(self, normal: SensorNoise) -> SensorNoise:
        """Return the likeliest normal noise, or noise with heavy tails that is likelier."""
        if not any(self.has_tails(one) for one in ([normal] if normal.grows else self.plain)):
            return normal
        heavy = heavy_autoregression(self.scaled, self.plain[0]), heavy_drift(self.scaled, self.plain[1])
        return min((normal, *heavy), key=self.criterion)

    def finish(self, best: SensorNoise) -> SensorNoise:
        """Return noise in the units of what was left; a drift knows its courses, for it may be one of the gain."""
        if best.is_fixed:
            return best
        logs = sum(len(one) * math.log(level) for one, level in zip(self.scaled, self.levels, strict=True))
        return replace(
            best,
            levels=best.levels * self.levels,
            is_shared=bool(np.all(self.levels == 1.0)),
            likelihood=best.likelihood - logs,
            courses=self.courses if isinstance(best.shape, Drift) else best.courses,
        )


def _sum(drafts: Sequence[_Draft], noises: Sequence[SensorNoise]) -> float:
    return sum(draft.criterion(one) for draft, one in zip(drafts, noises, strict=True))


def _late(drafts: Sequence[_Draft]) -> list[SensorNoise] | None:
    """Return the likeliest noise of each sensor with time stamps that are off, None where nothing speaks for that."""
    counted = [one for one in drafts if one.courses]
    scores = [score_of_jitter(one.scaled, one.courses, one.normal) for one in counted]
    spread = math.sqrt(sum(square for _, square in scores))
    if spread == 0.0 or sum(score for score, _ in scores) <= JITTER * spread:
        return None
    found, times, known = [], 0.0, 0.0
    weights = iter(scores)
    for draft in drafts:
        if not draft.courses:
            found.append(draft.normal)
            continue
        rivals = jitter_noises(draft.scaled, draft.courses, (draft.plain[1], *draft.gains))
        best, weight = min(rivals, key=draft.criterion), next(weights)[1]
        found.append(best)
        times, known = times + weight * best.jitter * float(best.levels[0]), known + weight
    return found if times >= LEAST_JITTER * known else None


def _relative_levels(segments: Sequence[Floats]) -> Floats:
    """Return the level of each recording over that of all; 1 where they do not differ for certain."""
    if len(segments) == 1:
        return np.ones(1)
    reflections, _ = reflections_of(list(segments), min(1, min(len(one) for one in segments) - 2))
    shape = from_reflections(reflections)
    sizes = np.array([np.log(max(float(np.median(np.abs(errors_of(shape, one)))), LEAST)) for one in segments])
    errors = np.array([_ERROR_OF_LEVEL / math.sqrt(len(one)) for one in segments])
    middle = np.average(sizes, weights=1.0 / errors**2)
    differ = np.max(np.abs(sizes - middle) / errors)
    return np.exp(sizes - middle) if differ > _UNEQUAL else np.ones(len(segments))


def _autoregression(segments: list[Floats]) -> SensorNoise:
    """Return the autoregression with normal innovations whose order has the least criterion."""
    count, shortest = sum(len(one) for one in segments), min(len(one) for one in segments)
    most = max(0, min(MAXIMUM_ORDER, count // SAMPLES_FOR_EACH, shortest - 2))
    reflections, left = reflections_of(segments, most)
    scores = [criterion(-0.5 * count * math.log(left[order]), order + 1, count) for order in range(most + 1)]
    return at_best_level(unscaled(from_reflections(reflections[: int(np.argmin(scores))]), segments), segments)


def _drift(segments: list[Floats], is_zeroed: bool) -> SensorNoise:
    """Return the drift of greatest likelihood, with white normal noise upon it."""
    grid = [np.array([ratio, memory]) for ratio in (-9.0, -6.0, -3.0, 0.0) for memory in (1.5, 3.5, 5.5)]
    return best_from(grid, unscaled(Drift(1.0, 0.5, is_zeroed), segments), segments)
