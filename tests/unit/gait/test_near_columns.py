"""What may be meant by a column that is not there: the same joint, marker and side, or nothing."""

import pytest

from ppafo.gait.recorded.near_columns import nearest_column

MARKERS = ["RTOE.x", "RTOE.y", "RANK.x", "LKNE.x", "RHEE.x", "RASI.x"]
COORDINATES = ["ankle_angle_l", "knee_angle_r", "hip_flexion_r", "subtalar_angle_r", "pelvis_tilt", "R.Knee.x"]


@pytest.mark.parametrize(
    ("missing", "known", "meant"),
    [
        ("RKNE.x", ["RTOE.x", "RANK.x"], ""),
        ("RKNE.x", MARKERS, "LKNE.x"),
        ("RANK.y", MARKERS, ""),
        ("ankle_angle_r", COORDINATES, "ankle_angle_l"),
        ("elbow_flex_r", COORDINATES, ""),
        ("ankel_angle_l", COORDINATES, "ankle_angle_l"),
        ("knee_angel_r", COORDINATES, "knee_angle_r"),
        ("hip_flexion_l", COORDINATES, "hip_flexion_r"),
        ("pelvistilt", COORDINATES, "pelvis_tilt"),
        ("R.Kneee.x", COORDINATES, "R.Knee.x"),
        ("L.Knee.x", COORDINATES, "R.Knee.x"),
        ("L.Toe.x", COORDINATES, ""),
    ],
)
def test_only_a_column_of_the_same_kind_is_suggested(missing: str, known: list[str], meant: str) -> None:
    assert nearest_column(missing, known) == (f", did you mean '{meant}'?" if meant else "")
