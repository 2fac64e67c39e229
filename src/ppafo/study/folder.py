"""The folder of a study's results: a file in it is written aside and renamed, and is there whole or not at all."""

import contextlib
import io
import re
import shutil
import stat
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ppafo.documents.json_text import json_document
from ppafo.errors import DataError
from ppafo.storage.files import LEFT_ASIDE, write_file

_MAXIMUM_BYTES_OF_DOCUMENT = 100_000_000
"""Bytes of a document that is read; no document of a study comes near."""
_BLOCK = 1_000_000
"""Bytes that are read at once."""
_LONGEST_WRITING = 86400.0
"""Nobody writes a file for longer [s]."""


@dataclass(frozen=True, slots=True)
class StudyFolder:
    """The folder of a study's results; names of files are relative to ``path``, with ``/`` between folders."""

    path: Path

    def names(self) -> frozenset[str]:
        """Return the names of all files, those left aside by a killed process not among them.

        DataError where it is a file.
        """
        if self.path.exists() and not self.path.is_dir():
            raise DataError(f"{self.path}: is a file; the results need a folder")
        files = (path for path in self.path.rglob("*") if not path.is_dir() and LEFT_ASIDE not in path.name)
        return frozenset(path.relative_to(self.path).as_posix() for path in files)

    def open(self, name: str) -> io.BufferedIOBase:
        """Return a file for reading. OSError where it is no regular file."""
        path = self.path / name
        if not stat.S_ISREG(path.stat().st_mode):
            raise OSError(None, f"{path} is not a regular file")
        return path.open("rb")

    def read_document(self, name: str) -> Any:
        """Return what a JSON file of ours holds, as plain data; OSError or ValueError where that is not possible."""
        with self.open(name) as file:
            content = bytearray()
            # In blocks: Python takes the room for as much as is asked for.
            while len(content) <= _MAXIMUM_BYTES_OF_DOCUMENT and (block := file.read(_BLOCK)):
                content += block
        if len(content) > _MAXIMUM_BYTES_OF_DOCUMENT:
            raise ValueError(f"{name} is larger than {_MAXIMUM_BYTES_OF_DOCUMENT / 1e6:g} MB")
        return json_document(bytes(content))

    def write(self, name: str, content: bytes) -> None:
        """Write a file aside, then rename it."""
        write_file(self.path / name, content)

    def remove(self, name: str) -> None:
        """Remove a file if it is there."""
        (self.path / name).unlink(missing_ok=True)

    def free_bytes(self) -> int:
        """Return the free space of the disk."""
        there = next(ancestor for ancestor in (self.path, *self.path.parents) if ancestor.exists())
        return shutil.disk_usage(there).free

    def tidy(self) -> None:
        """Remove files that were being written when a process was killed: a younger one may belong to another."""
        # By age and not by process: the folder may be shared by machines that cannot see each other's processes.
        latest = time.time() - _LONGEST_WRITING
        for path in self.path.rglob(f"*{LEFT_ASIDE}*"):
            with contextlib.suppress(OSError):
                if path.lstat().st_mtime < latest:
                    path.unlink()


def study_folder(path: str | Path) -> StudyFolder:
    """Return the folder at a path; DataError for an address of another computer."""
    if re.match(r"[a-z][a-z0-9+]+:/", str(path)):
        raise DataError(f"{path}: is an address; results of a study go into a folder of this computer")
    return StudyFolder(Path(path).absolute())
