"""Ten kinds of sensor noise: how each is drawn, and its covariance, from which the best possible interval follows."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ppafo.errors import IdentificationError, nearest_name
from ppafo.signals.recording import Floats

_MEMORY = 0.95
_AVERAGED = (1.0, 0.9, 0.6, 0.3)
_DRIFT, _DRIFT_SAMPLES = 0.5, 50.0
"""Drift of half the size of the white noise, over 50 samples: 50 ms at 1 kHz."""
_WALK = 0.05
_HUM, _HUM_PERIOD = 1.0, 20.0
"""Amplitude over the size of the white noise, and period in samples: 50 Hz at 1 kHz."""
_FREEDOM = 3.0
_UNEQUAL = 4.0
_UNKNOWN = 1.0e4


@dataclass(frozen=True, slots=True)
class NoiseKind:
    """How errors of a sensor are drawn and what covariance they have, all over the size of the white noise.

    Both are functions of the number of samples and of the number of the recording. Where errors are not normal the
    covariance is that of normal ones which say as much, and the kind ``is_heavy``. ``channels`` has the kind; the other
    channels are white.
    """

    draw: Callable[[int, int, np.random.Generator], Floats]
    covariance: Callable[[int, int], Floats]
    channels: tuple[str, ...] = ("angle", "pressure_1", "pressure_2")
    is_heavy: bool = False


def noise_kind(name: str) -> NoiseKind:
    """Return a kind of noise by name."""
    if name not in NOISE_KINDS:
        raise IdentificationError(
            f"no kind of noise '{name}'{nearest_name(name, NOISE_KINDS)}: {', '.join(NOISE_KINDS)}"
        )
    return NOISE_KINDS[name]


def _lags(count: int) -> Floats:
    return np.abs(np.subtract.outer(np.arange(count), np.arange(count))).astype(np.float64)


def _white(count: int, _recording: int, random: np.random.Generator) -> Floats:
    return random.standard_normal(count)


def _one(count: int, _recording: int) -> Floats:
    return np.eye(count)


def _remembered(count: int, memory: float, random: np.random.Generator) -> Floats:
    """Return stationary noise of variance 1 that keeps a share ``memory`` from sample to sample."""
    from scipy.signal import lfilter

    changes = math.sqrt(1.0 - memory**2) * random.standard_normal(count)
    changes[0] = random.standard_normal()
    return np.asarray(lfilter([1.0], [1.0, -memory], changes))


def _slow(count: int, _recording: int, random: np.random.Generator) -> Floats:
    return _remembered(count, _MEMORY, random)


def _of_slow(count: int, _recording: int) -> Floats:
    return np.asarray(_MEMORY ** _lags(count))


def _averaged(count: int, _recording: int, random: np.random.Generator) -> Floats:
    shares = np.array(_AVERAGED) / np.linalg.norm(_AVERAGED)
    return np.convolve(random.standard_normal(count + len(shares) - 1), shares, mode="valid")


def _of_averaged(count: int, _recording: int) -> Floats:
    shares = np.array(_AVERAGED) / np.linalg.norm(_AVERAGED)
    by_lag = np.correlate(shares, shares, mode="full")[len(shares) - 1 :]
    padded = np.concatenate([by_lag, np.zeros(count)])
    return np.asarray(padded[_lags(count).astype(np.intp)])


def _drift(count: int, _recording: int, random: np.random.Generator) -> Floats:
    return _white(count, 0, random) + _DRIFT * _remembered(count, math.exp(-1.0 / _DRIFT_SAMPLES), random)


def _of_drift(count: int, _recording: int) -> Floats:
    return np.asarray(np.eye(count) + _DRIFT**2 * np.exp(-_lags(count) / _DRIFT_SAMPLES))


def _walk(count: int, _recording: int, random: np.random.Generator) -> Floats:
    return _white(count, 0, random) + _WALK * np.cumsum(random.standard_normal(count))


def _of_walk(count: int, _recording: int) -> Floats:
    steps = np.arange(1.0, count + 1.0)
    return np.asarray(np.eye(count) + _WALK**2 * np.minimum.outer(steps, steps))


def _hum(count: int, _recording: int, random: np.random.Generator) -> Floats:
    phases = 2.0 * math.pi * (np.arange(count) / _HUM_PERIOD + random.random())
    return np.asarray(_white(count, 0, random) + _HUM * np.sin(phases))


def _of_hum(count: int, _recording: int) -> Floats:
    phases = 2.0 * math.pi * np.arange(count) / _HUM_PERIOD
    both = np.outer(np.sin(phases), np.sin(phases)) + np.outer(np.cos(phases), np.cos(phases))
    return np.asarray(np.eye(count) + _UNKNOWN * both)


def _heavy(count: int, _recording: int, random: np.random.Generator) -> Floats:
    return random.standard_t(_FREEDOM, count)


def _of_heavy(count: int, _recording: int) -> Floats:
    return np.asarray((_FREEDOM + 3.0) / (_FREEDOM + 1.0) * np.eye(count))


def _heavy_drift(count: int, _recording: int, random: np.random.Generator) -> Floats:
    return _heavy(count, 0, random) + _DRIFT * _remembered(count, math.exp(-1.0 / _DRIFT_SAMPLES), random)


def _of_heavy_drift(count: int, recording: int) -> Floats:
    return np.asarray(_of_heavy(count, recording) + _of_drift(count, recording) - np.eye(count))


def _unequal(count: int, recording: int, random: np.random.Generator) -> Floats:
    return _UNEQUAL**recording * _white(count, 0, random)


def _of_unequal(count: int, recording: int) -> Floats:
    return np.asarray(_UNEQUAL ** (2 * recording) * np.eye(count))


NOISE_KINDS: dict[str, NoiseKind] = {
    "white": NoiseKind(_white, _one),
    "slow-angle": NoiseKind(_slow, _of_slow, ("angle",)),
    "slow": NoiseKind(_slow, _of_slow),
    "moving-average": NoiseKind(_averaged, _of_averaged),
    "drift": NoiseKind(_drift, _of_drift),
    "random-walk": NoiseKind(_walk, _of_walk),
    "hum": NoiseKind(_hum, _of_hum),
    "heavy-tails": NoiseKind(_heavy, _of_heavy, is_heavy=True),
    "heavy-drift": NoiseKind(_heavy_drift, _of_heavy_drift, is_heavy=True),
    "unequal": NoiseKind(_unequal, _of_unequal),
}
"""By name: an autoregression of 0.95 on one channel and on all, a drift with white and with t (3) noise upon it, ..."""
