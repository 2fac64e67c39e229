"""Several programs and several processes: what they have in common is compiled once."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ppafo.engine import cache, numba_compiler
from ppafo.engine.cache import LOCK, load_generated, one_process
from ppafo.engine.numba_compiler import NumbaCompiler
from ppafo.errors import ProgramError

HEADER = "from collections import namedtuple\n\nimport math\nfrom numba import njit\n\nFAST = {fast}\n"
ROW = "Pair = namedtuple('Pair', ['a', 'b'])\n"
INNER = "@njit(fastmath=FAST)\ndef inner(x):\n    return {inner}\n"
OUTER = "@njit(fastmath=FAST)\ndef outer(pair):\n    return inner(pair.a) + pair.b\n"
LOOP = "@njit('float64(float64)', cache=True)\ndef run(x):\n    return outer(Pair(x, {added}))\n"


START = """
import sys
from ppafo.engine import cache, numba_compiler
from ppafo.engine.numba_compiler import NumbaCompiler

compile_text = numba_compiler._compile_text

def compile_and_say_so(*given):
    sys.stderr.write("compiling")
    compile_text(*given)

numba_compiler._compile_text = compile_and_say_so
"""
"""A process that says on the side when it compiles."""
LOAD = "print(cache.load_generated(sys.stdin.read(), NumbaCompiler())"


def text(inner: str = "2.0 * x", added: str = "1.0", fast: str = "False") -> str:
    return "\n\n".join([HEADER.format(fast=fast), ROW, INNER.format(inner=inner), OUTER, LOOP.format(added=added)])


@pytest.mark.usefixtures("fresh_cache")
def test_two_programs_share_a_function_that_is_the_same_with_all_it_calls_and_no_other() -> None:
    first, second = load_generated(text(), NumbaCompiler()), load_generated(text(added="3.0"), NumbaCompiler())
    assert (first.run(5.0), second.run(5.0)) == (11.0, 13.0)
    assert first.outer is second.outer
    assert first.Pair is second.Pair
    changed = load_generated(text(inner="4.0 * x"), NumbaCompiler())
    assert changed.run(5.0) == 21.0
    assert changed.outer is not first.outer
    assert load_generated(text(fast="True"), NumbaCompiler()).inner is not first.inner
    assert first.run(5.0) == 11.0


@pytest.mark.usefixtures("fresh_cache")
def test_mistake_in_a_second_program_is_reported_with_its_own_lines_though_the_function_was_shared() -> None:
    load_generated(text(), NumbaCompiler())
    wrong = "# a line more\n" + text().replace("Pair(x, 1.0)", "(x, 1.0)")
    with pytest.raises(ProgramError, match=r"pair has no 'a'|pair is a tuple and has no 'a'"):
        load_generated(wrong, NumbaCompiler())
    assert load_generated(text(added="7.0"), NumbaCompiler()).run(5.0) == 17.0


def test_program_with_shared_functions_is_loaded_by_a_process_that_has_none(fresh_cache: Path) -> None:
    for added in ("1.5", "2.5"):
        load_generated(text(added=added), NumbaCompiler())
    start = f"{START}numba_compiler._SHARED = None\n{LOAD}.run(5.0))"
    found = subprocess.run(
        [sys.executable, "-c", start], input=text(added="2.5"), capture_output=True, text=True, check=True
    )
    assert found.stdout == "12.5\n"
    assert "compiling" not in found.stderr


SLOWLY = "import os, time\nopen(os.environ['SEEN'], 'a').write('x')\ntime.sleep(1.5)\nlast_line = 1\n"
LOAD_ONE = f"{START}{LOAD})"


def start(source: str, seen: Path) -> "subprocess.Popen[str]":
    environment = {**os.environ, "SEEN": str(seen)}
    process = subprocess.Popen(
        [sys.executable, "-c", LOAD_ONE], env=environment, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdin
    process.stdin.write(source)
    process.stdin.close()
    return process


def test_of_two_processes_that_need_a_program_at_once_one_compiles_it(fresh_cache: Path, tmp_path: Path) -> None:
    told = []
    for process in [start(SLOWLY, tmp_path / "seen") for _ in range(2)]:
        assert process.stderr
        told.append(process.stderr.read())
        assert process.wait() == 0
    assert sorted("compiling" in text for text in told) == [False, True]
    assert not list(fresh_cache.glob(f"{LOCK}*"))


def test_killed_process_holds_no_lock(fresh_cache: Path, tmp_path: Path) -> None:
    source = SLOWLY.replace("1.5", "60.0 if 'STUCK' in os.environ else 0.0")
    os.environ["STUCK"] = "yes"
    try:
        process = start(source, tmp_path / "seen")
    finally:
        del os.environ["STUCK"]
    while not (tmp_path / "seen").exists():
        assert process.poll() is None
        time.sleep(0.02)
    assert list(fresh_cache.glob(f"{LOCK}*"))
    process.kill()
    process.wait()
    os.environ["SEEN"] = str(tmp_path / "seen")
    begin = time.monotonic()
    try:
        assert load_generated(source, NumbaCompiler()).last_line == 1
    finally:
        del os.environ["SEEN"]
    assert time.monotonic() - begin < 30.0


def test_process_that_waits_too_long_goes_on_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "LONGEST_WAIT", 0.2)
    with one_process(tmp_path / "program"):
        begin = time.monotonic()
        with one_process(tmp_path / "program"):
            assert 0.1 < time.monotonic() - begin < 20.0
        assert list(tmp_path.glob(f"{LOCK}*"))
    assert not list(tmp_path.iterdir())


def test_lock_that_cannot_be_made_is_done_without(tmp_path: Path) -> None:
    (tmp_path / f"{LOCK}program").mkdir()
    for place in (tmp_path / "program", tmp_path / "absent" / "program"):
        with one_process(place):
            pass
    assert [item.name for item in tmp_path.iterdir()] == [f"{LOCK}program"]


def test_garbage_collection_is_as_it_was_after_compiling(fresh_cache: Path) -> None:
    import gc

    assert gc.isenabled()
    load_generated(text(added="9.0"), NumbaCompiler())
    assert gc.isenabled()
    assert numba_compiler._SHARED
