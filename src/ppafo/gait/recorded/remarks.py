"""Remarks on an imported gait: strides, signs and sizes of the curves, sampling, zero of the ankle, and scatter."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ppafo.gait.agreement import delay_remarks, size_remarks
from ppafo.gait.gait import FitError
from ppafo.gait.mean_stride import MeanStride
from ppafo.gait.plausible import force_remarks, moment_remarks
from ppafo.gait.plausible_angles import sign_remarks, standing_tilt, zero_remarks
from ppafo.gait.plausible_knee import turning_remarks
from ppafo.gait.recorded.curves import CurveStatistics, scatter_remarks
from ppafo.gait.recorded.footfalls import FORCE, SHANK, Stride
from ppafo.gait.recorded.knee import knee_remarks
from ppafo.gait.recorded.mapping import setting_text
from ppafo.gait.recorded.signal import Signal
from ppafo.gait.recorded.source import GaitSource
from ppafo.gait.recorded.strides import StrideSelection

_COARSE_RATE = 50.0
"""Sampling rate [Hz] below which the error of an event exceeds a hundredth of a stride."""
_NOISY_FORCE = 0.02
"""Standard deviation of the force in swing [body weights] for a remark; events are at 0.05 and 0.03."""
_WITHIN_SWING = 0.1
"""Fraction of the swing at both ends in which the foot may still touch the plate."""


def import_remarks(
    source: GaitSource,
    events: str,
    walk: Mapping[str, Signal],
    curves: Mapping[str, CurveStatistics],
    errors: Mapping[str, FitError],
    strides: StrideSelection,
    mean_stride: MeanStride,
) -> list[str]:
    """Return the remarks on the mean stride of an import, for the user.

    ``events`` is the source of the strides; ``walk``, ``curves`` and ``errors`` are signals, curves over the strides
    and errors of the Fourier series by curve.
    """
    means, settings = mean_stride.curves, source.settings
    left_out = [f"stride from {each.start:.4g} to {each.end:.4g} s left out: {why}" for each, why in strides.left_out]
    count, covered = len(strides.taken), {name: len(curve.strides) for name, curve in curves.items()}
    partly_covered = [f"{name} covers {own} of {count} strides" for name, own in covered.items() if own < count]
    less = ": heel strikes and toe-offs are from shank_angle and less exact" if events == SHANK else ""
    no_force = f"no vertical force{less}; name its column in a gait map ({setting_text('columns')}) if there is one"
    tilt = standing_tilt(means["shank_angle"], means["ankle_angle"])
    # Reading of the file with the foot perpendicular to the shank in standing.
    sign, neutral = source.columns.ankle_angle.sign_and_neutral()
    standing = float(np.degrees(neutral)) + sign * tilt
    correction = f"give {setting_text('ankle_neutral', math.radians(standing), f'{standing:.1f} deg')}"
    return [
        *left_out,
        *partly_covered,
        *(force_remarks(means[FORCE]) if FORCE in means else [no_force]),
        *knee_remarks(source.columns.knee, walk, settings.stature),
        *sign_remarks(means["shank_angle"], means["ankle_angle"]),
        *(moment_remarks(means["ankle_moment"]) if "ankle_moment" in means else []),
        *turning_remarks(mean_stride),
        *delay_remarks(mean_stride),
        *size_remarks(mean_stride),
        *_sampling_remarks(walk, strides.taken),
        *zero_remarks(tilt, correction),
        *scatter_remarks(curves, errors),
    ]


def _sampling_remarks(walk: Mapping[str, Signal], strides: Sequence[Stride]) -> list[str]:
    """Return remarks on curves with few samples, and on noise of the force while the foot is in the air."""
    rates: dict[int, list[str]] = {}
    for name, signal in walk.items():
        if signal.rate < _COARSE_RATE:
            rates.setdefault(round(signal.rate), []).append(name)
    remarks = [
        f"{', '.join(names)}: sampled at {rate} Hz; heel strikes and toe-offs are accurate to about "
        f"{500.0 / rate:.0f} ms"
        for rate, names in rates.items()
    ]
    force = walk.get(FORCE)
    if force is None:
        return remarks
    spans = [(stride.toe_off, stride.end, _WITHIN_SWING * (stride.end - stride.toe_off)) for stride in strides]
    # Only the middle of the swing: at its ends the foot may still be on the plate.
    swings = [force.values[(force.time > off + slack) & (force.time < end - slack)] for off, end, slack in spans]
    scatter = max((float(np.std(values)) for values in swings if values.size > 1), default=0.0)
    if scatter > _NOISY_FORCE:
        remarks.append(
            f"vertical_force has noise of {scatter:.2g} body weights in swing, close to the thresholds of heel strike "
            "and toe-off, 0.05 and 0.03; filter the force in the file for reliable events"
        )
    return remarks
