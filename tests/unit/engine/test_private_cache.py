"""The cache of compiled models runs nothing of others, and whatever is wrong with it, a model is compiled and runs."""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ppafo.engine.cache import folder as private
from ppafo.engine.cache.folder import cache_folder, refusal
from ppafo.engine.cache.kept import is_whole
from ppafo.engine.cache.tidying import clear, evict, list_programs
from ppafo.engine.loading import load_generated
from ppafo.translation import native
from tests.compilers_here import first_compiler

SOURCE = '@entry("void(float64[::1])")\ndef twice(x):\n    x[0] = 2.0 * x[0]\n'
LIBRARY = "program.so"


def checksums_of(folder: Path) -> dict[str, str]:
    """Hash of every file of a program but the list of them itself."""
    files = [path for path in folder.rglob("*") if path.is_file() and path.name != "checksums.json"]
    return {path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


@pytest.fixture
def compiled(fresh_cache: Path) -> Path:
    """The folder of the one program in a fresh cache."""
    assert loaded() == 42.0
    (program,) = list_programs(fresh_cache)
    return program.path


def loaded() -> float:
    """What the program says when it is loaded as a new process loads it."""
    module = load_generated(SOURCE, first_compiler())
    x = np.array([21.0])
    module.twice(x)
    del sys.modules[module.__name__]
    return float(x[0])


def set_trap(library: Path, sprung: Path) -> None:
    """Put a library in the place of a program's that makes a folder where it is loaded."""
    code = (
        "#include <sys/stat.h>\n"
        f'__attribute__((constructor)) static void spring(void) {{ mkdir("{sprung}", 0700); }}\n'
        "void twice_packed(void *arrays) { (void)arrays; }\n"
        "int ppafo_rounds_as_written(double a, double b, double c, double d) { return a + b + c + d > -9.0; }\n"
    )
    trap = sprung.with_name("trap.c")
    trap.write_text(code, encoding="utf-8")
    command = native.compiler(first_compiler().name).command
    subprocess.run([*command, "-shared", "-fPIC", str(trap), "-o", str(library)], check=True)


def spoil(path: Path) -> None:
    """Change one bit in the middle of a file."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    # Another file of that name: this one is loaded, and its pages would change in the process.
    path.unlink()
    path.write_bytes(bytes(content))


@pytest.mark.parametrize("ending", ["so", "c", "py", "json"])
@pytest.mark.parametrize("damage", ["cut", "empty", "spoilt", "gone", "pipe", "folder"])
def test_damaged_program_is_compiled_anew(compiled: Path, ending: str, damage: str) -> None:
    (path,) = compiled.rglob(f"*.{ending}")
    content = path.read_bytes()
    if damage == "spoilt":
        spoil(path)
    else:
        path.unlink()
        if damage in ("cut", "empty"):
            path.write_bytes(content[: len(content) // 2] if damage == "cut" else b"")
        elif damage == "pipe":
            os.mkfifo(path)
        elif damage == "folder":
            path.mkdir()
    assert loaded() == 42.0
    assert path.is_file()
    assert is_whole(compiled)


@pytest.mark.parametrize("kind", ["others can write", "link", "another user", "place can be taken"])
def test_compiled_code_in_a_folder_that_is_not_private_is_not_run(
    compiled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    set_trap(compiled / LIBRARY, tmp_path / "sprung")
    (compiled / "checksums.json").write_text(str(checksums_of(compiled)).replace("'", '"'))
    folder = compiled.parent
    if kind == "others can write":
        folder.chmod(0o777)
    elif kind == "link":
        monkeypatch.setenv("PPAFO_CACHE_DIR", str(tmp_path / "link"))
        (tmp_path / "link").symlink_to(folder)
    elif kind == "another user":
        monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    else:
        tmp_path.chmod(0o777)
    assert refusal(cache_folder())
    assert loaded() == 42.0
    assert not (tmp_path / "sprung").exists()


def test_program_that_no_one_used_for_long_is_removed_and_a_used_one_stays(compiled: Path) -> None:
    old = compiled.with_name(compiled.name.replace(f"ppafo_{first_compiler().name}", "ppafo_old"))
    left = compiled.with_name(".writing-0123456789abcdef")
    for place in (old, left):
        place.mkdir()
        os.utime(place, (0.0, 0.0))
    evict(compiled.parent)
    assert [place.name for place in compiled.parent.iterdir()] == [compiled.name]


def test_clearing_leaves_what_is_not_a_program(compiled: Path) -> None:
    (compiled.parent / "ppafo_results").mkdir()
    (compiled.parent / "notes.txt").write_text("mine")
    assert clear(compiled.parent) > 0
    assert sorted(place.name for place in compiled.parent.iterdir()) == ["notes.txt", "ppafo_results"]
    (compiled.parent / "notes.txt").unlink()
    (compiled.parent / "ppafo_results").rmdir()
    clear(compiled.parent)
    assert not compiled.parent.exists()


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can make files of another user")
def test_program_that_another_user_left_in_the_folder_is_not_run(compiled: Path, tmp_path: Path) -> None:
    set_trap(compiled / LIBRARY, tmp_path / "sprung")
    sums = compiled / "checksums.json"
    sums.write_text(json.dumps(checksums_of(compiled)))
    for place in (compiled, *compiled.rglob("*")):
        os.chown(place, 65534, 65534)
    assert loaded() == 42.0
    assert not (tmp_path / "sprung").exists()
    assert compiled.stat().st_uid == 0


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="no permission bits here")
@pytest.mark.parametrize("which", ["folder", "file", "checksums"])
def test_program_into_which_others_can_write_is_compiled_anew(compiled: Path, which: str) -> None:
    place = {"folder": compiled, "file": compiled / LIBRARY, "checksums": compiled / "checksums.json"}[which]
    place.chmod(0o777)
    assert loaded() == 42.0
    assert place.stat().st_mode & 0o022 == 0


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="no permission bits here")
def test_a_folder_above_may_be_written_by_a_group_of_this_user_alone(
    fresh_cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert refusal(fresh_cache) == ""
    tmp_path.chmod(0o770)
    monkeypatch.setattr(private, "_is_own_group", lambda _number: True)
    assert refusal(fresh_cache) == ""
    monkeypatch.setattr(private, "_is_own_group", lambda _number: False)
    assert "other users can replace" in refusal(fresh_cache)
