"""The way of the knee in the plane, against the same leg in space."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.gait import Gait
from ppafo.gait.plausible import FOOT_FLAT, turning_about_ankle
from ppafo.gait.recorded.importing import acceleration_of
from ppafo.gait.recorded.signal import knee_position
from ppafo.signals.recording import Floats

HIP = np.array([-0.06828, -0.06384, 0.08233])
KNEE = np.array([-0.00451, -0.39691, 0.0])
"""Right hip in the pelvis and knee in the thigh [m] in the authors' scaled model of the subject
(github.com/antoinefalisse/3dpredictsim, ExternalFunctions/PredSim.cpp)."""
CHAIN = ("pelvis_tilt", "pelvis_list", "pelvis_rotation"), ("hip_flexion_r", "hip_adduction_r", "hip_rotation_r")


def knee_in_space(columns: dict[str, Floats]) -> Floats:
    """Where the knee is [m] with every angle of pelvis and hip, each turned about z, x and y."""
    from scipy.spatial.transform import Rotation

    pelvis, hip = (
        Rotation.from_euler("ZXY", np.stack([columns[n] for n in names], 1), degrees=True) for names in CHAIN
    )
    origin = np.stack([columns[f"pelvis_t{axis}"] for axis in "xyz"], axis=1)
    return np.asarray(origin + pelvis.apply(HIP) + (pelvis * hip).apply(KNEE))


def test_the_plane_gives_the_accelerations_of_the_leg_in_space(normative: Gait, shared_data: Path) -> None:
    from scipy.io import loadmat

    file = loadmat(shared_data / "gait" / "falisse2019_subject1" / "IK_average_walking_FGC.mat", squeeze_me=True)
    table = file["Qsall"]
    columns = {str(name): table["data"].item()[:, i] for i, name in enumerate(table["colheaders"].item())}
    lean = np.radians(columns["pelvis_tilt"] + columns["hip_flexion_r"])
    plane = knee_position(columns["pelvis_tx"], columns["pelvis_ty"], lean, float(np.hypot(*KNEE[:2])))
    space = knee_in_space(columns)
    phases = np.linspace(0.0, 1.0, lean.size)
    for axis, name in enumerate(("knee_forward", "knee_up")):
        shown = acceleration_of(plane[axis], 6, normative.stride_time)
        np.testing.assert_allclose(shown, normative.curve(name).values_at(phases), atol=0.01)
        apart = shown - acceleration_of(space[:, axis], 6, normative.stride_time)
        assert np.sqrt(np.mean(apart**2)) < 0.75


def test_the_mean_speed_is_taken_out() -> None:
    phase = np.linspace(0.0, 1.0, 101)
    way = 0.05 * np.cos(2.0 * np.pi * 2.0 * phase)
    expected = -((2.0 * np.pi * 2.0 / 1.2) ** 2) * way
    for speed in (0.0, 1.4, -1.4):
        assert acceleration_of(way + speed * 1.2 * phase, 6, 1.2) == pytest.approx(expected, abs=1e-9)


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
