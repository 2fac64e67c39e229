"""Trial reading of files in a separate process, because a C library may crash or hang on a damaged file.

The process is ``python -m ppafo.storage.trial_reading READER LIBRARY PATH``, with limited memory. READER is a function
of the package, ``MODULE:NAME``, and LIBRARY is the C extension module that it uses.
"""

import os
import pkgutil
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from ppafo.errors import DataError
from ppafo.storage.files import MAXIMUM_GROWTH

TRIAL = ("-P", "-m", __name__)
"""Python arguments for the separate process; ``-P`` prevents imports from the working folder."""
_MAXIMUM_SECONDS = 30.0
"""Time limit for reading a file [s], including the start of a process on a busy computer."""
_BYTES_PER_SECOND = 5e6
"""Reading rate of a slow disk [bytes/s], which extends the time limit of large files."""
# Exit codes: invalid file, with one line of explanation on the output; and excessive memory.
REFUSED = 76
OUT_OF_MEMORY = 77
_ALWAYS_ALLOWED = 400_000_000
"""Memory that reading may take for a file of any size [bytes]."""


def check_can_be_read(path: Path, read: Callable[[str], object], library: str) -> None:
    """Raise DataError for a file on which ``read`` fails, crashes, hangs or takes excessive memory.

    ``read`` is a public function of a module, called in a separate process with the path alone. ``library`` is the C
    extension module that it uses, loaded before memory is limited (if the system can limit memory).
    """
    if not sys.executable or not path.is_file():
        return
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    reader = f"{read.__module__}:{read.__qualname__}"
    # A slow disk must not pass for a damaged file, nor a busy computer.
    limit = _MAXIMUM_SECONDS + path.stat().st_size / _BYTES_PER_SECOND
    try:
        ended = subprocess.run(
            [sys.executable, *TRIAL, reader, library, str(path)],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=limit,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise DataError(f"{path}: is damaged: the library {library} does not finish reading it") from error
    if ended.returncode == REFUSED:
        raise DataError(os.fsdecode(ended.stdout))
    if ended.returncode == OUT_OF_MEMORY:
        raise DataError(f"{path}: is damaged: the library {library} needs far more memory than a file of its size")
    # Below 0 is the signal that ended it. Any other end is of no file, and the reading itself shows what is wrong.
    if ended.returncode < 0:
        raise DataError(f"{path}: is damaged: the library {library} crashes")


def read_on_trial(reader: str, library: str, path: str) -> int:
    """Read a file on trial. Returns the exit code: 0, ``REFUSED`` with a reason on the output, or ``OUT_OF_MEMORY``."""
    # The memory of the libraries themselves does not count.
    import_module(library)
    read = pkgutil.resolve_name(reader)
    sizes = Path("/proc/self/statm")
    # Only Linux reports the memory in use and limits what is allocated beyond it.
    if sizes.exists():
        import resource

        taken = int(sizes.read_text().split()[0]) * resource.getpagesize()
        limit = taken + max(_ALWAYS_ALLOWED, MAXIMUM_GROWTH * Path(path).stat().st_size)
        highest = resource.getrlimit(resource.RLIMIT_AS)[1]
        limit = limit if highest == resource.RLIM_INFINITY else min(limit, highest)
        resource.setrlimit(resource.RLIMIT_AS, (limit, highest))
    try:
        read(path)
    except DataError as error:
        sys.stdout.buffer.write(os.fsencode(str(error)))
        return REFUSED
    except MemoryError:
        return OUT_OF_MEMORY
    return 0


if __name__ == "__main__":
    sys.exit(read_on_trial(*sys.argv[1:]))
