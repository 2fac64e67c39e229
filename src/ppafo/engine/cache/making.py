"""Compilation into the cache: into a temporary folder, by one process while others wait, with a message if slow."""

import contextlib
import hashlib
import json
import logging
import os
import secrets
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar, copy_context
from pathlib import Path
from types import ModuleType

from ppafo.documents.regular_file import read_regular_file
from ppafo.engine.cache.folder import LOCK, cache_folder, refusal
from ppafo.engine.cache.kept import CHECKSUMS, RequestedProgram, is_kept, load_kept_module, remove
from ppafo.engine.cache.tidying import evict
from ppafo.engine.compilers import Compiler, Effort
from ppafo.wording import reason, set_within

try:
    import fcntl
except ImportError:  # not on this system: each process compiles for itself
    fcntl = None  # type: ignore[assignment]

logger = logging.getLogger("ppafo")

LONGEST_WAIT = 300.0
"""Longest wait for a lock [s], after which a process compiles for itself; a dead process holds no lock."""
# Between two tries to get the lock [s]: short beside the seconds of a compilation.
_PAUSE = 0.05
QUIET = 2.0
"""Duration of a compilation [s] below which no message is shown."""


@contextlib.contextmanager
def one_process(folder: Path) -> Iterator[None]:
    """Lock a program during its compilation; continue without a lock if none is available."""
    lock_file = folder.with_name(LOCK + folder.name)
    descriptor = _lock(lock_file)
    try:
        yield
    finally:
        if descriptor is not None:
            with contextlib.suppress(OSError):
                lock_file.unlink()
            os.close(descriptor)


def _lock(lock_file: Path) -> int | None:
    """Open and lock a file, waiting for its present owner; its descriptor, or None if it cannot be locked."""
    if fcntl is None:
        return None
    end = time.monotonic() + LONGEST_WAIT
    while time.monotonic() < end:
        try:
            descriptor = os.open(lock_file, os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o600)
        except OSError:
            return None
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # The last holder may have removed it in the meantime: then others lock another file of this name.
            if os.path.samestat(os.fstat(descriptor), os.lstat(lock_file)):
                return descriptor
        except BlockingIOError:
            time.sleep(_PAUSE)
        except FileNotFoundError:
            pass
        except OSError:
            os.close(descriptor)
            return None
        os.close(descriptor)
    return None


_models: ContextVar[int] = ContextVar("models that are compiled together", default=0)


@contextlib.contextmanager
def announce(where: str, models: int = 1) -> Iterator[None]:
    """Log that models are being compiled, once this takes longer than ``QUIET``, and log the end.

    Models that are announced together are not announced individually.
    """
    if _models.get():
        yield
        return
    what = "a model" if models == 1 else f"{models} models"
    timer = threading.Timer(QUIET, logger.warning, (f"ppafo: compiling {what} for this computer ...",))
    # A program that ends while it compiles does not wait for the message.
    timer.daemon = True
    start = time.perf_counter()
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
    seconds = time.perf_counter() - start
    if seconds >= QUIET:
        logger.warning("ppafo: compiled in %.1f s, %s", seconds, where)


def make(program: RequestedProgram, folder: Path | None) -> ModuleType:
    """Compile a program into the cache, or in memory if there is no cache folder or the program cannot be stored."""
    if folder is not None:
        try:
            with one_process(folder):
                # Another process may have compiled it while this one waited for the lock.
                return load_kept_module(folder, program) or _compile_and_keep(folder, program)
        except OSError as error:
            logger.warning("ppafo: the compiled model cannot be cached in %s: %s", folder.parent, reason(error))
    with announce("not kept"):
        return program.compile(Path(f"<{program.name}>"))


def load_all(programs: Iterable[tuple[str, Effort]], compiler: Compiler, load: Callable[[str, Effort], object]) -> None:
    """Load programs, given by source and effort, with ``load``; missing programs are compiled in parallel."""
    missing = [
        (source, effort)
        for source, effort in dict.fromkeys(programs)
        if not (is_kept(source, compiler) or is_kept(source, compiler.with_effort(effort)))
    ]
    # One alone is compiled where it is needed, with its own message.
    if len(missing) < 2:
        return
    from concurrent.futures import ThreadPoolExecutor

    folder = cache_folder()
    where = "not kept" if folder is None or refusal(folder) else f"kept in {folder}"
    workers = min(len(missing), os.cpu_count() or 1)
    with announce(where, len(missing)), ThreadPoolExecutor(workers) as pool:
        # A context variable, not a global: two threads may compile different sets at once.
        with set_within(_models, len(missing)):
            started = [pool.submit(copy_context().run, load, source, effort) for source, effort in missing]
        for task in started:
            task.result()


def _compile_and_keep(folder: Path, program: RequestedProgram) -> ModuleType:
    """Compile a program in a temporary folder, which is renamed to its final name when complete."""
    # Written aside and renamed: to other processes a program is whole, or not there.
    aside = folder.with_name(f".writing-{secrets.token_hex(8)}")
    try:
        aside.mkdir(mode=0o700)
        path = aside / f"{program.name}.py"
        path.write_text(program.source, encoding="utf-8")
        with announce(f"kept in {folder.parent}"):
            module = program.compile(path)
        files = sorted(file for file in aside.rglob("*") if not file.is_dir())
        hashes = {
            file.relative_to(aside).as_posix(): hashlib.sha256(read_regular_file(file)).hexdigest() for file in files
        }
        (aside / CHECKSUMS).write_text(json.dumps(hashes, indent=2), encoding="utf-8")
        for entry in aside.rglob("*"):  # compilers let a group write where the user's habits (umask) do
            entry.chmod(0o700 if entry.is_dir() else 0o600)
        with contextlib.suppress(OSError):  # another process was quicker, with the same program
            aside.rename(folder)
        evict(folder.parent)
    except OSError:
        sys.modules.pop(program.name, None)
        raise
    finally:
        remove(aside)
    return module
