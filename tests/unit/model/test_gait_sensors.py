"""What a controller of walking sees: bandwidth and lost samples of angle, pressures and forces."""

import math

import numpy as np
import pytest

from ppafo.engine.scheme.actuators import VANE_FUNCTIONS
from ppafo.model.sensors import (
    NOTHING_SEEN,
    GaitMeasurement,
    GaitSeen,
    GaitSensors,
    SensorParameters,
    measure_gait,
)
from ppafo.parameters.loading import load_device
from ppafo.parameters.plant import plant_parameters

QUIET = SensorParameters(0.0, 0.0, 0.0, 0.0, 1.0)
IDEAL = GaitSensors(200.0, *(0.0,) * 7)
PLANT = plant_parameters(load_device("ppafo2011"))
TORQUE_CONSTANT = PLANT.torque_constant
PERIOD = 1.0e-3
TRUE = (1.5, 3.0e5, 1.0e5, 400.0, 120.0)


def seen(
    sensors: GaitSensors, sample: int, last: GaitSeen, true: tuple[float, ...] = TRUE, quiet: SensorParameters = QUIET
) -> tuple[GaitMeasurement, GaitSeen]:
    return measure_gait(quiet, sensors, last, *true, PLANT, sample, parts=VANE_FUNCTIONS)


def test_an_ideal_sensor_shows_what_is_there() -> None:
    angle, first, second, heel, toe = TRUE
    shown, _ = seen(IDEAL, 7, NOTHING_SEEN)
    assert shown == (angle, first, second, TORQUE_CONSTANT * (first - second), heel, toe)


def test_a_bandwidth_makes_a_sensor_follow_as_a_first_order_one_from_a_settled_start() -> None:
    bandwidth = 20.0
    memory = math.exp(-2.0 * math.pi * bandwidth * PERIOD)
    slow = IDEAL._replace(angle_memory=memory, pressure_memory=memory)
    shown, last = seen(slow, 0, NOTHING_SEEN)
    assert shown[:3] == TRUE[:3], "settled before the walk begins"
    stepped = (2.5, 4.0e5, 1.2e5, 400.0, 120.0)
    for sample in range(1, 31):
        shown, last = seen(slow, sample, last, stepped)
    left = math.exp(-2.0 * math.pi * bandwidth * 30 * PERIOD)
    assert 0.01 < left < 0.1
    assert shown[:3] == pytest.approx([new + (old - new) * left for old, new in zip(TRUE, stepped[:3], strict=False)])
    assert (shown.heel_force, shown.toe_force) == TRUE[3:], "the force sensors have a follow rate of their own"


def test_lost_samples_show_the_last_reading_as_often_as_stated_and_never_at_first() -> None:
    losing = IDEAL._replace(angle_lost_share=0.3, pressure_lost_share=0.6, lost_share=0.4)
    count, last, kept = 4000, NOTHING_SEEN, np.zeros(5)
    for sample in range(count):
        true = tuple(value + sample for value in TRUE)
        shown, last = seen(losing, sample, last, true)
        readings = (*shown[:3], shown.heel_force, shown.toe_force)
        kept += [reading == value for reading, value in zip(readings, true, strict=True)]
        if sample == 0:
            assert kept.tolist() == [1.0] * 5
    np.testing.assert_allclose(1.0 - kept / count, [0.3, 0.6, 0.6, 0.4, 0.4], atol=0.03)


def test_a_first_sample_is_never_lost() -> None:
    losing = IDEAL._replace(angle_lost_share=1.0, pressure_lost_share=1.0, lost_share=1.0)
    first, last = seen(losing, 0, NOTHING_SEEN)
    ideal, _ = seen(IDEAL, 0, NOTHING_SEEN)
    assert first == ideal
    second, _ = seen(losing, 1, last, tuple(1.1 * value for value in TRUE))
    assert second == ideal


def test_samples_of_both_pressures_are_lost_independently() -> None:
    losing, last, together = IDEAL._replace(pressure_lost_share=0.5), NOTHING_SEEN, []
    for sample in range(2000):
        true = tuple(value + sample for value in TRUE)
        shown, last = seen(losing, sample, last, true)
        together.append((shown.pressure_1 == true[1], shown.pressure_2 == true[2]))
    assert abs(np.corrcoef(np.array(together, dtype=float).T)[0, 1]) < 0.08


def test_noise_and_steps_come_after_the_bandwidth() -> None:
    slow = IDEAL._replace(angle_memory=0.9)
    coarse = QUIET._replace(angle_resolution=0.1)
    _, last = seen(slow, 0, NOTHING_SEEN, quiet=coarse)
    shown, last = seen(slow, 1, last, (2.0, *TRUE[1:]), coarse)
    assert last.smooth_angle == pytest.approx(1.55)
    assert shown.angle == pytest.approx(round(shown.angle, 1))
