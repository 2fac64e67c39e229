"""Gaits that differ from one as much as its strides do: series coefficients, stride times and events of many people."""

from dataclasses import dataclass

import numpy as np

from ppafo.gait import Gait
from ppafo.gait.gait import KNEE, Curve
from ppafo.model.elementary import sine_and_cosine
from ppafo.model.fourier import HARMONICS
from ppafo.signals.recording import Floats
from ppafo.walking.anthropometry import draw_bounded_normal
from ppafo.walking.gait_series import EVENT_PHASES, gait_events

SERIES = {
    "shank": "shank_angle",
    "ankle": "ankle_angle",
    "moment": "ankle_moment",
    "force": "vertical_force",
    "knee_forward": "knee_forward",
    "knee_up": "knee_up",
}
"""Curves that vary, by their field of ``GaitSeries``."""

LEVEL_FRACTION = 0.5
"""Fraction of a curve's variance that moves it as a whole; the rest goes to the harmonics by their power. Assumed: a
gait file has one deviation for each curve."""

_AT_ONCE = 1000


@dataclass(frozen=True, slots=True, eq=False)
class SeriesOfMany:
    """Coefficients of many curves: mean (people,), cosines and sines (people, 8)."""

    mean: Floats
    cosines: Floats
    sines: Floats

    def at_heel_strike(self) -> Floats:
        """Value at phase 0."""
        return np.asarray(self.mean + self.cosines.sum(axis=1))

    def scale(self, factor: Floats) -> "SeriesOfMany":
        """The curves, each times its factor [-] (people,)."""
        return SeriesOfMany(self.mean * factor, self.cosines * factor[:, None], self.sines * factor[:, None])


@dataclass(frozen=True, slots=True, eq=False)
class VariedGaits:
    """Series by field of ``GaitSeries``, and the timing (people,) by field of ``GaitTiming``."""

    series: dict[str, SeriesOfMany]
    timing: dict[str, Floats]
    stride_time: Floats

    def strike_angle(self) -> Floats:
        """Angle [rad] of each foot over the horizontal at its heel strike."""
        return self.series["shank"].at_heel_strike() - self.series["ankle"].at_heel_strike() + 0.5 * np.pi


def draw_gaits(gait: Gait, stature: Floats, generator: np.random.Generator) -> VariedGaits:
    """Draw gaits for people whose stature is a multiple [-] (people,) of the first one's, who has the gait itself.

    A curve that was not measured stays 0. The motion of the knee scales with stature and takes the person's stride
    time, so its acceleration goes with stature over stride time squared.
    """
    count = stature.size
    series = {field: _draw_series(gait.curves.get(name), count, generator) for field, name in SERIES.items()}
    time = gait.stride_time + gait.stride_time_deviation * draw_bounded_normal(generator, (count,))
    fraction = gait.stance_share + gait.stance_share_deviation * draw_bounded_normal(generator, (count,))
    time[0], fraction[0] = gait.stride_time, gait.stance_share
    hurry = stature * (gait.stride_time / time) ** 2
    series |= {name: series[name].scale(hurry) for name in KNEE}
    timing = {"frequency": 1.0 / time, **_events(series["shank"], series["ankle"], fraction)}
    return VariedGaits(series, timing, time)


def _draw_series(curve: Curve | None, count: int, generator: np.random.Generator) -> SeriesOfMany:
    if curve is None:
        return SeriesOfMany(np.zeros(count), np.zeros((count, HARMONICS)), np.zeros((count, HARMONICS)))
    missing = (0.0,) * HARMONICS
    cosines, sines = (np.array((*values, *missing)[:HARMONICS]) for values in (curve.cosines, curve.sines))
    power = 0.5 * (cosines**2 + sines**2)
    fraction = power / max(float(power.sum()), 1.0e-30)
    spread = curve.deviation * np.sqrt((1.0 - LEVEL_FRACTION) * fraction)
    normal = draw_bounded_normal(generator, (2, count, HARMONICS))
    level = curve.deviation * np.sqrt(LEVEL_FRACTION) * draw_bounded_normal(generator, (count,))
    normal[:, 0], level[0] = 0.0, 0.0
    return SeriesOfMany(curve.mean + level, cosines + spread * normal[0], sines + spread * normal[1])


def _events(shank: SeriesOfMany, ankle: SeriesOfMany, stance_share: Floats) -> dict[str, Floats]:
    """What ``gait_events`` finds, by field of ``GaitTiming``; some people at a time, to need less memory."""
    sine, cosine = sine_and_cosine(np.outer(np.arange(1, HARMONICS + 1), EVENT_PHASES))
    found = []
    for first in range(0, stance_share.size, _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        level = shank.mean[part] - ankle.mean[part] + 0.5 * np.pi
        cosines, sines = (shank.cosines - ankle.cosines)[part], (shank.sines - ankle.sines)[part]
        foot = np.repeat(level[:, None], EVENT_PHASES.size, axis=1)
        for order in range(HARMONICS):
            foot += cosines[:, order, None] * cosine[order] + sines[:, order, None] * sine[order]
        found.append(gait_events(foot, stance_share[part]))
    return {name: np.concatenate([part[name] for part in found]) for name in found[0]}
