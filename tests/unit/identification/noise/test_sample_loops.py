"""Loops over samples: each has the bits of Python by every compiler, those of logarithms and exponentials too."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ppafo.engine.loading import array_module
from ppafo.identification.noise import sample_loops
from ppafo.identification.noise.sample_loops import (
    innovations,
    likelihood_left,
    mixture_likelihood,
    prediction_errors,
    scales_of_t,
    smooth,
    sum_of_innovations,
    sums_of_logs,
)
from ppafo.identification.noise.shapes import from_coefficients, from_reflections
from ppafo.identification.noise.t_distribution import t_nodes
from tests.compilers_here import modules_of

COUNT, WIDTH = 60, 3
DRIFT = 0.9, 0.3, 1.2
LOOPS: list[Callable[..., None]] = [
    prediction_errors,
    innovations,
    sum_of_innovations,
    smooth,
    mixture_likelihood,
    scales_of_t,
    sums_of_logs,
    likelihood_left,
]


def arguments(name: str) -> tuple[Any, ...]:
    """What a loop is handed: drawn samples, and arrays for what it finds."""
    draw = np.random.default_rng(8)
    columns, weights, one = draw.standard_normal((COUNT, WIDTH)), draw.uniform(0.2, 2.0, COUNT), np.zeros(1)
    values, squares = columns[:, 0].copy(), np.square(columns[:, 1])
    shape = from_reflections(np.array([0.6, -0.3, 0.2]))
    drawn = draw.standard_normal((20, 6))
    given: dict[str, tuple[Any, ...]] = {
        "prediction_errors": (columns, weights, shape.predictors, shape.spreads, np.zeros_like(columns), one),
        "innovations": (columns, weights, np.zeros(WIDTH), np.zeros_like(columns), one, *DRIFT),
        "sum_of_innovations": (values, weights, np.zeros(2), *DRIFT),
        "smooth": (values, weights, columns[:, 2].copy(), np.zeros(COUNT), np.zeros(COUNT), *DRIFT),
        "mixture_likelihood": (values, *t_nodes(3.0), one, *DRIFT),
        "scales_of_t": (squares, np.array([1.5, 4.0, 50.0]), np.ones(3), 12),
        "sums_of_logs": (squares, np.array([1.5, 1.0e-4]), np.zeros(2), 1.0e10),
        "likelihood_left": (drawn.T @ drawn, np.zeros((6, 6)), one, 1.0e-4),
    }
    return given[name]


def written(given: tuple[Any, ...]) -> list[bytes]:
    return [item.tobytes() for item in given if isinstance(item, np.ndarray)]


@pytest.mark.parametrize("loop", LOOPS, ids=lambda loop: loop.__name__)
def test_a_loop_has_the_bits_of_python_by_every_compiler(loop: Callable[..., None]) -> None:
    before, expected = arguments(loop.__name__), arguments(loop.__name__)
    loop(*expected)
    assert written(expected) != written(before)
    for name, module in modules_of(array_module(LOOPS)).items():
        found = arguments(loop.__name__)
        getattr(module, loop.__name__)(*found)
        assert written(found) == written(expected), name


def test_all_loops_are_in_the_compiled_module() -> None:
    module = sample_loops.sample_loops()
    assert all(hasattr(module, loop.__name__) for loop in LOOPS)


def test_columns_that_leave_nothing_of_the_residuals_have_no_likelihood() -> None:
    drawn = np.random.default_rng(8).standard_normal((20, 5))
    columns = np.column_stack([drawn, drawn[:, 0] + drawn[:, 1]])
    found = np.full(1, 7.0)
    likelihood_left(columns.T @ columns, np.zeros((6, 6)), found, 1.0e-4)
    assert found.tolist() == [7.0]


def test_coefficients_lead_back_to_the_reflections_that_they_come_from() -> None:
    shape = from_reflections(np.array([0.6, -0.3, 0.2, 0.05]))
    again = from_coefficients(shape.predictors[4])
    assert again is not None
    assert again.predictors == pytest.approx(shape.predictors, abs=1e-15)
    assert from_coefficients(np.array([0.5, 1.1])) is None
