"""Gaits that differ from one by as much as its strides do: series coefficients, stride times and events of many."""

from dataclasses import dataclass

import numpy as np

from ppafo.gait import Gait
from ppafo.gait.gait import KNEE, Curve
from ppafo.model.fourier import HARMONICS
from ppafo.signals.recording import Floats
from ppafo.walking.anthropometry import bounded_normal
from ppafo.walking.followed_gait import EVENT_PHASES, gait_events

SERIES = {
    "shank": "shank_angle",
    "ankle": "ankle_angle",
    "moment": "ankle_moment",
    "force": "vertical_force",
    "knee_forward": "knee_forward",
    "knee_up": "knee_up",
}
"""Curves that vary, by their field of ``GaitSeries``."""

SHARE_OF_LEVEL = 0.5
"""Share of a curve's variance that moves it as a whole; the rest goes to the harmonics by their power. Assumed: a gait
file has one deviation for a curve."""

_AT_ONCE = 1000


@dataclass(frozen=True, slots=True, eq=False)
class SeriesOfMany:
    """Coefficients of many curves: mean (people,), cosines and sines (people, 8)."""

    mean: Floats
    cosines: Floats
    sines: Floats

    def at_heel_strike(self, frequency: Floats) -> tuple[Floats, Floats, Floats]:
        """Value, rate and acceleration by time at phase 0, for strides per second."""
        order = 2.0 * np.pi * np.arange(1, HARMONICS + 1)
        value = self.mean + self.cosines.sum(axis=1)
        return value, frequency * (self.sines @ order), -(frequency**2) * (self.cosines @ order**2)

    def scaled(self, factor: Floats) -> "SeriesOfMany":
        """The curves times a factor each (people,)."""
        return SeriesOfMany(self.mean * factor, self.cosines * factor[:, None], self.sines * factor[:, None])

    def rows(self) -> dict[str, Floats]:
        """Coefficients (people,) by their path in ``model.fourier.Series``."""
        found = {"mean": self.mean}
        for order in range(HARMONICS):
            found[f"harmonics[{order}].cosine"] = self.cosines[:, order]
            found[f"harmonics[{order}].sine"] = self.sines[:, order]
        return found


@dataclass(frozen=True, slots=True, eq=False)
class VariedGaits:
    """Series by field of ``GaitSeries``, and the timing (people,) by field of ``GaitTiming``."""

    series: dict[str, SeriesOfMany]
    timing: dict[str, Floats]
    stride_time: Floats


def varied_gaits(gait: Gait, stature: Floats, generator: np.random.Generator) -> VariedGaits:
    """Draw gaits for people of a stature over that of the first (people,); the first walks as ``gait`` says.

    A curve that nobody measured stays 0. The way of the knee is as long as people are tall and walked in their stride
    time, so its acceleration goes with stature over stride time squared.
    """
    count = stature.size
    series = {field: _varied(gait.curves.get(name), count, generator) for field, name in SERIES.items()}
    time = gait.stride_time + gait.stride_time_deviation * bounded_normal(generator, (count,))
    share = gait.stance_share + gait.stance_share_deviation * bounded_normal(generator, (count,))
    time[0], share[0] = gait.stride_time, gait.stance_share
    hurry = stature * (gait.stride_time / time) ** 2
    series |= {name: series[name].scaled(hurry) for name in KNEE}
    timing = {"frequency": 1.0 / time, **_events(series["shank"], series["ankle"], share)}
    return VariedGaits(series, timing, time)


def _varied(curve: Curve | None, count: int, generator: np.random.Generator) -> SeriesOfMany:
    if curve is None:
        return SeriesOfMany(np.zeros(count), np.zeros((count, HARMONICS)), np.zeros((count, HARMONICS)))
    missing = (0.0,) * HARMONICS
    cosines, sines = (np.array((*values, *missing)[:HARMONICS]) for values in (curve.cosines, curve.sines))
    power = 0.5 * (cosines**2 + sines**2)
    share = power / max(float(power.sum()), 1.0e-30)
    spread = curve.deviation * np.sqrt((1.0 - SHARE_OF_LEVEL) * share)
    normal = bounded_normal(generator, (2, count, HARMONICS))
    level = curve.deviation * np.sqrt(SHARE_OF_LEVEL) * bounded_normal(generator, (count,))
    normal[:, 0], level[0] = 0.0, 0.0
    return SeriesOfMany(curve.mean + level, cosines + spread * normal[0], sines + spread * normal[1])


def _events(shank: SeriesOfMany, ankle: SeriesOfMany, stance_share: Floats) -> dict[str, Floats]:
    """What ``gait_events`` finds, by field of ``GaitTiming``; some people at a time, to need less memory."""
    turns = 2.0 * np.pi * np.outer(np.arange(1, HARMONICS + 1), EVENT_PHASES)
    cosine, sine = np.cos(turns), np.sin(turns)
    found = []
    for first in range(0, stance_share.size, _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        level = shank.mean[part] - ankle.mean[part] + 0.5 * np.pi
        foot = (shank.cosines - ankle.cosines)[part] @ cosine + (shank.sines - ankle.sines)[part] @ sine
        foot += level[:, None]
        found.append(gait_events(foot, stance_share[part]))
    return {name: np.concatenate([part[name] for part in found]) for name in found[0]}
