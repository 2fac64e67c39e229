"""Bytes to and from disk: a file or a folder is written whole beside its place, then renamed, or not at all."""

import contextlib
import secrets
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

from ppafo.errors import DataError


def read_bytes(path: str | Path) -> bytes:
    """Return the content of a file that is there and is not empty."""
    try:
        content = Path(path).read_bytes()
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read: {_reason(error)}") from error
    if not content:
        raise DataError(f"{path}: is empty")
    return content


def write_file(path: str | Path, content: bytes) -> Path:
    """Write a file, replacing an earlier one; folders are made if need be. Returns the path."""
    target = Path(path)
    with _written_errors(target):
        target.parent.mkdir(parents=True, exist_ok=True)
        aside = _sibling(target, "writing")
        try:
            aside.write_bytes(content)
            aside.replace(target)
        finally:
            aside.unlink(missing_ok=True)
    return target


def replace_folder(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Make ``folder`` hold exactly these files; an earlier folder stays as it was until the new one is whole."""
    with _written_errors(folder):
        target = folder.resolve()
        target.parent.mkdir(parents=True, exist_ok=True)
        aside = _sibling(target, "writing")
        try:
            aside.mkdir()
            for name, content in contents.items():
                (aside / name).write_bytes(content)
            _swap(aside, target)
        finally:
            shutil.rmtree(aside, ignore_errors=True)


def _swap(new: Path, target: Path) -> None:
    """Rename ``new`` to ``target``; a folder that was there goes aside first and comes back if that fails."""
    if not target.exists():
        new.rename(target)
        return
    old = _sibling(target, "replaced")
    try:
        target.rename(old)
        new.rename(target)
    finally:
        if old.exists() and not target.exists():
            old.rename(target)
        shutil.rmtree(old, ignore_errors=True)


def _sibling(target: Path, purpose: str) -> Path:
    """Return a path beside ``target``, on the same disk, that nothing has yet."""
    return target.with_name(f".{target.name}.{purpose}-{secrets.token_hex(4)}")


@contextlib.contextmanager
def _written_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be written: {_reason(error)}") from error


def _reason(error: OSError | ValueError) -> str:
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return text[:1].lower() + text[1:]
