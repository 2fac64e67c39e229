"""Functions of floats over columns."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.engine.rows import leaves
from ppafo.model.columns import over_runs
from ppafo.model.flow_curve import isentropic_curve, iso6358_curve
from ppafo.model.gas import choked_flow_constant, critical_pressure_ratio
from ppafo.model.orifice import sonic_conductance_mass


class Pair(NamedTuple):
    power: float
    places: tuple[float, float]


def power_of(base: float, exponent: float) -> Pair:
    return Pair(base**exponent, (base, exponent))


@given(st.lists(st.tuples(st.floats(0.1, 9.0), st.floats(-3.0, 3.0)), min_size=1, max_size=40))
def test_columns_give_what_each_run_gives_alone_bit_for_bit(pairs: list[tuple[float, float]]) -> None:
    bases, exponents = (np.array(column) for column in zip(*pairs, strict=True))
    together = over_runs(power_of, bases, exponents)
    alone = [power_of(*pair) for pair in pairs]
    assert isinstance(together, Pair)
    assert together.power.tolist() == [pair.power for pair in alone]
    assert together.places[1].tolist() == [pair.places[1] for pair in alone]


def test_a_function_of_plain_numbers_is_called_as_it_is() -> None:
    assert over_runs(power_of, 2.0, 3.0) == Pair(8.0, (2.0, 3.0))


def test_a_function_is_called_once_for_each_combination_that_occurs() -> None:
    calls = []

    def noted(value: float, other: float) -> float:
        calls.append((value, other))
        return value - other

    column = np.repeat([3.0, 1.0, 2.0], 50)
    assert over_runs(noted, column, 1.0).tolist() == (column - 1.0).tolist()
    assert over_runs(noted, column, np.tile([0.5, 0.25], 75)).shape == (150,)
    assert len(calls) == 3 + 6


@pytest.mark.parametrize(
    ("function", "columns"),
    [
        (critical_pressure_ratio, ([1.2, 1.3, 1.4],)),
        (choked_flow_constant, ([1.2, 1.3, 1.4], [188.9, 190.0, 287.0], [280.0, 298.0, 310.5])),
        (sonic_conductance_mass, ([1e-8, 2e-8, 0.0], [188.9, 190.0, 287.0], [280.0, 298.0, 310.5])),
        (iso6358_curve, ([0.0, 0.21, 0.5], [0.99, 0.995, 0.999])),
        (isentropic_curve, ([1.2, 1.3, 1.4], [0.99, 0.995, 0.999])),
    ],
)
def test_flow_of_many_runs_is_that_of_each_alone(function: object, columns: tuple[list[float], ...]) -> None:
    assert callable(function)
    together = np.array(leaves((function(*(np.array(column) for column in columns)),)))
    for run, values in enumerate(zip(*columns, strict=True)):
        assert together[:, run].tolist() == leaves((function(*values),))
