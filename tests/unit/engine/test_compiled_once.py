"""Several processes that need one program: it is compiled once."""

import os
import subprocess
import sys
import time
from pathlib import Path

from ppafo.engine.cache.folder import LOCK
from ppafo.engine.loading import load_generated
from tests.compilers_here import ScriptCompiler

LOAD_ONE = """
import sys
from ppafo.engine.loading import load_generated
from tests.compilers_here import ScriptCompiler
load_generated(sys.stdin.read(), ScriptCompiler(says=True))
"""
"""A process that says on the side when it compiles."""
SLOWLY = "import os, time\nopen(os.environ['SEEN'], 'a').write('x')\ntime.sleep(1.5)\nlast_line = 1\n"


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
        assert load_generated(source, ScriptCompiler()).last_line == 1
    finally:
        del os.environ["SEEN"]
    assert time.monotonic() - begin < 30.0
