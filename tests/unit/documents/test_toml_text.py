"""A document is read from its file: one that is changed by whoever asked for it is as written for the next."""

from importlib import resources
from pathlib import Path

import pytest

from ppafo.documents.regular_file import MAXIMUM_BYTES_TYPED
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import ParameterError, PpafoError, ScenarioError
from ppafo.parameters import load_parameter_set
from ppafo.simulation.loading import load_scenario

KIND = TomlKind("scenario", "scenario", resources.files("ppafo") / "scenarios", ScenarioError)


def test_what_one_reader_changes_in_a_document_another_does_not_see() -> None:
    content = b'name = "mine"\n[device]\noverrides = ["valve.area=1 mm^2"]\n'
    first = KIND.parse(content, "mine.toml")
    first["device"]["overrides"].append("valve.area=2 mm^2")
    first["device"]["set"] = "another"
    assert KIND.parse(content, "mine.toml") == {"name": "mine", "device": {"overrides": ["valve.area=1 mm^2"]}}


@pytest.mark.parametrize(("load", "kind"), [(load_scenario, ScenarioError), (load_parameter_set, ParameterError)])
def test_a_typed_file_of_more_than_a_megabyte_is_refused(load, kind: type[PpafoError], tmp_path: Path) -> None:
    file = tmp_path / "long.toml"
    file.write_bytes(b"#" * MAXIMUM_BYTES_TYPED)
    with pytest.raises(kind, match=r"^(?!.*larger).*$"):
        load(file)
    file.write_bytes(b"#" * (MAXIMUM_BYTES_TYPED + 1))
    with pytest.raises(kind, match=r"long\.toml: cannot be read: it is larger than 1 MB"):
        load(file)


def test_dots_that_are_no_key_are_read() -> None:
    text = 'note = "' + "end. " * 100 + '" # ' + "." * 100
    assert KIND.parse(text.encode(), "mine.toml") == {"note": "end. " * 100}
