"""A stretch with one value is found wherever it lies in the strides, and nothing else is."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from ppafo.gait.recorded.importing import LONGEST_HELD, constant_stretches

RATE = 200.0
TIME = np.arange(0.0, 8.0, 1.0 / RATE)
SPANS = [(1.0, 2.0), (2.0, 3.0), (3.0, 4.0), (5.0, 6.0)]


def moving(seed: int, step: float) -> np.ndarray:
    """A walk's angle with harmonics drawn by chance, as a sensor with this step shows it; 0: as it is."""
    rng = np.random.default_rng(seed)
    values = sum(rng.normal(0.0, 1.0 / k) * np.cos(2.0 * np.pi * k * TIME + rng.uniform(0.0, 6.0)) for k in range(1, 7))
    return np.asarray(values if step == 0.0 else step * np.round(values / step))


@settings(max_examples=100)
@given(seed=st.integers(0, 10**6), start=st.floats(0.0, 7.0), length=st.floats(0.02, 1.5))
def test_a_filled_drop_out_is_found_where_it_covers_the_strides(seed: int, start: float, length: float) -> None:
    values = moving(seed, 0.0)
    inside = np.flatnonzero((start <= TIME) & (start + length >= TIME))
    values[inside] = values[inside[0]]
    first = float(TIME[inside[0]])
    last = float(TIME[inside[-1]])
    covered = sum(max(0.0, min(last, high) - max(first, low)) for low, high in SPANS)
    assert constant_stretches(TIME, values, SPANS) == ([(first, last)] if covered > LONGEST_HELD else [])


@settings(max_examples=100)
@given(seed=st.integers(0, 10**6), step=st.sampled_from([0.0, 0.02, 0.05, 0.1]))
def test_a_sensor_that_only_has_coarse_steps_is_let_pass(seed: int, step: float) -> None:
    assert constant_stretches(TIME, moving(seed, step), SPANS) == []
