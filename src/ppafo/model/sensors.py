"""Sensors of the controller: ideal, or with bandwidth, noise and quantisation; also the sensors of a walk.

Noise is a pure function of seed, sample number and channel, so that a run has the same noise alone, in any block and on
any number of threads. A walking controller has two additional force sensors under the foot.
"""

from typing import NamedTuple

from ppafo.model.elementary import DOUBLINGS, SMALLEST_FRACTION, TERMS
from ppafo.model.plant import ActuatorFunctions, PlantParameters

MASK = 0xFFFFFFFF
ARRIVAL = 40.0
"""Settling time to rounding accuracy of a sensor, in time constants [-]."""


class Measurement(NamedTuple):
    """Measured angle [rad] and absolute pressures [Pa], and actuator torque computed from them [N m]."""

    angle: float
    pressure_1: float
    pressure_2: float
    torque: float


class SensorParameters(NamedTuple):
    """Standard deviations and quantisation steps of angle [rad] and pressure [Pa] (0 for none), and random seed."""

    angle_noise: float
    pressure_noise: float
    angle_resolution: float
    pressure_resolution: float
    seed: float


def decay_factors(rate: float, step: float) -> tuple[float, float]:
    """Decay factor exp(-rate step) and its mean over the step [-], by a power series and doubling."""
    # Beyond ARRIVAL exp is 0 to rounding and its mean falls as one over the step: the last line scales it.
    whole = rate * step
    small = -min(whole, ARRIVAL) * SMALLEST_FRACTION
    term = 1.0
    kept = 1.0
    mean = 1.0
    for order in range(1, TERMS):
        term *= small / order
        kept += term
        mean += term / (order + 1)
    for _ in range(DOUBLINGS):
        # The mean over twice the step is (1 + exp)/2 times the mean over the step, and exp is squared.
        mean *= 0.5 * (1.0 + kept)
        kept *= kept
    return kept, mean * ARRIVAL / max(whole, ARRIVAL)


def follow(rate: float, step: float, shown: float, before: float, now: float) -> float:
    """Reading of a first-order sensor after a step [s] with a linear true value, in its own unit; exact."""
    kept, mean = decay_factors(rate, step)
    return kept * shown + (mean - kept) * before + (1.0 - mean) * now if rate > 0.0 else now


def follow_rate(rate: float, shown: float, now: float) -> float:
    """Rate of the reading of a first-order sensor, in its unit per second; 0 for ``rate`` [1/s] 0."""
    return rate * (now - shown)


def mix_bits(value: int) -> int:
    """Hash of a 32-bit integer (0 to 2^32 - 1): xor, shift and multiply, three times."""
    value = (value ^ (value >> 16)) * 0x7FEB352D & MASK
    value = (value ^ (value >> 15)) * 0x6C50B47D & MASK
    value = (value ^ (value >> 16)) * 0x45D9F3B & MASK
    return value ^ (value >> 16)


def next_word(value: int) -> int:
    """Next 32-bit word in the sequence of the noise generator."""
    return mix_bits((value + 0x1E3779B9) & MASK)


def halves(value: int) -> int:
    """Sum of both 16-bit halves of a 32-bit word."""
    return (value & 0xFFFF) + (value >> 16)


def standard_noise(seed: int, sample: int, channel: int) -> float:
    """Random number [-] with mean 0 and variance 1 for one sample of one channel: sum of twelve uniform numbers.

    The sum is within 6 and has an excess kurtosis of -0.1, close enough to normal for a sensor.
    """
    # Six words of two uniforms each, written out: a loop inside would keep the runs from running side by side.
    first = mix_bits(mix_bits(mix_bits(seed & MASK) ^ (sample & MASK)) ^ (channel & MASK))
    second = next_word(first)
    third = next_word(second)
    fourth = next_word(third)
    fifth = next_word(fourth)
    total = halves(first) + halves(second) + halves(third) + halves(fourth) + halves(fifth) + halves(next_word(fifth))
    # Each half stands for the middle of its 1/65536, twelve halves make the 6: the mean is exactly 0.
    return (total + 6.0) / 65536.0 - 6.0


def unit_noise(seed: int, sample: int, channel: int) -> float:
    """Random number from 0 to 1 for one sample of one channel, from the generator of ``standard_noise``."""
    return float(mix_bits(mix_bits(mix_bits(seed & MASK) ^ (sample & MASK)) ^ (channel & MASK))) / 4294967296.0


def quantise(value: float, resolution: float) -> float:
    """``value`` rounded half up to a multiple of ``resolution`` in the same unit; unchanged for a resolution of 0."""
    # Both sides of a select are computed in vector code: one must not divide by 0. int() cuts towards 0, so each sign
    # has its own half.
    safe = resolution if resolution > 0.0 else 1.0
    rounded = (
        resolution * float(int(value / safe + 0.5)) if value >= 0.0 else -resolution * float(int(0.5 - value / safe))
    )
    return rounded if resolution > 0.0 else value


def measure(
    sensors: SensorParameters,
    angle: float,
    pressure_1: float,
    pressure_2: float,
    plant: PlantParameters,
    sample: int,
    *,
    parts: ActuatorFunctions,
) -> Measurement:
    """Measurement of one sample with noise and quantisation; angle [rad], pressures [Pa absolute].

    The torque is computed from the measured angle and pressures.
    """
    seed = int(sensors.seed)
    angle = quantise(angle + sensors.angle_noise * standard_noise(seed, sample, 0), sensors.angle_resolution)
    first = quantise(pressure_1 + sensors.pressure_noise * standard_noise(seed, sample, 1), sensors.pressure_resolution)
    second = quantise(
        pressure_2 + sensors.pressure_noise * standard_noise(seed, sample, 2), sensors.pressure_resolution
    )
    torque = parts.torque(plant, angle, first, second)
    return Measurement(angle=angle, pressure_1=first, pressure_2=second, torque=torque)


class GaitMeasurement(NamedTuple):
    """Angle [rad], absolute pressures [Pa], actuator torque computed from both [N m], heel and toe forces [N]."""

    angle: float
    pressure_1: float
    pressure_2: float
    torque: float
    heel_force: float
    toe_force: float


class GaitSensors(NamedTuple):
    """Sensors of a walk: response, noise and resolution of the forces [N], and fractions of lost samples.

    ``follow_rate`` [1/s] of the force sensors; ``angle_memory`` and ``pressure_memory`` are the remaining fractions of
    a first-order sensor's last value after one sample, 0 for a sensor without lag.
    """

    follow_rate: float
    force_noise: float
    force_resolution: float
    lost_share: float
    angle_memory: float
    pressure_memory: float
    angle_lost_share: float
    pressure_lost_share: float


class GaitSeen(NamedTuple):
    """Last readings: forces under heel and toes [N], angle [rad], absolute pressures [Pa].

    The last three fields are the first-order filtered angle and pressures, before noise and quantisation.
    """

    heel_force: float
    toe_force: float
    angle: float
    pressure_1: float
    pressure_2: float
    smooth_angle: float
    smooth_pressure_1: float
    smooth_pressure_2: float


NOTHING_SEEN = GaitSeen._make((0.0,) * len(GaitSeen._fields))


def force_reading(sensors: GaitSensors, force: float, seed: int, sample: int, channel: int) -> float:
    """Force [N] with noise and quantisation, at least 0."""
    noisy = force + sensors.force_noise * standard_noise(seed, sample, channel)
    # A force sensor under a foot does not pull.
    return max(quantise(noisy, sensors.force_resolution), 0.0)


def hold_if_lost(last: float, reading: float, lost_share: float, seed: int, sample: int, channel: int) -> float:
    """Reading, or the last reading if the sample is lost, in the same unit; ``lost_share`` [-] is the probability.

    The first sample is never lost.
    """
    return last if sample > 0 and unit_noise(seed, sample, channel) < lost_share else reading


def measure_gait(
    sensors: SensorParameters,
    gait_sensors: GaitSensors,
    last: GaitSeen,
    angle: float,
    pressure_1: float,
    pressure_2: float,
    heel_force: float,
    toe_force: float,
    plant: PlantParameters,
    sample: int,
    *,
    parts: ActuatorFunctions,
) -> tuple[GaitMeasurement, GaitSeen]:
    """Measurement [SI] of a sample with bandwidth, noise, quantisation and loss, and the last readings."""
    seed = int(sensors.seed)
    # A sensor has settled before the walk begins: its reading before the first sample is the same.
    angle_memory = gait_sensors.angle_memory if sample > 0 else 0.0
    pressure_memory = gait_sensors.pressure_memory if sample > 0 else 0.0
    # Bandwidth before noise and rounding: what the amplifier adds is not filtered by the sensor.
    smooth_angle = angle + (last.smooth_angle - angle) * angle_memory
    smooth_1 = pressure_1 + (last.smooth_pressure_1 - pressure_1) * pressure_memory
    smooth_2 = pressure_2 + (last.smooth_pressure_2 - pressure_2) * pressure_memory
    # Channels of the noise: 0 to 4 values, 5 to 9 lost samples.
    seen = measure(sensors, smooth_angle, smooth_1, smooth_2, plant, sample, parts=parts)
    heel = force_reading(gait_sensors, heel_force, seed, sample, 3)
    toe = force_reading(gait_sensors, toe_force, seed, sample, 4)
    seen_angle = hold_if_lost(last.angle, seen.angle, gait_sensors.angle_lost_share, seed, sample, 7)
    seen_1 = hold_if_lost(last.pressure_1, seen.pressure_1, gait_sensors.pressure_lost_share, seed, sample, 8)
    seen_2 = hold_if_lost(last.pressure_2, seen.pressure_2, gait_sensors.pressure_lost_share, seed, sample, 9)
    seen_heel = hold_if_lost(last.heel_force, heel, gait_sensors.lost_share, seed, sample, 5)
    seen_toe = hold_if_lost(last.toe_force, toe, gait_sensors.lost_share, seed, sample, 6)
    remembered = GaitSeen(
        heel_force=seen_heel,
        toe_force=seen_toe,
        angle=seen_angle,
        pressure_1=seen_1,
        pressure_2=seen_2,
        smooth_angle=smooth_angle,
        smooth_pressure_1=smooth_1,
        smooth_pressure_2=smooth_2,
    )
    # The torque follows from the readings, right or wrong.
    shown = GaitMeasurement(
        angle=seen_angle,
        pressure_1=seen_1,
        pressure_2=seen_2,
        torque=parts.torque(plant, seen_angle, seen_1, seen_2),
        heel_force=seen_heel,
        toe_force=seen_toe,
    )
    return shown, remembered
