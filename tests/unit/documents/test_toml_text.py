"""A document is read from its file: one that is changed by whoever asked for it is as written for the next."""

import time
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
    first = KIND.parse(content, "mine.toml").document
    first["device"]["overrides"].append("valve.area=2 mm^2")
    first["device"]["set"] = "another"
    assert KIND.parse(content, "mine.toml").document == {"name": "mine", "device": {"overrides": ["valve.area=1 mm^2"]}}


@pytest.mark.parametrize(("load", "kind"), [(load_scenario, ScenarioError), (load_parameter_set, ParameterError)])
def test_a_typed_file_of_more_than_a_megabyte_is_refused(load, kind: type[PpafoError], tmp_path: Path) -> None:
    file = tmp_path / "long.toml"
    file.write_bytes(b"#" * MAXIMUM_BYTES_TYPED)
    with pytest.raises(kind, match=r"^(?!.*larger).*$"):
        load(file)
    file.write_bytes(b"#" * (MAXIMUM_BYTES_TYPED + 1))
    with pytest.raises(kind, match=r"long\.toml: cannot be read: it is larger than 1 MB"):
        load(file)


def test_a_number_that_would_become_0_is_refused() -> None:
    with pytest.raises(
        ScenarioError, match=r"mine.toml: is not valid TOML: 1e-400 is too close to 0 for a 64-bit number"
    ):
        KIND.parse(b"value = 1e-400", "mine.toml")
    assert KIND.parse(b"value = 0.0e-400", "mine.toml").document == {"value": 0.0}


@pytest.mark.parametrize("text", ["mine = 28,014  # kg", "mine = { value = 28,014, unit = 'kg' }", "mine = -1.234,5"])
def test_a_comma_in_a_number_is_named(text: str) -> None:
    with pytest.raises(ScenarioError, match=r"^file: line 2: mine = (28,014|-1\.234,5): a number has a point"):
        KIND.parse(f"[table]\n{text}\n".encode(), "file")


@pytest.mark.parametrize("text", ["[{}]", "{} = 1", "mine = {{{} = 1}}", "[[ {} ]]"])
@pytest.mark.parametrize("dot", [".", " . "])
def test_a_key_of_very_many_dots_is_refused_at_once(text: str, dot: str) -> None:
    key = dot.join(["a", '"b"'] * 25_000)
    start = time.process_time()
    with pytest.raises(ScenarioError, match=r"^mine.toml: has tables nested deeper than 50 levels; a few are enough$"):
        KIND.parse(text.format(key).encode(), "mine.toml")
    assert time.process_time() - start < 1.0


def test_dots_that_are_no_key_are_read() -> None:
    text = 'note = "' + "end. " * 100 + '" # ' + "." * 100
    assert KIND.parse(text.encode(), "mine.toml").document == {"note": "end. " * 100}
