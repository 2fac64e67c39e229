"""A walk that fails within its first sample says so, as every other failure."""

import pytest

from ppafo.walking import contradictions
from ppafo.walking.loading import load_walk
from ppafo.walking.walk import walk

# The ankle begins beyond the stop of a device whose chambers can neither hold nor vent their gas.
BEYOND = (
    "actuator.angle_max=81.7 deg",
    "actuator.displacement_per_radian=100.8 cm^3/rad",
    "actuator.dead_volume_1=2 cm^3",
    "actuator.dead_volume_2=2 cm^3",
    "valve.discharge_coefficient=0.0116",
)


def test_a_walk_that_fails_at_once_has_a_status_and_one_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    # The stop that a gait passes is refused when the walk is loaded.
    monkeypatch.setattr(contradictions, "BEYOND_STOP", 1.0)
    result = walk(load_walk("off", BEYOND), minutes=0.09)
    assert result.status.kind == "diverged"
    assert "try a smaller run.step" in result.status.message
    assert len(result.recording.time) == 1
    assert result.recording["swing_knee_torque"].shape == (1,)
