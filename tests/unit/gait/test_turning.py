"""The knee over a resting ankle, from the shank angle alone."""

import numpy as np
import pytest

from ppafo.gait import Gait
from ppafo.gait.plausible.turning import FOOT_FLAT, turning_about_ankle

PHASES = np.linspace(0.0, 1.0, 101)
SHANK = 0.43


def test_the_turning_is_the_second_derivative_of_where_the_knee_is(normative: Gait) -> None:
    step, time = 1e-4, normative.stride_time
    knee = []
    for shift in (-step, 0.0, step):
        phi = normative.shank_angle.values_at(PHASES[FOOT_FLAT] + shift)
        # The ankle is in front of the knee with phi above 0, so the knee lies behind the resting ankle.
        knee.append(np.stack([-SHANK * np.sin(phi), SHANK * np.cos(phi)]))
    expected = (knee[0] - 2.0 * knee[1] + knee[2]) / (step * time) ** 2
    found = SHANK * turning_about_ankle(normative.shank_angle.values_at(PHASES), time)
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_the_knee_of_the_built_in_gait_turns_about_the_ankle_of_its_standing_foot(normative: Gait) -> None:
    given = np.stack([normative.curve(name).values_at(PHASES[FOOT_FLAT]) for name in ("knee_forward", "knee_up")])
    turning = SHANK * turning_about_ankle(normative.shank_angle.values_at(PHASES), normative.stride_time)
    left = np.sqrt(np.mean((given - turning) ** 2, axis=1))
    assert left == pytest.approx([1.2, 0.9], abs=0.05)
    assert np.all(np.sqrt(np.mean((given[::-1] - turning) ** 2, axis=1)) > 2.0 * left)
