"""What a controller of walking sees: two force sensors under the foot beside angle and pressures, with faults."""

from typing import NamedTuple

from ppafo.model.sensors import SensorParameters, measure, quantised, standard_noise, unit_noise


class GaitMeasurement(NamedTuple):
    """Angle [rad], absolute pressures [Pa], actuator torque from them [N m], forces under heel and toes [N]."""

    angle: float
    pressure_1: float
    pressure_2: float
    torque: float
    heel_force: float
    toe_force: float


class Fault(NamedTuple):
    """From ``time`` [s] on a sensor shows its last value (``holds`` 1) or ``reading`` (``holds`` 0)."""

    time: float
    holds: float
    reading: float


class GaitSensors(NamedTuple):
    """Force sensors: how fast they follow [1/s], noise and step [N], share of samples that are lost; faults of all."""

    follow_rate: float
    force_noise: float
    force_quantum: float
    lost_share: float
    heel_fault: Fault
    toe_fault: Fault
    angle_fault: Fault


class GaitSeen(NamedTuple):
    """Last readings: forces under heel and toes [N], angle [rad]."""

    heel_force: float
    toe_force: float
    angle: float


def followed(shown: float, true: float, follow_rate: float, step: float) -> float:
    """What a first-order sensor shows after a step [s]; ``follow_rate`` [1/s] is the inverse of its time constant."""
    share = follow_rate * step
    return shown + (true - shown) * share / (1.0 + share)


def faulty(fault: Fault, reading: float, last: float, time: float) -> float:
    """A reading as a sensor with a fault gives it."""
    stuck = last if fault.holds > 0.5 else fault.reading
    return stuck if time >= fault.time else reading


def force_reading(sensors: GaitSensors, force: float, last: float, seed: int, sample: int, channel: int) -> float:
    """A force [N] with noise, steps and lost samples, never below 0."""
    noisy = force + sensors.force_noise * standard_noise(seed, sample, channel)
    shown = max(quantised(noisy, sensors.force_quantum), 0.0)
    return last if unit_noise(seed, sample, channel + 2) < sensors.lost_share else shown


def measure_gait(
    sensors: SensorParameters,
    gait_sensors: GaitSensors,
    last: GaitSeen,
    angle: float,
    pressure_1: float,
    pressure_2: float,
    heel_force: float,
    toe_force: float,
    torque_constant: float,
    time: float,
    sample: int,
) -> GaitMeasurement:
    """Measurement of one sample with noise, steps, lost samples and faults."""
    seed = int(sensors.seed)
    seen = measure(sensors, angle, pressure_1, pressure_2, torque_constant, sample)
    heel = force_reading(gait_sensors, heel_force, last.heel_force, seed, sample, 3)
    toe = force_reading(gait_sensors, toe_force, last.toe_force, seed, sample, 4)
    return GaitMeasurement(
        faulty(gait_sensors.angle_fault, seen.angle, last.angle, time),
        seen.pressure_1,
        seen.pressure_2,
        seen.torque,
        faulty(gait_sensors.heel_fault, heel, last.heel_force, time),
        faulty(gait_sensors.toe_fault, toe, last.toe_force, time),
    )
