"""Folder of a study's results; files are written under a temporary name, then renamed, so that none is incomplete."""

import contextlib
import io
import shutil
import stat
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ppafo.documents.json_text import json_document
from ppafo.errors import DataError
from ppafo.storage.files import LEFT_ASIDE, is_address, write_file

_MAXIMUM_BYTES_OF_DOCUMENT = 100_000_000
"""Largest document that is read [bytes]; documents of studies are far smaller."""
_BLOCK = 1_000_000
"""Size of a read block [bytes]."""
_LONGEST_WRITING = 86400.0
"""Age from which a temporary file counts as abandoned [s]."""


@dataclass(frozen=True, slots=True)
class StudyFolder:
    """Folder of a study's results; file names are relative to ``path``, with ``/`` between folders."""

    path: Path

    def names(self) -> frozenset[str]:
        """Return the names of all files except temporary files left by a killed process.

        Raises DataError if the path is a file.
        """
        if self.path.exists() and not self.path.is_dir():
            raise DataError(f"{self.path}: is a file; the results need a folder")
        files = (path for path in self.path.rglob("*") if not path.is_dir() and LEFT_ASIDE not in path.name)
        return frozenset(path.relative_to(self.path).as_posix() for path in files)

    def open(self, name: str) -> io.BufferedIOBase:
        """Return a file opened for reading; OSError if it is not a regular file."""
        path = self.path / name
        if not stat.S_ISREG(path.stat().st_mode):
            raise OSError(None, f"{path} is not a regular file")
        return path.open("rb")

    def read_document(self, name: str) -> Any:
        """Return the content of a JSON file of this package as plain data; OSError or ValueError on failure."""
        with self.open(name) as file:
            content = bytearray()
            # In blocks: Python takes the room for as much as is asked for.
            while len(content) <= _MAXIMUM_BYTES_OF_DOCUMENT and (block := file.read(_BLOCK)):
                content += block
        if len(content) > _MAXIMUM_BYTES_OF_DOCUMENT:
            raise ValueError(f"{name} is larger than {_MAXIMUM_BYTES_OF_DOCUMENT / 1e6:g} MB")
        return json_document(bytes(content))

    def write(self, name: str, content: bytes) -> None:
        """Write a file under a temporary name, then rename it."""
        write_file(self.path / name, content)

    def remove(self, name: str) -> None:
        """Remove a file if it exists."""
        (self.path / name).unlink(missing_ok=True)

    def free_bytes(self) -> int:
        """Return the free disk space [bytes]."""
        there = next(ancestor for ancestor in (self.path, *self.path.parents) if ancestor.exists())
        return shutil.disk_usage(there).free

    def tidy(self) -> None:
        """Remove old temporary files left by killed processes; recent ones may belong to a running process."""
        # By age and not by process: the folder may be shared by machines that cannot see each other's processes.
        latest = time.time() - _LONGEST_WRITING
        for path in self.path.rglob(f"*{LEFT_ASIDE}*"):
            with contextlib.suppress(OSError):
                if path.lstat().st_mtime < latest:
                    path.unlink()


def study_folder(path: str | Path) -> StudyFolder:
    """Return the folder at a path; DataError for a remote address such as a URL."""
    if is_address(path):
        raise DataError(f"{path}: is a URL; give a folder on this computer for the results")
    return StudyFolder(Path(path).absolute())
