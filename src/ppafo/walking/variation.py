"""Random variation between people: build, stride, and fitting of the controller.

A seed gives the same people every time, because the draws are made in one order: builds, curves, stride times, stances,
thresholds, starts of the push-off. The first person is never varied.
"""

import numpy as np

from ppafo.engine.rows import rebuilt
from ppafo.gait import Gait
from ppafo.gait.gait import KNEE, GaitCurve
from ppafo.model.elementary import sine_and_cosine
from ppafo.model.gait import HARMONICS, GaitSeries, GaitTiming, Series
from ppafo.signals.recording import Floats
from ppafo.walking.gait_series import EVENT_PHASES, SERIES, gait_events

MASS_VARIATION = 0.166
STATURE_VARIATION = 0.039
"""Relative standard deviations of body mass and stature: 85.5 +- 14.2 kg and 1756 +- 69 mm for men in ANSUR II (Gordon
et al. 2014, NATICK/TR-15/007)."""

CORRELATION = 0.5
"""Correlation between body mass and stature. Assumed: the survey's table of means does not contain it."""

LEVEL_FRACTION = 0.5
"""Fraction of a curve's variance that shifts its mean; the rest is distributed over the harmonics by their power.
Assumed: a gait file has a single deviation for each curve."""

THRESHOLD_VARIATION = 0.15
"""Relative standard deviation of the thresholds between fitters and sensor positions [-]. Assumed."""

START_VARIATION = 0.03
"""Standard deviation of the start of the push-off [strides]. Assumed."""

MAXIMUM_DEVIATIONS = 2.5
"""Limit of random draws [standard deviations]; larger deviations are clipped."""

_BATCH = 1000
"""Number of people whose events are computed at once, to limit memory."""


def draw_bounded_normal(generator: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Return standard normal draws [-] of this shape, clipped at ``MAXIMUM_DEVIATIONS``."""
    return np.clip(generator.standard_normal(shape), -MAXIMUM_DEVIATIONS, MAXIMUM_DEVIATIONS)


def draw_builds(count: int, generator: np.random.Generator) -> tuple[Floats, Floats]:
    """Draw body masses and statures relative to the first person [-], each (people,)."""
    normal = draw_bounded_normal(generator, (2, count))
    normal[:, 0] = 0.0
    # Two normal numbers with this correlation, from two that have none.
    mass = CORRELATION * normal[0] + np.sqrt(1.0 - CORRELATION**2) * normal[1]
    return 1.0 + MASS_VARIATION * mass, 1.0 + STATURE_VARIATION * normal[0]


def draw_gaits(gait: Gait, stature: Floats, generator: np.random.Generator) -> tuple[GaitSeries, GaitTiming, Floats]:
    """Draw curves and events, whose numbers are arrays (people,), and stride times [s] (people,).

    ``stature`` (people,) is relative to the first person [-]. A curve that was not measured stays 0. The acceleration
    of the knee scales with stature divided by stride time squared.
    """
    count = stature.size
    curves = {field: _draw_curve(gait.curves.get(name), count, generator) for field, name in SERIES.items()}
    stride_time = gait.stride_time + gait.stride_time_deviation * draw_bounded_normal(generator, (count,))
    stance_share = gait.stance_share + gait.stance_share_deviation * draw_bounded_normal(generator, (count,))
    stride_time[0], stance_share[0] = gait.stride_time, gait.stance_share
    for name in KNEE:
        curves[name] = curves[name] * (stature * (gait.stride_time / stride_time) ** 2)
    series = GaitSeries(**{field: rebuilt(Series, numbers) for field, numbers in curves.items()})
    events = _events(curves["shank"] - curves["ankle"], stance_share)
    timing: GaitTiming = rebuilt(GaitTiming, [1.0 / stride_time, np.zeros(count), *events])
    return series, timing, stride_time


def draw_fitting(count: int, generator: np.random.Generator) -> tuple[Floats, Floats]:
    """Draw factors on the force thresholds [-], and shifts of the start of the push-off [strides], each (people,)."""
    thresholds, start = (draw_bounded_normal(generator, (count,)) for _ in range(2))
    thresholds[0], start[0] = 0.0, 0.0
    return 1.0 + THRESHOLD_VARIATION * thresholds, START_VARIATION * start


def _draw_curve(curve: GaitCurve | None, count: int, generator: np.random.Generator) -> Floats:
    """Draw the numbers of a ``Series`` in the order of its leaves, shape (1 + 2 harmonics, people)."""
    if curve is None:
        return np.zeros((1 + 2 * HARMONICS, count))
    missing = (0.0,) * HARMONICS
    cosines, sines = (np.array((*values, *missing)[:HARMONICS]) for values in (curve.cosines, curve.sines))
    power = 0.5 * (cosines**2 + sines**2)
    # A curve that stays constant has no harmonics to vary.
    fraction = power / max(float(power.sum()), 1.0e-30)
    deviation = curve.deviation * np.sqrt((1.0 - LEVEL_FRACTION) * fraction)
    normal = draw_bounded_normal(generator, (2, count, HARMONICS))
    level = curve.deviation * np.sqrt(LEVEL_FRACTION) * draw_bounded_normal(generator, (count,))
    normal[:, 0], level[0] = 0.0, 0.0
    harmonics = np.stack([cosines + deviation * normal[0], sines + deviation * normal[1]], axis=2)
    return np.vstack([curve.mean + level, harmonics.reshape(count, 2 * HARMONICS).T])


def _events(difference: Floats, stance_share: Floats) -> Floats:
    """Return ``gait_events`` of many people, shape (events, people).

    ``difference`` holds the numbers of shank angle minus ankle angle [rad], shape (1 + 2 harmonics, people).
    """
    sine, cosine = sine_and_cosine(np.outer(np.arange(1, HARMONICS + 1), EVENT_PHASES))
    batches = []
    for start in range(0, stance_share.size, _BATCH):
        mean, *coefficients = difference[:, start : start + _BATCH, None]
        foot = np.repeat(mean + 0.5 * np.pi, EVENT_PHASES.size, axis=1)
        for order in range(HARMONICS):
            foot += coefficients[2 * order] * cosine[order] + coefficients[2 * order + 1] * sine[order]
        batches.append(list(gait_events(foot, stance_share[start : start + _BATCH]).values()))
    return np.concatenate(batches, axis=1)
