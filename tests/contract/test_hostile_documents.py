"""Whatever lies in the place of a file that people write, the answer is one line, soon, whatever kind of file it is."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ppafo.analyses.design.problem import load_design
from ppafo.analyses.reproduce.claims import load_publication
from ppafo.analyses.tuning import load_tuning
from ppafo.cli.doctor import FORMATS
from ppafo.documents.json_text import MAXIMUM_LEVELS, is_nested_too_deeply, json_document
from ppafo.errors import PpafoError
from ppafo.gait.document import load_gait
from ppafo.gait.recorded.mapping import load_map
from ppafo.identification.problem import load_problem
from ppafo.parameters import load_parameter_set
from ppafo.parameters.bottles.bottle import load_bottle
from ppafo.rig.preset import load_preset
from ppafo.simulation.loading import load_scenario, scenario_from_dict
from ppafo.storage.column_map import load_column_map
from ppafo.storage.reading import read_recording
from ppafo.studies.loading import load_study
from ppafo.walking.loading import load_walk

LOADERS: dict[str, Callable[[str], Any]] = {
    "parameters": load_parameter_set,
    "scenario": load_scenario,
    "study": load_study,
    "tuning": load_tuning,
    "design": load_design,
    "walk": load_walk,
    "identification": load_problem,
    "columns": load_column_map,
    "rig": load_preset,
    "gait": load_gait,
    "gait-map": load_map,
    "bottle": load_bottle,
    "publication": load_publication,
}

DEEP = 600
CONTENTS = {
    "tables in tables": f"[{'.'.join('a' * DEEP)}]\n".encode(),
    "dotted keys": f"{'.'.join('a' * DEEP)} = 1\n".encode(),
    "inline tables": b"a = " + b"{b = " * 60 + b"1" + b"}" * 60 + b"\n",
    "inline tables without end": b"a = " + b"{b = " * 100_000,
    "lists in lists": b"a = " + b"[" * 60 + b"]" * 60 + b"\n",
    "lists without end": b"a = " + b"[" * 200_000,
    "tables in a list": b"[[a]]\n" + f"[{'.'.join('a' * DEEP)}]\n".encode(),
    "long number": b"schema_version = " + b"9" * 10_000 + b"\n",
    "long unit": b'name = "1 ' + b"m" * 100_000 + b'"\n',
    "zero byte": b'name = "a\0b"\n',
    "not UTF-8": b'name = "\xff"\n',
    "UTF-16": 'name = "a"\n'.encode("utf-16"),
    "nothing": b"",
    "blanks": b" \n\t\n",
    "too long": b"# comment\n" * 200_000,
    "a comment": b"# nothing else\n",
}


def pipe(path: Path) -> None:
    os.mkfifo(path)


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def loop(path: Path) -> None:
    path.symlink_to(path)


def dangling(path: Path) -> None:
    path.symlink_to("nowhere")


def sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(10**12)


PLACES = [pipe, device, loop, dangling, sparse, Path.mkdir]


def assert_refused(load: Callable[[str], Any], path: Path) -> None:
    """One line that names the file, from any loader."""
    with pytest.raises(PpafoError) as refused:
        load(str(path))
    message = str(refused.value)
    assert path.name in message
    assert len(message.splitlines()) == 1
    assert len(message) < 2_000


def test_every_format_has_its_loader_here() -> None:
    assert set(LOADERS) == set(FORMATS)


@pytest.mark.parametrize("kind", CONTENTS)
@pytest.mark.parametrize("name", LOADERS)
def test_hostile_content_is_refused_in_one_line(tmp_path: Path, name: str, kind: str) -> None:
    path = tmp_path / "hostile.toml"
    path.write_bytes(CONTENTS[kind])
    assert_refused(LOADERS[name], path)


@pytest.mark.parametrize("make", PLACES, ids=lambda make: make.__name__)
@pytest.mark.parametrize("name", LOADERS)
def test_what_is_no_file_is_refused_in_one_line(tmp_path: Path, name: str, make: Callable[[Path], None]) -> None:
    path = tmp_path / "hostile.toml"
    make(path)
    assert_refused(LOADERS[name], path)


@pytest.mark.parametrize("ending", ["csv", "nc"])
@pytest.mark.parametrize("make", PLACES, ids=lambda make: make.__name__)
def test_what_is_no_recording_is_refused_in_one_line(tmp_path: Path, ending: str, make: Callable[[Path], None]) -> None:
    path = tmp_path / f"hostile.{ending}"
    make(path)
    assert_refused(read_recording, path)


def test_depth_of_a_document_is_counted_and_a_circle_has_none() -> None:
    deep: Any = 1
    for _ in range(MAXIMUM_LEVELS):
        deep = {"a": [deep]} if isinstance(deep, int) else {"a": deep}
    assert not is_nested_too_deeply(deep["a"])
    assert is_nested_too_deeply({"a": deep})
    circle: dict[str, Any] = {}
    circle["a"] = [circle, circle]
    assert is_nested_too_deeply(circle)
    for load in (scenario_from_dict, load_study, load_tuning):
        with pytest.raises(PpafoError, match="nested deeper"):
            load(circle)


def test_json_is_read_back_as_it_was_written_and_no_deeper() -> None:
    assert json_document(b'{"a": [1, "\xc3\xa9"]}') == {"a": [1, "é"]}
    with pytest.raises(ValueError, match="nested"):
        json_document(b"[" * 100 + b"]" * 100)
