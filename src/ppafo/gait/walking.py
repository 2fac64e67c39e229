"""A gait repeated: the recording of a wearer whose strides are all equal."""

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.gait import CURVES, Gait
from ppafo.signals import Channel, Recording

_RATE = 200.0
_MAXIMUM_STRIDES = 100_000


def walk_recording(gait: Gait, strides: int, rate: float = _RATE) -> Recording:
    """Return a number of equal strides, sampled at about ``rate`` [Hz], marked synthetic; SI units, package signs.

    DataError for a number that is not plausible.
    """
    if not 1 <= strides <= _MAXIMUM_STRIDES:
        raise DataError(f"the number of strides must be from 1 to {_MAXIMUM_STRIDES}, not {strides}")
    per_stride = max(10, round(rate * gait.stride_time))
    phase = np.arange(strides * per_stride + 1) / per_stride
    one = np.arange(per_stride) / per_stride
    channels = {
        name: Channel(np.append(np.tile(curve.values_at(one), strides), curve.value(0.0)), CURVES[name])
        for name, curve in gait.curves.items()
    }
    return Recording(f"{gait.name}, {strides} equal strides", phase * gait.stride_time, channels, "synthetic")
