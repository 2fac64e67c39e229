"""Chambers, vane, friction and sensors."""

import itertools
import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from ppafo.engine.scheme.actuators import VANE_FUNCTIONS
from ppafo.model.plant import (
    actuator_torque,
    chamber_1_volume,
    chamber_2_volume,
    direction_of,
    gravity_torque,
    holds_still,
    net_torque,
)
from ppafo.model.sensors import SensorParameters, measure, quantise, standard_noise
from ppafo.parameters.loading import load_device
from ppafo.parameters.plant import plant_parameters


def test_printed_volumes_are_the_case_without_dead_volume_and_lower_stop() -> None:
    assert chamber_1_volume(0.5, 0.0, 51e-6, 0.0) == pytest.approx(51e-6 * 0.5)
    assert chamber_2_volume(0.5, math.pi / 2, 51e-6, 0.0) == pytest.approx(51e-6 * (math.pi / 2 - 0.5))


@given(st.floats(0.3, 2.3))
def test_volumes_add_up_to_the_same_sum_at_every_angle(angle: float) -> None:
    total = chamber_1_volume(angle, 0.3, 51e-6, 2e-6) + chamber_2_volume(angle, 2.3, 51e-6, 2e-6)
    assert total == pytest.approx(2.0 * 51e-6 + 4e-6)


def test_torque_is_positive_in_plantarflexion() -> None:
    assert actuator_torque(2e5, 1e5, 1.451e-5) == pytest.approx(1.451)


@given(st.floats(-10.0, 10.0))
@example(10.0)
@example(math.radians(330.0))
@example(-10.0)
def test_gravity_is_a_cosine_at_every_angle_that_a_set_may_state(angle: float) -> None:
    assert gravity_torque(angle, 0.6) == pytest.approx(-0.6 * math.cos(angle - math.pi / 2), abs=1e-7)


@given(st.floats(-20.0, 20.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_friction_and_damping_never_add_energy(rate: float, dynamic_torque: float, damping: float) -> None:
    assert net_torque(0.0, direction_of(rate), dynamic_torque, damping, 1.0, rate) * rate <= 0.0


def test_stop_holds_against_any_torque_towards_it_but_not_away_from_it() -> None:
    assert holds_still(-9.0, 0.45, at_lower_stop=True, at_upper_stop=False)
    assert not holds_still(0.46, 0.45, at_lower_stop=True, at_upper_stop=False)
    assert holds_still(9.0, 0.45, at_lower_stop=False, at_upper_stop=True)


def test_noise_has_mean_zero_and_variance_one_and_no_memory() -> None:
    values = [standard_noise(7, sample, 1) for sample in range(20_000)]
    mean = sum(values) / len(values)
    variance = sum(value * value for value in values) / len(values) - mean * mean
    neighbours = sum(a * b for a, b in itertools.pairwise(values)) / len(values)
    assert abs(mean) < 0.025
    assert abs(variance - 1.0) < 0.04
    assert abs(neighbours) < 0.025


def test_noise_of_channels_and_seeds_is_unrelated() -> None:
    for other in ((7, 2), (8, 1)):
        product = [standard_noise(7, s, 1) * standard_noise(other[0], s, other[1]) for s in range(20_000)]
        assert abs(sum(product) / len(product)) < 0.03


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e3))
def test_quantised_values_are_whole_quanta_within_half_of_one(value: float, quantum: float) -> None:
    result = quantise(value, quantum)
    assert abs(result - value) <= 0.5 * quantum * (1 + 1e-9)
    assert result / quantum == pytest.approx(round(result / quantum), abs=1e-6)


def test_ideal_sensors_change_nothing() -> None:
    plant = plant_parameters(load_device("ppafo2011"))
    seen = measure(SensorParameters(0.0, 0.0, 0.0, 0.0, 1.0), 1.2, 3e5, 1e5, plant, 4, parts=VANE_FUNCTIONS)
    assert seen == (1.2, 3e5, 1e5, pytest.approx(plant.torque_constant * 2e5))
