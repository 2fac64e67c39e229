"""Periodic curves: value, rate and acceleration agree, and the functions can be compiled as they stand."""

import math

import numpy as np
import pytest

from ppafo.engine.source_text import SourceCollector
from ppafo.model.periodic import periodic_motion, periodic_value

MEAN, COSINES, SINES, STRIDE_TIME = 0.3, (0.5, -0.2, 0.05), (-0.1, 0.4, 0.02), 1.1
PHASES = (-0.3, 0.0, 0.17, 0.5, 0.99, 7.25)


@pytest.mark.parametrize("phase", PHASES)
def test_the_value_is_the_sum_of_the_series(phase: float) -> None:
    angles = [2.0 * math.pi * order * phase for order in (1, 2, 3)]
    wanted = MEAN + sum(a * math.cos(x) + b * math.sin(x) for a, b, x in zip(COSINES, SINES, angles, strict=True))
    assert periodic_value(MEAN, COSINES, SINES, phase) == pytest.approx(wanted, abs=1e-8)


@pytest.mark.parametrize("phase", PHASES)
def test_rate_and_acceleration_are_the_derivatives_by_time(phase: float) -> None:
    step = 1e-4
    around = [periodic_motion(MEAN, COSINES, SINES, phase + k * step / STRIDE_TIME, STRIDE_TIME) for k in (-1, 0, 1)]
    value, rate, acceleration = around[1]
    assert value == pytest.approx(periodic_value(MEAN, COSINES, SINES, phase), rel=1e-12)
    assert rate == pytest.approx((around[2][0] - around[0][0]) / (2.0 * step), abs=1e-4)
    assert acceleration == pytest.approx((around[2][1] - around[0][1]) / (2.0 * step), abs=1e-3)


def test_the_functions_are_compiled_as_the_engine_does_it() -> None:
    import numba

    collector = SourceCollector("@njit")
    name = collector.add(periodic_motion)
    scope: dict[str, object] = {"njit": numba.njit}
    exec(collector.text(), scope)
    compiled = scope[name]
    assert callable(compiled)
    plain = periodic_motion(MEAN, COSINES, SINES, 0.17, STRIDE_TIME)
    assert compiled(MEAN, COSINES, SINES, 0.17, STRIDE_TIME) == pytest.approx(plain, rel=1e-12)


def test_both_ends_of_the_stride_are_the_same() -> None:
    ends = np.array([periodic_value(MEAN, COSINES, SINES, phase) for phase in (0.0, 1.0, 2.0)])
    assert np.ptp(ends) < 1e-8
