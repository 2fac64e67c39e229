"""Plausibility of a stride: limits wide enough for impaired walking that exclude impossible values.

Each error names file, curve, number and limits. A sign is rejected only if the opposite sign fits clearly better,
because impaired walking often breaks the rules of healthy walking slightly.
"""

from functools import partial

import numpy as np

from ppafo.errors import DataError, check_all
from ppafo.gait.gait import HARMONICS, Gait, fit_curve
from ppafo.gait.plausible_angles import CLEARLY_BETTER, MeanStride, check_ankle, check_ankle_range, check_shank
from ppafo.gait.plausible_knee import check_knee, check_knee_means
from ppafo.signals.recording import Floats
from ppafo.wording import without_exponent

STANCE_FRACTION = (0.45, 0.85)
STRIDE_TIME = (0.5, 3.0)


def check_gait(gait: Gait, file: str) -> None:
    """Raise DataError for a gait file with an implausible stride, by the checks of ``check_plausible``."""
    percent = np.linspace(0.0, 1.0, 101)
    curves = {name: curve.values_at(percent) for name, curve in gait.curves.items()}
    check_plausible(MeanStride(dict.fromkeys(curves, file), curves, gait.stance_share, gait.stride_time))


def check_plausible(walk: MeanStride) -> None:
    """Raise DataError for an implausible mean stride; the message names file, curve, number and limits."""
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
    """Raise DataError for a stride time that is implausible for walking."""
    low, high = STRIDE_TIME
    if not low <= walk.stride_time <= high:
        raise DataError(
            f"{walk.file['shank_angle']}: the stride time is {walk.stride_time:.3g} s (plausible: {low:g} to "
            f"{high:g} s)"
        )


def check_stance(walk: MeanStride) -> None:
    """Raise DataError for a stance fraction that is implausible for walking."""
    low, high = STANCE_FRACTION
    if not low <= walk.stance_share <= high:
        decides = "vertical_force" if "vertical_force" in walk.curves else "shank_angle"
        raise DataError(
            f"{walk.file[decides]}: the foot is on the ground for {100.0 * walk.stance_share:.0f} % of the stride, by "
            f"{decides} (plausible: {100.0 * low:.0f} to {100.0 * high:.0f} %)"
        )


# Far from 0 and nearer to the half stride at which the other foot lies.
_OTHER_FOOT = 0.3
"""Least delay between ankle and shank [strides] that shows two different feet, which are half a stride apart."""
_ALIKE, _UNLIKE = 0.65, 0.4
"""Limits of the correlation with a usual ankle angle [-]: least at the best shift (0.76), largest without a shift."""
_ALIKE_SHANK = 0.8
"""Least correlation with a usual shank angle without a shift [-] (0.97); a reversed sign gives less."""
_FINE = np.linspace(0.0, 1.0, 1000, endpoint=False)


def check_side(walk: MeanStride, usual: Gait) -> None:
    """Raise DataError if the ankle is half a stride out of phase with its shank; ``usual`` is a healthy gait."""
    if not STANCE_FRACTION[0] <= walk.stance_share <= STANCE_FRACTION[1]:
        # Nothing has a place in such a stride, which is refused by itself.
        return
    shank, _, in_place = _lag(walk, usual, "shank_angle")
    ankle, best, own = _lag(walk, usual, "ankle_angle")
    apart = abs((ankle - shank + 0.5) % 1.0 - 0.5)
    if apart > _OTHER_FOOT and in_place > _ALIKE_SHANK and best > _ALIKE and own < _UNLIKE:
        raise DataError(
            f"{walk.file['ankle_angle']}: ankle_angle is shifted by {100.0 * apart:.0f} % of the stride against "
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


MOMENT_PEAK = (0.05, 3.5)
FORCE_PEAK = (0.5, 2.5)
FORCE_MEAN = (0.25, 0.75)
USUAL_FORCE_MEAN = (0.42, 0.58)
"""Plausible mean of the vertical force [body weights]: both legs together carry 1, each half in symmetric walking."""

_ON_GROUND = 0.05
"""Magnitude of the force [body weights] below which a force plate counts as unloaded."""
_AFTER_TOE_OFF = 0.03
"""Time after toe-off [strides] from which moments are checked; toe-off found from the shank has about this error."""
_LEFT_IN_SWING = 0.25
"""Largest moment in swing relative to the peak moment [-]; a swinging foot needs a few hundredths."""
_FOOT_ALONE = 0.05
"""Moment that is accepted in swing however weak the push-off [N m/kg]."""


def check_force_scale(file: str, force: Floats) -> None:
    """Raise DataError for a vertical force [body weights] whose unit or sign prevents the detection of heel strikes."""
    # One contact in a long record is less than 2 % of it.
    loaded = force[np.abs(force) > _ON_GROUND]
    # Percentiles, since a single spike has no sign to judge.
    lowest, highest = np.percentile(loaded if loaded.size else force, (2.0, 98.0)).tolist()
    # A reversed sign is looked for first: its peak would be refused as too small.
    low, high = FORCE_PEAK
    if -lowest > CLEARLY_BETTER * highest:
        raise DataError(f"{file}: vertical_force peaks at {lowest:.3g} body weights, below 0, so its sign is reversed")
    if not low <= highest <= high:
        raise DataError(f"{file}: vertical_force reaches {highest:.3g} body weights (plausible: {low:g} to {high:g})")


def check_moment(walk: MeanStride) -> None:
    """Raise DataError for an implausible ankle moment; a stride without a moment passes."""
    if "ankle_moment" not in walk.curves:
        return
    moment = walk.curves["ankle_moment"]
    where = f"{walk.file['ankle_moment']}: ankle_moment"
    if float(np.mean(moment)) < 0.0 and float(-np.min(moment)) > CLEARLY_BETTER * float(np.max(moment)):
        raise DataError(f"{where} peaks at {np.min(moment):.3g} N m/kg, in dorsiflexion, so its sign is reversed")
    peak, (low, high) = float(np.max(moment)), MOMENT_PEAK
    if not low <= peak <= high:
        raise DataError(
            f"{where} reaches {without_exponent(peak, '.3g')} N m/kg (plausible: {low:g} to {high:g} N m/kg)"
        )


_UNCLEAR_MOMENT = 0.5
"""Ratio of dorsiflexion to plantarflexion peak above which the sign is unclear; 0.05 to 0.2 in healthy walking."""


def moment_remarks(moment: Floats) -> list[str]:
    """Return a remark on an ankle moment [N m/kg] whose sign cannot be verified from its curve."""
    down, up = float(np.max(moment)), float(-np.min(moment))
    if up <= _UNCLEAR_MOMENT * down:
        return []
    return [
        f"the sign of ankle_moment is uncertain: it peaks at {down:.2g} N m/kg in plantarflexion and {up:.2g} N m/kg "
        "in dorsiflexion"
    ]


def check_moment_time(walk: MeanStride) -> None:
    """Raise DataError for an ankle moment that acts while the foot is off the ground; skipped without a moment."""
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
        f"from {100.0 * fraction:.0f} % on: the moment is of the other foot, or has another clock"
    )


def check_force(walk: MeanStride) -> None:
    """Raise DataError for a vertical force that is implausible for walking; a stride without a force passes."""
    if "vertical_force" not in walk.curves:
        return
    force = walk.curves["vertical_force"]
    where = f"{walk.file['vertical_force']}: vertical_force"
    peak, mean = float(np.max(force)), float(np.mean(force))
    if not FORCE_PEAK[0] <= peak <= FORCE_PEAK[1] or not FORCE_MEAN[0] <= mean <= FORCE_MEAN[1]:
        raise DataError(
            f"{where} has a mean of {mean:.3g} body weights (plausible: {FORCE_MEAN[0]:g} to {FORCE_MEAN[1]:g}) and a "
            f"peak of {peak:.3g} (plausible: {FORCE_PEAK[0]:g} to {FORCE_PEAK[1]:g})"
        )


def force_remarks(force: Floats) -> list[str]:
    """Return a remark on an unusual mean vertical force [body weights] over a stride; ``force`` includes both ends."""
    # Both ends are one phase, which must not count twice.
    mean, (low, high) = float(np.mean(force[:-1])), USUAL_FORCE_MEAN
    if low <= mean <= high:
        return []
    return [
        f"vertical_force has a mean of {mean:.3g} body weights, but each leg of a steady walk carries about 0.5 "
        f"(usual: {low:g} to {high:g})"
    ]
