"""Plausibility checks between the curves of one stride: delay, side (left or right foot) and scale.

Healthy walking relates the curves to each other. Just after toe-off the ankle has its peak plantarflexion, followed by
the rearmost position of the shank; ankle moment and vertical force end the push-off at the same time. While the foot is
flat, the ankle rotates with the shank. The largest push-off moment is the force times the length of the forefoot. An
impaired gait may differ in each of these relations, so an unusual curve causes a remark, not an error. An ankle that
fits better half a stride later, however, belongs to the other foot.

Numbers in brackets are the ranges of 13 recorded strides: 11 of one walker overground and both legs of another walker
on a treadmill.
"""

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import DataError
from ppafo.gait.gait import HARMONICS, Gait, fit_curve
from ppafo.gait.mean_stride import MeanStride
from ppafo.gait.plausible import STANCE_FRACTION, force_remarks
from ppafo.gait.plausible_angles import MIDSTANCE
from ppafo.signals.recording import Floats
from ppafo.wording import without_exponent

LARGEST_DELAY = 0.03
"""Largest plausible delay [s] of a curve relative to its usual time (at most 0.016 in the recorded strides)."""

_USUALLY = {"shank_angle": 0.052, "ankle_angle": 0.041, "ankle_moment": -0.002}
"""Usual delays [strides]: rearmost shank and peak plantarflexion after toe-off, end of moment after end of force."""
_ABOUT_TOE_OFF = (-0.16, 0.22)
"""Interval around toe-off [strides] in which peak plantarflexion and rearmost shank are searched."""
_PUSH_OFF_FROM = 0.35
"""Phase [strides] from which the push-off peak of a load is searched."""
_FORCE_ENDS = -0.06
"""Usual time of half the push-off peak of the force after toe-off [strides]; used without a measured force."""

# Far from 0 and nearer to the half stride at which the other foot lies.
_OTHER_FOOT = 0.3
"""Least delay between ankle and shank [strides] that shows two different feet, which are half a stride apart."""
_ALIKE, _UNLIKE = 0.65, 0.4
"""Limits of the correlation with a usual ankle angle [-]: least at the best shift (0.76), largest without a shift."""
_ALIKE_SHANK = 0.8
"""Least correlation with a usual shank angle without a shift [-] (0.97); a reversed sign gives less."""

USUAL_LEVER = (0.1, 0.21)
"""Plausible lever of the vertical force about the ankle at the largest push-off moment [m] (0.140 to 0.154)."""
USUAL_MOMENT = (0.9, 2.2)
"""Plausible largest ankle moment [N m/kg] (1.4 to 1.8), checked if no force gives the lever."""
USUAL_SHANK = (48.0, 105.0)
"""Plausible range of the shank angle in a stride [deg] (72 to 81)."""
USUAL_ANKLE = (18.0, 45.0)
"""Plausible range of the ankle angle in a stride [deg] (25 to 33)."""
USUAL_FOLLOWING = (0.35, 1.4)
"""Plausible ratio of ankle rotation to shank rotation while the foot stands [-] (0.38 to 1.07)."""
_RESTS = 0.2
"""Ratio of ankle rotation to shank rotation [-] below which the scale of the ankle cannot be checked."""

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
            "shank_angle, so it belongs to the other foot; give ankle and shank of the same side"
        )


def _lag(walk: MeanStride, usual: Gait, name: str) -> tuple[float, float, float]:
    """Return the delay of a curve against a usual gait [strides], and the correlations with and without this delay."""
    # Stance on stance and swing on swing: a toe-off that comes early or late is no delay.
    at = np.interp(_FINE, (0.0, walk.stance_share, 1.0), (0.0, usual.stance_share, 1.0))
    lags, expected = (
        values - np.mean(values) for values in (_smooth(walk.curves[name], name), usual.curve(name).values_at(at))
    )
    # Correlation at all 1000 shifts at once.
    spectrum = np.fft.rfft(lags) * np.conj(np.fft.rfft(expected))
    scale = float(np.sqrt(np.sum(lags**2) * np.sum(expected**2)))
    alike = np.fft.irfft(spectrum, _FINE.size) / scale
    return float(_FINE[np.argmax(alike)]), float(np.max(alike)), float(alike[0])


def _smooth(values: Floats, name: str) -> Floats:
    """Return a curve of 101 samples, smoothed by its Fourier series, at 1000 phases."""
    return fit_curve(values, HARMONICS[name])[0].values_at(_FINE)


def delay_remarks(walk: MeanStride) -> list[str]:
    """Return remarks on curves of a mean stride that are delayed relative to the force or, without force, to the shank.

    Curves from the same file as the reference share its clock, so they get no remark.
    """
    share = walk.stance_share
    # Of the shank the largest lean backwards, which is its minimum.
    shank = _peak(-_smooth(walk.curves["shank_angle"], "shank_angle"), share) - _USUALLY["shank_angle"]
    ankle = _peak(_smooth(walk.curves["ankle_angle"], "ankle_angle"), share) - _USUALLY["ankle_angle"]
    has_force = "vertical_force" in walk.curves
    delays_by_curve = {"shank_angle": shank, "ankle_angle": ankle} if has_force else {"ankle_angle": ankle - shank}
    if "ankle_moment" in walk.curves:
        moment = _end(_smooth(walk.curves["ankle_moment"], "ankle_moment")) - _USUALLY["ankle_moment"]
        force = _end(_smooth(walk.curves["vertical_force"], "vertical_force")) if has_force else share + _FORCE_ENDS
        delays_by_curve["ankle_moment"] = moment - force - (0.0 if has_force else shank)
    other = "vertical_force" if has_force else "shank_angle"
    seconds = {name: walk.stride_time * strides for name, strides in delays_by_curve.items()}
    late = {name: delay for name, delay in seconds.items() if abs(delay) > LARGEST_DELAY}
    late = {name: delay for name, delay in late.items() if walk.file[name] != walk.file[other]}
    # Curves that are late by the same time are on one other clock, and are named together.
    together = max(late.values(), default=0.0) - min(late.values(), default=0.0) < LARGEST_DELAY
    groups = [tuple(late)] if late and together else [(name,) for name in late]
    remarks = []
    for names in groups:
        delay, which = float(np.mean([late[name] for name in names])), " and ".join(names)
        timing = "late" if delay > 0.0 else "early"
        remarks.append(
            f"{which}: about {1000.0 * abs(delay):.0f} ms {timing} relative to {other}, compared with healthy walking; "
            f"check clocks and filters, or add {-delay:+.3f} s to the times of {which}"
        )
    return remarks


def _peak(values: Floats, share: float) -> float:
    """Return the time from toe-off to the largest of 1000 values near toe-off [strides]."""
    # Phases are periodic: counted from toe-off, from the lower limit on.
    low, high = _ABOUT_TOE_OFF
    after = (_FINE - share - low) % 1.0 + low
    return float(after[np.argmax(np.where(after < high, values, -np.inf))])


def _end(values: Floats) -> float:
    """Return the phase at which a load falls below half of its push-off peak [strides], or 1 if it does not."""
    first = int(np.argmax(np.where(_FINE > _PUSH_OFF_FROM, values, -np.inf)))
    fallen = np.flatnonzero(values[first:] < 0.5 * values[first])
    return float(_FINE[first + fallen[0]]) if fallen.size else 1.0


def size_remarks(walk: MeanStride) -> list[str]:
    """Return remarks on curves whose size does not match the other curves of the mean stride, with the numbers."""
    remarks = []
    for name, usual in (("shank_angle", USUAL_SHANK), ("ankle_angle", USUAL_ANKLE)):
        turns = float(np.ptp(np.degrees(walk.curves[name])))
        if not usual[0] <= turns <= usual[1]:
            remarks.append(
                f"{name} has a range of {turns:.0f} deg per stride (usual: {usual[0]:g} to {usual[1]:g} deg); "
                "check the scale"
            )
    # The turn of the ankle for each turn of the shank while the foot stands; 1 for a foot that rests.
    shank, ankle = (walk.curves[name][MIDSTANCE] for name in ("shank_angle", "ankle_angle"))
    lean = shank - np.mean(shank)
    follows, (low, high) = float(np.sum(lean * ankle) / np.sum(lean**2)), USUAL_FOLLOWING
    if follows > high or _RESTS < follows < low:
        remarks.append(
            f"while the foot is flat, ankle_angle changes {follows:.2g} times as much as shank_angle (usual: {low:g} "
            f"to {high:g}); check the scale of both"
        )
    if "ankle_moment" not in walk.curves:
        return remarks
    moment, why = walk.curves["ankle_moment"], "check the scale: N m/kg is per body mass, not per stature or weight"
    peak, force = float(np.max(moment)), walk.curves.get("vertical_force")
    # The lever of the vertical force about the ankle, unless the scale of the force is in doubt itself.
    arm = None
    if force is not None and not force_remarks(force):
        arm = peak / (STANDARD_GRAVITY * float(force[np.argmax(moment)]))
    if arm is not None and not USUAL_LEVER[0] <= arm <= USUAL_LEVER[1]:
        remarks.append(
            f"ankle_moment reaches {without_exponent(peak, '.3g')} N m/kg, which gives the vertical force a lever arm "
            f"of {100.0 * arm:.0f} cm about the ankle (usual: {100.0 * USUAL_LEVER[0]:.0f} to "
            f"{100.0 * USUAL_LEVER[1]:.0f} cm); {why}"
        )
    elif arm is None and peak > 0.0 and not USUAL_MOMENT[0] <= peak <= USUAL_MOMENT[1]:
        remarks.append(
            f"ankle_moment reaches {without_exponent(peak, '.3g')} N m/kg (usual: {USUAL_MOMENT[0]:g} to "
            f"{USUAL_MOMENT[1]:g} N m/kg); {why}"
        )
    return remarks
