"""Several sets in one ``ppafo validate``: how they are named, and what is refused."""

import pytest

from ppafo.errors import DataError
from ppafo.questions.validate.several import NamedSet, parse_sets


def test_a_set_is_named_with_values_of_its_own() -> None:
    text = "sets/fitted.toml:friction.static_torque=0 N m, valve.area=12 mm^2"
    own = ("friction.static_torque=0 N m", "valve.area=12 mm^2")
    assert parse_sets("ppafo2011", [text, "fitted.toml"]) == (
        NamedSet("ppafo2011", "ppafo2011"),
        NamedSet(text, "sets/fitted.toml", own),
        NamedSet("fitted.toml", "fitted.toml"),
    )


@pytest.mark.parametrize("text", ["", "valve.area=12 mm^2", ":valve.area=12 mm^2", "ppafo2011:=2"])
def test_a_text_without_a_set_or_a_path_is_refused(text: str) -> None:
    with pytest.raises(DataError, match="NAME or NAME:PATH=VALUE"):
        parse_sets("ppafo2011", [text])


def test_a_set_that_is_named_twice_is_refused() -> None:
    with pytest.raises(DataError, match="named twice"):
        parse_sets("ppafo2011", ["ppafo2011"])
