"""A document is read from its file: one that is changed by whoever asked for it is as written for the next."""

import os
import time
import tracemalloc
from dataclasses import replace
from importlib import resources
from pathlib import Path

import pytest

from ppafo import read_result
from ppafo.documents.regular_file import MAXIMUM_BYTES_TYPED, read_regular_file
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import DataError, ParameterError, PpafoError, ScenarioError
from ppafo.parameters import load_parameter_set
from ppafo.simulation.loading import load_scenario
from ppafo.storage import read_csv
from ppafo.storage.netcdf_reading import read_netcdf
from ppafo.storage.owned_folder import read_json
from ppafo.storage.reading import read_recording

KIND = TomlKind("scenario", "scenario", resources.files("ppafo") / "scenarios", ScenarioError)


def test_what_one_reader_changes_in_a_document_another_does_not_see() -> None:
    content = b'name = "mine"\n[device]\noverrides = ["valve.area=1 mm^2"]\n'
    first = KIND.parse(content, "mine.toml")
    first["device"]["overrides"].append("valve.area=2 mm^2")
    first["device"]["set"] = "another"
    assert KIND.parse(content, "mine.toml") == {"name": "mine", "device": {"overrides": ["valve.area=1 mm^2"]}}


ENDLESS = Path("/dev/zero")
needs_pipes = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes here")
needs_devices = pytest.mark.skipif(not ENDLESS.exists(), reason="there is no endless device here")


@needs_pipes
@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("a.toml", load_scenario),
        ("a.toml", load_parameter_set),
        ("a.csv", read_csv),
        ("a.nc", read_netcdf),
        ("a.csv", read_recording),
        ("run.json", lambda path: read_result(path.parent)),
    ],
)
def test_a_named_pipe_is_refused_at_once_wherever_a_file_is_read(name: str, read, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / name)
    with pytest.raises(PpafoError, match=r"cannot be read: it is a device or a pipe, not a regular file$") as caught:
        read(tmp_path / name)
    assert str(caught.value).startswith(str(tmp_path / name))


@needs_devices
def test_a_device_that_never_ends_is_refused() -> None:
    for read, kind in ((load_scenario, ScenarioError), (load_parameter_set, ParameterError), (read_csv, DataError)):
        with pytest.raises(kind, match="/dev/zero: cannot be read: it is a device or a pipe"):
            read(ENDLESS)


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        read_regular_file(tmp_path)


@pytest.mark.parametrize(("load", "kind"), [(load_scenario, ScenarioError), (load_parameter_set, ParameterError)])
def test_a_typed_file_of_more_than_a_megabyte_is_refused(load, kind: type[PpafoError], tmp_path: Path) -> None:
    file = tmp_path / "long.toml"
    file.write_bytes(b"#" * MAXIMUM_BYTES_TYPED)
    with pytest.raises(kind, match=r"^(?!.*larger).*$"):
        load(file)
    file.write_bytes(b"#" * (MAXIMUM_BYTES_TYPED + 1))
    with pytest.raises(kind, match=r"long\.toml: cannot be read: it is larger than 1 MB"):
        load(file)


def test_a_document_of_ours_that_is_far_too_long_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "run.json"
    file.write_bytes(b" " * 16_000_001)
    with pytest.raises(DataError, match=r"run\.json: cannot be read: it is larger than 16 MB"):
        read_json(file)


def test_a_link_to_a_file_is_read_and_recordings_may_be_long(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"x" * (MAXIMUM_BYTES_TYPED + 1))
    (tmp_path / "link").symlink_to(tmp_path / "file")
    assert len(read_regular_file(tmp_path / "link")) == MAXIMUM_BYTES_TYPED + 1


def test_room_is_taken_for_what_is_there_and_not_for_the_most_that_may_be(tmp_path: Path) -> None:
    (tmp_path / "small").write_bytes(b"x" * 1000)
    tracemalloc.start()
    content = read_regular_file(tmp_path / "small", 2_000_000_000)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert content == b"x" * 1000
    assert most < 10_000_000


def test_a_file_of_another_kind_and_a_folder_are_answered_with_what_to_give(tmp_path: Path) -> None:
    kind = replace(KIND, made=", which a command makes")
    (tmp_path / "walk.csv").write_text("time [s],angle [deg]\n", encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"walk\.csv: is not valid TOML: .*; give a \.toml file, which a command"):
        kind.parse(kind.read(tmp_path / "walk.csv"), "walk.csv")
    (tmp_path / "walk.csv").write_bytes(b"0" * (MAXIMUM_BYTES_TYPED + 1))
    with pytest.raises(ScenarioError, match=r"it is larger than 1 MB, .*; give a \.toml file, which a command makes$"):
        kind.read(tmp_path / "walk.csv")
    with pytest.raises(
        ScenarioError, match=r"it is a directory, not a file; give a \.toml file, which a command makes$"
    ):
        kind.read(tmp_path)
    (tmp_path / "run.json").write_text("{}", encoding="utf-8")
    for stored in (tmp_path, tmp_path / "run.json"):
        with pytest.raises(
            ScenarioError,
            match=r"it is a stored result, which is not run or compared again: give .*; its numbers are in ppafo\.read",
        ):
            kind.parse(kind.read(stored), str(stored))
    (tmp_path / "mine.toml").touch()
    with pytest.raises(ScenarioError, match=r"it is a directory, not a file; give \S*/mine\.toml$"):
        kind.read(tmp_path)


def test_a_number_that_would_become_0_is_refused() -> None:
    with pytest.raises(
        ScenarioError, match=r"mine.toml: is not valid TOML: 1e-400 is too close to 0 for a 64-bit number"
    ):
        KIND.parse(b"value = 1e-400", "mine.toml")
    assert KIND.parse(b"value = 0.0e-400", "mine.toml") == {"value": 0.0}


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
    assert KIND.parse(text.encode(), "mine.toml") == {"note": "end. " * 100}
