"""The knee over the flat foot: it turns about an ankle at rest, which shows columns exchanged and units of g."""

from dataclasses import dataclass

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import DataError
from ppafo.gait.fourier import HARMONICS, fit_curve
from ppafo.gait.gait import KNEE
from ppafo.gait.plausible.checked import MeanStride, SignSource
from ppafo.signals.recording import Floats

FOOT_FLAT = slice(15, 43)
"""Percent of the stride in which the foot stands flat."""

SHANK_LENGTHS = (0.25, 0.6)
"""Metres; within these the length is the one that fits best, since a gait does not say it."""

_FITS = 0.6
"""Largest misfit of the turning, relative and root mean square: true recordings have 0.3 to 0.46."""
_CLEARLY = 0.7
"""A mistake is named where correcting it leaves less than this fraction of the misfit."""

Factors = tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Mistake:
    """What may have happened, the way back in words, and the mended curves as fractions of the given (forward, up)."""

    words: str
    remedy: str
    forward: Factors
    up: Factors


_G = STANDARD_GRAVITY


def _too_small(factor: float, words: str) -> tuple[_Mistake, ...]:
    """Return numbers that are too small by a factor; knee_up alone is too small over the flat foot to be recognised."""
    return (
        _Mistake(f"are {words}", f"multiply both by {factor:g}", (factor, 0.0), (0.0, factor)),
        _Mistake(f"differ, knee_forward is {words}", f"multiply it by {factor:g}", (factor, 0.0), (0.0, 1.0)),
    )


def _too_large(factor: float) -> tuple[_Mistake, ...]:
    """Return numbers that are too large by a factor; one alone is first, since knee_up divided is as good as none."""
    words, fraction = f"{factor:g} times too large", 1.0 / factor
    return (
        _Mistake(f"differ, knee_forward is {words}", f"divide it by {factor:g}", (fraction, 0.0), (0.0, 1.0)),
        _Mistake(f"differ, knee_up is {words}", f"divide it by {factor:g}", (1.0, 0.0), (0.0, fraction)),
        _Mistake(f"are {words}", f"divide both by {factor:g}", (fraction, 0.0), (0.0, fraction)),
    )


_MISTAKES = (
    _Mistake("are exchanged", "exchange them", (0.0, 1.0), (1.0, 0.0)),
    _Mistake(
        "are exchanged, and knee_up has the other sign",
        "exchange them and reverse knee_up",
        (0.0, -1.0),
        (1.0, 0.0),
    ),
    *_too_small(_G, "in units of g"),
    *_too_small(1000.0, "1000 times too small"),
    *_too_large(_G),
    *_too_large(1000.0),
    _Mistake("are exchanged and in units of g", f"exchange them and multiply both by {_G:g}", (0.0, _G), (_G, 0.0)),
)
"""The first that fits is named. A sign alone is recognised in the swing."""

_WHERE: dict[SignSource, str] = {
    "map": "in the gait map or the file",
    "columns": "in the file",
    "gait_file": "in every number of their tables",
}


def check_turning(walk: MeanStride) -> None:
    """Raise DataError where the knee turns about the standing ankle only with a mistake corrected, and name it."""
    if any(name not in walk.curves for name in KNEE):
        return
    expected = turning_about_ankle(walk.curves["shank_angle"], walk.stride_time)
    # Over a stride that repeats the mean is 0; gravity in it is refused elsewhere and must not hide a unit here.
    forward, up = (walk.curves[name] - np.mean(walk.curves[name][:-1]) for name in KNEE)
    given = np.stack([forward, up])[:, FOOT_FLAT]
    missed = _misfit(given, expected)
    for mistake in _MISTAKES:
        left = _misfit(np.array([mistake.forward, mistake.up]) @ given, expected)
        if left < _FITS and left < _CLEARLY * missed:
            raise DataError(
                f"{walk.file['knee_forward']}: knee_forward and knee_up {mistake.words}: while the foot is flat the "
                f"knee turns about the resting ankle, which they miss by {100.0 * missed:.0f} %, and by "
                f"{100.0 * left:.0f} % with that corrected; {mistake.remedy} {_WHERE[walk.signs_from]}"
            )


def turning_about_ankle(shank: Floats, stride_time: float) -> Floats:
    """Return forward and up acceleration (2 x samples) of a knee over a resting ankle, per shank length [1/s^2].

    ``shank`` is phi [rad] at 101 phases; the ankle stands at (L sin phi, -L cos phi) from the knee.
    """
    curve, _ = fit_curve(shank, HARMONICS["shank_angle"])
    percent = np.linspace(0.0, 1.0, shank.size)[FOOT_FLAT]
    rates = curve.derivative(stride_time)
    phi, rate, acceleration = (item.values_at(percent) for item in (curve, rates, rates.derivative(stride_time)))
    sine, cosine = np.sin(phi), np.cos(phi)
    forward = sine * rate**2 - cosine * acceleration
    up = -cosine * rate**2 - sine * acceleration
    return np.stack([forward, up])


def _misfit(given: Floats, expected: Floats) -> float:
    """Return what the best shank leaves, as a fraction of what its turning asks for; infinite for a shank at rest."""
    square = float(np.sum(expected**2))
    if square == 0.0:
        return float("inf")
    length = float(np.clip(np.sum(given * expected) / square, *SHANK_LENGTHS))
    return float(np.sqrt(np.sum((given - length * expected) ** 2) / square)) / length
