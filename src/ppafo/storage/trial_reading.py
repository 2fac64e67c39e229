"""Files read first by another process: a library of C code can crash on a damaged file, hang, or take all memory."""

import os
import subprocess
import sys
from pathlib import Path

from ppafo.errors import DataError

_MAXIMUM_SECONDS, _BYTES_PER_SECOND = 30.0, 5e6
"""How long reading may take: what a start takes on a busy computer, and as long as a slow disk needs for the file."""

_ALWAYS_ALLOWED, _MAXIMUM_GROWTH = 400_000_000, 100
"""Bytes of memory that reading any file may take, and how often its own size a larger one may."""

_REFUSED, _OUT_OF_MEMORY = 76, 77
_TRIAL = f"""
import os, sys
from importlib import import_module
from ppafo.errors import DataError
from ppafo.storage.trial_reading import limit_memory

module, function, library, path = sys.argv[1:]
import_module(library)
read = getattr(import_module(module), function)
limit_memory(path)
try:
    read(path)
except DataError as error:
    sys.stdout.buffer.write(os.fsencode(str(error)))
    sys.exit({_REFUSED})
except MemoryError:
    sys.exit({_OUT_OF_MEMORY})
"""


def check_can_be_read(path: Path, module: str, function: str, library: str) -> None:
    """Refuse a file on which ``function(path)`` of a module brings down a process, or which it refuses itself.

    Memory is limited where the system can do it. DataError says why.
    """
    if not sys.executable or not path.is_file():
        return
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    # -P: nothing of the working folder is imported
    words = [sys.executable, "-P", "-c", _TRIAL, module, function, library, str(path)]
    # A slow disk must not pass for a damaged file, nor a busy computer.
    limit = _MAXIMUM_SECONDS + path.stat().st_size / _BYTES_PER_SECOND
    nothing = subprocess.DEVNULL
    try:
        done = subprocess.run(
            words, env=environment, stdin=nothing, stdout=subprocess.PIPE, stderr=nothing, timeout=limit, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise DataError(f"{path}: is damaged: the library {library} does not finish reading it") from error
    if done.returncode == _REFUSED:
        raise DataError(os.fsdecode(done.stdout))
    if done.returncode == _OUT_OF_MEMORY:
        raise DataError(f"{path}: is damaged: the library {library} requires far more memory than the file contains")
    if done.returncode < 0:
        raise DataError(f"{path}: is damaged: the library {library} crashes on it")


def limit_memory(path: str) -> None:
    """Let this process take no more memory than reading a file may need, beside what it has; only Linux can that."""
    pages = Path("/proc/self/statm")
    if not pages.exists():
        return
    import resource

    has = int(pages.read_text().split()[0]) * resource.getpagesize()
    limit = has + max(_ALWAYS_ALLOWED, _MAXIMUM_GROWTH * Path(path).stat().st_size)
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))
