"""Sensors of the simulated bench: lag, gain, offset, noise and quantisation by channel, from a random seed."""

import numpy as np

from ppafo.model.sensors import follow, quantise
from ppafo.rig.preset import Preset
from ppafo.signals.recording import Floats

SENSORS = {
    "angle": "angle_sensor",
    "pressure_1": "pressure_sensor",
    "pressure_2": "pressure_sensor",
    "supply_pressure": "pressure_sensor",
    "pressure_difference": "pressure_sensor",
    "upstream_pressure": "pressure_sensor",
    "downstream_pressure": "pressure_sensor",
    "torque": "torque_sensor",
    "mass_flow": "flow_sensor",
    "friction": "",
    "dorsiflexion_pressure": "pressure_sensor",
}
"""Sensor by channel; ``friction`` has no sensor, only a random stream.

The order determines the streams: a new channel must come last, so that the other streams do not change.
"""


def random_stream(seed: int, channel: str, *more: int) -> np.random.Generator:
    """Return a random generator of a channel, separate so that an additional channel changes no other channel."""
    # By its position, not its name: renaming a channel leaves its noise.
    sequence = np.random.SeedSequence([seed, list(SENSORS).index(channel), *more])
    return np.random.Generator(np.random.PCG64(sequence))


def read_off(
    preset: Preset,
    channel: str,
    seed: int,
    true: Floats,
    *,
    interval: float = 0.0,
    turn: float = 0.0,
    meter_range: float = 1.0,
) -> tuple[Floats, dict[str, float]]:
    """Return readings of true values [SI] by the sensor of a channel, and its offset [SI] and gain error [-].

    Arguments:
        interval: sample interval [s]; 0 for readings of steady states, which no lag changes
        turn: value [SI] that a gain error leaves as it is, the atmosphere for a gauge sensor
        meter_range: range relative to that of the preset's sensor [-], which scales offset, noise and resolution
    """
    names = ("gain", "lag", "offset", "noise", "resolution")
    gain, lag, offset, noise, resolution = (preset.values[f"{SENSORS[channel]}.{name}"] for name in names)
    stream = random_stream(seed, channel)
    # The offset comes first, so that a longer recording begins with the same noise.
    offset *= meter_range * float(stream.standard_normal())
    gain *= float(random_stream(seed, channel, 1).standard_normal())
    shown = np.array(true)
    for sample in range(1, shown.size if lag > 0.0 and interval > 0.0 else 0):
        shown[sample] = follow(
            1.0 / lag, interval, float(shown[sample - 1]), float(true[sample - 1]), float(true[sample])
        )
    shown += gain * (shown - turn) + offset + meter_range * noise * stream.standard_normal(true.size)
    readings = [quantise(float(value), meter_range * resolution) for value in shown]
    return np.array(readings), {"offset": offset, "gain": gain}
