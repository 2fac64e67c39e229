"""What a controller of walking sees: bandwidth, lost samples and faults of angle, pressures and forces."""

import math

import numpy as np
import pytest

from ppafo.engine.scheme.actuators import VANE_FUNCTIONS
from ppafo.model.sensors import (
    NOTHING_SEEN,
    Fault,
    GaitMeasurement,
    GaitSeen,
    GaitSensors,
    SensorParameters,
    measure_gait,
)
from ppafo.parameters.loading import load_device
from ppafo.parameters.plant import plant_parameters

QUIET = SensorParameters(0.0, 0.0, 0.0, 0.0, 1.0)
NEVER = Fault(1.0e9, 0.0, 0.0)
IDEAL = GaitSensors(200.0, *(0.0,) * 7, *(NEVER,) * 5)
PLANT = plant_parameters(load_device("ppafo2011"))
TORQUE_CONSTANT = PLANT.torque_constant
PERIOD = 1.0e-3
TRUE = (1.5, 3.0e5, 1.0e5, 400.0, 120.0)


def seen(
    sensors: GaitSensors, sample: int, last: GaitSeen, true: tuple[float, ...] = TRUE, quiet: SensorParameters = QUIET
) -> tuple[GaitMeasurement, GaitSeen]:
    return measure_gait(quiet, sensors, last, *true, PLANT, sample * PERIOD, sample, parts=VANE_FUNCTIONS)


def test_an_ideal_sensor_shows_what_is_there() -> None:
    angle, first, second, heel, toe = TRUE
    shown, _ = seen(IDEAL, 7, NOTHING_SEEN)
    assert shown == (angle, first, second, TORQUE_CONSTANT * (first - second), heel, toe)


@pytest.mark.parametrize("name", ["pressure_1", "pressure_2"])
def test_the_torque_comes_from_the_pressures_that_the_sensors_show(name: str) -> None:
    broken = IDEAL._replace(**{f"{name}_fault": Fault(0.002, 0.0, 2.0e5)})
    before, last = seen(broken, 1, NOTHING_SEEN)
    after, _ = seen(broken, 2, last)
    assert before.torque == pytest.approx(TORQUE_CONSTANT * 2.0e5)
    assert getattr(after, name) == 2.0e5
    assert after.torque == pytest.approx(TORQUE_CONSTANT * (after.pressure_1 - after.pressure_2))
    assert after.torque == pytest.approx(TORQUE_CONSTANT * 1.0e5)


@pytest.mark.parametrize("name", ["heel", "toe", "angle", "pressure_1", "pressure_2"])
def test_a_frozen_sensor_shows_its_last_reading_and_the_others_go_on(name: str) -> None:
    broken = IDEAL._replace(**{f"{name}_fault": Fault(0.002, 1.0, 0.0)})
    _, last = seen(broken, 1, NOTHING_SEEN)
    moved = tuple(1.1 * value for value in TRUE)
    for sample in (2, 3, 4):
        shown, last = seen(broken, sample, last, moved)
    field = f"{name}_force" if name in ("heel", "toe") else name
    truth = dict(zip(("angle", "pressure_1", "pressure_2", "heel_force", "toe_force"), TRUE, strict=True))
    for other, value in truth.items():
        assert getattr(shown, other) == pytest.approx(value if other == field else 1.1 * value), other


@pytest.mark.parametrize("name", ["heel", "toe", "angle", "pressure_1", "pressure_2"])
def test_a_sensor_that_is_frozen_from_the_beginning_keeps_its_first_reading(name: str) -> None:
    broken, last = IDEAL._replace(**{f"{name}_fault": Fault(0.0, 1.0, 0.0)}), NOTHING_SEEN
    field = f"{name}_force" if name in ("heel", "toe") else name
    truth = dict(zip(("angle", "pressure_1", "pressure_2", "heel_force", "toe_force"), TRUE, strict=True))
    for sample in range(3):
        shown, last = seen(broken, sample, last, tuple((1.0 + 0.1 * sample) * value for value in TRUE))
        assert getattr(shown, field) == truth[field]


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


FIELDS = {name: name for name in ("angle", "pressure_1", "pressure_2")} | {"heel": "heel_force", "toe": "toe_force"}
ORDER = ("angle", "pressure_1", "pressure_2", "heel", "toe")


def shown_with(name: str, fault: Fault, samples: int, last: GaitSeen = NOTHING_SEEN) -> list[float]:
    """What a sensor with a fault shows at each of some samples of the same truth, after a first one without it."""
    broken, shown = IDEAL._replace(**{f"{name}_fault": fault}), []
    _, last = seen(IDEAL, 0, last)
    for sample in range(1, samples + 1):
        measurement, last = seen(broken, sample, last)
        shown.append(float(getattr(measurement, FIELDS[name])))
    return shown


def distorted(**values: float) -> Fault:
    return Fault(0.0, 0.0, 0.0, distorts=1.0, **values)


@pytest.mark.parametrize("name", ORDER)
def test_a_distorted_sensor_has_a_gain_an_offset_and_a_drift(name: str) -> None:
    truth = TRUE[ORDER.index(name)]
    shown = shown_with(name, distorted(gain=0.5, offset=3.0, drift=100.0), 4)
    assert shown == pytest.approx([0.5 * truth + 3.0 + 100.0 * PERIOD * sample for sample in range(1, 5)])


@pytest.mark.parametrize("name", ORDER)
def test_a_sensor_that_lags_goes_to_what_is_there(name: str) -> None:
    truth = TRUE[ORDER.index(name)]
    shown = shown_with(name, distorted(gain=2.0, memory=0.9), 60)
    assert shown[0] == pytest.approx(truth + 0.1 * truth)
    assert shown[9] == pytest.approx(truth * (2.0 - 0.9**10))
    assert shown[-1] == pytest.approx(2.0 * truth, rel=2e-3)


def test_sensors_of_a_pair_mix_and_swap() -> None:
    swap = distorted(crosstalk=1.0)
    both = IDEAL._replace(heel_fault=swap, toe_fault=swap, pressure_1_fault=distorted(crosstalk=0.25))
    shown, _ = seen(both, 1, NOTHING_SEEN)
    angle, first, second, heel, toe = TRUE
    assert (shown.angle, shown.heel_force, shown.toe_force) == (angle, toe, heel)
    assert (shown.pressure_1, shown.pressure_2) == (0.75 * first + 0.25 * second, second)


def test_a_fault_that_comes_and_goes_is_there_in_the_first_half_of_each_period() -> None:
    shown = shown_with("heel", Fault(0.002, 0.0, 7.0, period=0.004), 12)
    assert [value == 7.0 for value in shown] == [False, True, True, False, False] * 1 + [True, True, False, False] + [
        True,
        True,
        False,
    ]


def test_a_distorted_sensor_loses_as_many_samples_as_stated() -> None:
    broken, last, lost = IDEAL._replace(toe_fault=distorted(lost_fraction=0.3)), NOTHING_SEEN, 0
    for sample in range(1, 3001):
        measurement, last = seen(broken, sample, last, (*TRUE[:4], float(sample)))
        lost += measurement.toe_force != sample
    assert lost / 3000 == pytest.approx(0.3, abs=0.03)
