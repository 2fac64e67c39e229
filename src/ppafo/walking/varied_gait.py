"""Gaits that differ from one by as much as its strides do: series coefficients, stride times and events of many."""

from dataclasses import dataclass

import numpy as np

from ppafo.gait import Gait
from ppafo.gait.gait import Curve
from ppafo.signals.recording import Floats
from ppafo.walking.anthropometry import bounded_normal
from ppafo.walking.planning import (
    CLEARANCE_FROM,
    CLEARANCE_TO,
    FLAT_FROM,
    FLAT_TO,
    HARMONICS,
    LATEST_HEEL_RISE,
    NEARLY_FLAT,
    USUAL_HEEL_RISE,
)

SERIES = {"shank": "shank_angle", "ankle": "ankle_angle", "moment": "ankle_moment", "force": "vertical_force"}
"""Curves that vary, by their field of ``GaitSeries``."""

SHARE_OF_LEVEL = 0.5
"""Share of a curve's variance that moves it as a whole; the rest goes to the harmonics by their power. Assumed: a gait
file has one deviation for a curve."""

_GRID = np.linspace(0.0, 1.0, 1001)[150:801]
"""Phases at which the events are looked for: from the flat foot to the latest heel rise."""
_AT_ONCE = 1000


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """Coefficients of many curves: mean (people,), cosines and sines (people, 8)."""

    mean: Floats
    cosines: Floats
    sines: Floats

    def at_heel_strike(self, frequency: Floats) -> tuple[Floats, Floats, Floats]:
        """Value, rate and acceleration by time at phase 0, for strides per second."""
        order = 2.0 * np.pi * np.arange(1, HARMONICS + 1)
        value = self.mean + self.cosines.sum(axis=1)
        return value, frequency * (self.sines @ order), -(frequency**2) * (self.cosines @ order**2)

    def rows(self) -> dict[str, Floats]:
        """Coefficients (people,) by the field of ``model.fourier.Series``."""
        found = {"mean": self.mean}
        for order in range(HARMONICS):
            found[f"cosine_{order + 1}"] = self.cosines[:, order]
            found[f"sine_{order + 1}"] = self.sines[:, order]
        return found


@dataclass(frozen=True, slots=True, eq=False)
class VariedGaits:
    """Series by field of ``GaitSeries``, and the timing (people,) by field of ``GaitTiming``."""

    series: dict[str, Series]
    timing: dict[str, Floats]
    stride_time: Floats


def varied_gaits(gait: Gait, count: int, generator: np.random.Generator) -> VariedGaits:
    """Draw gaits; the first is the one that is varied. A curve that nobody measured stays 0."""
    series = {field: _varied(gait.curves.get(name), count, generator) for field, name in SERIES.items()}
    time = gait.stride_time + gait.stride_time_deviation * bounded_normal(generator, (count,))
    share = gait.stance_share + gait.stance_share_deviation * bounded_normal(generator, (count,))
    time[0], share[0] = gait.stride_time, gait.stance_share
    ground, heel_off = _events(series["shank"], series["ankle"], share)
    swing = 1.0 - share
    timing = {
        "frequency": 1.0 / time,
        "heel_off": heel_off,
        "toe_off": share,
        "clearance_from": share + CLEARANCE_FROM * swing,
        "clearance_to": share + CLEARANCE_TO * swing,
        "ground_angle": ground,
    }
    return VariedGaits(series, timing, time)


def _varied(curve: Curve | None, count: int, generator: np.random.Generator) -> Series:
    if curve is None:
        return Series(np.zeros(count), np.zeros((count, HARMONICS)), np.zeros((count, HARMONICS)))
    missing = (0.0,) * HARMONICS
    cosines, sines = (np.array((*values, *missing)[:HARMONICS]) for values in (curve.cosines, curve.sines))
    power = 0.5 * (cosines**2 + sines**2)
    share = power / max(float(power.sum()), 1.0e-30)
    spread = curve.deviation * np.sqrt((1.0 - SHARE_OF_LEVEL) * share)
    normal = bounded_normal(generator, (2, count, HARMONICS))
    level = curve.deviation * np.sqrt(SHARE_OF_LEVEL) * bounded_normal(generator, (count,))
    normal[:, 0], level[0] = 0.0, 0.0
    return Series(curve.mean + level, cosines + spread * normal[0], sines + spread * normal[1])


def _events(shank: Series, ankle: Series, stance_share: Floats) -> tuple[Floats, Floats]:
    """Angle of the flat foot [rad] and phase of the heel's rise, as ``planning.gait_timing`` finds them."""
    turns = 2.0 * np.pi * np.outer(np.arange(1, HARMONICS + 1), _GRID)
    cosine, sine = np.cos(turns), np.sin(turns)
    flat = (_GRID >= FLAT_FROM) & (_GRID <= FLAT_TO)
    ground, heel_off = np.empty(stance_share.size), np.empty(stance_share.size)
    for first in range(0, stance_share.size, _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        level = shank.mean[part] - ankle.mean[part] + 0.5 * np.pi
        foot = (shank.cosines - ankle.cosines)[part] @ cosine + (shank.sines - ankle.sines)[part] @ sine
        foot += level[:, None]
        ground[part] = np.median(foot[:, flat], axis=1)
        steep = (foot < (ground[part] - NEARLY_FLAT)[:, None]) & (_GRID > FLAT_TO)
        usual = USUAL_HEEL_RISE * stance_share[part]
        heel_off[part] = np.where(steep.any(axis=1), _GRID[np.argmax(steep, axis=1)], usual)
    return ground, np.minimum(heel_off, LATEST_HEEL_RISE * stance_share)
