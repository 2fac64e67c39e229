"""Paired statistics against numbers worked out by hand and by theory."""

import math

import numpy as np
import pytest

from ppafo.questions.compare.paired import best_probabilities, compare_pairs, pareto_front
from ppafo.studies.distributions import NormalAround
from ppafo.studies.draws import Uncertainty
from ppafo.studies.study import Drawn


def test_pairs_are_counted_and_incomplete_ones_left_out() -> None:
    first = np.array([1.0, 2.0, 4.0, np.nan, 5.0])
    second = np.array([0.5, 2.0, 6.0, 1.0, np.nan])
    item = compare_pairs("rms_error", first, second, -1, 0.95)
    assert item is not None
    assert item.pairs == 3
    assert item.difference.value == pytest.approx((-0.5 + 0.0 + 2.0) / 3)
    assert item.change == pytest.approx(0.0)
    assert item.better is not None
    assert (item.better.value, item.equal) == pytest.approx((1 / 3, 1 / 3))


def test_more_is_better_where_the_metric_says_so() -> None:
    first, second = np.ones(10), np.array([2.0] * 7 + [0.5] * 3)
    less, more, neither = (compare_pairs("x", first, second, better, 0.95) for better in (-1, 1, 0))
    assert less is not None
    assert less.better is not None
    assert less.better.value == pytest.approx(0.3)
    assert more is not None
    assert more.better is not None
    assert more.better.value == pytest.approx(0.7)
    assert neither is not None
    assert neither.better is None


def test_configurations_that_are_equally_good_are_called_different_no_more_often_than_is_said() -> None:
    normals = Uncertainty(tuple(Drawn(f"x{number}", NormalAround(0.0, 1.0)) for number in range(6)))
    differs, is_better = [], []
    for seed in range(300):
        drawn = normals.replicated_columns(0, 256, seed)
        shared = drawn["x0"] ** 2 + drawn["x1"]
        first = shared + 0.3 * drawn["x2"] + 0.2 * drawn["x4"] ** 3
        item = compare_pairs("x", first, shared + 0.3 * drawn["x3"] + 0.2 * drawn["x5"] ** 3, -1, 0.95)
        assert item is not None
        assert item.better is not None
        differs.append(not item.difference.low <= 0.0 <= item.difference.high)
        is_better.append(not item.better.low <= 0.5 <= item.better.high)
    assert 0.01 <= np.mean(differs) <= 0.08
    assert np.mean(is_better) <= 0.05


def test_common_draws_see_a_difference_that_separate_draws_do_not() -> None:
    random = np.random.default_rng(3)
    device = random.normal(0.0, 1.0, 400)
    first, second = 10.0 + device, 9.95 + device + random.normal(0.0, 0.05, 400)
    together = compare_pairs("x", first, second, -1, 0.95)
    apart = compare_pairs("x", first, random.permutation(second), -1, 0.95)
    assert together is not None
    assert apart is not None
    assert together.difference.high < 0.0
    assert together.difference.width < 0.1 * apart.difference.width


def test_a_baseline_of_zero_has_no_relative_change() -> None:
    item = compare_pairs("switchings", np.zeros(5), np.ones(5), -1, 0.95)
    assert item is not None
    assert math.isnan(item.change)
    assert item.difference.value == 1.0


def test_no_pair_gives_nothing() -> None:
    assert compare_pairs("x", np.array([np.nan]), np.array([1.0]), -1, 0.95) is None


def test_the_best_of_several_is_counted_with_ties_for_all() -> None:
    values = [np.array([1.0, 3.0, 2.0, np.nan]), np.array([2.0, 1.0, 2.0, 0.0]), np.array([3.0, 4.0, 5.0, 1.0])]
    assert [share.value for share in best_probabilities(values, -1, 0.95)] == pytest.approx([2 / 3, 2 / 3, 0.0])


def test_the_front_has_what_nothing_beats_in_all_goals() -> None:
    points = np.array([[1.0, 5.0], [2.0, 2.0], [3.0, 1.0], [3.0, 2.0], [2.0, 2.0], [np.nan, 0.0]])
    assert pareto_front(points).tolist() == [True, True, True, False, True, False]
