"""Folders that a command makes whole: it takes one that is absent, empty or its own from earlier, and no other.

A folder that is taken ends up with exactly the new files; until they are all written it stays as it was.
"""

import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ppafo.documents.json_text import json_document, json_text
from ppafo.errors import DataError, one_line, reason
from ppafo.storage.files import check_folder_can_be_replaced, read_bytes, replace_folder

_MOST_BYTES_WRITTEN = 16_000_000
"""No document of ours comes near; one repeats what a scenario file of at most 1 MB says, but not sixteen times."""
_NAMED = 3


@dataclass(frozen=True, slots=True)
class FolderKind:
    """What a command writes: what messages call it, the file by which it is recognised, the names of all its files.

    ``files_of(folder)`` gives the names that an earlier run may have left; DataError where the mark is somebody else's.
    """

    noun: str
    mark: str
    files_of: Callable[[Path], Collection[str]]


MARK = "ppafo.json"
"""The file by which the folder of a command is recognised that has no document of its own kind."""

_FORMAT = "ppafo files"


def marked_folder(command: str) -> FolderKind:
    """Return the kind of folder that a command writes which marks it by ``MARK``."""

    def files_of(folder: Path) -> set[str]:
        document = read_json(folder / MARK)
        if not isinstance(document, dict) or document.get("format") != _FORMAT or document.get("command") != command:
            raise DataError(f"{folder}: is not a result of 'ppafo {command}' ({MARK} says so); choose another folder")
        files = document.get("files")
        return {MARK, *map(str, files if isinstance(files, list) else ())}

    return FolderKind(f"result of 'ppafo {command}'", MARK, files_of)


def write_marked_folder(folder: Path, contents: Mapping[str, bytes], command: str) -> None:
    """Make a folder hold exactly these files and ``MARK``, where it is absent, empty or that command's own."""
    document = {"format": _FORMAT, "schema_version": 1, "command": command, "files": sorted(contents)}
    marked = {**contents, MARK: f"{json_text(document)}\n".encode()}
    write_owned_folder(folder, marked, marked_folder(command))


def check_owned_folder(folder: Path, kind: FolderKind) -> None:
    """Refuse a folder that holds anything of somebody else's, or that cannot be made."""
    if os.path.isdir(folder):  # noqa: PTH112  # Path.is_dir raises where no file can have the name
        _check_own(folder, kind)
    elif os.path.lexists(folder):
        raise DataError(f"{folder}: is a file; a {kind.noun} needs a folder")
    check_folder_can_be_replaced(folder)


def write_owned_folder(folder: Path, contents: Mapping[str, bytes], kind: FolderKind) -> None:
    """Make a folder hold exactly these files, where ``check_owned_folder`` lets it be taken."""
    check_owned_folder(folder, kind)
    replace_folder(folder, contents)


def read_json(path: Path) -> Any:
    """Return what a JSON file of ours holds, as plain data."""
    try:
        return json_document(read_bytes(path, _MOST_BYTES_WRITTEN))
    except ValueError as error:
        raise DataError(f"{path}: is not JSON: {one_line(error)}") from error


def _check_own(folder: Path, kind: FolderKind) -> None:
    try:
        present = {entry.name for entry in folder.iterdir()}
    except OSError as error:
        raise DataError(f"{folder}: cannot be read: {reason(error)}") from error
    if not present:
        return
    if kind.mark not in present:
        raise DataError(f"{folder}: is not empty and not a {kind.noun} (it has no {kind.mark}); choose another folder")
    own = kind.files_of(folder)
    foreign = sorted(name for name in present if name not in own or (folder / name).is_dir())
    if foreign:
        shown = ", ".join(foreign[:_NAMED]) + (", ..." if len(foreign) > _NAMED else "")
        raise DataError(
            f"{folder}: holds files that are not of its {kind.noun} ({shown}); move them or choose another folder"
        )
