"""Cache of compiled models: found by the next process, never half a file, nothing of other users."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.engine import cache
from ppafo.engine.loading import load_generated
from ppafo.engine.program import Program
from ppafo.model.valves.proportional import IDEAL
from ppafo.translation import native
from tests.compilers_here import first_compiler
from tests.composed_programs import lane_source

START = """
import sys, time
import ppafo
if len(sys.argv) > 1:
    import ppafo.model.plant as vane
    text = open(vane.__file__).read().replace("(pressure_1 - pressure_2)", "(pressure_1 - 0.5 * pressure_2)")
    path = sys.argv[1]
    open(path, "w").write(text)
    import importlib.util
    spec = importlib.util.spec_from_file_location("ppafo.model.plant", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["ppafo.model.plant"] = module
    spec.loader.exec_module(module)
result = ppafo.simulate("torque-task-proportional", ["run.duration=50 ms"])
print(float(result.recording["torque"][-1]))
"""


def files_of(cache: Path) -> dict[Path, bytes]:
    """All that is kept, byte by byte."""
    return {path: path.read_bytes() for path in cache.rglob("*") if path.is_file()}


def start(cache: Path, *arguments: str) -> tuple[float, bool]:
    """Last torque of a short run in a new process, and whether it compiled anything."""
    environment = {**os.environ, "PPAFO_CACHE_DIR": str(cache)}
    before = files_of(cache)
    done = subprocess.run(
        [sys.executable, "-c", START, *arguments], env=environment, capture_output=True, text=True, check=True
    )
    return float(done.stdout), files_of(cache) != before


def test_second_start_finds_the_compiled_model_and_changed_physics_does_not(tmp_path: Path) -> None:
    folder = tmp_path / "programs"
    with ThreadPoolExecutor(2) as pool:
        (first, compiled_first), (at_once, _) = pool.map(start, [folder, folder])
    second, compiled_second = start(folder)
    changed, compiled_changed = start(folder, str(tmp_path / "vane.py"))
    assert compiled_first
    assert not compiled_second
    assert compiled_changed
    assert first == at_once == second
    assert not list(folder.rglob(".writing-*"))
    assert changed != first


def program() -> Program:
    """A program as the torque task uses it."""
    return Program(IDEAL, PROFILES["ramp_hold"], CONTROLLERS["pid"], PROFILES["constant"], True, False)


def test_source_changes_with_a_number_deep_in_the_physics(monkeypatch: pytest.MonkeyPatch) -> None:
    from ppafo.engine.scheme import pneumatics

    before = lane_source(program())
    monkeypatch.setattr(pneumatics, "GAMMA", 0.3)
    assert lane_source(program()) != before


SOURCE = '@entry("void(float64[::1])")\ndef twice(x):\n    x[0] = 2.0 * x[0]\n'


def loaded() -> float:
    """Result of the program of ``SOURCE``, loaded as a new process loads it."""
    module = load_generated(SOURCE, first_compiler())
    x = np.array([21.0])
    module.twice(x)
    del sys.modules[module.__name__]
    return float(x[0])


@pytest.fixture
def compiled(fresh_cache: Path) -> Path:
    """Folder of the one program in a fresh cache."""
    assert loaded() == 42.0
    (program,) = cache.entries(fresh_cache)
    return program.path


def set_trap(program: Path, sprung: Path) -> None:
    """Replace the library of a program, with its hash, by one that makes a folder where it is loaded."""
    code = (
        "#include <sys/stat.h>\n"
        f'__attribute__((constructor)) static void spring(void) {{ mkdir("{sprung}", 0700); }}\n'
        "void twice_packed(void *arrays) { (void)arrays; }\n"
        "int ppafo_rounds_as_written(double a, double b, double c, double d) { return a + b + c + d > -9.0; }\n"
    )
    trap = sprung.with_name("trap.c")
    trap.write_text(code, encoding="utf-8")
    command = native.compiler(first_compiler().name).command
    subprocess.run([*command, "-shared", "-fPIC", str(trap), "-o", str(program / native.LIBRARY_FILE)], check=True)
    names = (file.name for file in program.iterdir() if file.name != cache.CHECKSUMS)
    (program / cache.CHECKSUMS).write_text(json.dumps(cache._checksums(program, names)))


@pytest.mark.parametrize("ending", ["so", "json"])
@pytest.mark.parametrize("damage", ["cut", "empty", "spoilt", "gone", "pipe", "folder"])
def test_damaged_program_is_compiled_anew(compiled: Path, ending: str, damage: str) -> None:
    (path,) = compiled.rglob(f"*.{ending}")
    content = path.read_bytes()
    # Another file of that name: this one is loaded, and its pages would change in the process.
    path.unlink()
    if damage == "pipe":
        os.mkfifo(path)
    elif damage == "folder":
        path.mkdir()
    elif damage != "gone":
        middle = len(content) // 2
        spoilt = content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]
        path.write_bytes({"cut": content[:middle], "empty": b"", "spoilt": spoilt}[damage])
    assert loaded() == 42.0
    assert path.read_bytes() == content
    assert cache._is_whole(compiled)


@pytest.mark.parametrize("kind", ["open cache", "open program", "link", "another user"])
def test_compiled_code_that_another_user_could_have_written_is_not_run(
    compiled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    set_trap(compiled, tmp_path / "sprung")
    assert cache._is_whole(compiled)
    if kind == "link":
        monkeypatch.setenv("PPAFO_CACHE_DIR", str(tmp_path / "link"))
        (tmp_path / "link").symlink_to(compiled.parent)
    elif kind == "another user":
        monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    else:
        (compiled if kind == "open program" else compiled.parent).chmod(0o777)
    assert (cache.refusal(cache.cache_folder()) == "") is (kind == "open program")
    assert loaded() == 42.0
    assert not (tmp_path / "sprung").exists()


def test_a_program_is_compiled_in_memory_where_the_folder_cannot_be_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("PPAFO_CACHE_DIR", str(tmp_path / "file" / "programs"))
    assert loaded() == 42.0
    assert "compiled models are not cached" in caplog.text


@pytest.mark.parametrize("limit", ["LONGEST_UNUSED", "MAXIMUM_BYTES"])
def test_what_was_used_last_stays_and_the_rest_goes(
    compiled: Path, monkeypatch: pytest.MonkeyPatch, limit: str
) -> None:
    remains = [compiled.with_name(f".writing-{0:016x}"), compiled.with_name(compiled.name.replace("full", "old"))]
    for place in remains:
        place.mkdir()
        os.utime(place, (1e9, 1e9))
    monkeypatch.setattr(
        cache, limit, {"LONGEST_UNUSED": 1e6, "MAXIMUM_BYTES": cache.entries(compiled.parent)[0].size}[limit]
    )
    cache.evict(compiled.parent)
    assert [place.name for place in compiled.parent.iterdir()] == [compiled.name]


def test_clearing_leaves_what_is_not_of_the_cache(compiled: Path) -> None:
    folder = compiled.parent
    (folder / "ppafo_results").mkdir()
    (folder / "notes.txt").write_text("mine")
    elsewhere = folder.parent / "elsewhere"
    elsewhere.mkdir()
    text = elsewhere / f"text-{0:032x}"
    text.write_text("kept")
    (folder / cache.TEXTS).symlink_to(elsewhere)
    assert cache.clear(folder) > 0
    assert sorted(place.name for place in folder.iterdir()) == [cache.TEXTS, "notes.txt", "ppafo_results"]
    assert text.exists()


@pytest.mark.parametrize("damage", ["none", "spoilt", "cut", "link", "open"])
def test_a_text_is_made_once_and_again_where_it_is_damaged_or_may_be_of_another_user(
    fresh_cache: Path, damage: str
) -> None:
    made: list[bytes] = []

    def make() -> bytes:
        made.append(b"text")
        return b"text"

    assert [cache.kept_bytes("text", "inputs", make) for _ in range(3)] == [b"text"] * 3
    assert len(made) == 1
    (file,) = (fresh_cache / cache.TEXTS).iterdir()
    content = file.read_bytes()
    if damage == "link":
        file.symlink_to(file.rename(fresh_cache / "elsewhere"))
    elif damage == "open":
        file.parent.chmod(0o777)
    elif damage != "none":
        file.write_bytes(content[:-1] if damage == "cut" else content[:-1] + b"T")
    assert cache.kept_bytes("text", "inputs", make) == b"text"
    assert len(made) == (1 if damage == "none" else 2)
    assert damage == "open" or file.read_bytes() == content
