"""Cache of this computer: compiled programs, and texts that are expensive to compose, each under a hash of its inputs.

Loading compiled code executes it. The cache folder is therefore used only if it belongs to this user and no other user
can write into it. Programs and texts are written aside, with their hashes, and renamed when they are complete; what
does not have its hash is made again. If the folder cannot be used, a model is compiled in memory, and the next process
compiles it again.
"""

import contextlib
import hashlib
import json
import logging
import os
import re
import secrets
import shutil
import stat
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from ppafo.documents.regular_file import read_regular_file
from ppafo.engine.compilers import Compiler, CompilerError
from ppafo.engine.entries import without_origins
from ppafo.wording import count_of, reason, set_within

logger = logging.getLogger("ppafo")

CACHE_VARIABLE = "PPAFO_CACHE_DIR"
TEXTS = "made"
"""Folder of texts inside the folder of the programs."""
CHECKSUMS = "checksums.json"
"""File in the folder of a program with the SHA-256 hash of every other file, by name."""
PROGRAM = "ppafo_"
"""Prefix of the names of programs."""
LONGEST_UNUSED = 90.0 * 86400.0
"""Time [s] after which an unused entry is removed: about three months."""
MAXIMUM_BYTES = 500_000_000
"""Total size of all entries [byte] above which the least recently used are removed; one program has about 300 kB."""
QUIET = 2.0
"""Duration of a compilation [s] below which no message is shown."""
_ASIDE = ".writing-"
"""Prefix of the names of entries that are being written, or that a killed process left."""
_ENTRY = re.compile(
    r"ppafo_[a-z]+(_[a-z]+)?_[0-9a-f]{24}(-[0-9a-f]{12}|\..+)?|[a-z]+-[0-9a-f]{32}"
    r"|\.writing-[0-9a-f]{16}|\.lock-ppafo_.+|not-working-[a-z]+-[0-9a-f]{12}"
)
"""Names of programs and texts, whole or being written, and of what earlier releases stored; others are not removed."""
_HASH_BYTES = hashlib.sha256().digest_size
_models: ContextVar[int] = ContextVar("models that are compiled together", default=0)


def cache_folder() -> Path | None:
    """Return the cache folder of programs: ``PPAFO_CACHE_DIR``, or the user's cache; None without a home folder."""
    if os.environ.get(CACHE_VARIABLE):
        return Path(os.environ[CACHE_VARIABLE]).absolute()
    import platformdirs

    try:
        return Path(platformdirs.user_cache_dir("ppafo", appauthor=False)) / "programs"
    except RuntimeError:
        return None


def refusal(folder: Path | None) -> str:
    """Return the reason why a cache folder cannot be used, as the end of a sentence; empty if the folder can be used.

    A missing folder is created.
    """
    if folder is None:
        return "this user has no home folder"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        return _folder_fault(folder)
    except (OSError, ValueError) as error:
        return f"{folder} cannot be created: {reason(error)}"


def _folder_fault(folder: Path) -> str:
    """Return the reason why code of another user could lie in a folder, or why it cannot be written; empty if neither.

    Raises OSError for a missing folder.
    """
    status = folder.lstat()
    has_users = hasattr(os, "geteuid")
    if not stat.S_ISDIR(status.st_mode):
        return f"{folder} is {'a link' if stat.S_ISLNK(status.st_mode) else 'not a folder'}"
    if has_users and status.st_uid != os.geteuid():
        return f"{folder} belongs to another user"
    if has_users and status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"other users can write into {folder}; run 'ppafo doctor --clear' and 'chmod 700'"
    return "" if os.access(folder, os.W_OK | os.X_OK) else f"{folder} cannot be written"


def kept_bytes(kind: str, made_from: str, make: Callable[[], bytes]) -> bytes:
    """Return the result of ``make`` for the inputs ``made_from``, from the cache if it was stored before."""
    folder = cache_folder()
    if folder is None or refusal(folder):
        return make()
    # The name is the hash of all that the content depends on, so that nothing kept is ever out of date.
    key = hashlib.sha256(made_from.encode("utf-8", "surrogatepass")).hexdigest()[:32]
    file = folder / TEXTS / f"{kind}-{key}"
    with contextlib.suppress(OSError):
        file.parent.mkdir(mode=0o700, exist_ok=True)
        if _folder_fault(file.parent):
            return make()
        kept = read_regular_file(file)
        content = kept[_HASH_BYTES:]
        if not file.is_symlink() and hashlib.sha256(content).digest() == kept[:_HASH_BYTES]:
            os.utime(file)
            return content
    content = make()
    aside = file.with_name(f"{_ASIDE}{secrets.token_hex(8)}")
    with contextlib.suppress(OSError):
        try:
            aside.write_bytes(hashlib.sha256(content).digest() + content)
            aside.replace(file)
        finally:
            aside.unlink(missing_ok=True)
    return content


def program_name(source: str, compiler: Compiler) -> str:
    """Return the name of the module of a composed text."""
    digest = hashlib.sha256(without_origins(source).encode()).hexdigest()[:24]
    return f"{PROGRAM}{compiler.name}_{compiler.effort.name.lower()}_{digest}"


def _program_folder(cache: Path, name: str, compiler: Compiler) -> Path:
    return cache / f"{name}-{hashlib.sha256(compiler.identity().encode()).hexdigest()[:12]}"


def is_kept(source: str, compiler: Compiler) -> bool:
    """Return whether a program was already loaded with this compiler or is in the cache."""
    name = program_name(source, compiler)
    cache = cache_folder()
    return name in sys.modules or (cache is not None and os.path.lexists(_program_folder(cache, name, compiler)))


def load_or_compile(source: str, compiler: Compiler) -> ModuleType:
    """Return the module of a program from the cache; if it is missing, compiled into the cache, or else in memory."""
    name = program_name(source, compiler)
    cache = cache_folder()
    # Loading runs what lies there, so the folder is looked at each time, not once for the process.
    why_not = refusal(cache)
    if cache is None or why_not:
        logger.warning("ppafo: compiled models are not cached: %s; change %s", why_not, CACHE_VARIABLE)
    else:
        folder = _program_folder(cache, name, compiler)
        try:
            return _kept_module(folder, name, source, compiler) or _compile_into(folder, name, source, compiler)
        except OSError as error:
            logger.warning("ppafo: the compiled model cannot be cached in %s: %s", cache, reason(error))
    with announce():
        return execute(name, source, Path(f"<{name}>"), compiler.compile_text)


def _kept_module(folder: Path, name: str, source: str, compiler: Compiler) -> ModuleType | None:
    """Return the module of a cached program; None if it is missing. A damaged program is removed."""
    if not os.path.lexists(folder):
        return None
    if _is_whole(folder):
        # Another process may have removed it in this instant.
        with contextlib.suppress(OSError, CompilerError):
            module = execute(name, source, folder / f"{name}.py", compiler.run_text)
            os.utime(folder)
            return module
    logger.warning("ppafo: the compiled model %s is damaged and is compiled again", folder.name)
    remove(folder)
    return None


def _is_whole(folder: Path) -> bool:
    """Return whether the folder of a program is closed to other users and all its files have their recorded hashes."""
    try:
        recorded = json.loads(read_regular_file(folder / CHECKSUMS))
        # One that was made while others could write may still be another's.
        is_private = not _folder_fault(folder)
        return is_private and isinstance(recorded, dict) and recorded == _checksums(folder, recorded)
    except (OSError, ValueError, RecursionError):
        return False


def _checksums(folder: Path, names: Iterable[str]) -> dict[str, str]:
    return {name: hashlib.sha256(read_regular_file(folder / name)).hexdigest() for name in names}


def _compile_into(folder: Path, name: str, source: str, compiler: Compiler) -> ModuleType:
    """Compile a program in a temporary folder, which is renamed to its final name when complete."""
    aside = folder.with_name(f"{_ASIDE}{secrets.token_hex(8)}")
    try:
        aside.mkdir(mode=0o700)
        path = aside / f"{name}.py"
        path.write_text(source, encoding="utf-8")
        with announce():
            module = execute(name, source, path, compiler.compile_text)
        hashes = _checksums(aside, sorted(file.name for file in aside.iterdir() if file.is_file()))
        (aside / CHECKSUMS).write_text(json.dumps(hashes, indent=2), encoding="utf-8")
        with contextlib.suppress(OSError):  # another process was quicker, with the same program
            aside.rename(folder)
        evict(folder.parent)
    finally:
        remove(aside)
    return module


def execute(name: str, source: str, path: Path, fill: Callable[[str, str, ModuleType], None]) -> ModuleType:
    """Return the module filled by ``fill``."""
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    try:
        fill(source, str(path), module)
    # A module that was interrupted half-way must not be found by the next import.
    except BaseException:
        del sys.modules[name]
        raise
    return module


@contextlib.contextmanager
def announce(models: int = 1) -> Iterator[None]:
    """Log that models are being compiled, once this takes longer than ``QUIET``, and log the end.

    Models that are announced together are not announced individually.
    """
    if _models.get():
        yield
        return
    message = f"ppafo: compiling {count_of(models, 'model')} for this computer ..."
    timer = threading.Timer(QUIET, logger.warning, (message,))
    # A program that ends while it compiles does not wait for the message.
    timer.daemon = True
    start = time.perf_counter()
    timer.start()
    try:
        # A context variable, not a global: two threads may compile different sets at once.
        with set_within(_models, models):
            yield
    finally:
        timer.cancel()
        timer.join()
    seconds = time.perf_counter() - start
    if seconds >= QUIET:
        logger.warning("ppafo: compiled in %.1f s", seconds)


class CacheEntry(NamedTuple):
    """File or folder in the cache: path, size [byte], and time of last use [s since 1970]."""

    path: Path
    size: int
    used: float


def entries(folder: Path) -> list[CacheEntry]:
    """Return programs, texts and remains in a cache folder, most recently used first; empty without a folder.

    Links to other folders are not followed.
    """
    paths = [*folder.glob("*"), *(() if (folder / TEXTS).is_symlink() else (folder / TEXTS).glob("*"))]
    measured = []
    for path in paths:
        if _ENTRY.fullmatch(path.name):
            with contextlib.suppress(OSError):  # another process may remove it in this instant
                files = [path] if path.is_symlink() or not path.is_dir() else [path, *path.rglob("*")]
                size = sum(file.lstat().st_size for file in files)
                measured.append(CacheEntry(path, size, path.lstat().st_mtime))
    return sorted(measured, key=lambda entry: -entry.used)


def evict(folder: Path) -> None:
    """Remove entries unused for ``LONGEST_UNUSED`` and the least recently used entries beyond ``MAXIMUM_BYTES``."""
    oldest = time.time() - LONGEST_UNUSED
    total = 0
    # The list begins with what was used last, so that the total passes the limit at what is dropped.
    for entry in entries(folder):
        total += entry.size
        if entry.used < oldest or total > MAXIMUM_BYTES:
            remove(entry.path)


def clear(folder: Path) -> int:
    """Remove all cached entries, and the folder if it is then empty; return the number of bytes freed."""
    freed = 0
    for entry in entries(folder):
        remove(entry.path)
        freed += 0 if os.path.lexists(entry.path) else entry.size
    for emptied in (folder / TEXTS, folder):
        with contextlib.suppress(OSError):
            emptied.rmdir()
    return freed


def remove(path: Path) -> None:
    """Remove a program, a file or a link; failures to remove are ignored.

    A folder is first renamed, so that other processes see either the complete program or none.
    """
    with contextlib.suppress(OSError):
        if path.is_dir() and not path.is_symlink():
            aside = path.with_name(f"{_ASIDE}{secrets.token_hex(8)}")
            path.rename(aside)
            shutil.rmtree(aside)
        else:
            path.unlink()
