"""Remarks on an imported gait: strides, signs and sizes of the curves, sampling, zero of the ankle, and scatter."""

import math
from collections.abc import Mapping

import numpy as np

from ppafo.gait.gait import FitError
from ppafo.gait.mean_stride import MeanStride
from ppafo.gait.plausible import force_remarks, moment_remarks
from ppafo.gait.plausible_angles import sign_remarks, standing_tilt, zero_remarks
from ppafo.gait.recorded.curves import CurveStatistics, scatter_remarks
from ppafo.gait.recorded.footfalls import FORCE, SHANK
from ppafo.gait.recorded.knee import knee_remarks
from ppafo.gait.recorded.mapping import setting_text
from ppafo.gait.recorded.signal import Signal
from ppafo.gait.recorded.source import GaitSource
from ppafo.gait.recorded.strides import StrideSelection


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
        *zero_remarks(tilt, correction),
        *scatter_remarks(curves, errors),
    ]
