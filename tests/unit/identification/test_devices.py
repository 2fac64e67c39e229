"""Several devices of one kind: mean, spread and the next device's interval, on populations that are known."""

import math

import numpy as np
import pytest
from scipy.stats import chi2, t

from ppafo.errors import IdentificationError
from ppafo.identification.devices import coefficient_of_variation, devices_apart, spread_of_devices


@pytest.mark.parametrize("count", [3, 5, 10])
def test_without_errors_of_the_estimates_the_intervals_are_those_of_student_and_chi_square(count: int) -> None:
    values = np.random.default_rng(count).normal(7.0, 0.3, count)
    found = spread_of_devices(values.tolist(), [0.0] * count)
    deviation, factor = float(values.std(ddof=1)), float(t.ppf(0.975, count - 1))
    assert found.mean == pytest.approx(values.mean(), rel=1e-9)
    assert found.spread == pytest.approx(deviation, rel=1e-6)
    limits = [deviation * math.sqrt((count - 1) / chi2.ppf(level, count - 1)) for level in (0.975, 0.025)]
    assert found.spread_interval == pytest.approx(limits, rel=1e-6)
    half = factor * deviation * math.sqrt(1.0 + 1.0 / count)
    assert found.next_device == pytest.approx([found.mean - half, found.mean + half], rel=1e-3)
    half = factor * deviation / math.sqrt(count)
    assert found.mean_interval == pytest.approx([found.mean - half, found.mean + half], rel=1e-3)


def test_devices_that_are_the_same_show_no_difference_and_pool_to_the_weighted_mean() -> None:
    found = spread_of_devices([1.0, 1.01, 0.99, 1.3], [0.02, 0.02, 0.02, 0.5])
    weights = np.array([1.0, 1.0, 1.0, 0.0016]) / 0.0004
    assert found.is_common
    assert found.spread == 0.0
    assert found.chance > 0.5
    assert found.mean == pytest.approx(np.average([1.0, 1.01, 0.99, 1.3], weights=weights))
    assert found.next_device[1] > found.mean_interval[1]


@pytest.mark.long
@pytest.mark.parametrize(("count", "spread"), [(3, 0.0), (3, 2.0), (5, 0.0), (5, 2.0), (10, 0.0), (10, 2.0)])
def test_intervals_hold_on_drawn_populations(count: int, spread: float) -> None:
    random, draws, held = np.random.default_rng([count, int(spread)]), 200, np.zeros(3)
    for _ in range(draws):
        errors = np.exp(random.uniform(-1.0, 1.0, count))
        values = random.normal(0.0, spread, count) + errors * random.normal(0.0, 1.0, count)
        found = spread_of_devices(values.tolist(), errors.tolist())
        intervals = (found.mean_interval, found.spread_interval, found.next_device)
        truths = (0.0, spread, random.normal(0.0, spread))
        held += [low <= truth <= high for (low, high), truth in zip(intervals, truths, strict=True)]
    # Three standard errors of 200 draws; where devices hardly differ the intervals are wider than they need be.
    assert min(held) / draws > 0.95 - 3.0 * math.sqrt(0.95 * 0.05 / draws)
    if spread:
        assert max(held) / draws < 0.995


def test_units_do_not_matter() -> None:
    values, errors = [3.0, 4.0, 6.0, 5.0], [0.3, 0.2, 0.5, 0.4]
    one = spread_of_devices(values, errors)
    other = spread_of_devices([1e-7 * value for value in values], [1e-7 * error for error in errors])
    assert other.next_device == pytest.approx([1e-7 * end for end in one.next_device], rel=1e-6)
    assert other.chance == pytest.approx(one.chance)


def test_a_device_of_another_kind_is_named_and_one_of_the_same_kind_is_not() -> None:
    values, errors = [1.0, 1.05, 0.97, 1.02, 0.99, 1.01], [0.01] * 6
    assert devices_apart(values, errors) == ()
    assert devices_apart([*values, 2.0], [*errors, 0.01]) == (6,)
    # An estimate that nobody can rely on is not a device of another kind.
    assert devices_apart([*values, 2.0], [*errors, 0.6]) == ()
    assert devices_apart([1.0, 1.0, 5.0], [0.01] * 3) == devices_apart([1.0] * 5, [0.0] * 5) == ()


def test_two_devices_are_refused_and_equal_ones_without_error_are_one_number() -> None:
    with pytest.raises(IdentificationError, match="2 devices do not show how they spread"):
        spread_of_devices([1.0, 2.0], [0.1, 0.1])
    assert spread_of_devices([2.0] * 3, [0.0] * 3).next_device == (2.0, 2.0)


def test_spread_of_a_logarithm_as_a_fraction_of_the_mean() -> None:
    drawn = np.exp(np.random.default_rng(1).normal(0.0, 0.4, 200_000))
    assert coefficient_of_variation(0.4) == pytest.approx(drawn.std() / drawn.mean(), rel=0.02)
