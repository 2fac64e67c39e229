"""Sensors of the simulated bench: noise, offset and quantisation by channel, from a random seed.

The bandwidth of sensors is integrated with the rig. Every channel has a separate stream of random numbers, so that an
additional channel changes no other channel.
"""

from dataclasses import dataclass

import numpy as np

from ppafo.model.sensors import quantise
from ppafo.rig.preset import Preset
from ppafo.signals.recording import Floats

CHANNEL_SENSORS = {
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

# By its position, not its name: renaming a channel leaves its noise.
_STREAMS = {name: number for number, name in enumerate(CHANNEL_SENSORS)}
"""Index of the random stream of each channel."""


@dataclass(frozen=True, slots=True)
class SimulatedSensor:
    """Simulated sensor of a run: offset, quantisation step, and noise of every sample [SI]."""

    offset: float
    resolution: float
    noise: Floats

    def reads(self, true: float, sample: int) -> float:
        """Return the reading [SI] for a true value [SI] at a sample, whose index selects the noise."""
        return quantise(true + self.offset + float(self.noise[sample]), self.resolution)

    def readings(self, true: Floats) -> Floats:
        """Return readings of a series of true values [SI], starting at sample 0."""
        return np.array([self.reads(float(value), sample) for sample, value in enumerate(true)])


def random_stream(seed: int, channel: str) -> np.random.Generator:
    """Return the random generator of a channel."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, _STREAMS[channel]])))


def sensor(preset: Preset, channel: str, seed: int, samples: int, fraction_of_range: float = 1.0) -> SimulatedSensor:
    """Create the simulated sensor of a channel, with noise for a number of samples.

    ``fraction_of_range`` [-] scales offset, noise and quantisation step for a sensor of smaller range.
    """
    numbers = preset.section(CHANNEL_SENSORS[channel])
    offset, noise, resolution = (fraction_of_range * numbers[name] for name in ("offset", "noise", "resolution"))
    stream = random_stream(seed, channel)
    # The offset comes first, so that a longer recording begins with the same noise.
    drawn = offset * float(stream.standard_normal())
    return SimulatedSensor(drawn, resolution, noise * stream.standard_normal(samples))
