"""Noise models of sensors, estimated from residuals: size, and autoregression or drift (Burg, AIC)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from ppafo.signals.recording import Floats

HIGHEST_ORDER = 12
"""Highest order of the noise autoregression."""
SAMPLES_PER_COEFFICIENT = 100
"""Least number of samples per autoregression coefficient; 100 white samples then get order 0 in 7 of 10 fits."""
_LARGEST_REFLECTION = 1.0 - 1.0e-9
"""Largest reflection coefficient [-]; residuals that follow a law exactly, such as a constant, leave no innovation."""
_GAINS = tuple(2.0**-power for power in range(1, 9))
"""Trial gains of a drifting level [-]; with a smaller gain the level would not move within some hundred samples."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise model of a channel: white noise, an autoregression, or white noise plus a drifting level (random walk).

    ``deviation``: total standard deviation [SI]. ``reflection``: reflection coefficients of the autoregression (Burg)
    [-]. ``gain``: fraction of each innovation added to the drifting level [-], 0 without drift. ``innovation``:
    standard deviation of the unpredictable part (innovation), relative to the total [-].
    """

    deviation: float
    reflection: tuple[float, ...] = ()
    gain: float = 0.0
    innovation: float = 1.0

    @property
    def order(self) -> int:
        """Number of coefficients, 0 for white noise."""
        return len(self.reflection) + (self.gain > 0.0)


def burg(series: Sequence[Floats], highest: int = HIGHEST_ORDER, wanted_order: int | None = None) -> tuple[float, ...]:
    """Return the reflection coefficients [-] of an autoregression of several series (Burg), with order from AIC.

    The columns of a series (samples, columns) are summed in power, such as residuals and their uncertainty. There is at
    most one coefficient per 100 samples: with more, the misfit of a wrong law would pass for noise in the few readings
    of a bench. Correlated noise in shorter series is therefore not detected, and intervals are too narrow there.
    """
    forward = list(series)
    backward = list(series)
    count = sum(map(len, series))
    shortest = min(map(len, series))
    power = 1.0
    coefficients = []
    best = (0.0, 0)
    for order in range(1, min(highest, count // SAMPLES_PER_COEFFICIENT, shortest - 2) + 1):
        ahead = [errors[1:] for errors in forward]
        behind = [errors[:-1] for errors in backward]
        across = sum(float(np.sum(a * b)) for a, b in zip(ahead, behind, strict=True))
        size = sum(float(np.sum(a * a + b * b)) for a, b in zip(ahead, behind, strict=True))
        # Residuals of 0 throughout, of a law without noise, have no memory.
        if size <= 0.0:
            break
        coefficient = max(-_LARGEST_REFLECTION, min(_LARGEST_REFLECTION, 2.0 * across / size))
        coefficients.append(coefficient)
        forward = [a - coefficient * b for a, b in zip(ahead, behind, strict=True)]
        backward = [b - coefficient * a for a, b in zip(ahead, behind, strict=True)]
        power *= 1.0 - coefficient**2
        best = min(best, (count * math.log(max(power, 1.0e-300)) + 2.0 * order, order))
    return tuple(coefficients[: best[1] if wanted_order is None else wanted_order])


def noise_of(
    series: Sequence[Floats], highest: int = HIGHEST_ORDER, may_drift: bool = True, like: Noise | None = None
) -> Noise:
    """Return the noise model of several series [-] chosen by AIC: an autoregression, or white noise plus a random walk.

    The random walk is tried only if sensors ``may_drift``; an autoregression would need many coefficients for slow
    drift. Columns are summed in power, as in ``burg``. With ``like``, order and gain are those of that model.
    """
    count = sum(map(len, series))
    size = sum(float(np.square(values).sum()) for values in series)
    # Residuals below the floor are the engine's, and no noise.
    if size < 0.5 * count:
        return Noise(1.0)
    reflection = burg(series, highest, None if like is None else len(like.reflection))
    innovation = math.sqrt(math.prod(1.0 - coefficient * coefficient for coefficient in reflection))
    noise = Noise(1.0, reflection, 0.0, innovation)
    best = 2.0 * count * math.log(innovation) + 2.0 * len(reflection)
    gains = _GAINS if may_drift and count >= SAMPLES_PER_COEFFICIENT else ()
    if like is not None:
        gains, best = ((like.gain,), math.inf) if like.gain > 0.0 else ((), best)
    previous = math.inf
    for gain in gains:
        squares = sum(float(np.square(_without_level(values, gain)).sum()) for values in series)
        innovation = math.sqrt(squares / size)
        # With ever less gain the innovations fall, and grow again: what follows is larger still.
        if innovation > previous:
            break
        previous = innovation
        criterion = 2.0 * count * math.log(innovation) + 2.0
        if criterion < best:
            best = criterion
            noise = Noise(1.0, (), gain, innovation)
    return noise


def _without_level(values: Floats, gain: float) -> Floats:
    """Return the innovations of white noise plus a random walk: steady-state Kalman filter of a local-level model."""
    return np.asarray(lfilter([1.0, -1.0], [1.0, gain - 1.0], values, axis=0))


def whiten(values: Floats, noise: Noise) -> Floats:
    """Whiten columns (samples, columns) [SI] of a recording: innovations [-] of the noise model of the channel."""
    forward = values / noise.deviation
    if noise.gain > 0.0:
        return _without_level(forward, noise.gain) / noise.innovation
    backward = forward.copy()
    power = 1.0
    innovations = forward.copy()
    for order, coefficient in enumerate(noise.reflection, start=1):
        forward, backward = forward[1:] - coefficient * backward[:-1], backward[:-1] - coefficient * forward[1:]
        power *= 1.0 - coefficient * coefficient
        innovations[order:] = forward / math.sqrt(power)
    return innovations
