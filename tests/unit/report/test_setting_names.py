"""What people call a setting."""

import pytest

from ppafo.report.kind import label_of


@pytest.mark.parametrize(
    ("path", "label"),
    [
        ("valve.area", "Valve area"),
        ("effects.mesh.area", "Area"),
        ("sensors.angle_noise", "Sensors: angle noise"),
    ],
)
def test_a_setting_is_called_by_its_own_name_or_after_the_last_part_of_its_path(path: str, label: str) -> None:
    assert label_of(path) == label
