"""The published schema says the same as the loader."""

import tomllib
from importlib import resources
from typing import Any

import jsonschema  # type: ignore[import-untyped]
import pytest

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.loading import json_schema
from ppafo.simulation.loading import list_scenarios


def document_of(name: str) -> dict[str, Any]:
    return tomllib.loads((resources.files("ppafo") / "scenarios" / f"{name}.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", list_scenarios())
def test_every_scenario_of_the_package_fits_the_schema(name: str) -> None:
    assert not list(jsonschema.Draft202012Validator(json_schema()).iter_errors(document_of(name)))


@pytest.mark.parametrize(
    ("section", "change"),
    [
        ("run", {"colour": "blue"}),
        ("motion", {"angle": 75}),
        ("motion", {"kind": "hold"}),
        ("controller", {"rate": True}),
    ],
)
def test_the_schema_refuses_what_the_loader_refuses(section: str, change: dict[str, Any]) -> None:
    document = document_of("torque-task-proportional")
    document[section] |= change
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(document, json_schema())


def test_the_schema_knows_every_controller_and_profile_and_their_settings() -> None:
    sections = json_schema()["$defs"].values()
    described = {(item["properties"].get("kind", {}).get("const"), frozenset(item["properties"])) for item in sections}
    for controller in CONTROLLERS.values():
        names = {"kind", "rate", "period", *(quantity.name for quantity in controller.quantities)}
        assert (controller.name, frozenset(names)) in described
    for profile in PROFILES.values():
        assert (profile.name, frozenset({"kind", *(quantity.name for quantity in profile.quantities)})) in described
