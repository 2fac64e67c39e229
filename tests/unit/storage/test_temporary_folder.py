"""Temporary folders in which something is built: a full one is one line with a remedy, and nothing stays in it."""

import errno
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from ppafo.errors import DataError
from ppafo.exports.fmu import platforms
from ppafo.page import workbench
from ppafo.processor.simulated import try_firmware
from ppafo.simulation.loading import load_scenario
from ppafo.storage.files import temporary_folder

BUILDERS: dict[str, Callable[[], object]] = {
    "unit": lambda: platforms.build("linux64", {"unit.c": b"int"}, "unit.c"),
    "page": lambda: workbench.built({"module.c": b"int"}),
    "firmware": lambda: try_firmware(load_scenario("torque-task-solenoid"), 1),
    "study": lambda: temporary_folder("ppafo-study", {"a/b": b"x"}),
}


@pytest.mark.parametrize("name", BUILDERS)
def test_a_full_temporary_folder_is_said_in_one_line_by_all_that_build_in_one(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_path: Path, _content: bytes) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(platforms, "compiler_for", lambda _name: ["cc"])
    monkeypatch.setattr("ppafo.processor.simulated.missing_tools", lambda: ())
    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(DataError, match=r"^temporary files cannot be written: no space left on device; .*TMPDIR"):
        BUILDERS[name]()
    assert list(tmp_path.iterdir()) == []


def test_files_lie_in_the_folder_by_path_as_long_as_it_is_needed() -> None:
    with temporary_folder("ppafo", {"sources/unit.c": b"int"}) as folder:
        assert Path(folder, "sources", "unit.c").read_bytes() == b"int"
    assert not Path(folder).exists()
