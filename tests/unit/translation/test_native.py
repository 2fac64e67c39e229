"""Programs by a compiler of C: the bits of Python, the same cache, and one line where it cannot be."""

import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main
from ppafo.engine import loading
from ppafo.engine.cache.programs import load_generated
from ppafo.engine.cache.tidying import list_programs
from ppafo.engine.compilers import CompilerError
from ppafo.engine.lanes import Batch, load_program, run_batch
from ppafo.engine.run import batch_of
from ppafo.errors import ProgramError, SimulationError
from ppafo.golden_bits import digest
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.translation import compiling, native
from ppafo.translation.native_source import translated_text
from scripts.built_programs import build
from scripts.golden_bits import drawn_batch

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
SHORT = ["run.duration=20 ms"]
NO_C = "import math\n@entry('void(float64[:, ::1])')\ndef advance(x):\n    x[0, 0] = math.sin(x[0, 0])\n"


@pytest.fixture(scope="module")
def batch() -> Batch:
    """The torque task of the proportional valve, short."""
    return batch_of(plan_run(load_scenario("torque-task-proportional", SHORT)))


def by(compiler: str, batch: Batch, monkeypatch: pytest.MonkeyPatch, threads: int = 1) -> str:
    monkeypatch.setenv("PPAFO_BACKEND", compiler)
    loading._load_by.cache_clear()
    return digest(run_batch(batch, threads))


def forget_programs(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a new process."""
    for name in [item for item in sys.modules if item.startswith("ppafo_gcc_")]:
        monkeypatch.delitem(sys.modules, name)


@needs_gcc
def test_gcc_and_python_give_the_same_bits_on_any_number_of_threads(
    batch: Batch, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = drawn_batch(batch, 40)
    assert by("python", drawn, monkeypatch) == by("gcc", drawn, monkeypatch) == by("gcc", drawn, monkeypatch, threads=2)


@needs_gcc
def test_a_program_of_gcc_is_kept_found_again_and_made_anew_where_it_is_damaged(
    batch: Batch, fresh_cache: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    compiled: list[Path] = []
    compile_c = compiling.compile_library

    def counted(source: str, library: Path, *given: Any) -> None:
        compiled.append(library)
        compile_c(source, library, *given)

    monkeypatch.setattr(compiling, "compile_library", counted)
    forget_programs(monkeypatch)
    expected = by("gcc", batch, monkeypatch)
    (kept,) = list_programs(fresh_cache)
    assert kept.path.name.startswith("ppafo_gcc_")
    forget_programs(monkeypatch)
    assert by("gcc", batch, monkeypatch) == expected
    assert len(compiled) == 1
    library = kept.path / "program.so"
    # Another file in its place: what is loaded already stays as it is.
    copy = library.with_name("copy")
    copy.write_bytes(library.read_bytes() + b"x")
    copy.replace(library)
    forget_programs(monkeypatch)
    assert by("gcc", batch, monkeypatch) == expected
    assert len(compiled) == 2
    assert "is damaged and is compiled again" in caplog.text


@needs_gcc
def test_without_a_folder_for_it_a_program_of_gcc_runs_all_the_same(
    batch: Batch, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    expected = by("gcc", batch, monkeypatch)
    (tmp_path / "file").touch()
    monkeypatch.setenv("PPAFO_CACHE_DIR", str(tmp_path / "file"))
    forget_programs(monkeypatch)
    assert by("gcc", batch, monkeypatch) == expected
    assert "compiled models are not cached" in caplog.text


def test_a_name_that_is_no_compiler_is_refused_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", "gc")
    assert main(["simulate", "torque-task-proportional", "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert said == "ppafo: PPAFO_BACKEND = 'gc': must be c, gcc, clang, zig, python, did you mean 'gcc'?\n"
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("name", "missing"), [("c", "no C compiler was found"), ("clang", "'clang' is not installed")])
def test_a_computer_without_a_compiler_says_what_to_install(
    name: str, missing: str, fresh_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(native, "_command", lambda _: ())
    monkeypatch.setenv("PPAFO_BACKEND", name)
    with pytest.raises(SimulationError, match=rf"PPAFO_BACKEND={name}: {missing}.*gcc or clang.*ppafo\[native\]"):
        load_program(batch_of(plan_run(load_scenario("torque-task-proportional", SHORT))).program)


OBEYS = '#!/bin/sh\n[ "$1" = --version ] && echo "fake 1" && exit 0\n'
BROKEN = {
    "no interpreter": ("#!/no/such/interpreter\n", "cannot be run: no such file or directory"),
    "no program": ("\0\1\2", "cannot be run: exec format error"),
    "no library": (f"{OBEYS}exit 0\n", "reported success but wrote no library"),
    "half a library": (
        f'{OBEYS}for word; do [ "$last" = -o ] && printf half > "$word"; last="$word"; done\n',
        "the library of a compiled model cannot be loaded: .*file too short",
    ),
    "another library": (
        f'{OBEYS}for word; do last="$own"; [ "$flag" = -o ] && own="$word"; flag="$word"; done\n'
        'echo "int x;" | exec REAL -shared -fPIC -xc - -o "$own"\n',
        "lacks functions of the model",
    ),
    "killed": (f"{OBEYS}kill -9 $$\n", "does not compile a model: it returned -9"),
    "no utf-8": ("#!/bin/sh\nprintf '\\377\\n' >&2\nexit 1\n", "does not compile a model: \ufffd"),
    "a warning first": (
        f"{OBEYS}echo warning: w >&2; echo p.c:3: error: e >&2; exit 1\n",
        "does not compile a model: p.c:3: error",
    ),
}


@needs_gcc
@pytest.mark.skipif(sys.platform == "win32", reason="the compilers that fail are shell scripts")
@pytest.mark.parametrize("how", BROKEN)
def test_a_compiler_that_fails_halfway_is_said_in_one_line_and_leaves_nothing(
    how: str,
    fresh_cache: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    script, line = BROKEN[how]
    broken = tmp_path / "gcc"
    broken.write_text(script.replace("REAL", str(shutil.which("gcc"))), encoding="utf-8")
    broken.chmod(0o755)
    compiler = native.CCompiler("gcc", (str(broken),))
    source = f"@entry('void(float64[:, ::1])')\ndef advance(x):\n    x[0, 0] = {len(how)}.5\n"
    with pytest.raises(CompilerError, match=line):
        load_generated(source, compiler)
    assert list(fresh_cache.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="the compiler is a shell script")
def test_temporary_files_of_a_compiler_that_is_killed_are_with_what_it_was_to_make(tmp_path: Path) -> None:
    killed = tmp_path / "cc"
    killed.write_text('#!/bin/sh\ntouch "$TMPDIR/program-1.o"\nkill -9 $$\n', encoding="utf-8")
    killed.chmod(0o700)
    aside = tmp_path / "aside"
    aside.mkdir()
    with pytest.raises(CompilerError):
        build("int one(void) { return 1; }", aside, [str(killed)])
    assert (aside / "program-1.o").exists()


def test_what_has_no_c_is_refused() -> None:
    with pytest.raises(ProgramError, match="cannot be translated"):
        translated_text(NO_C)
