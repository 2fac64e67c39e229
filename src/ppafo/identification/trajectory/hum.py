"""Hum: lines in the spectrum of a sensor that stand far above their neighbourhood, such as those of the mains."""

import math
from collections.abc import Sequence

import numpy as np

from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.sensor_noise import errors_of
from ppafo.identification.trajectory.whitening import from_reflections, reflections_of

MOST_LINES = 3
CHANCE = 1.0e-4
"""Chance at which noise alone would be taken for hum, for each sensor."""

_PADDED = 4
_FEWEST_CYCLES = 5.0
_CELLS = 12
_FEWEST_SAMPLES = 64


def hum_of(segments: Sequence[Floats]) -> tuple[float, ...]:
    """Return the frequencies of hum in a sensor's recordings, in cycles per sample."""
    found: list[float] = []
    if min(len(one) for one in segments) < _FEWEST_SAMPLES:
        return ()
    for _ in range(MOST_LINES):
        left = [without_hum(one, tuple(found)) for one in segments]
        line = _strongest(left)
        if line is None:
            break
        found.append(line)
    return tuple(found)


def hum_columns(count: int, frequencies: Sequence[float]) -> Floats:
    """Return a cosine and a sine of each frequency at ``count`` samples, (samples, columns)."""
    phases = 2.0 * math.pi * np.outer(np.arange(count), np.array(frequencies))
    return np.hstack([np.cos(phases), np.sin(phases)])


def without_hum(segment: Floats, frequencies: Sequence[float]) -> Floats:
    """Return the samples less what sinusoids of these frequencies explain."""
    if not frequencies:
        return segment
    columns = hum_columns(len(segment), frequencies)
    return np.asarray(segment - columns @ np.linalg.lstsq(columns, segment, rcond=None)[0])


def _strongest(segments: Sequence[Floats]) -> float | None:
    """Return the line that stands highest above its neighbourhood, None where chance may have made it."""
    from scipy.ndimage import median_filter
    from scipy.stats import gamma

    reflections, _ = reflections_of(list(segments), 1)
    white = [errors_of(from_reflections(reflections), one)[1:] for one in segments]
    shortest = min(len(one) for one in white)
    size = _PADDED * max(len(one) for one in white)
    power = np.zeros(size // 2 + 1)
    for one in white:
        power += np.square(np.abs(np.fft.rfft((one - one.mean()) * np.hanning(len(one)), size))) / len(one)
    parts = float(len(white))
    around = median_filter(power, size=2 * _CELLS * _PADDED + 1, mode="nearest")
    height = power / np.maximum(around, 1.0e-300) * gamma.ppf(0.5, parts)
    edge = math.ceil(_FEWEST_CYCLES * size / shortest)
    height[:edge] = height[-edge:] = 0.0
    best = int(np.argmax(height))
    if gamma.sf(height[best], parts) * shortest > CHANCE:
        return None
    return _refined(white, best / size, 1.0 / size)


def _refined(white: Sequence[Floats], frequency: float, reach: float) -> float:
    """Return the frequency near one at which sinusoids explain most."""
    from scipy.optimize import minimize_scalar

    def left(place: float) -> float:
        return sum(float(np.sum(np.square(without_hum(one, (place,))))) for one in white)

    found = minimize_scalar(left, bounds=(frequency - reach, frequency + reach), method="bounded")
    return float(found.x)
