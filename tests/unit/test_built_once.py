"""The tests build each library once."""

import shutil
from pathlib import Path

import pytest

from ppafo.errors import ProgramError
from ppafo.exports.fmu import platforms
from ppafo.translation import compiling
from tests import built_once

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
SOURCE = "double answer(void) { return 42.0; }\n"


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """What compilers are asked."""
    lines: list[list[str]] = []

    def ask(line: list[str], remedy: str, folder: str, scratch: Path) -> built_once.Done:
        lines.append(line)
        return compiling.asked(line, remedy, folder, scratch)

    monkeypatch.setattr(platforms, "asked", built_once._asked_once(ask))
    monkeypatch.setattr(platforms, "compiler_for", lambda _name: ["gcc", "-s"])
    return lines


def test_the_same_sources_are_built_once_and_others_anew(asked: list[list[str]], tmp_path: Path) -> None:
    mark = f"/* {tmp_path} */\n"
    first, again = (platforms.build("linux64", {"a.c": (mark + SOURCE).encode()}, "a.c") for _ in range(2))
    assert first == again
    assert first.startswith(b"\x7fELF")
    assert len(asked) == 1
    platforms.build("linux64", {"a.c": (mark + SOURCE.replace("42", "43")).encode()}, "a.c")
    assert len(asked) == 2


def test_what_is_refused_is_refused_again(asked: list[list[str]]) -> None:
    for _ in range(2):
        with pytest.raises(ProgramError, match="failed to build the library"):
            platforms.build("linux64", {"a.c": b"double answer(void) {\n"}, "a.c")
    assert len(asked) == 2


def test_a_library_of_a_test_is_built_once_and_anew_where_a_header_changes(tmp_path: Path) -> None:
    (tmp_path / "a.c").write_text('#include "a.h"\n' + SOURCE, encoding="utf-8")
    (tmp_path / "a.h").write_text("#define A 1\n", encoding="utf-8")
    first, again = (built_once.shared_library(tmp_path / "a.c") for _ in range(2))
    assert first == again
    (tmp_path / "a.h").write_text("#define A 2\n", encoding="utf-8")
    assert built_once.shared_library(tmp_path / "a.c") != first
