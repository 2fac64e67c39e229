"""Folders of files that may be on another machine: on a disk, or at any address that fsspec knows (s3://, gs://).

A file is there whole or not at all: on a disk it is written aside and renamed, and the object stores put it whole.
"""

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
from ppafo.storage.files import LEFT_ASIDE, write_file
from ppafo.wording import reason

_ADDRESS_MARK = "://"
_MAXIMUM_BYTES_OF_DOCUMENT = 100_000_000
"""Bytes of a document that is read; no document of a study comes near."""
_BLOCK = 1_000_000
"""Bytes that are read at once."""
_LONGEST_WRITING = 86400.0
"""Nobody writes a file for longer [s]."""


def read_document(place: "Place", name: str) -> Any:
    """Return what a JSON file of ours holds, as plain data; OSError or ValueError where that is not possible."""
    with place.open(name) as file:
        content = bytearray()
        # In blocks: Python takes the room for as much as is asked for.
        while len(content) <= _MAXIMUM_BYTES_OF_DOCUMENT and (block := file.read(_BLOCK)):
            content += block
    if len(content) > _MAXIMUM_BYTES_OF_DOCUMENT:
        raise ValueError(f"{name} is larger than {_MAXIMUM_BYTES_OF_DOCUMENT / 1e6:g} MB")
    return json_document(bytes(content))


def place_at(address: str | Path) -> "Place":
    """Return the folder at a path or an address such as ``s3://bucket/study``; DataError where it cannot be opened."""
    text = str(address)
    if _ADDRESS_MARK not in text:
        return DiskFolder(Path(text).absolute())
    try:
        from fsspec.core import url_to_fs
    except ModuleNotFoundError as error:
        raise DataError(f"{text}: an address needs the extra 'cluster': pip install 'ppafo[cluster]'") from error
    try:
        system, root = url_to_fs(text)
    except (ValueError, ImportError, OSError) as error:
        raise DataError(f"{text}: cannot be opened: {' '.join(str(error).split())}") from error
    return RemoteFolder(text.rstrip("/"), system, str(root).rstrip("/"))


@dataclass(frozen=True, slots=True)
class DiskFolder:
    """A folder on a disk of this machine, or on one that several machines share; ``/`` is between its folders."""

    folder: Path

    @property
    def address(self) -> str:
        """The absolute path: its name in messages, by which another process can open it."""
        return str(self.folder)

    def names(self) -> frozenset[str]:
        """Return the names of all files, none where it does not exist; those left aside are not among them.

        DataError where it is a file.
        """
        if self.folder.exists() and not self.folder.is_dir():
            raise DataError(f"{self.folder}: is a file; the results need a folder")
        files = (path for path in self.folder.rglob("*") if not path.is_dir() and LEFT_ASIDE not in path.name)
        return frozenset(path.relative_to(self.folder).as_posix() for path in files)

    def open(self, name: str) -> io.BufferedIOBase:
        """Return a file for reading. OSError where it is no regular file."""
        path = self.folder / name
        if not stat.S_ISREG(path.stat().st_mode):
            raise OSError(None, f"{path} is not a regular file")
        return path.open("rb")

    def write(self, name: str, content: bytes) -> None:
        """Write a file aside, then rename it."""
        write_file(self.folder / name, content)

    def remove(self, name: str) -> None:
        """Remove a file if it is there."""
        (self.folder / name).unlink(missing_ok=True)

    def free_bytes(self) -> int | None:
        """Return how much can still be written, None where nobody knows: the free space of the disk."""
        there = next(ancestor for ancestor in (self.folder, *self.folder.parents) if ancestor.exists())
        return shutil.disk_usage(there).free

    def tidy(self) -> None:
        """Remove what a killed process has left half written; a younger file may belong to another."""
        # By age and not by process: the folder may be shared by machines that cannot see each other's processes.
        latest = time.time() - _LONGEST_WRITING
        for path in self.folder.rglob(f"*{LEFT_ASIDE}*"):
            with contextlib.suppress(OSError):
                if path.lstat().st_mtime < latest:
                    path.unlink()


@dataclass(frozen=True, slots=True)
class RemoteFolder:
    """A folder at an address that fsspec knows, such as an object store."""

    address: str
    system: Any
    root: str

    def names(self) -> frozenset[str]:
        """Return the names of all files."""
        if not self.system.exists(self.root):
            return frozenset()
        return frozenset(str(path)[len(self.root) :].lstrip("/") for path in self.system.find(self.root))

    def open(self, name: str) -> io.BufferedIOBase:
        """Return the whole of a file for reading."""
        return io.BytesIO(self.system.cat_file(f"{self.root}/{name}"))

    def write(self, name: str, content: bytes) -> None:
        """Put a file whole. DataError where it cannot be written."""
        try:
            self.system.makedirs(f"{self.root}/{name}".rpartition("/")[0], exist_ok=True)
            self.system.pipe_file(f"{self.root}/{name}", content)
        except (OSError, ValueError) as error:
            raise DataError(f"{self.address}/{name}: cannot be written: {reason(error)}") from error

    def remove(self, name: str) -> None:
        """Remove a file if it is there."""
        with contextlib.suppress(FileNotFoundError):
            self.system.rm_file(f"{self.root}/{name}")

    def free_bytes(self) -> int | None:
        """Return None: an object store does not say."""
        return None

    def tidy(self) -> None:
        """Do nothing: nothing is left aside."""


Place = DiskFolder | RemoteFolder
"""A folder of files, wherever it is."""
