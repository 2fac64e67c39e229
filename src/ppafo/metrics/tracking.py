"""How well the torque follows its reference."""

import numpy as np

from ppafo.metrics.metric import MetricKind
from ppafo.metrics.phases import hold, ramp
from ppafo.signals import Recording

_NEEDED = ("torque", "reference")


def rms_error(recording: Recording) -> float:
    """Root of the time average of (reference - torque)^2 [N m], by the trapezoidal rule: any sampling will do."""
    error = recording["reference"] - recording["torque"]
    return float(np.sqrt(np.trapezoid(error**2, recording.time) / recording.duration))


def rms_error_ramp(recording: Recording) -> float | None:
    """``rms_error`` [N m] until the reference reaches the level it keeps."""
    part = ramp(recording)
    return None if part is None else rms_error(part)


def rms_error_hold(recording: Recording) -> float | None:
    """``rms_error`` [N m] from where the reference stays at its final level."""
    part = hold(recording)
    return None if part is None else rms_error(part)


def peak_error(recording: Recording) -> float:
    """Largest absolute difference of reference and torque [N m]."""
    return float(np.max(np.abs(recording["reference"] - recording["torque"])))


METRICS = (
    MetricKind("rms_error", "N m", "root-mean-square torque error", _NEEDED, rms_error),
    MetricKind("rms_error_ramp", "N m", "root-mean-square torque error on the ramp", _NEEDED, rms_error_ramp),
    MetricKind("rms_error_hold", "N m", "root-mean-square torque error on the hold", _NEEDED, rms_error_hold),
    MetricKind("peak_error", "N m", "largest torque error, either sign", _NEEDED, peak_error),
)
