"""Reading of regular files only, because devices never end and an opened named pipe blocks."""

import codecs
import stat
from pathlib import Path

MAXIMUM_BYTES_TYPED = 1_000_000
"""Largest size [bytes] of a file written by hand, such as a scenario or a parameter set."""
_TWO_CHARACTERS = 4
"""Bytes of UTF-16."""


def read_regular_file(path: Path, maximum: int | None = None) -> bytes:
    """Read a regular file of at most ``maximum`` bytes. Raises OSError with a reason as text."""
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(None, "it is a directory, not a file")
    if not stat.S_ISREG(status.st_mode):
        raise OSError(None, "it is a device or a pipe, not a regular file")
    if maximum is None or status.st_size <= maximum:
        with path.open("rb") as file:
            # Python takes the room for as much as is asked for; what grows meanwhile, or states no size, is read on.
            content = file.read(status.st_size + 1)
            if len(content) > status.st_size:
                content += file.read() if maximum is None else file.read(maximum + 1 - len(content))
        if maximum is None or len(content) <= maximum:
            return content
    raise OSError(None, f"it is larger than {maximum / 1e6:g} MB, the maximum size of such a file")


def decoded(content: bytes) -> str:
    """Decode UTF-8 or UTF-16 text, with or without byte-order mark.

    Raises UnicodeDecodeError for other encodings. Spreadsheets and loggers on Windows write UTF-16.
    """
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16")
    # Without a mark: two plain characters, each with a byte of zero behind it or before it.
    for zero, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        if len(content) >= _TWO_CHARACTERS and not any(content[zero:4:2]) and all(content[1 - zero : 4 : 2]):
            return content.decode(encoding)
    return content.decode("utf-8-sig")
