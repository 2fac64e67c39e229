"""One process compiles a program while others wait for it."""

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path

from ppafo.engine.cache.folder import LOCK

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
