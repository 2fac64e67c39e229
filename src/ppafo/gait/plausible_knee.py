"""Plausibility of knee accelerations: range, mean, sign, and rotation of the knee about the standing ankle."""

from functools import partial

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import DataError, check_all, raise_noted
from ppafo.gait.gait import HARMONICS, KNEE, fit_curve
from ppafo.gait.plausible_angles import MeanStride
from ppafo.signals.recording import Floats

FOOT_FLAT = slice(15, 43)
"""Samples [percent of the stride] in which the foot stands flat."""

SHANK_LENGTHS = (0.25, 0.6)
"""Range of shank lengths [m] for the best fit, as a gait does not contain the length."""

_FITS = 0.6
"""Largest misfit to a rotation about the ankle [-, RMS] that counts as a fit; correct recordings have 0.3 to 0.46."""
_LEFT_BY_ONE = 0.62
"""Fraction of the misfit below which a correction explains it; correct knees in units of g leave 0.48 to 0.57."""

_G = STANDARD_GRAVITY
_FACTORS = {
    **{f"multiply %s by {factor:g}": factor for factor in (_G, 1000.0)},
    **{f"divide %s by {factor:g}": 1.0 / factor for factor in (_G, 1000.0)},
}
_CORRECTIONS = {
    "exchange them": ((0.0, 1.0), (1.0, 0.0)),
    "exchange them and reverse knee_up": ((0.0, -1.0), (1.0, 0.0)),
    **{words % "both": ((factor, 0.0), (0.0, factor)) for words, factor in _FACTORS.items() if factor > 1.0},
    **{words % "knee_forward": ((factor, 0.0), (0.0, 1.0)) for words, factor in _FACTORS.items()},
    **{words % "knee_up": ((1.0, 0.0), (0.0, factor)) for words, factor in _FACTORS.items() if factor < 1.0},
    **{words % "both": ((factor, 0.0), (0.0, factor)) for words, factor in _FACTORS.items() if factor < 1.0},
    f"exchange them and multiply both by {_G:g}": ((0.0, _G), (_G, 0.0)),
}
"""Coefficients of each corrected curve (forward, up) in the given ones; the first that fits is reported.

A knee_up too small by a factor and a wrong sign alone are not recognised here. One that is divided by a factor fits
almost as well as the given curves.
"""


def _check_turning(walk: MeanStride) -> None:
    """Raise DataError for a knee that turns about the resting ankle only after a correction."""
    expected = turning_about_ankle(walk.curves["shank_angle"], walk.stride_time)
    # Over a stride that repeats the mean is 0; gravity in it is refused elsewhere and must not hide a unit here.
    forward, up = (walk.curves[name] - np.mean(walk.curves[name][:-1]) for name in KNEE)
    turned = np.stack([forward, up])[:, FOOT_FLAT]
    missed = _misfit(turned, expected)
    for remedy, factors in _CORRECTIONS.items():
        is_of_one_alone = factors[0][1] == factors[1][0] == 0.0 and factors[0][0] != factors[1][1]
        left = _misfit(np.array(factors) @ turned, expected)
        if left < min(_FITS, _LEFT_BY_ONE * missed) and not (walk.is_knee_one_marker and is_of_one_alone):
            raise DataError(
                f"{walk.file['knee_forward']}: knee_forward and knee_up differ by {100.0 * missed:.0f} % "
                f"({100.0 * left:.0f} % if corrected) from a rotation of the knee about the resting ankle while the "
                f"foot is flat; {remedy}"
            )


def turning_about_ankle(shank: Floats, stride_time: float) -> Floats:
    """Return the acceleration (2 x samples: forward, up) of a knee above a resting ankle, per shank length [1/s^2].

    ``shank`` is phi [rad] at 101 phases; relative to the knee the ankle is at (L sin phi, -L cos phi).
    """
    curve, _ = fit_curve(shank, HARMONICS["shank_angle"])
    percent = np.linspace(0.0, 1.0, shank.size)[FOOT_FLAT]
    rates = curve.derivative(stride_time)
    phi, rate, acceleration = (series.values_at(percent) for series in (curve, rates, rates.derivative(stride_time)))
    sine, cosine = np.sin(phi), np.cos(phi)
    forward = sine * rate**2 - cosine * acceleration
    # Centripetal and tangential acceleration of a point that turns about the ankle.
    up = -cosine * rate**2 - sine * acceleration
    return np.stack([forward, up])


def _misfit(measured: Floats, expected: Floats) -> float:
    """Return the relative misfit to the expected acceleration at the best shank length [-]; infinite at rest."""
    square = float(np.sum(expected**2))
    if square == 0.0:
        return float("inf")
    # Least squares for the one unknown, the length of the shank.
    length = float(np.clip(np.sum(measured * expected) / square, *SHANK_LENGTHS))
    return float(np.sqrt(np.sum((measured - length * expected) ** 2) / square)) / length


KNEE_TRAVEL = (0.5, 80.0)
"""Plausible range of the knee acceleration over a stride [m/s^2]."""
KNEE_MEAN = 1.5
"""Largest mean of the knee acceleration over a stride [m/s^2]; it is 0 for a periodic motion."""
_HELD_BACK = 0.2
"""Fraction of its range by which a knee must decelerate in the phase of usual acceleration to reject its sign [-].

A measured knee accelerates by 0.8 to 0.9 of its range.
"""

_PARTS = {"knee_forward": ((-0.3, 0.0), (0.3, 0.6)), "knee_up": ((0.0, 0.3), (0.4, 0.7))}
"""Intervals about toe-off [fractions of the swing] of acceleration (forward, up) and of deceleration."""


def check_knee(walk: MeanStride) -> None:
    """Raise DataError for knee accelerations that no leg can have; a stride without accelerations passes."""
    there = [name for name in KNEE if name in walk.curves]
    if len(there) == 1:
        (missing,) = set(KNEE) - set(there)
        raise DataError(f"{walk.file[there[0]]}: {there[0]} needs {missing}; give both or neither")
    if there:
        _check_turning(walk)
    check_knee_means(walk)
    check_all([partial(_check_knee_curve, walk, name)] for name in there)


def check_knee_means(walk: MeanStride) -> None:
    """Raise DataError for knee accelerations whose mean over a stride is not 0; skipped without accelerations."""
    # Without the last sample, which is the first phase again.
    means = {name: float(np.mean(walk.curves[name][:-1])) for name in KNEE if name in walk.curves}
    raise_noted(
        [
            DataError(
                f"{walk.file[name]}: {name} has a mean of {mean:.3g} m/s^2, but must average to 0 over a stride "
                f"(allowed: up to {KNEE_MEAN:g} m/s^2; gravity is not part of it)"
            )
            for name, mean in means.items()
            if abs(mean) > KNEE_MEAN
        ]
    )


def _check_knee_curve(walk: MeanStride, name: str) -> None:
    values, where = walk.curves[name], f"{walk.file[name]}: {name}"
    travel, (low, high) = float(np.ptp(values)), KNEE_TRAVEL
    if not low <= travel <= high:
        raise DataError(f"{where} has a range of {travel:.3g} m/s^2 per stride (plausible: {low:g} to {high:g} m/s^2)")
    # Gait phase of the swing, below 0 before toe-off.
    swung = (np.linspace(0.0, 1.0, values.size) - walk.stance_share) / (1.0 - walk.stance_share)
    driven, held = (float(np.mean(values[(swung >= start) & (swung <= end)])) for start, end in _PARTS[name])
    if held - driven > _HELD_BACK * travel:
        raise DataError(
            f"{where} is {driven:.3g} m/s^2 around toe-off and {held:.3g} m/s^2 in mid-swing, while walking has the "
            "opposite pattern: the sign is reversed, or the data are of the other knee"
        )
