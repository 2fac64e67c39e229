"""The cache of this computer: compiled programs, and texts that are expensive to compose.

Loading compiled code runs it, so the folder is used only where no other user can write to it, and a program only where
every byte has its recorded hash. If anything is wrong with the folder, the model is compiled in memory and runs; only
the next start has to compile again. Texts are stored by a key of what they were composed from, in files that begin with
the hash of their content (``kept_bytes``).
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
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextvars import ContextVar, copy_context
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from types import ModuleType

from ppafo.documents.regular_file import read_regular_file
from ppafo.engine.compilers import Compiler
from ppafo.engine.source_text import without_origins
from ppafo.errors import one_line, reason
from ppafo.progress import time_text

try:
    import fcntl
except ImportError:  # not on this system: each process compiles for itself
    fcntl = None  # type: ignore[assignment]

logger = logging.getLogger("ppafo")

CACHE_VARIABLE = "PPAFO_CACHE_DIR"
LONGEST_UNUSED = 90.0 * 86400.0
"""Seconds after which a program that no run has used is removed."""

MAXIMUM_BYTES = 500_000_000
"""Size of all programs above which those that were not used for longest are removed."""

WRITTEN_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH

LONGEST_WAIT = 300.0
"""Seconds after which a process compiles for itself, whoever holds the lock; one that has died holds none."""
# Between two tries to get the lock [s]: short beside the seconds of a compilation.
_PAUSE = 0.05
LOCK = ".lock-"
"""Beginning of the name of a lock file; the rest is the program's."""
QUIET = 2.0
"""Seconds of compiling that nobody has to hear of."""
SECONDS_FILE = "seconds.txt"
"""The file of a kept program that says how long it took to compile [s]."""
# Programs whose times are read for an estimate: a median of more says no more, and each costs two files.
_MAXIMUM_ASKED = 20
_models: ContextVar[int] = ContextVar("models that are compiled together", default=0)

_PROGRAM = re.compile(r"ppafo_[a-z]+_[0-9a-f]{24}(-[0-9a-f]{12}|\..+)?")
"""Names of programs; also of an earlier release, whose programs lay in several files."""

NOTE = "not-working-"
_ASIDE = re.compile(rf"\.writing-[0-9a-f]{{16}}|{re.escape(LOCK)}{_PROGRAM.pattern}|{NOTE}[a-z]+-[0-9a-f]{{12}}")
LEFT_OUT_FOR = 86400.0
"""Seconds after which a compiler that did not work is tried again: headers may have been installed."""
_LONGEST_ASIDE = 86400.0
_CHECKSUMS = "checksums.json"
_LOADING: dict[str, threading.RLock] = {}


@dataclass(frozen=True, slots=True)
class CachedProgram:
    """A program in the cache: where it is, its bytes, and when it was last used, in seconds since 1970."""

    place: Path
    size: int
    used: float


def cache_folder() -> Path | None:
    """Return the folder of the programs: ``PPAFO_CACHE_DIR``, or the user's cache; None where the user has no home."""
    if os.environ.get(CACHE_VARIABLE):
        return Path(os.environ[CACHE_VARIABLE]).absolute()
    import platformdirs

    try:
        folder = Path(platformdirs.user_cache_dir("ppafo", appauthor=False)) / "programs"
    except RuntimeError:
        return None
    return folder if folder.is_absolute() else None


@dataclass(frozen=True, slots=True)
class _Wanted:
    """A program: its text, and what compiles it."""

    source: str
    compiler: Compiler

    @property
    def name(self) -> str:
        """Name of its module."""
        return f"ppafo_{self.compiler.name}_{hashlib.sha256(without_origins(self.source).encode()).hexdigest()[:24]}"

    def place(self, folder: Path) -> Path:
        """Where it is kept."""
        return folder / f"{self.name}-{_short_hash(self.compiler.identity())}"

    def compile(self, path: Path) -> ModuleType:
        """Compile it, beside ``path`` where that is a place."""
        return _execute(self.name, self.source, path, self.compiler.compile_text)

    def estimate(self, kept: Iterable[Path]) -> float:
        """About how long it takes to compile [s]."""
        kind = self.name.rpartition("_")[0]
        alike = [place for place in kept if place.name.startswith(f"{kind}_")]
        return estimate_seconds(self.source, alike, self.compiler.seconds_per_byte)


def load_generated(source: str, compiler: Compiler) -> ModuleType:
    """Import the module with this source, from the cache where it is there and whole; else it is compiled.

    ProgramError where it cannot be compiled, in terms of the file that the function at fault was written in;
    CompilerError where the compiler does not work.
    """
    wanted = _Wanted(source, compiler)
    # A second thread must not get a module of which only the beginning has run.
    with _LOADING.setdefault(wanted.name, threading.RLock()):
        return sys.modules[wanted.name] if wanted.name in sys.modules else _import_program(wanted)


def load_all(sources: Iterable[str], compiler: Compiler, load: Callable[[str], object]) -> None:
    """Import the modules with these sources by ``load``; several that ``compiler`` must make are made side by side."""
    missing = [source for source in dict.fromkeys(sources) if not is_kept(source, compiler)]
    # One alone is compiled where it is needed, with its own message.
    if len(missing) < 2:
        return
    folder = cache_folder()
    kept = [] if folder is None else _entries_named(folder, _PROGRAM)
    expected = sum(_Wanted(source, compiler).estimate(kept) for source in missing)
    where = "not kept" if folder is None or refusal(folder) else f"kept in {folder}"
    compile_side_by_side([partial(load, source) for source in missing], expected, where)


def is_kept(source: str, compiler: Compiler) -> bool:
    """True where a program was loaded by this compiler already, or lies in the cache."""
    wanted, folder = _Wanted(source, compiler), cache_folder()
    return wanted.name in sys.modules or (folder is not None and os.path.lexists(wanted.place(folder)))


def note_name(compiler: Compiler) -> str:
    """Name of the file in the cache that says why a compiler does not work on this computer."""
    return f"{NOTE}{compiler.name}-{_short_hash(compiler.identity())}"


def list_left_out(folder: Path) -> dict[str, str]:
    """Return why compilers were left out lately, by their names."""
    found = {}
    for place in _entries_named(folder, _ASIDE):
        if place.name.startswith(NOTE):
            with contextlib.suppress(OSError):
                text = read_regular_file(place).decode("utf-8", "replace")
                if time.time() - place.lstat().st_mtime < LEFT_OUT_FOR:
                    found[place.name.removeprefix(NOTE).partition("-")[0]] = one_line(text)
    return found


def list_programs(folder: Path) -> list[CachedProgram]:
    """Return the programs in a cache folder, the one that was used last first."""
    return _measured([*_entries_named(folder, _PROGRAM), *_entries_named(folder / "__pycache__", _PROGRAM)])


def clear(folder: Path) -> int:
    """Remove all that is kept, and the folder where nothing else is in it; return how many bytes that freed."""
    freed = 0
    aside, made = _measured(_entries_named(folder, _ASIDE)), _measured(_files(folder / FOLDER))
    for program in [*list_programs(folder), *aside, *made]:
        _remove(program.place)
        freed += 0 if os.path.lexists(program.place) else program.size
    for emptied in (folder / FOLDER, folder / "__pycache__", folder):
        with contextlib.suppress(OSError):
            emptied.rmdir()
    return freed


def evict(folder: Path) -> None:
    """Remove programs unused for ``LONGEST_UNUSED``, those beyond ``MAXIMUM_BYTES``, and what a killed process left."""
    _evict(list_programs(folder), MAXIMUM_BYTES)
    for left in _measured(_entries_named(folder, _ASIDE)):
        # A day is longer than any compilation: what is older was left by a process that was killed.
        if time.time() - left.used > _LONGEST_ASIDE:
            _remove(left.place)


def _evict(programs: Iterable[CachedProgram], most: int) -> None:
    """Remove what was unused for ``LONGEST_UNUSED`` and what is beyond ``most`` bytes, the last used coming first."""
    now, total = time.time(), 0
    # The list begins with what was used last, so that the total passes the limit at what is dropped.
    for program in programs:
        total += program.size
        if now - program.used > LONGEST_UNUSED or total > most:
            _remove(program.place)


def _import_program(wanted: _Wanted) -> ModuleType:
    folder = cache_folder()
    # Loading runs what lies there, so the folder is looked at each time, not once for the process.
    why_not = refusal(folder)
    if folder is None or why_not:
        logger.warning("ppafo: compiled models are not kept: %s; %s names another folder", why_not, CACHE_VARIABLE)
    else:
        kept = wanted.place(folder)
        module = _load_kept_module(kept, wanted)
        if module is not None:
            return module
        try:
            with one_process(kept):
                # Another process may have compiled it while this one waited for the lock.
                return _load_kept_module(kept, wanted) or _compile_and_keep(kept, wanted)
        except OSError as error:
            logger.warning("ppafo: the compiled model is not kept in %s: %s", folder, reason(error))
    with announce(wanted.estimate(()), "not kept"):
        return wanted.compile(Path(f"<{wanted.name}>"))


def _load_kept_module(kept: Path, wanted: _Wanted) -> ModuleType | None:
    """Return the module of a program that is there and whole; one that is damaged is removed."""
    if not os.path.lexists(kept):
        return None
    if not _is_whole(kept):
        logger.warning("ppafo: the compiled model %s is damaged; it is made anew", kept.name)
        _remove(kept)
        return None
    try:
        path = kept / f"{wanted.name}.py"
        module = _execute(wanted.name, wanted.source, path, wanted.compiler.run_text)
        os.utime(kept)
    except OSError:  # another process has removed it in this instant, or the disk is full
        return sys.modules.get(wanted.name)
    return module


def _compile_and_keep(kept: Path, wanted: _Wanted) -> ModuleType:
    """Compile a program in a folder aside, which takes its place when it is whole."""
    # Written aside and renamed: to other processes a program is whole, or not there.
    aside = kept.with_name(f".writing-{secrets.token_hex(8)}")
    try:
        aside.mkdir(mode=0o700)
        path = aside / f"{wanted.name}.py"
        path.write_text(wanted.source, encoding="utf-8")
        start = time.perf_counter()
        with announce(wanted.estimate(_entries_named(kept.parent, _PROGRAM)), f"kept in {kept.parent}"):
            module = wanted.compile(path)
        (aside / SECONDS_FILE).write_text(f"{time.perf_counter() - start:.2f}", encoding="ascii")
        (aside / _CHECKSUMS).write_text(json.dumps(_checksums(aside), indent=2), encoding="utf-8")
        for place in aside.rglob("*"):  # compilers let a group write where the user's habits (umask) do
            place.chmod(0o700 if place.is_dir() else 0o600)
        with contextlib.suppress(OSError):  # another process was quicker, with the same program
            aside.rename(kept)
        evict(kept.parent)
    except OSError:
        sys.modules.pop(wanted.name, None)
        raise
    finally:
        _remove(aside)
    return module


def _execute(name: str, source: str, path: Path, execute: Callable[[str, str, ModuleType], None]) -> ModuleType:
    """Return the module that ``execute`` fills; Python's own compiled file, which may be damaged, is not asked."""
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    try:
        execute(source, str(path), module)
    # A module that was interrupted half-way must not be found by the next import.
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _short_hash(described: str) -> str:
    return hashlib.sha256(described.encode()).hexdigest()[:12]


def _is_whole(kept: Path) -> bool:
    """Return whether a program's folder is as it was written, file by file."""
    try:
        stated = json.loads(read_regular_file(kept / _CHECKSUMS))
        # What else lies there is no part of it.
        files = stated.items() if isinstance(stated, dict) else ()
        return _is_own(kept, [name for name, _ in files]) and all(
            hashlib.sha256(read_regular_file(kept / name)).hexdigest() == given for name, given in files
        )
    except (OSError, ValueError, RecursionError):
        return False


def _is_own(kept: Path, files: Collection[str]) -> bool:
    """Return whether a program and all in it is this user's, and nobody else can write into its ``files`` and folders.

    What came while others could write stays theirs. Nobody else can then change a file between this look and its use.
    """
    found = [kept.lstat()]
    for place in kept.rglob("*"):
        with contextlib.suppress(FileNotFoundError):
            found.append(place.lstat())
    if not hasattr(os, "geteuid"):
        return stat.S_ISDIR(found[0].st_mode)
    # Root may own a file: what root can do, no check prevents.
    is_whose = all(item.st_uid in (0, os.geteuid()) for item in found)
    used = [item for item in found if stat.S_ISDIR(item.st_mode)]
    is_folder = found[0] in used
    used += [(kept / name).lstat() for name in (_CHECKSUMS, *files)]
    return is_whose and is_folder and bool(files) and not any(item.st_mode & WRITTEN_BY_OTHERS for item in used)


def _checksums(folder: Path) -> dict[str, str]:
    """Return the hash of every file of a program but the list of them itself."""
    files = sorted(path for path in folder.rglob("*") if not path.is_dir() and path.name != _CHECKSUMS)
    return {path.relative_to(folder).as_posix(): hashlib.sha256(read_regular_file(path)).hexdigest() for path in files}


def _entries_named(folder: Path, pattern: re.Pattern[str]) -> list[Path]:
    """Return the entries of a folder with such a name; what others put beside them is left alone."""
    try:
        return [place for place in folder.iterdir() if pattern.fullmatch(place.name)]
    except OSError:
        return []


def _measured(places: Iterable[Path]) -> list[CachedProgram]:
    """Return programs and files with their sizes, the one that was used last first."""
    found = []
    for place in places:
        try:
            files = [place] if place.is_symlink() or not place.is_dir() else [place, *place.rglob("*")]
            size, used = sum(path.lstat().st_size for path in files), place.lstat().st_mtime
        except OSError:  # another process has removed it in this instant
            size, used = 0, time.time()
        found.append(CachedProgram(place, size, used))
    return sorted(found, key=lambda item: -item.used)


def _remove(place: Path) -> None:
    """Remove a program, a file or a link; what cannot be removed stays.

    A folder is moved aside first: to another process a program is there and whole, or not there.
    """
    with contextlib.suppress(OSError):
        if place.is_dir() and not place.is_symlink():
            aside = place.with_name(f".writing-{secrets.token_hex(8)}")
            place.rename(aside)
            shutil.rmtree(aside)
        else:
            place.unlink()


def refusal(folder: Path | None) -> str:
    """Return why programs are neither read from nor kept in a folder, as the end of a sentence; empty where they are.

    The folder is made if need be. It must be this user's own and no link, and nobody else may write it or put another
    in its place.
    """
    if folder is None:
        return "this user has no home folder"
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileExistsError):
            folder.mkdir(mode=0o700)
        found = folder.lstat()
        # Whoever can write in any folder above can rename this one and put his own in its place.
        above = [place.stat() for place in Path(os.path.realpath(folder)).parents]
    except (OSError, ValueError) as error:
        return f"{folder} cannot be made: {reason(error)}"
    has_users = hasattr(os, "geteuid")
    if not stat.S_ISDIR(found.st_mode):
        why_not = f"{folder} is {'a link' if stat.S_ISLNK(found.st_mode) else 'not a folder'}"
    elif has_users and found.st_uid != os.geteuid():
        why_not = f"{folder} belongs to another user"
    elif has_users and found.st_mode & WRITTEN_BY_OTHERS:
        why_not = f"others can write into {folder}; 'ppafo doctor --clear' and 'chmod 700' make it safe"
    elif has_users and any(_can_be_exchanged(place) for place in above):
        why_not = f"others can put another folder in the place of {folder}"
    else:
        why_not = "" if os.access(folder, os.W_OK | os.X_OK) else f"{folder} cannot be written"
    return why_not


def _can_be_exchanged(place: os.stat_result) -> bool:
    """Return whether another user can rename what lies in a folder."""
    if place.st_uid not in (0, os.geteuid()):
        return True
    # A sticky folder such as /tmp lets each user rename only what is his own.
    writers = stat.S_IWOTH if _is_own_group(place.st_gid) else WRITTEN_BY_OTHERS
    return bool(place.st_mode & writers and not place.st_mode & stat.S_ISVTX)


@cache
def _is_own_group(number: int) -> bool:
    """Return whether a group is this user's alone: many systems give each user one, which may write where they may."""
    import grp
    import pwd

    try:
        user, group = pwd.getpwuid(os.geteuid()), grp.getgrgid(number)
    except KeyError:
        return False
    return user.pw_gid == number and group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}


@contextlib.contextmanager
def one_process(kept: Path) -> Iterator[None]:
    """Hold the lock of a program while it is compiled; where none can be had, go on without."""
    place = kept.with_name(LOCK + kept.name)
    held = _lock(place)
    try:
        yield
    finally:
        if held is not None:
            with contextlib.suppress(OSError):
                place.unlink()
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


def compile_side_by_side(tasks: Sequence[Callable[[], object]], expected: float, where: str) -> None:
    """Compile several models on all cores, with one message about all; ``expected`` [s] is the time on one core."""
    from concurrent.futures import ThreadPoolExecutor

    workers = min(len(tasks), os.cpu_count() or 1)
    with announce(expected / workers, where, len(tasks)), ThreadPoolExecutor(workers) as pool:
        # A context variable, not a global: two threads may compile different sets at once.
        known = _models.set(len(tasks))
        try:
            started = [pool.submit(copy_context().run, task) for task in tasks]
        finally:
            _models.reset(known)
        for task in started:
            task.result()


@contextlib.contextmanager
def announce(expected: float, where: str, models: int = 1) -> Iterator[None]:
    """Say, once it takes longer than ``QUIET``, what is compiled and about how long [s] that takes, and how it ended.

    Nothing is said of what is quick, and of one of several models that are announced together.
    """
    # One of several: their message counts them together.
    if _models.get():
        yield
        return
    what = "a model" if models == 1 else f"{models} models"
    text = f"ppafo: compiling {what} for this computer, about {time_text(max(expected, QUIET))} ..."
    # A message only where it takes long: most programs are kept, and the rest compile in the quiet time.
    timer = threading.Timer(QUIET, logger.warning, (text,))
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
        logger.warning("ppafo: compiled in %.1f s and %s", seconds, where)


def estimate_seconds(source: str, kept: Iterable[Path], usual: float) -> float:
    """Return about how long [s] a source takes to compile, from how long the kept programs of this computer took."""
    import statistics

    rates = []
    for folder in kept:
        with contextlib.suppress(OSError, ValueError, StopIteration):
            seconds = float((folder / SECONDS_FILE).read_text(encoding="ascii"))
            # Seconds per byte of text: programs of one kind differ in length more than in difficulty.
            rates.append(seconds / next(folder.glob("*.py")).stat().st_size)
        if len(rates) == _MAXIMUM_ASKED:
            break
    return len(source) * (statistics.median(rates) if rates else usual)


FOLDER = "made"
"""Folder of these files inside the folder of the programs."""

MAXIMUM_MADE_BYTES = 50_000_000
"""Size of all files above which those that were not used for longest are removed."""

_HASH_BYTES = hashlib.sha256().digest_size
_OWN_NAME = re.compile(r"[a-z]+-[0-9a-f]{32}|\.writing-[0-9a-f]{16}")


def kept_bytes(kind: str, made_from: str, make: Callable[[], bytes]) -> bytes:
    """Return what ``make`` makes of ``made_from``, all that it depends on; from the disk where it was made before."""
    folder = cache_folder()
    if folder is None or refusal(folder):
        return make()
    # The name is the hash of all that the content depends on, so that nothing kept is ever out of date.
    key = hashlib.sha256(made_from.encode("utf-8", "surrogatepass")).hexdigest()[:32]
    place = folder / FOLDER / f"{kind}-{key}"
    content = _read(place)
    if content is None:
        content = make()
        with contextlib.suppress(OSError):
            _write(place, content)
            _evict(_measured(_files(place.parent)), MAXIMUM_MADE_BYTES)
    return content


def kept_sizes(folder: Path) -> list[int]:
    """Return the sizes [bytes] of what is kept in the folder of the programs."""
    return [made.size for made in _measured(_files(folder / FOLDER))]


def _read(place: Path) -> bytes | None:
    try:
        found, above = place.lstat(), place.parent.lstat()
        if not (stat.S_ISREG(found.st_mode) and stat.S_ISDIR(above.st_mode)):
            return None
        # It may be run: file and folder must be this user's, and nobody else may write there.
        if hasattr(os, "geteuid"):
            is_written = (found.st_mode | above.st_mode) & WRITTEN_BY_OTHERS
            if is_written or not {found.st_uid, above.st_uid} <= {0, os.geteuid()}:
                return None
        content = read_regular_file(place)
        os.utime(place)
    except OSError:
        return None
    # A file that was cut by a full disk, or changed, counts as not there.
    stated, rest = content[:_HASH_BYTES], content[_HASH_BYTES:]
    return rest if hashlib.sha256(rest).digest() == stated else None


def _write(place: Path, content: bytes) -> None:
    # Through a link the file would land in a folder that nobody has checked.
    if place.parent.is_symlink():
        return
    place.parent.mkdir(mode=0o700, exist_ok=True)
    aside = place.with_name(f".writing-{secrets.token_hex(8)}")
    try:
        aside.write_bytes(hashlib.sha256(content).digest() + content)
        aside.chmod(0o600)
        aside.replace(place)
    finally:
        aside.unlink(missing_ok=True)


def _files(folder: Path) -> list[Path]:
    """Return this module's files in a folder that is no link; what others put beside them is left alone."""
    return [] if folder.is_symlink() else _entries_named(folder, _OWN_NAME)
