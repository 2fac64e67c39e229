"""A document is read from its file: one that is changed by whoever asked for it is as written for the next."""

from importlib import resources

from ppafo.documents.toml_text import TomlKind
from ppafo.errors import ScenarioError

KIND = TomlKind("scenario", "scenario", resources.files("ppafo") / "scenarios", ScenarioError)


def test_what_one_reader_changes_in_a_document_another_does_not_see() -> None:
    content = b'name = "mine"\n[device]\noverrides = ["valve.area=1 mm^2"]\n'
    first = KIND.parse(content, "mine.toml")
    first["device"]["overrides"].append("valve.area=2 mm^2")
    first["device"]["set"] = "another"
    assert KIND.parse(content, "mine.toml") == {"name": "mine", "device": {"overrides": ["valve.area=1 mm^2"]}}
