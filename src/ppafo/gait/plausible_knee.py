"""Plausibility of knee accelerations: range, mean, sign, and rotation of the knee about the standing ankle."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import DataError, check_all, raise_noted
from ppafo.gait.gait import HARMONICS, KNEE, fit_curve
from ppafo.gait.mean_stride import MeanStride, SignSource, other_sign
from ppafo.signals.recording import Floats

FOOT_FLAT = slice(15, 43)
"""Samples [percent of the stride] in which the foot stands flat."""

SHANK_LENGTHS = (0.25, 0.6)
"""Range of shank lengths [m] for the best fit, as a gait does not contain the length."""

_FITS = 0.6
"""Largest misfit to a rotation about the ankle [-, RMS] that counts as a fit; correct recordings have 0.3 to 0.46."""
_LEFT_BY_MISTAKE, _LEFT_BY_ONE = 0.7, 0.62
"""Fractions of the misfit that remain after correction of a mistake: below the first for a remark, below the second
for an error. Correct knees in units of g leave 0.48 to 0.57, and a correct knee in its own unit has shown 0.68."""

Factors = tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Mistake:
    """Possible mistake in the knee accelerations: description, remedy, and correction.

    ``forward`` and ``up`` are the coefficients with which each corrected curve is computed from the given (forward,
    up).
    """

    words: str
    remedy: str
    forward: Factors
    up: Factors


_G = STANDARD_GRAVITY


def _too_small(factor: float, words: str) -> tuple[_Mistake, ...]:
    """Return the mistakes of values too small by a factor; for knee_up alone, the mistake cannot be recognised."""
    return (
        _Mistake(f"are {words}", f"multiply both by {factor:g}", (factor, 0.0), (0.0, factor)),
        _Mistake(
            f"differ (knee_forward is {words})", f"multiply knee_forward by {factor:g}", (factor, 0.0), (0.0, 1.0)
        ),
    )


def _too_large(factor: float) -> tuple[_Mistake, ...]:
    """Return the mistakes of values too large by a factor, first for one curve alone.

    The order matters because knee_up divided by the factor fits almost as well as the given curves.
    """
    words, fraction = f"{factor:g} times too large", 1.0 / factor
    return (
        _Mistake(
            f"differ (knee_forward is {words})", f"divide knee_forward by {factor:g}", (fraction, 0.0), (0.0, 1.0)
        ),
        _Mistake(f"differ (knee_up is {words})", f"divide knee_up by {factor:g}", (1.0, 0.0), (0.0, fraction)),
        _Mistake(f"are {words}", f"divide both by {factor:g}", (fraction, 0.0), (0.0, fraction)),
    )


_MISTAKES = (
    _Mistake("are exchanged", "exchange them", (0.0, 1.0), (1.0, 0.0)),
    _Mistake(
        "are exchanged, and knee_up has the opposite sign", "exchange them and reverse knee_up", (0.0, -1.0), (1.0, 0.0)
    ),
    *_too_small(_G, "in units of g"),
    *_too_small(1000.0, "1000 times too small"),
    *_too_large(_G),
    *_too_large(1000.0),
    _Mistake("are exchanged and in units of g", f"exchange them and multiply both by {_G:g}", (0.0, _G), (_G, 0.0)),
)
"""Possible mistakes; the first that fits is reported. A wrong sign alone is recognised from the swing."""

_WHERE: dict[SignSource, str] = {
    "map": "in the gait map or the file",
    "columns": "in the file",
    "gait_file": "in the gait file",
}


def turning_remarks(walk: MeanStride) -> list[str]:
    """Return a remark if a mistake would partly explain the misfit of the knee to a rotation about the ankle."""
    found = _mistaken_turning(walk)
    return [] if found is None else [f"{found[0]}; the walk itself may be the cause"]


def _mistaken_turning(walk: MeanStride) -> tuple[str, str, float] | None:
    """Return the mistake that explains the knee's misfit, its remedy, and the remaining fraction of the misfit [-]."""
    if any(name not in walk.curves for name in KNEE):
        return None
    expected = turning_about_ankle(walk.curves["shank_angle"], walk.stride_time)
    # Over a stride that repeats the mean is 0; gravity in it is refused elsewhere and must not hide a unit here.
    forward, up = (walk.curves[name] - np.mean(walk.curves[name][:-1]) for name in KNEE)
    turned = np.stack([forward, up])[:, FOOT_FLAT]
    missed = _misfit(turned, expected)
    for mistake in _MISTAKES:
        is_of_one_alone = mistake.forward[1] == mistake.up[0] == 0.0 and mistake.forward[0] != mistake.up[1]
        if walk.is_knee_one_marker and is_of_one_alone:
            continue
        left = _misfit(np.array([mistake.forward, mistake.up]) @ turned, expected)
        if left < _FITS and left < _LEFT_BY_MISTAKE * missed:
            statement = (
                f"knee_forward and knee_up {mistake.words}: they differ by {100.0 * missed:.0f} % ({100.0 * left:.0f} "
                "% if corrected) from a rotation of the knee about the resting ankle while the foot is flat"
            )
            return statement, mistake.remedy, left / missed
    return None


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
    found = _mistaken_turning(walk)
    if found is not None and found[2] < _LEFT_BY_ONE:
        statement, remedy, _ = found
        raise DataError(f"{walk.file['knee_forward']}: {statement}; {remedy} {_WHERE[walk.signs_from]}")
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
                f"(allowed: up to {KNEE_MEAN:g} m/s^2); subtract gravity from accelerometer data"
            )
            for name, mean in means.items()
            if abs(mean) > KNEE_MEAN
        ]
    )


def _check_knee_curve(walk: MeanStride, name: str) -> None:
    values, where = walk.curves[name], f"{walk.file[name]}: {name}"
    travel, (low, high) = float(np.ptp(values)), KNEE_TRAVEL
    if not low <= travel <= high:
        raise DataError(
            f"{where} has a range of {travel:.3g} m/s^2 per stride (plausible: {low:g} to {high:g} m/s^2); "
            "check the unit (m/s^2, or m for a position)"
        )
    # Gait phase of the swing, below 0 before toe-off.
    swung = (np.linspace(0.0, 1.0, values.size) - walk.stance_share) / (1.0 - walk.stance_share)
    driven, held = (float(np.mean(values[(swung >= start) & (swung <= end)])) for start, end in _PARTS[name])
    if held - driven > _HELD_BACK * travel:
        raise DataError(
            f"{where} is {driven:.3g} m/s^2 around toe-off and {held:.3g} m/s^2 in mid-swing, while walking has the "
            "opposite pattern: the sign is reversed, or the data are of the other knee; "
            f"{other_sign(walk.signs_from, f'the sign of knee.{name[5:]}')}"
        )
