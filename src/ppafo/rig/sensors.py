"""Sensors of the rig: bandwidth is integrated with the rig; noise, offset and quantisation come here, from a seed.

Every channel has a stream of random numbers of its own, so that one more channel changes none of the others.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.model.sensors import quantise
from ppafo.rig.preset import Preset

Floats = NDArray[np.float64]

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
"""Sensor of each channel; ``friction`` is no sensor but has a stream of random numbers too.

The order decides the streams: a new channel comes last, so that the numbers of the others stay.
"""

_STREAMS = {name: number for number, name in enumerate(CHANNEL_SENSORS)}


@dataclass(frozen=True, slots=True)
class Sensor:
    """One sensor at work: offset that was drawn, step of quantisation, and the noise of every sample to come."""

    offset: float
    quantum: float
    noise: Floats

    def reads(self, true: float, sample: int) -> float:
        """Return the reading at a sample, in the unit of ``true`` [SI]."""
        return quantise(true + self.offset + float(self.noise[sample]), self.quantum)

    def readings(self, true: Floats) -> Floats:
        """Return the readings [SI] at the first samples."""
        return np.array([self.reads(float(value), sample) for sample, value in enumerate(true)])


def random_stream(seed: int, channel: str) -> np.random.Generator:
    """Return the random numbers of a channel for a seed."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, _STREAMS[channel]])))


def sensor(preset: Preset, channel: str, seed: int, samples: int, fraction_of_range: float = 1.0) -> Sensor:
    """Return the sensor of a channel for a number of samples; one of a smaller range is finer in everything.

    ``fraction_of_range`` [-] scales offset, noise and step.
    """
    given = preset.section(CHANNEL_SENSORS[channel])
    offset, noise, quantum = (fraction_of_range * given[name] for name in ("offset", "noise", "quantum"))
    stream = random_stream(seed, channel)
    drawn = offset * float(stream.standard_normal())
    return Sensor(drawn, quantum, noise * stream.standard_normal(samples))
