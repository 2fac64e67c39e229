"""A set says what its actuator turns: the joint and its two directions, in tables, figures and reports."""

from importlib import resources
from pathlib import Path

import pytest

from ppafo.analyses.sets.audit import shown_values
from ppafo.errors import ParameterError
from ppafo.parameters import load_device, load_parameter_set
from ppafo.parameters.joint import JointNames
from ppafo.parameters.loading import parameter_set_toml, parse_parameter_set

CYLINDER = (resources.files("ppafo.parameters") / "sets" / "cylinder-lever.toml").read_text(encoding="utf-8")
ELBOW = '\n[joint]\nname = "elbow"\npositive = "flexion"\n'


@pytest.fixture
def elbow(tmp_path: Path) -> Path:
    file = tmp_path / "elbow.toml"
    file.write_text(CYLINDER.replace('name = "cylinder-lever"', 'name = "elbow"', 1) + ELBOW, encoding="utf-8")
    return file


def test_a_set_names_its_joint_and_the_opposite_is_known(elbow: Path) -> None:
    loaded = load_parameter_set(elbow)
    assert load_device(loaded).joint == JointNames("elbow", "flexion", "extension")
    written = parse_parameter_set(parameter_set_toml(loaded).encode(), "again", elbow.parent)
    assert written.joint == loaded.joint
    assert "joint: elbow, whose angle grows in flexion, falls in extension" in str(shown_values(loaded))


@pytest.mark.parametrize(
    ("joint", "message"),
    [
        ('name = "elbow"', "'joint.positive' is missing|joint.positive"),
        (
            'name = "elbow"\npositive = "flexoin"',
            "the name of the opposite direction is unknown.*flexion.*joint.negative",
        ),
        ('name = "elbow"\npositive = "flexion"\nsign = "up"', "unknown key 'joint.sign'"),
        ('name = ""\npositive = "flexion"', "joint.name"),
    ],
)
def test_words_that_cannot_be_are_refused(joint: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        parse_parameter_set(f"{CYLINDER}\n[joint]\n{joint}\n".encode(), "elbow.toml")
