"""Programs by a compiler of C: the bits of Python, the same cache, and one line where it cannot be."""

import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

from ppafo.engine import loading
from ppafo.engine.compilers import CompilerError
from ppafo.engine.lanes import Batch, load_program, run_batch
from ppafo.engine.loading import load_generated
from ppafo.engine.run import batch_of
from ppafo.errors import SimulationError
from ppafo.golden_bits import digest
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.translation import compiling, native
from scripts.golden_bits import drawn_batch

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
SHORT = ["run.duration=20 ms"]


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
    (kept,) = fresh_cache.glob("ppafo_*")
    assert kept.name.startswith("ppafo_gcc_")
    forget_programs(monkeypatch)
    assert by("gcc", batch, monkeypatch) == expected
    assert len(compiled) == 1
    library = kept / "program.so"
    # Another file in its place: what is loaded already stays as it is.
    copy = library.with_name("copy")
    copy.write_bytes(library.read_bytes() + b"x")
    copy.replace(library)
    forget_programs(monkeypatch)
    assert by("gcc", batch, monkeypatch) == expected
    assert len(compiled) == 2
    assert "is damaged and is compiled again" in caplog.text


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
    "reported success but wrote no library": "exit 0\n",
    "file too short": 'for word; do [ "$last" = -o ] && printf half > "$word"; last="$word"; done\n',
    "it returned -9": "kill -9 $$\n",
}


@pytest.mark.skipif(sys.platform == "win32", reason="the compilers that fail are shell scripts")
@pytest.mark.parametrize("reason", BROKEN)
def test_a_compiler_that_fails_halfway_is_refused_and_leaves_nothing(
    reason: str, fresh_cache: Path, tmp_path: Path
) -> None:
    broken = tmp_path / "gcc"
    broken.write_text(OBEYS + BROKEN[reason], encoding="utf-8")
    broken.chmod(0o755)
    source = f"@entry('void(float64[:, ::1])')\ndef advance(x):\n    x[0, 0] = {len(reason)}.5\n"
    with pytest.raises(CompilerError, match=reason):
        load_generated(source, native.CCompiler("gcc", (str(broken),)))
    assert list(fresh_cache.iterdir()) == []
