"""What recorded numbers show of their converter."""

import numpy as np
import pytest

from ppafo.signals.faults import resolution_of, rounding_of


def test_the_step_of_a_converter_shows_where_values_come_again_and_in_no_noise() -> None:
    random = np.random.default_rng(5)
    noise = random.standard_normal(400)
    assert resolution_of(noise) == 0.0
    assert resolution_of(0.25 * np.round(noise / 0.25)) == pytest.approx(0.25)
    assert resolution_of(np.full(30, 2.0)) == 0.0
    # Ten readings that happen to lie apart are on no grid.
    assert resolution_of(np.linspace(0.0, 9.0, 10)) == 0.0


def test_a_run_of_equal_values_says_no_more_than_one() -> None:
    sizes = rounding_of(np.array([1.0, 1.0, 1.0, 1.0, 2.0, 3.0, 3.0]), 1.0)
    assert sizes == pytest.approx(np.sqrt(np.array([4.0, 4.0, 4.0, 4.0, 1.0, 2.0, 2.0]) / 12.0))
    assert np.sum(1.0 / sizes**2) == pytest.approx(3 * 12.0)
