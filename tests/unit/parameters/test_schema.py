"""The published schema says the same as the loader."""

import functools
import operator
import tomllib
from importlib import resources
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import pytest

from ppafo.parameters import list_sets
from ppafo.parameters.loading import json_schema


def document_of(name: str) -> dict[str, Any]:
    return tomllib.loads((resources.files("ppafo.parameters") / "sets" / f"{name}.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", list_sets())
def test_every_set_of_the_package_fits_the_schema(name: str) -> None:
    assert not list(jsonschema.Draft202012Validator(json_schema()).iter_errors(document_of(name)))


def test_the_schema_refuses_an_unknown_key() -> None:
    document = document_of("ppafo2011") | {"colour": "blue"}
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(document, json_schema())


@pytest.mark.parametrize("of", [("valves",), ("reported", "valves")])
def test_the_schema_refuses_a_name_of_a_valve_that_no_path_can_hold(of: tuple[str, ...]) -> None:
    document = document_of("ppafo2011-printed")
    jsonschema.validate(document, json_schema())
    valves = functools.reduce(operator.getitem, of, document)
    valves["mhj.10"] = valves.pop("solenoid")
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(document, json_schema())
