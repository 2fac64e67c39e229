"""What may be meant by a column that is not there: the same joint, marker and side, or nothing."""

import pytest

from ppafo.gait.recorded.mapping import ShankMap, column_names
from ppafo.gait.recorded.near_columns import nearest_column
from ppafo.storage.text_table import told_apart

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


@pytest.mark.parametrize(
    ("names", "descriptions", "apart"),
    [
        (["A", "B", "A"], [], ["A#1", "B", "A#2"]),
        (["A", "B", "A"], ["left", "", "right"], ["left", "B", "right"]),
        (["A", "B", "A"], ["B", "", "right"], ["A#1", "B", "A#2"]),
        (["A", "A", "A"], ["one", "", "three"], ["A#1", "A#2", "A#3"]),
        (["A", "B"], ["one", "two"], ["A", "B"]),
    ],
)
def test_doubled_names_are_told_apart(names: list[str], descriptions: list[str], apart: list[str]) -> None:
    assert told_apart(names, descriptions) == apart


def test_a_map_may_name_a_column_with_its_unit_as_the_header_does() -> None:
    shank = ShankMap(terms=("shank to vertical [deg]", "-lean[2]"))
    assert column_names(shank) == ("shank to vertical", "-lean[2]")
