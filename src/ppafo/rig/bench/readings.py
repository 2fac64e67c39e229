"""Readings of a steady bench as a recording: true values in, what the instruments show out."""

from collections.abc import Mapping

import numpy as np

from ppafo.parameters.device import Device
from ppafo.rig.request import Outcome, Request
from ppafo.rig.sensors import CHANNEL_SENSORS, Floats, sensor
from ppafo.signals.channels import CHANNELS
from ppafo.signals.recording import Channel, Recording


def read_off(
    name: str,
    request: Request,
    device: Device,
    interval: float,
    true: Mapping[str, Floats],
    settings: Mapping[str, float],
    fraction_of_flow_range: float = 1.0,
) -> Outcome:
    """Return a reading every ``interval`` [s] of true values by channel [SI]; what no sensor reads is exact."""
    count = len(next(iter(true.values())))
    fractions = {"mass_flow": fraction_of_flow_range}
    sensors = {
        channel: sensor(request.preset, channel, request.seed, count, fractions.get(channel, 1.0))
        for channel in true
        if channel in CHANNEL_SENSORS
    }
    channels = {
        channel: Channel(sensors[channel].readings(values) if channel in sensors else values, CHANNELS[channel].unit)
        for channel, values in true.items()
    }
    recording = Recording(name, np.arange(count, dtype=np.float64) * interval, channels, kind="synthetic")
    offsets = {channel: item.offset for channel, item in sensors.items()}
    return Outcome(recording, device, offsets, {"reading_interval": interval, **settings})
