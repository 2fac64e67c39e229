"""Counts in fixed bins: they add up over chunks in any order, and their quantiles are within a bin."""

import numpy as np
import pytest

from ppafo.questions.sweep.bands import BINS, Bins, bins_around, counts_of, outside_fraction, quantiles_of

SHARES = (0.0, 0.05, 0.25, 0.5, 0.9, 1.0)


@pytest.fixture
def traces() -> np.ndarray:
    """Three times, 5000 runs: a normal, a skew and a constant one, some of them failed."""
    random = np.random.default_rng(2)
    values = np.stack([random.normal(3.0, 1.0, 5000), random.exponential(2.0, 5000), np.full(5000, 1.0)])
    values[:, ::50] = np.nan
    return values


def test_counts_of_parts_add_up_to_those_of_the_whole(traces: np.ndarray) -> None:
    bins = bins_around(traces[:, :200])
    parts = [counts_of(part, bins) for part in np.array_split(traces, 7, axis=1)]
    np.testing.assert_array_equal(sum(reversed(parts)), counts_of(traces, bins))
    assert counts_of(traces, bins).sum(axis=1).tolist() == [4900] * 3


def test_quantiles_are_within_a_bin_of_those_of_the_values(traces: np.ndarray) -> None:
    bins = bins_around(traces)
    found = quantiles_of(counts_of(traces, bins), bins, SHARES)
    for share in SHARES:
        exact = np.nanquantile(traces, share, axis=1, method="inverted_cdf")
        assert np.all(np.abs(found[share] - exact) <= bins.width * 1.000001)


def test_values_beyond_the_bins_are_counted_at_their_ends(traces: np.ndarray) -> None:
    bins = Bins(2.0, 3.0)
    counts = counts_of(traces, bins)
    known = traces[0][np.isfinite(traces[0])]
    assert counts[0, 0] == np.count_nonzero(known < 2.0)
    assert counts[0, -1] == np.count_nonzero(known >= 3.0)
    assert counts.shape == (3, BINS + 2)
    found = quantiles_of(counts, bins, (0.001, 0.999))
    assert found[0.001][0] == 2.0
    assert found[0.999][0] == 3.0
    assert 0.0 < outside_fraction({"torque": counts}) < 1.0


def test_a_time_without_any_run_has_no_quantile() -> None:
    counts = counts_of(np.full((2, 4), np.nan), Bins(0.0, 1.0))
    assert np.isnan(quantiles_of(counts, Bins(0.0, 1.0), (0.5,))[0.5]).all()
    assert outside_fraction({"torque": counts}) == 0.0


@pytest.mark.parametrize("value", [0.0, 5.0, -1e5, 1e-9])
def test_bins_around_a_constant_hold_it_inside(value: float) -> None:
    bins = bins_around(np.full((3, 4), value))
    assert bins.low < value < bins.high


def test_bins_around_nothing_exist() -> None:
    assert bins_around(np.full((3, 4), np.nan)).width > 0.0
