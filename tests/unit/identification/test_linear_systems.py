"""Linear systems of any scale and rank: the same solution, and no certainty where columns see nothing."""

import numpy as np
import pytest
from ppafo.identification.trajectory.information import covariance, directions_for, solution

from ppafo.identification.linear_systems import inverse_of, inverse_of_steps, rank_of, solution_of
from ppafo.identification.noise.shapes import previous_samples, regression_of

UNITS = np.array([1.0e9, 1.0e-9, 1.0])


def columns() -> np.ndarray:
    return np.random.default_rng(3).standard_normal((50, 3))


def test_the_unit_of_a_column_changes_its_coefficient_and_nothing_else() -> None:
    plain, values = columns(), np.random.default_rng(4).standard_normal(50)
    expected = np.linalg.lstsq(plain, values)[0]
    other = plain * UNITS
    assert solution_of(other.T @ other, other.T @ values) * UNITS == pytest.approx(expected, rel=1e-9)
    assert inverse_of(other.T @ other) * np.outer(UNITS, UNITS) == pytest.approx(np.linalg.inv(plain.T @ plain))
    assert rank_of(other.T @ other) == 3


def test_a_column_that_is_there_twice_takes_half_and_is_not_known_at_all() -> None:
    plain, values = columns(), np.random.default_rng(4).standard_normal(50)
    once = np.linalg.lstsq(plain, values)[0]
    twice = np.column_stack([plain, 1.0e6 * plain[:, 0]])
    products = twice.T @ twice
    assert rank_of(products) == 3
    assert solution_of(products, twice.T @ values) == pytest.approx([0.5 * once[0], *once[1:], 0.5e-6 * once[0]])
    known = np.diag(inverse_of(products))
    assert known[0] > 1.0e9 * known[1]
    assert known[1:3] == pytest.approx(np.diag(np.linalg.inv(plain.T @ plain))[1:], rel=1e-6)


def test_columns_of_zeros_have_no_coefficients_and_a_huge_variance() -> None:
    nothing = np.zeros((3, 3))
    assert not solution_of(nothing, np.ones(3)).any()
    assert np.all(np.diag(inverse_of(nothing)) > 1.0e12)
    assert rank_of(nothing) == 0


def test_steps_in_units_that_are_powers_of_ten_apart_are_inverted_exactly() -> None:
    turn = np.linalg.qr(np.random.default_rng(5).standard_normal((3, 3)))[0]
    steps = turn * np.array([1.0e-12, 1.0, 1.0e12])[:, None]
    assert inverse_of_steps(steps) @ steps == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize("curve", [np.linspace(0.0, 50.0, 400), np.full(400, 7.0), np.zeros(400)])
def test_the_samples_of_a_smooth_curve_are_predicted_from_those_before(curve: np.ndarray) -> None:
    coefficients, _ = regression_of([curve], [np.ones(400)], 20)
    assert previous_samples(curve, 20) @ coefficients == pytest.approx(curve[20:], abs=1e-6)
    assert np.abs(coefficients).max() < 10.0


def test_what_recordings_say_nothing_of_keeps_a_number_as_its_variance_and_does_not_move() -> None:
    nothing = np.zeros((2, 2))
    assert np.isfinite(covariance(nothing)).all()
    assert np.isfinite(directions_for(nothing, np.zeros(2, dtype=np.bool_))).all()
    assert not solution(nothing, np.ones(2)).any()
