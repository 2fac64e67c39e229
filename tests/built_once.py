"""Units, modules and libraries in C are built once in a session, whichever process needs them first.

They lie in a folder of the session, under the hash of what they are made of and with. Only what was built is kept:
where a compiler refuses, it does so again. Their time counts apart (``costs.py``).
"""

import contextlib
import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

from tests.costs import BUILT

FOLDER = "PPAFO_TEST_BUILDS"
"""The variable by which the processes of a session know its folder."""
BUILDERS = ("ppafo.exports.fmu.platforms", "ppafo.page.workbench")
"""Modules of the package that let a compiler build in a folder."""
Done = subprocess.CompletedProcess[str]


def pytest_configure(config: pytest.Config) -> None:
    """Make the folder where the session is led."""
    if not hasattr(config, "workerinput"):
        os.environ[FOLDER] = tempfile.mkdtemp(prefix="ppafo-builds-")


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove it there."""
    if not hasattr(config, "workerinput"):
        shutil.rmtree(os.environ.pop(FOLDER), ignore_errors=True)


def pytest_runtest_setup() -> None:
    """Let the package build once, as soon as its exports are loaded: who runs other tests does not load them."""
    for module in filter(None, map(sys.modules.get, BUILDERS)):
        if not hasattr(module.asked, "is_once"):
            module.asked = _asked_once(module.asked)


@contextlib.contextmanager
def one_process(path: Path) -> Iterator[None]:
    """Let one process build while others wait."""
    with path.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def once(ingredients: Sequence[object], build: Callable[[], bytes]) -> Path:
    """The file that ``build`` gives of the ingredients."""
    kept = Path(os.environ[FOLDER]) / hashlib.sha256(repr(ingredients).encode()).hexdigest()[:32]
    with BUILT.counted(), one_process(kept):
        if not kept.exists():
            aside = kept.with_suffix(".writing")
            aside.write_bytes(build())
            aside.rename(kept)
    return kept


def shared_library(source: Path, *flags: str) -> Path:
    """The library that gcc makes of a C file, with what it includes from its folder."""
    words = ["gcc", "-std=c99", "-shared", "-fPIC", *flags]
    beside = {file.name: file.read_bytes() for file in sorted(source.parent.glob("*.[ch]"))}

    def build() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            library = Path(folder) / "library.so"
            subprocess.run([*words, str(source), "-o", str(library), "-lm"], check=True)
            return library.read_bytes()

    return once([words, source.name, beside], build)


class _RefusedError(Exception):
    """Nothing was built."""

    def __init__(self, done: Done) -> None:
        super().__init__()
        self.done = done


_Asked = Callable[[Sequence[str], str, str, Path], Done]


def _asked_once(asked: _Asked) -> _Asked:
    def ask(line: Sequence[str], remedy: str, folder: str, scratch: Path) -> Done:
        target = Path(folder) / line[line.index("-o") + 1]
        beside = {file.name: file.read_bytes() for file in sorted(Path(folder).iterdir())}

        def build() -> bytes:
            done = asked(line, remedy, folder, scratch)
            if done.returncode != 0 or not target.is_file():
                raise _RefusedError(done)
            return target.read_bytes()

        try:
            target.write_bytes(once([line, beside], build).read_bytes())
        except _RefusedError as refused:
            return refused.done
        return subprocess.CompletedProcess(line, 0, "", "")

    ask.is_once = True  # type: ignore[attr-defined]
    return ask
