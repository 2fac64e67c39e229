"""The readings of the paper's chambers: three of its own device, none of any other."""

from dataclasses import replace

import pytest

from ppafo.parameters import load_device
from ppafo.parameters.chamber_volumes import SHORT_LINES, other_readings, own_reading, readings

PAPER = load_device("ppafo2011")


def test_there_are_three_and_each_is_known_by_its_volumes() -> None:
    assert [reading.name for reading in readings()] == ["ppafo2011", "ppafo2011-consistent", SHORT_LINES]
    for reading in readings():
        values = {path.removeprefix("actuator."): number for path, number in reading.numbers().items()}
        assert own_reading(replace(PAPER.actuator, **values)) == reading


@pytest.mark.parametrize("name", ["ppafo2011", "ppafo2011-consistent"])
def test_a_device_of_the_paper_has_the_two_others(name: str) -> None:
    others = other_readings(load_device(name).actuator)
    assert len(others) == 2
    assert name not in {reading.name for reading in others}


@pytest.mark.parametrize("field", ["torque_constant", "volume_per_angle", "dead_volume_1"])
def test_a_device_with_numbers_of_its_own_has_none(field: str) -> None:
    own = replace(PAPER.actuator, **{field: 1.1 * getattr(PAPER.actuator, field)})
    assert other_readings(own) == ()
