"""Trial reading of a file in a process with limited memory, started by ``trial_reading.py``.

The command is ``python -m ppafo.storage.trial_process READER LIBRARY PATH``. READER is a function of the package,
``MODULE:NAME``, and LIBRARY is the C extension module that it uses.
"""

import os
import pkgutil
import sys
from importlib import import_module
from pathlib import Path

from ppafo.errors import DataError

REFUSED, OUT_OF_MEMORY = 76, 77
"""Exit codes: invalid file, with one line of explanation on the output; and excessive memory."""
_ALWAYS_ALLOWED = 400_000_000
"""Memory that reading may take for a file of any size [bytes]."""
_MAXIMUM_GROWTH = 100
"""Largest ratio of memory for reading to file size [-], for larger files."""


def read_on_trial(reader: str, library: str, path: str) -> int:
    """Read a file on trial. Returns the exit code: 0, ``REFUSED`` with a reason on the output, or ``OUT_OF_MEMORY``."""
    # What the libraries take themselves does not count.
    import_module(library)
    read = pkgutil.resolve_name(reader)
    sizes = Path("/proc/self/statm")
    # Only Linux reports the memory in use and limits what is allocated beyond it.
    if sizes.exists():
        import resource

        taken = int(sizes.read_text().split()[0]) * resource.getpagesize()
        limit = taken + max(_ALWAYS_ALLOWED, _MAXIMUM_GROWTH * Path(path).stat().st_size)
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
