"""Plausibility of a stride: limits wide enough for impaired walking that exclude impossible values.

Each error names file, curve, number and limits. A sign is rejected only if the opposite sign fits clearly better,
because impaired walking often breaks the rules of healthy walking slightly. The angles are checked by the standing foot
in mid-stance, the knee by its rotation about the standing ankle.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import DataError, Faults
from ppafo.gait.gait import HARMONICS, KNEE, REQUIRED, Gait, fit_curve
from ppafo.signals.recording import Floats
from ppafo.wording import without_exponent

STANCE_FRACTION = (0.45, 0.85)
STRIDE_TIME = (0.5, 3.0)

# Far from 0 and nearer to the half stride at which the other foot lies.
_OTHER_FOOT = 0.3
"""Least delay between ankle and shank [strides] that shows two different feet, which are half a stride apart."""
# Limits of the correlation with a usual ankle angle [-]: least at the best shift (0.76), largest without a shift.
_ALIKE = 0.65
_UNLIKE = 0.4
_ALIKE_SHANK = 0.8
"""Least correlation with a usual shank angle without a shift [-] (0.97); a reversed sign gives less."""
SHANK_RANGE = (25.0, 120.0)
ANKLE_RANGE = (5.0, 80.0)
ANKLE_LIMITS = (40.0, 150.0)
_TURNS = 2.0
"""Least rotation of a standing foot [deg, RMS] that shows a wrong sign; recorded feet rotate by 0.5 to 1.5 deg."""
_TURNED_BACK = 0.1
"""Backward rotation of the shank over the standing foot, relative to its range [-], that shows a reversed sign.

Recorded shanks rotate forward by 0.15 to 0.25 of the range.
"""
# Limits of the mean tilt of the standing foot in mid-stance [deg] for a remark, and for an error. Recorded feet on
# level ground have 0.5 to 4.6 deg, from the sole of the shoe and the placement of markers. A standing foot is not
# tilted by more than 20 deg: this is a heel of 6 cm on a foot of 17 cm from heel to ball, walking on the toes, or a
# ramp of 1 in 3. A larger tilt shows a wrong zero.
REMARKED_TILT = 5.0
REFUSED_TILT = 20.0
CLEARLY_BETTER = 2.0
"""Factor by which the opposite sign of a curve must fit better, or give a larger value, to reject the given sign."""
MOMENT_PEAK = (0.05, 3.5)
FORCE_PEAK = (0.5, 2.5)
FORCE_MEAN = (0.25, 0.75)
USUAL_FORCE_MEAN = (0.42, 0.58)
"""Plausible mean of the vertical force [body weights]: both legs together carry 1, each half in symmetric walking."""
UNDER_FOOT = (-0.2, 0.4)
"""Plausible places of the centre of pressure in front of the ankle [m]: heel to toes of a large shoe, with room."""
LEAST_ROLL = 0.005
"""Least range of the centre of pressure in stance [m]; 0.15 to 0.25 in healthy walking, a few cm on the toes alone."""
_ON_GROUND = 0.05
"""Magnitude of the force [body weights] below which a force plate counts as unloaded."""
_AFTER_TOE_OFF = 0.03
"""Time after toe-off [strides] from which moments are checked; toe-off found from the shank has about this error."""
_LEFT_IN_SWING = 0.25
"""Largest moment in swing relative to the peak moment [-]; a swinging foot needs a few hundredths."""
_FOOT_ALONE = 0.05
"""Moment that is accepted in swing however weak the push-off [N m/kg]."""
_UNCLEAR_MOMENT = 0.5
"""Ratio of dorsiflexion to plantarflexion peak above which the sign is unclear; 0.05 to 0.2 in healthy walking."""
SHANK_LENGTHS = (0.25, 0.6)
"""Range of shank lengths [m] for the best fit, as a gait does not contain the length."""
_FITS = 0.6
"""Largest misfit to a rotation about the ankle [-, RMS] that counts as a fit; correct recordings have 0.3 to 0.46."""
_LEFT_BY_ONE = 0.62
"""Fraction of the misfit below which a correction explains it; correct knees in units of g leave 0.48 to 0.57."""
KNEE_TRAVEL = (0.5, 80.0)
"""Plausible range of the knee acceleration over a stride [m/s^2]."""
KNEE_MEAN = 1.5
"""Largest mean of the knee acceleration over a stride [m/s^2]; it is 0 for a periodic motion."""
_HELD_BACK = 0.2
"""Fraction of its range by which a knee must decelerate in the phase of usual acceleration to reject its sign [-].

A measured knee accelerates by 0.8 to 0.9 of its range.
"""


@dataclass(frozen=True, slots=True)
class MeanStride:
    """Mean stride: files and curves (101 samples, SI) by curve name, stance fraction [-] and stride time [s].

    ``is_knee_one_marker`` is True if both coordinates of the knee are from one marker, whose scales cannot differ.
    """

    file: Mapping[str, str]
    curves: Mapping[str, Floats]
    stance_share: float
    stride_time: float
    is_knee_one_marker: bool = False

    def where(self, name: str) -> str:
        """Return file and name of a curve, at the start of a refusal."""
        return f"{self.file[name]}: {name}"


def check_plausible(walk: MeanStride) -> None:
    """Raise DataError for an implausible mean stride; the message names file, curve, number and limits."""
    Faults([DataError(fault) for fault in _faults(walk)]).raise_all()


def _faults(walk: MeanStride) -> Iterator[str]:
    """Yield the faults of a stride; a wrong unit is not told again as a wrong sign."""
    yield from _outside(f"{walk.file['shank_angle']}: the stride time is {{}} s", walk.stride_time, STRIDE_TIME)
    decides = "vertical_force" if "vertical_force" in walk.curves else "shank_angle"
    share = 100.0 * walk.stance_share
    limits = (100.0 * STANCE_FRACTION[0], 100.0 * STANCE_FRACTION[1])
    said = f"{walk.file[decides]}: the foot is on the ground for {{}} % of the stride, by {decides}"
    stance = [*_outside(said, share, limits)]
    yield from stance or _of_moment_time(walk)
    shank = [*_of_shank(walk)]
    yield from shank
    turning = [] if shank else [*_of_turning_knee(walk)]
    yield from turning
    # Without the last sample, which is the first phase again.
    means = {name: float(np.mean(walk.curves[name][:-1])) for name in KNEE if name in walk.curves}
    shifted = [
        f"{walk.where(name)} has a mean of {mean:.3g} m/s^2, but must average to 0 over a stride (allowed: up to "
        f"{KNEE_MEAN:g} m/s^2; gravity is not part of it)"
        for name, mean in means.items()
        if abs(mean) > KNEE_MEAN
    ]
    yield from shifted
    for name in () if shank or turning or shifted else means:
        yield from _of_knee_curve(walk, name)
    ankle = [*range_faults(walk.where("ankle_angle"), walk.curves["ankle_angle"], ANKLE_RANGE)]
    yield from ankle or ([] if shank else _of_ankle(walk))
    yield from moment_faults(walk)
    yield from _of_loads(walk)


def _outside(said: str, number: float, limits: tuple[float, float]) -> Iterator[str]:
    """Yield what is ``said`` of a number that is outside of its plausible limits."""
    low, high = limits
    if not low <= number <= high:
        yield f"{said.format(without_exponent(number, '.3g'))} (plausible: {low:g} to {high:g})"


_FINE = np.linspace(0.0, 1.0, 1000, endpoint=False)


def check_side(walk: MeanStride, usual: Gait) -> None:
    """Raise DataError if the ankle is half a stride out of phase with its shank; ``usual`` is a healthy gait."""
    if not STANCE_FRACTION[0] <= walk.stance_share <= STANCE_FRACTION[1]:
        # Such a stride is refused by itself: its curves have no usual place.
        return
    shank, _, in_place = _lag(walk, usual, "shank_angle")
    ankle, best, own = _lag(walk, usual, "ankle_angle")
    apart = abs((ankle - shank + 0.5) % 1.0 - 0.5)
    if apart > _OTHER_FOOT and in_place > _ALIKE_SHANK and best > _ALIKE and own < _UNLIKE:
        raise DataError(
            f"{walk.where('ankle_angle')} is shifted by {100.0 * apart:.0f} % of the stride against "
            "shank_angle, so it belongs to the other foot"
        )


def _lag(walk: MeanStride, usual: Gait, name: str) -> tuple[float, float, float]:
    """Return the delay of a curve against a usual gait [strides], and the correlations with and without this delay."""
    # Stance on stance and swing on swing: a toe-off that comes early or late is no delay.
    at = np.interp(_FINE, (0.0, walk.stance_share, 1.0), (0.0, usual.stance_share, 1.0))
    smooth = fit_curve(walk.curves[name], HARMONICS[name])[0].values_at(_FINE)
    lags, expected = (values - np.mean(values) for values in (smooth, usual.curve(name).values_at(at)))
    # Correlation at all 1000 shifts at once.
    spectrum = np.fft.rfft(lags) * np.conj(np.fft.rfft(expected))
    scale = float(np.sqrt(np.sum(lags**2) * np.sum(expected**2)))
    alike = np.fft.irfft(spectrum, _FINE.size) / scale
    return float(_FINE[np.argmax(alike)]), float(np.max(alike)), float(alike[0])


MIDSTANCE = slice(15, 41)
"""Mid-stance samples [percent of the stride], in which the foot stands and the ankle rotates with the shank."""


def _of_shank(walk: MeanStride) -> Iterator[str]:
    """Yield the faults of a shank angle that no leg can have."""
    phi = np.degrees(walk.curves["shank_angle"])
    where = walk.where("shank_angle")
    # The range is free of the zero, so that a wrong unit shows before a wrong zero.
    ranges = [*range_faults(where, walk.curves["shank_angle"], SHANK_RANGE)]
    # Means of five samples at both ends: a single one may lie on a tremor.
    growth = float(np.mean(phi[MIDSTANCE][-5:]) - np.mean(phi[MIDSTANCE][:5]))
    if ranges:
        yield from ranges
    elif growth > _TURNED_BACK * float(np.ptp(phi)):
        yield (
            f"{where} increases by {growth:.2g} deg in mid-stance, so the shank would rotate backwards over the foot: "
            "its sign is reversed, or a vertical force is of the other foot"
        )
    elif float(phi[0]) < -10.0 or float(np.mean(phi)) > 10.0 or float(np.mean(phi)) < -50.0:
        yield (
            f"{where} is {phi[0]:.0f} deg at heel strike and {np.mean(phi):.0f} deg on average (plausible: above -10 "
            "deg at heel strike, and -50 to 10 deg on average; 0 is vertical, positive with the ankle in front of the "
            "knee)"
        )


def range_faults(where: str, angle: Floats, limits: tuple[float, float], is_whole: bool = False) -> Iterator[str]:
    """Yield the fault of an angle [rad] with an implausible range [deg]; a whole record has no upper limit."""
    low, high = limits
    travel = float(np.ptp(np.degrees(angle)))
    if not low <= travel <= (np.inf if is_whole else high):
        units = {"radians": np.degrees(travel), "degrees": np.radians(travel)}
        hint = "".join(f"; the numbers look like {unit}" for unit, number in units.items() if low <= number <= high)
        yield f"{where} has a range of {travel:.3g} deg (plausible in a stride: {low:g} to {high:g} deg){hint}"


def _of_ankle(walk: MeanStride) -> Iterator[str]:
    """Yield the faults of an ankle angle that is implausible together with the shank angle."""
    shank = walk.curves["shank_angle"]
    ankle = walk.curves["ankle_angle"]
    turned, reversed_turned = standing_turns(shank, ankle)
    if turned > CLEARLY_BETTER * reversed_turned and turned > _TURNS:
        yield (
            f"{walk.where('ankle_angle')} moves into plantarflexion while the shank rotates forward: the flat foot "
            f"would rotate by {turned:.2g} deg (RMS), but only by {reversed_turned:.2g} deg with the opposite sign, so "
            "the sign is reversed"
        )
        # A reversed sign turns the angle about 90 deg: the zero is wrong, too, where the foot is tilted even then.
        ankle = np.pi - ankle
    yield from _of_ankle_zero(walk, np.degrees(ankle), standing_tilt(shank, ankle))


def ankle_faults_alone(walk: MeanStride) -> Iterator[str]:
    """Yield the faults of an ankle angle, if there is one, whose range or zero is implausible beside any shank."""
    if "ankle_angle" in walk.curves:
        angle = walk.curves["ankle_angle"]
        ranges = [*range_faults(walk.where("ankle_angle"), angle, ANKLE_RANGE)]
        yield from ranges or _of_ankle_zero(walk, np.degrees(angle), 0.0)


def _of_ankle_zero(walk: MeanStride, theta: Floats, foot: float) -> Iterator[str]:
    """Yield the fault of an ankle angle ``theta`` [deg] out of its limits, or of a standing foot with a tilt [deg]."""
    low, high = ANKLE_LIMITS
    if abs(foot) > REFUSED_TILT or float(theta.min()) < low or float(theta.max()) > high:
        as_read = np.degrees(walk.curves["ankle_angle"])
        tilt = f"implies a foot tilted by {foot:.0f} deg in mid-stance (plausible: up to {REFUSED_TILT:g} deg) and "
        yield (
            f"{walk.where('ankle_angle')} {tilt if foot else ''}ranges from {as_read.min():.0f} to "
            f"{as_read.max():.0f} deg (neutral: 90 deg)"
        )


def standing_tilt(shank: Floats, ankle: Floats) -> float:
    """Return the mean tilt [deg] of the foot from 15 to 40 % of the stride, positive with the toes down.

    ``shank`` and ``ankle`` are curves [rad] of 101 samples in the signs of the package.
    """
    # On level ground the ankle is 90 deg plus the shank angle while the foot is flat.
    foot = np.degrees(ankle - shank)[MIDSTANCE] - 90.0
    return float(np.mean(foot))


def standing_turns(shank: Floats, ankle: Floats) -> tuple[float, float]:
    """Return the rotation of the foot [deg, RMS] from 15 to 40 % of the stride, as given and with the ankle reversed.

    ``shank`` and ``ankle`` are curves [rad] of 101 samples in the signs of the package. A foot flat on the ground has a
    rotation of 0.
    """
    # A flat foot stands still while the shank leans: the ankle then follows the shank, with the sign as it is or
    # reversed.
    lean = np.degrees(shank)[MIDSTANCE]
    stand = np.degrees(ankle)[MIDSTANCE]
    return float(np.std(stand - lean)), float(np.std(stand + lean))


def stride_remarks(curves: Mapping[str, Floats]) -> list[str]:
    """Return remarks on the curves of a stride, both ends included: unusual force, unclear signs, zero of the ankle."""
    remarks = []
    shank = curves["shank_angle"]
    ankle = curves["ankle_angle"]
    if "vertical_force" in curves:
        # Both ends are one phase, which must not count twice.
        mean = float(np.mean(curves["vertical_force"][:-1]))
        low, high = USUAL_FORCE_MEAN
        if not low <= mean <= high:
            remarks.append(
                f"vertical_force has a mean of {mean:.3g} body weights, but each leg of a steady walk carries about "
                f"0.5 (usual: {low:g} to {high:g})"
            )
    turned, reversed_turned = standing_turns(shank, ankle)
    if CLEARLY_BETTER * turned > reversed_turned:
        remarks.append(
            f"the sign of ankle_angle is uncertain: in mid-stance the flat foot rotates by {turned:.2g} deg (RMS), and "
            f"by {reversed_turned:.2g} deg with the opposite sign"
        )
    if "ankle_moment" in curves:
        down = float(np.max(curves["ankle_moment"]))
        up = float(-np.min(curves["ankle_moment"]))
        if up > _UNCLEAR_MOMENT * down:
            remarks.append(
                f"the sign of ankle_moment is uncertain: it peaks at {down:.2g} N m/kg in plantarflexion and {up:.2g} "
                "N m/kg in dorsiflexion"
            )
    if abs(tilt := standing_tilt(shank, ankle)) > REMARKED_TILT:
        remarks.append(
            f"the zero of ankle_angle seems to be off: the flat foot appears tilted by {abs(tilt):.1f} deg, toes "
            f"{'down' if tilt > 0.0 else 'up'} (mean from 15 to 40 % of the stride, usual on level ground: up to "
            f"{REMARKED_TILT:g} deg)"
        )
    return remarks


def gait_file_remarks(gait: Gait) -> list[str]:
    """Return remarks on sign and zero of the ankle angle of a finished gait."""
    percent = np.linspace(0.0, 1.0, 101)
    return stride_remarks({name: gait.curve(name).values_at(percent) for name in REQUIRED})


def check_force_scale(file: str, force: Floats) -> None:
    """Raise DataError for a vertical force [body weights] whose unit or sign prevents the detection of heel strikes."""
    # One contact in a long record is less than 2 % of it.
    loaded = force[np.abs(force) > _ON_GROUND]
    # Percentiles, since a single spike has no sign to judge.
    lowest, highest = np.percentile(loaded if loaded.size else force, (2.0, 98.0)).tolist()
    # A reversed sign is looked for first: its peak would be refused as too small.
    if -lowest > CLEARLY_BETTER * highest:
        raise DataError(f"{file}: vertical_force peaks at {lowest:.3g} body weights, below 0, so its sign is reversed")
    for fault in _outside(f"{file}: vertical_force reaches {{}} body weights", highest, FORCE_PEAK):
        raise DataError(fault)


def moment_faults(walk: MeanStride) -> Iterator[str]:
    """Yield the fault of an implausible ankle moment, by its sign or else by its peak."""
    if "ankle_moment" in walk.curves:
        moment = walk.curves["ankle_moment"]
        where = walk.where("ankle_moment")
        lowest = float(np.min(moment))
        peak = float(np.max(moment))
        if float(np.mean(moment)) < 0.0 and -lowest > CLEARLY_BETTER * peak:
            yield f"{where} peaks at {lowest:.3g} N m/kg, in dorsiflexion, so its sign is reversed"
        else:
            yield from _outside(f"{where} reaches {{}} N m/kg", peak, MOMENT_PEAK)


def _of_moment_time(walk: MeanStride) -> Iterator[str]:
    """Yield the fault of an ankle moment that acts while the foot is off the ground."""
    if "ankle_moment" not in walk.curves:
        return
    moment = walk.curves["ankle_moment"]
    fraction = walk.stance_share
    phase = np.linspace(0.0, 1.0, moment.size)
    peak = float(np.max(moment))
    at = float(phase[np.argmax(moment)])
    swing = float(np.max(moment[phase > fraction + _AFTER_TOE_OFF]))
    if at >= fraction or swing >= max(_LEFT_IN_SWING * peak, _FOOT_ALONE):
        where = "" if at >= fraction else f" and is {swing:.2g} N m/kg in swing"
        yield (
            f"{walk.where('ankle_moment')} peaks at {100.0 * at:.0f} % of the stride{where}, but the foot is off the "
            f"ground from {100.0 * fraction:.0f} % on: the moment is of the other foot, or has another clock"
        )


def _of_loads(walk: MeanStride) -> Iterator[str]:
    """Yield the faults of a vertical force, and of a centre of pressure that no foot can have."""
    if "vertical_force" in walk.curves:
        force = walk.curves["vertical_force"]
        where = walk.where("vertical_force")
        yield from _outside(f"{where} has a mean of {{}} body weights", float(np.mean(force)), FORCE_MEAN)
        yield from _outside(f"{where} has a peak of {{}} body weights", float(np.max(force)), FORCE_PEAK)
    if "centre_of_pressure" in walk.curves:
        place = walk.curves["centre_of_pressure"]
        low, high = UNDER_FOOT
        back = float(np.min(place))
        front = float(np.max(place))
        if back < low or front > high or front - back < LEAST_ROLL:
            yield (
                f"{walk.where('centre_of_pressure')} is {back:.3g} to {front:.3g} m in front of the ankle (plausible: "
                f"within {low:g} to {high:g} m, and over {LEAST_ROLL:g} m or more)"
            )


FOOT_FLAT = slice(15, 43)
"""Samples [percent of the stride] in which the foot stands flat."""

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


def turning_about_ankle(shank: Floats, stride_time: float) -> Floats:
    """Return the acceleration (2 x samples: forward, up) of a knee above a resting ankle, per shank length [1/s^2].

    ``shank`` is phi [rad] at 101 phases; relative to the knee the ankle is at (L sin phi, -L cos phi).
    """
    curve, _ = fit_curve(shank, HARMONICS["shank_angle"])
    percent = np.linspace(0.0, 1.0, shank.size)[FOOT_FLAT]
    rates = curve.derivative(stride_time)
    phi, rate, acceleration = (series.values_at(percent) for series in (curve, rates, rates.derivative(stride_time)))
    sine = np.sin(phi)
    cosine = np.cos(phi)
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


_PARTS = {"knee_forward": ((-0.3, 0.0), (0.3, 0.6)), "knee_up": ((0.0, 0.3), (0.4, 0.7))}
"""Intervals about toe-off [fractions of the swing] of acceleration (forward, up) and of deceleration."""


def _of_turning_knee(walk: MeanStride) -> Iterator[str]:
    """Yield the fault of a knee that does not rotate about the resting ankle, or that has one acceleration alone."""
    there = [name for name in KNEE if name in walk.curves]
    if len(there) == 1:
        (missing,) = set(KNEE) - set(there)
        yield f"{walk.where(there[0])} needs {missing}; give both or neither"
    if len(there) < len(KNEE):
        return
    expected = turning_about_ankle(walk.curves["shank_angle"], walk.stride_time)
    # Over a stride that repeats the mean is 0; gravity in it is refused elsewhere and must not hide a unit here.
    turned = np.stack([walk.curves[name] - np.mean(walk.curves[name][:-1]) for name in KNEE])[:, FOOT_FLAT]
    missed = _misfit(turned, expected)
    for remedy, factors in _CORRECTIONS.items():
        is_of_one_alone = factors[0][1] == factors[1][0] == 0.0 and factors[0][0] != factors[1][1]
        left = _misfit(np.array(factors) @ turned, expected)
        if left < min(_FITS, _LEFT_BY_ONE * missed) and not (walk.is_knee_one_marker and is_of_one_alone):
            yield (
                f"{walk.where('knee_forward')} and knee_up differ by {100.0 * missed:.0f} % "
                f"({100.0 * left:.0f} % if corrected) from a rotation of the knee about the resting ankle while the "
                f"foot is flat; {remedy}"
            )
            return


def _of_knee_curve(walk: MeanStride, name: str) -> Iterator[str]:
    """Yield the fault of a knee acceleration by its range or else by its sign, which shows in the swing."""
    values = walk.curves[name]
    where = walk.where(name)
    travel = float(np.ptp(values))
    ranges = [*_outside(f"{where} has a range of {{}} m/s^2 per stride", travel, KNEE_TRAVEL)]
    yield from ranges
    # Gait phase of the swing, below 0 before toe-off.
    swung = (np.linspace(0.0, 1.0, values.size) - walk.stance_share) / (1.0 - walk.stance_share)
    driven, held = (float(np.mean(values[(swung >= start) & (swung <= end)])) for start, end in _PARTS[name])
    if not ranges and held - driven > _HELD_BACK * travel:
        yield (
            f"{where} is {driven:.3g} m/s^2 around toe-off and {held:.3g} m/s^2 in mid-swing, while walking has the "
            "opposite pattern: the sign is reversed, or the data are of the other knee"
        )
