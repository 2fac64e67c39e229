"""What a controller sees of the plant: ideal, or with a bandwidth, noise and quantisation.

Noise is a pure function of seed, sample number and channel, so that a run gives the same noise alone, in any block
and on any number of threads.
"""

from typing import NamedTuple

from ppafo.model.turns import DOUBLINGS, SMALLEST_FRACTION, TERMS

MASK = 0xFFFFFFFF
ARRIVAL = 40.0
"""Time over the time constant of a sensor after which it has arrived to rounding."""


class Measurement(NamedTuple):
    """Angle [rad], absolute pressures [Pa] and the actuator torque worked out from them [N m]."""

    angle: float
    pressure_1: float
    pressure_2: float
    torque: float


class SensorParameters(NamedTuple):
    """Standard deviations and quantisation steps of angle [rad] and pressure [Pa] (0 for none), and a seed."""

    angle_noise: float
    pressure_noise: float
    angle_quantum: float
    pressure_quantum: float
    seed: float


def decay_factors(rate: float, step: float) -> tuple[float, float]:
    """exp(-rate step) and its mean over the step [-], by series at a small fraction of it, doubled up to the whole."""
    whole = rate * step
    small = -min(whole, ARRIVAL) * SMALLEST_FRACTION
    term, kept, mean = 1.0, 1.0, 1.0
    for order in range(1, TERMS):
        term *= small / order
        kept += term
        mean += term / (order + 1)
    for _ in range(DOUBLINGS):
        mean *= 0.5 * (1.0 + kept)
        kept *= kept
    return kept, mean * ARRIVAL / max(whole, ARRIVAL)


def follow(rate: float, step: float, shown: float, before: float, now: float) -> float:
    """What a first-order sensor shows after a step [s] in which the truth runs straight, in its own unit; exact."""
    kept, mean = decay_factors(rate, step)
    return kept * shown + (mean - kept) * before + (1.0 - mean) * now if rate > 0.0 else now


def mix_bits(value: int) -> int:
    """A 32-bit integer that looks unrelated to ``value`` (0 to 2^32 - 1): xor, shift and multiply, thrice."""
    value = (value ^ (value >> 16)) * 0x7FEB352D & MASK
    value = (value ^ (value >> 15)) * 0x6C50B47D & MASK
    value = (value ^ (value >> 16)) * 0x45D9F3B & MASK
    return value ^ (value >> 16)


def next_word(value: int) -> int:
    """The 32-bit word after this one."""
    return mix_bits((value + 0x1E3779B9) & MASK)


def halves(value: int) -> int:
    """Both 16-bit halves of a 32-bit word, added."""
    return (value & 0xFFFF) + (value >> 16)


def standard_noise(seed: int, sample: int, channel: int) -> float:
    """Random number [-] of mean 0 and variance 1 for one sample of one channel: twelve uniforms added up.

    The sum is within 6 and has an excess kurtosis of -0.1, near enough to normal for a sensor.
    """
    # Six words of two uniforms each, written out: a loop inside would keep the lanes from running side by side.
    first = mix_bits(mix_bits(mix_bits(seed & MASK) ^ (sample & MASK)) ^ (channel & MASK))
    second = next_word(first)
    third = next_word(second)
    fourth = next_word(third)
    fifth = next_word(fourth)
    total = halves(first) + halves(second) + halves(third) + halves(fourth) + halves(fifth) + halves(next_word(fifth))
    return (total + 6.0) / 65536.0 - 6.0


def unit_noise(seed: int, sample: int, channel: int) -> float:
    """Random number from 0 to 1 for one sample of one channel, as ``standard_noise`` draws them."""
    return float(mix_bits(mix_bits(mix_bits(seed & MASK) ^ (sample & MASK)) ^ (channel & MASK))) / 4294967296.0


def quantise(value: float, quantum: float) -> float:
    """``value`` rounded to a whole number of ``quantum`` of the same unit (half upwards); unchanged where that is 0."""
    safe = quantum if quantum > 0.0 else 1.0
    rounded = quantum * float(int(value / safe + 0.5)) if value >= 0.0 else -quantum * float(int(0.5 - value / safe))
    return rounded if quantum > 0.0 else value


def measure(
    sensors: SensorParameters, angle: float, pressure_1: float, pressure_2: float, torque_constant: float, sample: int
) -> Measurement:
    """Measurement of one sample with noise and quantisation; angle [rad], pressures [Pa absolute]."""
    seed = int(sensors.seed)
    angle = quantise(angle + sensors.angle_noise * standard_noise(seed, sample, 0), sensors.angle_quantum)
    first = quantise(pressure_1 + sensors.pressure_noise * standard_noise(seed, sample, 1), sensors.pressure_quantum)
    second = quantise(pressure_2 + sensors.pressure_noise * standard_noise(seed, sample, 2), sensors.pressure_quantum)
    return Measurement(angle=angle, pressure_1=first, pressure_2=second, torque=torque_constant * (first - second))
