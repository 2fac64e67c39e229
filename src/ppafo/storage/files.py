"""Atomic reading and writing of files: each is written completely under a temporary name, then renamed."""

import contextlib
import errno
import os
import re
import secrets
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from ppafo import interrupts
from ppafo.documents.regular_file import decoded, read_regular_file
from ppafo.errors import DataError
from ppafo.wording import reason

LEFT_ASIDE = ".writing-"
"""Part of the temporary name of a file; such a file remains only from a killed process."""

# Constants ``AT_FDCWD`` and ``RENAME_EXCHANGE`` of Linux.
_CURRENT_FOLDER = -100
_EXCHANGE = 2

MAXIMUM_BYTES_RECORDED = 2_000_000_000
"""Largest size of a recording file [bytes]; an hour at 1 kHz with twenty channels is smaller, even as text."""

MAXIMUM_GROWTH = 100
"""Largest ratio of memory for reading a file to its size [-], beyond what a file of any size may take."""


def read_bytes(path: str | Path, maximum: int = MAXIMUM_BYTES_RECORDED) -> bytes:
    """Return the content of a regular file. Raises DataError if absent, empty or larger than ``maximum`` bytes."""
    try:
        content = read_regular_file(Path(path), maximum)
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read: {reason(error)}") from error
    if not content:
        raise DataError(f"{path}: is empty")
    return content


def check_growth(required: int, size: int, always_allowed: int) -> None:
    """Raise DataError for a file that takes implausibly much memory to read; all sizes in bytes.

    ``always_allowed`` is the memory that a file of any size may take.
    """
    if required > max(always_allowed, MAXIMUM_GROWTH * size):
        raise DataError(
            f"requires {required / 1e6:,.0f} MB of memory, more than {MAXIMUM_GROWTH} times the size of the file "
            f"({size / 1e6:.2g} MB)"
        )


def text_of(content: bytes, encoding: str = "utf-8", remedy: str = "") -> str:
    """Decode the content of a file as text. Raises DataError, ending in ``remedy``, if the encoding is wrong."""
    try:
        text = decoded(content) if encoding == "utf-8" else content.decode(encoding)
    except UnicodeDecodeError as error:
        if b"\0" in content:
            # In no encoding that is offered.
            raise DataError(f"is not a text file (byte {content.index(0)} is zero)") from error
        raise DataError(f"is not a text file in UTF-8 (byte {error.start} is invalid){remedy}") from error
    # Latin-1 reads any bytes as a text: a zero gives away what is none.
    if "\0" in text:
        raise DataError(f"is not a text file (byte {text.index(chr(0))} is zero)")
    return text


def is_address(path: str | Path) -> bool:
    """Return whether a path is the address of remote storage, such as ``s3://bucket``."""
    return re.match(r"[a-z][a-z0-9+]+:/", str(path)) is not None


def write_file(path: str | Path, content: bytes) -> Path:
    """Write a file, replacing an earlier one and creating missing folders. Returns the path."""
    target = Path(path)
    add_files(target.parent, {target.name: content}, target)
    return target


def add_files(folder: Path, contents: Mapping[str, bytes], named: Path | None = None) -> None:
    """Write files into a folder, replacing files of equal names; all are written before the first is renamed.

    Errors name the folder, or the path ``named``.
    """
    with _write_errors(named or folder), _make_folder(folder):
        _check_no_folder(folder, contents)
        aside = _sibling(folder / "files", "writing")
        try:
            aside.mkdir()
            for name, content in contents.items():
                (aside / name).write_bytes(content)
            for name in contents:
                (aside / name).replace(folder / name)
        finally:
            shutil.rmtree(aside, ignore_errors=True)


def temporary_folder(purpose: str, contents: Mapping[str, bytes] | None = None) -> "tempfile.TemporaryDirectory[str]":
    """Create a temporary folder with the given files by path; ``purpose`` is part of its name.

    The folder is removed at the end of a ``with`` block, or with the last reference to it. Raises DataError, leaving
    nothing behind, if the folder or a file cannot be written.
    """
    try:
        made = tempfile.TemporaryDirectory(prefix=f"{purpose}-", ignore_cleanup_errors=True)
        try:
            for name, content in (contents or {}).items():
                path = Path(made.name, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
        except OSError:
            made.cleanup()
            raise
    except OSError as error:
        remedy = "free disk space, or set TMPDIR to another folder"
        raise DataError(f"temporary files cannot be written: {reason(error)}; {remedy}") from error
    return made


def replace_folder(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Replace ``folder`` by these files, by path; the old folder stays until the new folder is complete."""
    target = _real(folder)
    with _write_errors(folder), _make_folder(target.parent):
        aside = _sibling(target, "writing")
        try:
            aside.mkdir()
            for name, content in contents.items():
                (aside / name).parent.mkdir(parents=True, exist_ok=True)
                (aside / name).write_bytes(content)
            # The last moment at which an interrupt leaves the folder as it was.
            interrupts.check()
            _swap(aside, target)
        finally:
            shutil.rmtree(aside, ignore_errors=True)


def check_folder_can_be_replaced(folder: Path) -> None:
    """Raise DataError if a folder cannot be replaced, by a trial that leaves nothing behind."""
    target = _real(folder)
    with _write_errors(folder), _make_folder(target.parent):
        trial = _sibling(target, "trial")
        _try_folder(trial)
        if not target.is_dir():
            return
        # A mount point, another user's sticky folder or a lower layer cannot be renamed. The trial's target contains a
        # file, so that nothing is renamed; other obstacles are reported first.
        try:
            trial.mkdir()
            (trial / "file").touch()
            target.rename(trial)
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                why = f"the folder itself cannot be replaced ({reason(error)}); choose a new subfolder"
                raise OSError(None, why) from error
        else:
            trial.rename(target)
        finally:
            shutil.rmtree(trial, ignore_errors=True)


def check_files_can_be_added(folder: Path, names: Iterable[str]) -> None:
    """Raise DataError if these files cannot be written into a folder, by a trial that leaves nothing behind."""
    with _write_errors(folder), _make_folder(folder):
        _check_no_folder(folder, names)
        _try_folder(_sibling(folder / "files", "trial"))


def _try_folder(trial: Path) -> None:
    try:
        trial.mkdir()
    finally:
        with contextlib.suppress(OSError):
            trial.rmdir()


def _real(folder: Path) -> Path:
    """Resolve links in a path; for circular links ``Path.resolve`` raises an error that is no OSError."""
    try:
        return Path(os.path.realpath(folder))
    except ValueError as error:
        raise DataError(f"{folder}: cannot be written: {reason(error)}") from error


@contextlib.contextmanager
def _make_folder(folder: Path) -> Iterator[None]:
    """Create a folder and its parents for a ``with`` block; at the end, empty new folders are removed."""
    new = [ancestor for ancestor in (folder, *folder.parents) if not ancestor.exists()]
    nearest = folder if folder.exists() else new[-1].parent
    if not nearest.is_dir():
        raise NotADirectoryError(None, f"'{nearest}' is a file, not a folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    finally:
        for ancestor in new:
            with contextlib.suppress(OSError):
                ancestor.rmdir()


def _check_no_folder(folder: Path, names: Iterable[str]) -> None:
    """Raise IsADirectoryError if a folder has the name of a file to be written, before any file is written."""
    for name in names:
        if (folder / name).is_dir():
            raise IsADirectoryError(None, f"'{name}' in it must be a file, and is a folder")


def _swap(new: Path, target: Path) -> None:
    """Rename ``new`` to ``target``; an existing ``target`` becomes ``new`` or is removed.

    If both cannot be exchanged in one step, the old folder is moved aside first, and back if the second step fails.
    """
    if not target.exists():
        new.rename(target)
        return
    if _exchange(new, target):
        return
    old = _sibling(target, "replaced")
    try:
        target.rename(old)
        new.rename(target)
    finally:
        if old.exists() and not target.exists():
            old.rename(target)
        shutil.rmtree(old, ignore_errors=True)


def _exchange(one: Path, other: Path) -> bool:
    """Exchange two folders atomically and return whether this succeeded; supported by Linux on most file systems."""
    import ctypes

    try:
        rename = ctypes.CDLL(None).renameat2
    except (AttributeError, OSError, TypeError):
        return False
    return bool(rename(_CURRENT_FOLDER, os.fsencode(one), _CURRENT_FOLDER, os.fsencode(other), _EXCHANGE) == 0)


def _sibling(target: Path, purpose: str) -> Path:
    """Return an unused path next to ``target``, on the same disk."""
    # Beside it, as a rename is one step on one disk only; with a random part, as two commands may write at once.
    return target.with_name(f".{target.name}.{purpose}-{secrets.token_hex(4)}")


@contextlib.contextmanager
def _write_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be written: {reason(error)}") from error
