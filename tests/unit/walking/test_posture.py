"""Where the leg is in the plane: on the ground in stance, over it in the swing, with segments of the right length."""

import numpy as np
import pytest

from ppafo.gait import load_gait
from ppafo.walking.gait_series import MID_SWING_CLEARANCE, AnklePath, ankle_path, gait_timing
from ppafo.walking.wearer import paper_subject

PHASES = np.linspace(0.0, 1.0, 401)


@pytest.fixture(scope="module")
def path() -> AnklePath:
    gait = load_gait()
    return ankle_path(gait, gait_timing(gait), paper_subject())


def angles() -> tuple[np.ndarray, np.ndarray]:
    gait = load_gait()
    return gait.shank_angle.values_at(PHASES), gait.ankle_angle.values_at(PHASES)


def test_the_healthy_foot_touches_the_ground_in_stance_and_clears_it_in_the_swing(path: AnklePath) -> None:
    posture = path.posture(PHASES[:-1], *(values[:-1] for values in angles()))
    lowest = np.minimum(posture.heel[:, 1], posture.toe[:, 1])
    stance = PHASES[:-1] < load_gait().stance_share
    np.testing.assert_allclose(lowest[stance], 0.0, atol=1e-3)
    middle = np.abs(PHASES[:-1] - 0.5 * (1.0 + load_gait().stance_share)) < 0.005
    assert lowest[middle] == pytest.approx(MID_SWING_CLEARANCE, abs=1e-3)
    assert lowest.min() > -1e-3


def test_the_ankle_moves_smoothly_through_the_swing_and_sets_the_heel_down(path: AnklePath) -> None:
    gait = load_gait()
    phases = np.linspace(0.0, 1.0, 1001)
    swing = phases[:-2] > gait.stance_share + 0.01
    assert np.abs(np.diff(path.up, 2)[swing]).max() < 1e-4, "a kink would be 1.6 mm"
    posture = path.posture(
        phases[:-1], gait.shank_angle.values_at(phases[:-1]), gait.ankle_angle.values_at(phases[:-1])
    )
    assert abs(posture.heel[-1, 1]) < 1e-3
    late = phases[:-1] > 0.9
    assert posture.heel[late, 1].min() > -1e-3
    assert (np.diff(posture.toe[late, 1]) > -1e-3).all()
    assert (np.diff(posture.heel[late, 1]) < 0.0).all()


def test_segments_keep_their_lengths_and_the_ankle_its_angle(path: AnklePath) -> None:
    shank, ankle = angles()
    posture = path.posture(PHASES, shank, ankle + 0.3)
    wearer = paper_subject()
    np.testing.assert_allclose(np.linalg.norm(posture.knee - posture.ankle, axis=1), wearer.shank_length, rtol=1e-9)
    length = wearer.heel_lever + wearer.toe_lever
    np.testing.assert_allclose(np.linalg.norm(posture.toe - posture.heel, axis=1), length, rtol=1e-9)
    sole = posture.toe - posture.heel
    tilt = np.arctan2(sole[:, 1], sole[:, 0])
    np.testing.assert_allclose(tilt + path.ground_angle, shank - ankle - 0.3 + 0.5 * np.pi, atol=1e-9)


def test_a_loaded_foot_does_not_slide_and_a_stride_leads_on(path: AnklePath) -> None:
    shank, ankle = angles()
    posture = path.posture(PHASES, shank, ankle)
    flat = (PHASES > 0.2) & (PHASES < 0.35)
    assert np.ptp(posture.ankle[flat, 0]) < 0.01
    assert path.stride_length == pytest.approx(1.33 * 1.0384)
    start, end = path.posture(np.array([0.0, 0.9999]), shank[[0, -1]], ankle[[0, -1]]).ankle[:, 0]
    assert end - start == pytest.approx(path.stride_length, abs=2e-3)
    assert np.abs(np.diff(posture.ankle[:, 0])).max() < 0.03


def test_toe_height_is_that_of_the_posture(path: AnklePath) -> None:
    shank, ankle = angles()
    posture = path.posture(PHASES, shank, ankle + 0.2)
    np.testing.assert_allclose(path.toe_height(PHASES % 1.0, shank, ankle + 0.2), posture.toe[:, 1], atol=1e-12)
