"""Functions of the model over columns have the bits of the functions themselves, also where they have no such form."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ppafo.control import profiles
from ppafo.engine.in_python import over_samples
from ppafo.engine.rows import leaves, rebuilt
from ppafo.model.elementary import exponential, sine_and_cosine_of_turns
from ppafo.model.leg import FootLoad, ShankNow, torque_on_foot, torque_on_resting_foot
from ppafo.model.plant import direction_of
from ppafo.simulation.leg import shank_over_samples

COLUMN = np.concatenate([[0.0, -0.0, 0.25, 0.5, 1.0, 2.0], np.random.default_rng(1).uniform(-3.0, 3.0, 200)])
KNOTS = np.concatenate([[0.0, 1.0], np.ravel([(0.1 * place, (-1.0) ** place) for place in range(1, 32)])])
TABLE = rebuilt(profiles.TabulatedProfile, [0.5, 2.5, *KNOTS[1:]])


@pytest.mark.parametrize(
    ("function", "row"),
    [
        (profiles.constant_value, profiles.ConstantProfile(2.0)),
        (profiles.ramp_hold_value, profiles.RampHold(-1.0, 2.0, 0.5, 1.5)),
        (profiles.sine_value, profiles.Sine(1.0, 2.0, 0.7, 0.25)),
        (profiles.table_value, TABLE),
        (profiles.smooth_value, TABLE),
    ],
)
def test_a_profile_over_a_column_has_the_bits_of_each_value(function: Callable[..., Any], row: Any) -> None:
    times = np.abs(COLUMN)
    alone = np.array([function(row, float(time)) for time in times]).T
    together = [np.broadcast_to(part, times.shape) for part in over_samples(function, row, times)]
    assert np.array(together).tobytes() == np.ascontiguousarray(alone).tobytes()


@pytest.mark.parametrize("function", [sine_and_cosine_of_turns, exponential, lambda value: value + 1.0])
def test_a_function_of_one_column_has_the_bits_of_each_value_whatever_its_form(function: Callable[..., Any]) -> None:
    found = over_samples(function, COLUMN)
    alone = [function(value) for value in COLUMN.tolist()]
    assert np.array(found).tobytes() == np.ascontiguousarray(np.array(alone).T).tobytes()


def test_friction_is_along_the_motion_and_none_at_rest() -> None:
    alone = [direction_of(value) for value in COLUMN.tolist()]
    assert over_samples(direction_of, COLUMN).tobytes() == np.array(alone).tobytes()


def test_a_shank_that_rests_puts_the_same_torque_on_a_foot_to_the_bit_as_one_that_might_move() -> None:
    load = FootLoad(0.09, 0.02, 0.46, 9.80665)
    now = ShankNow(0.3, 0.0, 0.0, 0.0, 0.0)
    shown = shank_over_samples(profiles.CONSTANT, profiles.ConstantProfile(0.3), COLUMN)
    assert all(np.all(shown_part == part) for shown_part, part in zip(leaves(shown), leaves(now), strict=True))
    alone = [torque_on_resting_foot(load, 0.3, angle) for angle in COLUMN.tolist()]
    assert alone == [torque_on_foot(load, now, angle) for angle in COLUMN.tolist()]
    assert over_samples(torque_on_foot, load, now, COLUMN).tolist() == alone
