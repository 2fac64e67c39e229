"""Plausibility of a stride: limits wide enough for impaired walking that exclude the impossible.

Each refusal names file, curve, number and limits, and the remedy for what is wrong with units, signs and sides. A sign
is refused only where the other one fits clearly better: impaired walking breaks every rule of healthy walking a little.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import DataError, check_all, raise_noted
from ppafo.gait.gait import HARMONICS, KNEE, Gait, fit_curve
from ppafo.signals.recording import Floats

SignSource = Literal["map", "columns", "gait_file"]
"""Source of the sign convention: a gait map, the file's own convention, or a gait file."""


@dataclass(frozen=True, slots=True)
class MeanStride:
    """The stride that is checked: mean curves (101 samples, SI) by name, stance fraction [-] and stride time [s]."""

    file: Mapping[str, str]
    curves: Mapping[str, Floats]
    stance_share: float
    stride_time: float
    signs_from: SignSource
    is_knee_one_marker: bool = False
    """True if both coordinates of the knee are of one marker, which excludes a scale between them."""


def other_sign(signs_from: SignSource, key: str, turned: str = "the other sign") -> str:
    """Return how to reverse a curve: by its key in a gait map, or in the file."""
    return {
        "map": f"change {key} in the gait map",
        "columns": f"correct it in the file, or change {key} in a gait map",
        "gait_file": f"write mean, cosine and sine with {turned}",
    }[signs_from]


STANCE_FRACTION = (0.45, 0.85)
STRIDE_TIME = (0.5, 3.0)


def check_gait(gait: Gait, file: str) -> None:
    """Raise DataError for a gait file whose stride is not plausible, as ``check_plausible`` does."""
    percent = np.linspace(0.0, 1.0, 101)
    curves = {name: curve.values_at(percent) for name, curve in gait.curves.items()}
    check_plausible(MeanStride(dict.fromkeys(curves, file), curves, gait.stance_share, gait.stride_time, "gait_file"))


def check_plausible(walk: MeanStride) -> None:
    """Raise DataError for a mean stride that is not plausible; names file, curve, number, limits and remedy of all."""
    # A check in a chain is made only where those before it pass: a wrong unit would be refused again as a wrong sign.
    chains = (
        (check_stride_time,),
        (check_stance, check_moment_time),
        (check_shank, check_knee),
        (check_knee_means,),
        (check_ankle_range, check_shank, check_ankle),
        (check_moment,),
        (check_force,),
    )
    check_all([partial(check, walk) for check in chain] for chain in chains)


def check_stride_time(walk: MeanStride) -> None:
    """Raise DataError for a stride time that no walk has."""
    low, high = STRIDE_TIME
    if not low <= walk.stride_time <= high:
        raise DataError(
            f"{walk.file['shank_angle']}: a stride takes {walk.stride_time:.3g} s, plausible is {low:g} to {high:g} s; "
            "is the time in seconds?"
        )


def check_stance(walk: MeanStride) -> None:
    """Raise DataError for a stance that no walk has."""
    low, high = STANCE_FRACTION
    if low <= walk.stance_share <= high:
        return
    if walk.signs_from == "gait_file":
        hint = "give stride.stance_share from heel strike to toe-off"
    elif "vertical_force" in walk.curves:
        hint = "is the force of this foot, its sign and unit right?"
    else:
        remedy = other_sign(walk.signs_from, "shank_angle.positive")
        hint = f"it comes from shank_angle: where its sign is reversed, {remedy}"
    file = walk.file.get("vertical_force", walk.file["shank_angle"])
    raise DataError(
        f"{file}: the foot is on the ground for {100.0 * walk.stance_share:.0f} % of the stride, "
        f"plausible is {100.0 * low:.0f} to {100.0 * high:.0f} %; {hint}"
    )


SHANK_RANGE = (25.0, 120.0)
ANKLE_RANGE = (5.0, 80.0)
ANKLE_LIMITS = (40.0, 150.0)
MIDSTANCE = slice(15, 41)
"""Percent of the stride in which the foot stands: the ankle then turns as the shank does."""
_TURNS = 2.0
"""Degrees, RMS, by which a standing foot has to turn for a sign to show; recorded feet turn by 0.5 to 1.5."""
_TURNED_BACK = 0.1
"""Fraction of its range by which a shank has to rotate backwards over the standing foot for its sign to be reversed.

Recorded shanks rotate forward by 0.15 to 0.25 of it.
"""
_CLEARLY_BETTER = 2.0
"""Times that a curve has to fit better, or be larger, with the other sign for its sign to be reversed."""
REMARKED_TILT, REFUSED_TILT = 5.0, 20.0
"""Degrees that the standing foot may be tilted, on average over mid-stance, before it is remarked and refused.

Recorded feet on level ground have 0.5 to 4.6: the sole of a shoe and the placing of markers. Nothing tilts a standing
foot further than 20: a shoe with a heel of 6 cm on a foot of 17 cm from heel to ball, a walk on the toes, or a ramp of
1 in 3. Beyond that the zero is another one.
"""


def check_shank(walk: MeanStride) -> None:
    """Raise DataError for a shank angle that no leg has."""
    phi = np.degrees(walk.curves["shank_angle"])
    where = f"{walk.file['shank_angle']}: shank_angle"
    # The range is free of the zero, so that a wrong unit shows before a wrong zero.
    travel = float(np.ptp(phi))
    check_shank_range(where, travel, SHANK_RANGE[1])
    # Means of five samples at both ends: a single one may lie on a tremor.
    growth = float(np.mean(phi[MIDSTANCE][-5:]) - np.mean(phi[MIDSTANCE][:5]))
    if growth > _TURNED_BACK * travel:
        raise DataError(
            f"{where} grows by {growth:.2g} deg while the foot stands: the shank would rotate backwards over it; "
            f"{other_sign(walk.signs_from, 'shank_angle.positive')}{_other_foot(walk)}"
        )
    if float(phi[0]) < -10.0 or float(np.mean(phi)) > 10.0 or float(np.mean(phi)) < -50.0:
        raise DataError(
            f"{where} is {phi[0]:.0f} deg at heel strike and {np.mean(phi):.0f} deg on average; plausible is above "
            "-10 and -50 to 10 deg (0 is vertical, above 0 the ankle is in front); its zero or its columns are wrong"
            f"{_other_foot(walk)}"
        )


def check_shank_range(where: str, travel: float, most: float = float("inf")) -> None:
    """Raise DataError for a shank that turns by less [deg] than any leg that walks, or by more than ``most``."""
    low, high = SHANK_RANGE
    if not low <= travel <= most:
        raise DataError(
            f"{where} covers a range of {travel:.3g} deg in a stride, plausible is {low:g} to {high:g} deg; "
            f"{_unit_hint(travel, low, high)}"
        )


def check_ankle_range(walk: MeanStride) -> None:
    """Raise DataError for an ankle angle over a range that no leg has."""
    travel = float(np.ptp(np.degrees(walk.curves["ankle_angle"])))
    low, high = ANKLE_RANGE
    if not low <= travel <= high:
        raise DataError(
            f"{walk.file['ankle_angle']}: ankle_angle covers a range of {travel:.3g} deg in a stride, plausible is "
            f"{low:g} to {high:g} deg; {_unit_hint(travel, low, high)}"
        )


def check_ankle(walk: MeanStride) -> None:
    """Raise DataError for an ankle angle that no leg has with this shank."""
    theta = np.degrees(walk.curves["ankle_angle"])
    where = f"{walk.file['ankle_angle']}: ankle_angle"
    turned, reversed_turned = standing_turns(walk.curves["shank_angle"], walk.curves["ankle_angle"])
    if turned > _CLEARLY_BETTER * reversed_turned and turned > _TURNS:
        raise DataError(
            f"{where} goes into plantarflexion while the shank rotates forward over the standing foot, which would "
            f"turn by {turned:.2g} deg (RMS), and by {reversed_turned:.2g} deg with the other sign: its sign is "
            f"reversed; {other_sign(walk.signs_from, 'ankle_angle.positive', 'the other sign about 90 deg')}"
        )
    foot = standing_tilt(walk.curves["shank_angle"], walk.curves["ankle_angle"])
    if abs(foot) > REFUSED_TILT or float(theta.min()) < ANKLE_LIMITS[0] or float(theta.max()) > ANKLE_LIMITS[1]:
        raise DataError(
            f"{where} would tilt the standing foot by {foot:.0f} deg, plausible is within {REFUSED_TILT:g} deg "
            f"(angles from {theta.min():.0f} to {theta.max():.0f} deg, neutral 90); {_NEUTRAL[walk.signs_from]}"
        )


def standing_tilt(shank: Floats, ankle: Floats) -> float:
    """Return the mean tilt [deg] of the foot from 15 to 40 % of the stride, above 0 with the toes down.

    ``shank`` and ``ankle`` are curves [rad] of 101 samples in the signs of the package.
    """
    # On level ground the ankle is 90 deg plus the shank angle while the foot is flat.
    foot = np.degrees(ankle - shank)[MIDSTANCE] - 90.0
    return float(np.mean(foot))


def standing_turns(shank: Floats, ankle: Floats) -> tuple[float, float]:
    """Return how far the foot turns [deg, RMS] from 15 to 40 % of the stride, as it is and with the ankle reversed.

    ``shank`` and ``ankle`` are curves [rad] of 101 samples in the signs of the package; a foot that stands turns by 0.
    """
    # A flat foot stands still while the shank leans: the ankle then follows the shank, with the sign as it is or
    # reversed.
    lean, stand = np.degrees(shank)[MIDSTANCE], np.degrees(ankle)[MIDSTANCE]
    return float(np.std(stand - lean)), float(np.std(stand + lean))


def sign_remarks(shank: Floats, ankle: Floats) -> list[str]:
    """Return a remark on an ankle whose sign the standing foot does not show."""
    turned, reversed_turned = standing_turns(shank, ankle)
    if _CLEARLY_BETTER * turned <= reversed_turned:
        return []
    return [
        f"mid-stance does not show the sign of ankle_angle: the standing foot turns by {turned:.2g} deg (RMS), and by "
        f"{reversed_turned:.2g} deg with the other sign; check that the angle grows into plantarflexion"
    ]


def zero_remarks(tilt: float, correction: str) -> list[str]:
    """Return a remark on the zero of an ankle whose standing foot is tilted [deg]."""
    if abs(tilt) <= REMARKED_TILT:
        return []
    way = "toes down" if tilt > 0.0 else "toes up"
    return [
        f"the zero of ankle_angle seems to be off by {abs(tilt):.1f} deg: the standing foot would be tilted {way} "
        f"by as much (mean from 15 to 40 % of the stride; up to {REMARKED_TILT:g} is usual); "
        f"on level ground {correction}"
    ]


def gait_file_remarks(gait: Gait) -> list[str]:
    """Return a remark on the ankle's zero in a finished gait, with the new mean of its series."""
    percent = np.linspace(0.0, 1.0, 101)
    tilt = standing_tilt(gait.shank_angle.values_at(percent), gait.ankle_angle.values_at(percent))
    mean = float(np.degrees(gait.ankle_angle.mean)) - tilt
    return zero_remarks(tilt, f"the mean of [ankle_angle] in gait '{gait.name}' would be {mean:.1f} deg")


_NEUTRAL: dict[SignSource, str] = {
    "map": "give ankle_angle.neutral in the gait map: the reading of the file when the foot is "
    "perpendicular to the shank",
    "columns": "write it as 90 deg when the foot is perpendicular to the shank, or give a gait map with "
    "ankle_angle.neutral",
    "gait_file": "write its mean so that it is 90 deg when the foot is perpendicular to the shank",
}


def _other_foot(walk: MeanStride) -> str:
    if walk.signs_from == "gait_file" or "vertical_force" not in walk.curves:
        return ""
    return ", or the force is of the other foot: choose the other side, or the column of this foot"


def _unit_hint(travel: float, low: float, high: float) -> str:
    """Return which unit would make a range of an angle plausible."""
    if low <= np.degrees(travel) <= high:
        return "the numbers look like radians: give 'rad' as their unit"
    if low <= np.radians(travel) <= high:
        return "the numbers look like degrees: give 'deg' as their unit"
    return "check unit and columns"


MOMENT_PEAK = (0.05, 3.5)
FORCE_PEAK = (0.5, 2.5)
FORCE_MEAN = (0.25, 0.75)
USUAL_FORCE_MEAN = (0.42, 0.58)
"""Body weights: over steady strides both legs carry 1 together, half each in a symmetric walk."""

_ON_GROUND = 0.05
"""Body weights, either way; a plate with no foot on it shows less."""
_AFTER_TOE_OFF = 0.03
"""Fraction of the stride; a toe-off found in the shank is no nearer than this."""
_LEFT_IN_SWING = 0.25
"""Fraction of the peak; the swinging foot needs a few hundredths."""
_FOOT_ALONE = 0.05
"""N m/kg that a swinging foot may need, however weak the push-off."""


def check_force_scale(file: str, force: Floats, signs_from: SignSource) -> None:
    """Raise DataError for a vertical force [body weights] whose unit or sign leaves no heel strike to find."""
    # One contact in a long record is less than 2 % of it.
    loaded = force[np.abs(force) > _ON_GROUND]
    # Percentiles, since a single spike has no sign to judge.
    lowest, highest = np.percentile(loaded if loaded.size else force, (2.0, 98.0)).tolist()
    # A reversed sign is looked for first: its peak would be refused as too small.
    low, high = FORCE_PEAK
    if -lowest > _CLEARLY_BETTER * highest:
        raise DataError(
            f"{file}: vertical_force is {lowest:.3g} body weights at its largest and points downwards: its sign is "
            f"reversed; "
            f"{other_sign(signs_from, 'vertical_force.positive')}"
        )
    if not low <= highest <= high:
        raise DataError(
            f"{file}: vertical_force reaches {highest:.3g} body weights, plausible is {low:g} to {high:g}; "
            "is the body mass right, and the unit (N, '-')?"
        )


def check_moment(walk: MeanStride) -> None:
    """Raise DataError for an ankle moment, where there is one, that no leg has."""
    if "ankle_moment" not in walk.curves:
        return
    moment = walk.curves["ankle_moment"]
    where = f"{walk.file['ankle_moment']}: ankle_moment"
    if float(np.mean(moment)) < 0.0 and float(-np.min(moment)) > _CLEARLY_BETTER * float(np.max(moment)):
        raise DataError(
            f"{where} is {np.min(moment):.3g} N m/kg at its largest, into dorsiflexion: its sign is reversed; "
            f"{other_sign(walk.signs_from, 'ankle_moment.positive')}"
        )
    peak, (low, high) = float(np.max(moment)), MOMENT_PEAK
    if not low <= peak <= high:
        raise DataError(
            f"{where} reaches {peak:.3g} N m/kg, plausible is {low:g} to {high:g} N m/kg; is the unit right "
            "(N m, N m/kg, N mm/kg) and the body mass?"
        )


_UNCLEAR_MOMENT = 0.5
"""Fraction of the largest plantarflexion moment; healthy walking has 0.05 to 0.2 of it into dorsiflexion."""


def moment_remarks(moment: Floats) -> list[str]:
    """Return a remark on an ankle moment [N m/kg] whose sign its curve hardly shows."""
    down, up = float(np.max(moment)), float(-np.min(moment))
    if up <= _UNCLEAR_MOMENT * down:
        return []
    return [
        f"the ankle moment hardly shows its sign: {down:.2g} N m/kg into plantarflexion and {up:.2g} N m/kg into "
        "dorsiflexion at most; check that push-off is above 0"
    ]


def check_moment_time(walk: MeanStride) -> None:
    """Raise DataError for an ankle moment, where there is one, that works while the foot is off the ground."""
    if "ankle_moment" not in walk.curves:
        return
    moment = walk.curves["ankle_moment"]
    peak, column = float(np.max(moment)), f"{walk.file['ankle_moment']}: ankle_moment"
    fraction, phase = walk.stance_share, np.linspace(0.0, 1.0, moment.size)
    at, swing = float(phase[np.argmax(moment)]), float(np.max(moment[phase > fraction + _AFTER_TOE_OFF]))
    if at < fraction and swing < max(_LEFT_IN_SWING * peak, _FOOT_ALONE):
        return
    where = "" if at >= fraction else f" and is {swing:.2g} N m/kg in swing"
    raise DataError(
        f"{column} peaks at {100.0 * at:.0f} % of the stride{where}, but the foot is off the ground "
        f"from {100.0 * fraction:.0f} % on; {_OTHER_TIME[walk.signs_from]}"
    )


_OTHER_TIME: dict[SignSource, str] = {
    "map": "it is of the other foot or on another clock: choose the other side, or the column of this foot",
    "columns": "it is of the other foot or on another clock: choose the other side, or the column of this foot",
    "gait_file": "write the moment of this foot, counted from its heel strike",
}


def check_force(walk: MeanStride) -> None:
    """Raise DataError for a vertical force, where there is one, that no walk has."""
    if "vertical_force" not in walk.curves:
        return
    force = walk.curves["vertical_force"]
    where = f"{walk.file['vertical_force']}: vertical_force"
    peak, mean = float(np.max(force)), float(np.mean(force))
    if not FORCE_PEAK[0] <= peak <= FORCE_PEAK[1] or not FORCE_MEAN[0] <= mean <= FORCE_MEAN[1]:
        raise DataError(
            f"{where} is {mean:.3g} body weights on average and {peak:.3g} at its peak, plausible is "
            f"{FORCE_MEAN[0]:g} to {FORCE_MEAN[1]:g} and {FORCE_PEAK[0]:g} to {FORCE_PEAK[1]:g}; "
            "is the body mass right, and the unit (N, '-')?"
        )


def force_remarks(force: Floats) -> list[str]:
    """Return what is unusual about the mean of a vertical force [body weights] over a stride, both ends counted."""
    # Both ends are one phase, which must not count twice.
    mean, (low, high) = float(np.mean(force[:-1])), USUAL_FORCE_MEAN
    if low <= mean <= high:
        return []
    return [
        f"the vertical force is {mean:.3g} body weights on average, and one leg of a steady walk carries about 0.5 "
        f"(usually {low:g} to {high:g}): check the body mass, {2.0 * mean:.2g} times as much would make it 0.5, and "
        "the scale of the force"
    ]


FOOT_FLAT = slice(15, 43)
"""Percent of the stride in which the foot stands flat."""

SHANK_LENGTHS = (0.25, 0.6)
"""Metres; within these the length is the one that fits best, since a gait does not say it."""

_FITS = 0.6
"""Largest misfit of the turning, relative and root mean square: true recordings have 0.3 to 0.46."""
_LEFT_BY_MISTAKE, _LEFT_BY_ONE = 0.7, 0.62
"""A mistake is remarked where correcting it leaves less than the first fraction of the misfit, and refused below the
second: true knees in units of g leave 0.48 to 0.57, and a true knee in its own unit has shown 0.68.
"""

Factors = tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Mistake:
    """A possible mistake, its remedy in words, and the corrected curves as fractions of the given (forward, up)."""

    words: str
    remedy: str
    forward: Factors
    up: Factors

    @property
    def is_of_one_alone(self) -> bool:
        """Tell whether exactly one curve has another scale."""
        return self.forward[1] == self.up[0] == 0.0 and self.forward[0] != self.up[1]


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
        "are exchanged, and knee_up has the other sign", "exchange them and reverse knee_up", (0.0, -1.0), (1.0, 0.0)
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


def turning_remarks(walk: MeanStride) -> list[str]:
    """Return a remark where a mistake would explain a part of how the knee misses the standing ankle."""
    mistake = _mistaken_turning(walk)
    return [] if mistake is None else [f"{mistake.statement}, which may be the walk itself"]


@dataclass(frozen=True, slots=True)
class _Mistaken:
    """A mistake that would explain a turning, and what the knee misses without and with it corrected [-]."""

    mistake: _Mistake
    missed: float
    left: float

    @property
    def statement(self) -> str:
        return (
            f"knee_forward and knee_up {self.mistake.words}: while the foot is flat the knee turns about the resting "
            f"ankle, which they miss by {100.0 * self.missed:.0f} %, and by {100.0 * self.left:.0f} % with that "
            "corrected"
        )


def _mistaken_turning(walk: MeanStride) -> _Mistaken | None:
    if any(name not in walk.curves for name in KNEE):
        return None
    expected = turning_about_ankle(walk.curves["shank_angle"], walk.stride_time)
    # Over a stride that repeats the mean is 0; gravity in it is refused elsewhere and must not hide a unit here.
    forward, up = (walk.curves[name] - np.mean(walk.curves[name][:-1]) for name in KNEE)
    turned = np.stack([forward, up])[:, FOOT_FLAT]
    missed = _misfit(turned, expected)
    for mistake in _MISTAKES:
        if walk.is_knee_one_marker and mistake.is_of_one_alone:
            continue
        left = _misfit(np.array([mistake.forward, mistake.up]) @ turned, expected)
        if left < _FITS and left < _LEFT_BY_MISTAKE * missed:
            return _Mistaken(mistake, missed, left)
    return None


def turning_about_ankle(shank: Floats, stride_time: float) -> Floats:
    """Return forward and up acceleration (2 x samples) of a knee over a resting ankle, per shank length [1/s^2].

    ``shank`` is phi [rad] at 101 phases; the ankle stands at (L sin phi, -L cos phi) from the knee.
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
    """Return the misfit of the best shank as a fraction of its turning; infinite for a shank at rest."""
    square = float(np.sum(expected**2))
    if square == 0.0:
        return float("inf")
    # Least squares for the one unknown, the length of the shank.
    length = float(np.clip(np.sum(measured * expected) / square, *SHANK_LENGTHS))
    return float(np.sqrt(np.sum((measured - length * expected) ** 2) / square)) / length


KNEE_TRAVEL = (0.5, 80.0)
"""Range of a knee's acceleration over the stride, in m/s^2, that a walk may have."""
KNEE_MEAN = 1.5
"""Mean of a knee's acceleration over the stride, in m/s^2, that a walk may have: it comes back to where it was."""
_HELD_BACK = 0.2
"""Fraction of its range by which a knee has to decelerate where others are driven for its sign to be reversed.

A measured knee is driven by 0.8 to 0.9 of it.
"""

_PARTS = {"knee_forward": ((-0.3, 0.0), (0.3, 0.6)), "knee_up": ((0.0, 0.3), (0.4, 0.7))}
"""Parts of the swing, from toe-off, in which the knee is driven on and up, and in which it is held back and falls."""


def check_knee(walk: MeanStride) -> None:
    """Raise DataError for knee accelerations, where there are some, that no leg has."""
    there = [name for name in KNEE if name in walk.curves]
    if len(there) == 1:
        (missing,) = set(KNEE) - set(there)
        raise DataError(f"{walk.file[there[0]]}: {there[0]} is given without {missing}; give both, or neither")
    mistake = _mistaken_turning(walk)
    if mistake is not None and mistake.left < _LEFT_BY_ONE * mistake.missed:
        raise DataError(
            f"{walk.file['knee_forward']}: {mistake.statement}; {mistake.mistake.remedy} {_WHERE[walk.signs_from]}"
        )
    check_knee_means(walk)
    check_all([partial(_check_knee_curve, walk, name)] for name in there)


def check_knee_means(walk: MeanStride) -> None:
    """Raise DataError for accelerations of the knee, where there are some, that do not average to 0 over a stride."""
    # Without the last sample, which is the first phase again.
    means = {name: float(np.mean(walk.curves[name][:-1])) for name in KNEE if name in walk.curves}
    raise_noted(
        [
            DataError(
                f"{walk.file[name]}: {name} is {mean:.3g} m/s^2 on average, and a periodic stride has 0 (up to "
                f"{KNEE_MEAN:g} is accepted); an accelerometer measures gravity too: subtract it"
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
            f"{where} covers a range of {travel:.3g} m/s^2 in a stride, plausible is {low:g} to {high:g} m/s^2; "
            "is the unit right (m/s^2, or m for a position)?"
        )
    # Gait phase of the swing, below 0 before toe-off.
    swung = (np.linspace(0.0, 1.0, values.size) - walk.stance_share) / (1.0 - walk.stance_share)
    driven, held = (float(np.mean(values[(swung >= start) & (swung <= end)])) for start, end in _PARTS[name])
    if held - driven > _HELD_BACK * travel:
        raise DataError(
            f"{where} is {driven:.3g} m/s^2 about toe-off and {held:.3g} m/s^2 in the middle of the swing, and it "
            "is the other way round in walking: its sign is reversed, or it is of the other knee; "
            f"{other_sign(walk.signs_from, f'the sign of knee.{name[5:]}')}"
        )
