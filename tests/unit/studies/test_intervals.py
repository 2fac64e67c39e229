"""Intervals hold the truth as often as they say."""

import math

import numpy as np
import pytest

from ppafo.studies.intervals import (
    effective_sample_size,
    fraction_interval,
    quantile_interval,
    replicates_interval,
)


def test_the_interval_of_a_mean_is_the_one_of_student_over_replicates() -> None:
    from scipy import stats

    values = np.random.default_rng(1).normal(3.0, 2.0, 64)
    interval = replicates_interval(values, 4, 0.9)
    known = stats.ttest_1samp([values[number::4].mean() for number in range(4)], 0.0).confidence_interval(0.9)
    assert (interval.low, interval.high) == pytest.approx((known.low, known.high), rel=1e-12)
    assert interval.value == pytest.approx(values.mean())
    assert replicates_interval(values[:3], 4, 0.9).width == math.inf


def test_one_large_draw_carries_a_mean_alone_and_normal_draws_all_do() -> None:
    random = np.random.default_rng(1)
    assert effective_sample_size(np.array([0.0] * 499 + [1.0])) == pytest.approx(1.0, rel=0.01)
    assert effective_sample_size(random.normal(size=500)) == 500.0
    assert effective_sample_size(random.exponential(size=100_000)) == pytest.approx(25_000, rel=0.2)
    assert effective_sample_size(np.ones(7)) == 7.0


@pytest.mark.parametrize(("hits", "draws"), [(0, 40), (3, 40), (40, 40), (250, 1000)])
def test_the_interval_of_a_share_is_the_exact_one(hits: int, draws: int) -> None:
    from scipy import stats

    interval = fraction_interval(hits, draws, 0.95)
    known = stats.binomtest(hits, draws).proportion_ci(0.95, "exact")
    assert (interval.low, interval.high) == pytest.approx((known.low, known.high), abs=1e-12)


@pytest.mark.parametrize("share", [0.05, 0.5, 0.9])
def test_the_interval_of_a_quantile_holds_it_often_enough_and_not_by_much(share: float) -> None:
    from scipy import stats

    random = np.random.default_rng(2)
    truth = stats.expon.ppf(share)
    intervals = [quantile_interval(random.exponential(size=200), share, 0.9) for _ in range(2000)]
    held = np.mean([interval.low <= truth <= interval.high for interval in intervals])
    assert 0.89 <= held <= 0.95


def test_a_quantile_that_few_draws_cannot_bound_has_an_open_end() -> None:
    interval = quantile_interval(np.arange(20.0), 0.99, 0.95)
    assert interval.high == math.inf
    assert interval.width == math.inf
