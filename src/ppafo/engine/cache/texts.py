"""Texts that are expensive to compose, stored under a key of their inputs."""

import contextlib
import hashlib
import os
import secrets
from collections.abc import Callable
from pathlib import Path

from ppafo.documents.regular_file import read_regular_file
from ppafo.engine.cache.folder import TEXTS, cache_folder, is_private, refusal

MAXIMUM_BYTES = 50_000_000
"""Total size of all texts [byte] above which the least recently used texts are removed."""

_HASH_BYTES = hashlib.sha256().digest_size


def kept_bytes(kind: str, made_from: str, make: Callable[[], bytes]) -> bytes:
    """Return the result of ``make`` for the inputs ``made_from``, from the cache if it was stored before."""
    folder = cache_folder()
    if folder is None or refusal(folder):
        return make()
    # The name is the hash of all that the content depends on, so that nothing kept is ever out of date.
    key = hashlib.sha256(made_from.encode("utf-8", "surrogatepass")).hexdigest()[:32]
    file = folder / TEXTS / f"{kind}-{key}"
    content = _read(file)
    if content is None:
        content = make()
        with contextlib.suppress(OSError):
            _write(file, content)
            from ppafo.engine.cache.tidying import evict_beyond, list_texts  # most texts are there

            evict_beyond(list_texts(folder), MAXIMUM_BYTES)
    return content


def _read(file: Path) -> bytes | None:
    try:
        # It may be run: file and folder must be this user's, and nobody else may write there.
        if not is_private(file, file.parent):
            return None
        content = read_regular_file(file)
        os.utime(file)
    except OSError:
        return None
    # A file that was cut by a full disk, or changed, counts as not there.
    stated, rest = content[:_HASH_BYTES], content[_HASH_BYTES:]
    return rest if hashlib.sha256(rest).digest() == stated else None


def _write(file: Path, content: bytes) -> None:
    # Through a link the file would land in a folder that nobody has checked.
    if file.parent.is_symlink():
        return
    file.parent.mkdir(mode=0o700, exist_ok=True)
    aside = file.with_name(f".writing-{secrets.token_hex(8)}")
    try:
        aside.write_bytes(hashlib.sha256(content).digest() + content)
        aside.chmod(0o600)
        aside.replace(file)
    finally:
        aside.unlink(missing_ok=True)
