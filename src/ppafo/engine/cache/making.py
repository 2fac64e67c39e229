"""Compilation into the cache: into a temporary file, by one process while others wait, announced where it is slow."""

import contextlib
import hashlib
import json
import logging
import os
import secrets
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from types import ModuleType

from ppafo.documents.regular_file import read_regular_file
from ppafo.engine.cache.announcing import (
    SECONDS_FILE,
    announce,
    compile_side_by_side,
    estimate_seconds,
    processor_seconds,
)
from ppafo.engine.cache.folder import LOCK, cache_folder, refusal
from ppafo.engine.cache.kept import CHECKSUMS, RequestedProgram, is_kept, load_kept_module, remove
from ppafo.engine.cache.tidying import PROGRAM, entries_named, evict
from ppafo.engine.compilers import Compiler, Effort
from ppafo.wording import reason

# One process compiles a program while others wait for it.

try:
    import fcntl
except ImportError:  # not on this system: each process compiles for itself
    fcntl = None  # type: ignore[assignment]

LONGEST_WAIT = 300.0
"""Seconds after which a process compiles for itself, whoever holds the lock; one that has died holds none."""
# Between two tries to get the lock [s]: short beside the seconds of a compilation.
_PAUSE = 0.05


@contextlib.contextmanager
def one_process(kept: Path) -> Iterator[None]:
    """Hold the lock of a program while it is compiled; where none can be had, go on without."""
    file = kept.with_name(LOCK + kept.name)
    held = _lock(file)
    try:
        yield
    finally:
        if held is not None:
            with contextlib.suppress(OSError):
                file.unlink()
            os.close(held)


def _lock(place: Path) -> int | None:
    """Open and lock a file, waiting for its present owner; None where that cannot be done."""
    if fcntl is None:
        return None
    end = time.monotonic() + LONGEST_WAIT
    while time.monotonic() < end:
        try:
            file = os.open(place, os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o600)
        except OSError:
            return None
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Who had it before may have removed it in the meantime: then others lock another file of this name.
            if os.path.samestat(os.fstat(file), os.lstat(place)):
                return file
        except BlockingIOError:
            time.sleep(_PAUSE)
        except FileNotFoundError:
            pass
        except OSError:
            os.close(file)
            return None
        os.close(file)
    return None


logger = logging.getLogger("ppafo")


def make(wanted: RequestedProgram, kept: Path | None) -> ModuleType:
    """Compile a program and keep it at its place, or in memory alone where there is none or it cannot be kept."""
    if kept is not None:
        try:
            with one_process(kept):
                # Another process may have compiled it while this one waited for the lock.
                return load_kept_module(kept, wanted) or _compile_and_keep(kept, wanted)
        except OSError as error:
            logger.warning("ppafo: the compiled model is not kept in %s: %s", kept.parent, reason(error))
    with announce(_estimate(wanted, ()), "not kept"):
        return wanted.compile(Path(f"<{wanted.name}>"))


def load_all(programs: Iterable[tuple[str, Effort]], compiler: Compiler, load: Callable[[str, Effort], object]) -> None:
    """Import programs, given by source and effort, by ``load``; those to be compiled are compiled side by side."""
    missing = [
        (source, effort)
        for source, effort in dict.fromkeys(programs)
        if not (is_kept(source, compiler) or is_kept(source, compiler.with_effort(effort)))
    ]
    # One alone is compiled where it is needed, with its own message.
    if len(missing) < 2:
        return
    folder = cache_folder()
    kept = [] if folder is None else entries_named(folder, PROGRAM)
    expected = sum(
        _estimate(RequestedProgram(source, compiler.with_effort(effort)), kept) for source, effort in missing
    )
    where = "not kept" if folder is None or refusal(folder) else f"kept in {folder}"
    compile_side_by_side([partial(load, source, effort) for source, effort in missing], expected, where)


def _compile_and_keep(kept: Path, wanted: RequestedProgram) -> ModuleType:
    """Compile a program in a folder aside, which takes its place when it is whole."""
    # Written aside and renamed: to other processes a program is whole, or not there.
    aside = kept.with_name(f".writing-{secrets.token_hex(8)}")
    try:
        aside.mkdir(mode=0o700)
        path = aside / f"{wanted.name}.py"
        path.write_text(wanted.source, encoding="utf-8")
        start, worked = time.perf_counter(), processor_seconds()
        with announce(_estimate(wanted, entries_named(kept.parent, PROGRAM)), f"kept in {kept.parent}"):
            module = wanted.compile(path)
        # Others work on this computer meanwhile, and compilers of other threads count as this process's.
        seconds = min(time.perf_counter() - start, processor_seconds() - worked)
        (aside / SECONDS_FILE).write_text(f"{seconds:.2f}", encoding="ascii")
        (aside / CHECKSUMS).write_text(json.dumps(_checksums(aside), indent=2), encoding="utf-8")
        for entry in aside.rglob("*"):  # compilers let a group write where the user's habits (umask) do
            entry.chmod(0o700 if entry.is_dir() else 0o600)
        with contextlib.suppress(OSError):  # another process was quicker, with the same program
            aside.rename(kept)
        evict(kept.parent)
    except OSError:
        sys.modules.pop(wanted.name, None)
        raise
    finally:
        remove(aside)
    return module


def _estimate(wanted: RequestedProgram, kept: Iterable[Path]) -> float:
    """About how long a program takes to compile [s]."""
    kind = wanted.name.rpartition("_")[0]
    alike = [entry for entry in kept if entry.name.startswith(f"{kind}_")]
    return estimate_seconds(wanted.source, alike, wanted.compiler.seconds_per_byte)


def _checksums(folder: Path) -> dict[str, str]:
    """Return the hash of every file of a program but the list of them itself."""
    files = sorted(path for path in folder.rglob("*") if not path.is_dir() and path.name != CHECKSUMS)
    return {path.relative_to(folder).as_posix(): hashlib.sha256(read_regular_file(path)).hexdigest() for path in files}
