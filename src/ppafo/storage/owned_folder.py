"""Output folders of commands, marked by a file of hashes, and replaced only while their files are unchanged.

A command only replaces a folder that is absent, empty or an earlier result of its own; the folder then has exactly the
new files, and stays unchanged until all of these are written. The mark of a folder states the hash of each file, and
only unchanged files are replaced: no file that a user changed, and no file listed by a foreign mark, is ever removed.
"""

import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ppafo.documents.json_text import json_document, json_text
from ppafo.documents.regular_file import read_regular_file
from ppafo.errors import DataError
from ppafo.storage.files import check_folder_can_be_replaced, is_address, read_bytes, replace_folder
from ppafo.wording import one_line, reason

MARK = "ppafo.json"
"""Mark file in the output folder of a command without a document of its own."""
MARK_FORMAT = "ppafo files"
HASHES = "sha256"
"""Key of the file hashes in a mark."""
_MAXIMUM_BYTES_WRITTEN = 16_000_000
"""Largest size of a JSON document of this package [bytes], far above any written.

A document repeats the content of a scenario file, at most 1 MB, less than sixteen times.
"""
_MOST_NAMED = 3
"""Largest number of files named in a message."""
_NOTHING_KEPT: Mapping[str, bytes] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class FolderKind:
    """Kind of output folder: ``noun`` is its name in messages, ``mark`` the file that identifies it.

    ``document_of(folder)`` reads the mark, which states the hashes of all other files by name; it raises DataError for
    a foreign mark.
    """

    noun: str
    mark: str
    document_of: Callable[[Path], Mapping[str, Any]]


def marked_folder(command: str) -> FolderKind:
    """Return the kind of output folder that a command marks with ``MARK``."""

    def document_of(folder: Path) -> Any:
        if marking_command(folder) != command:
            raise DataError(f"{folder}: is not a result of 'ppafo {command}' (see its {MARK}); choose another folder")
        return read_json(folder / MARK)

    return FolderKind(f"result of 'ppafo {command}'", MARK, document_of)


def marking_command(folder: Path) -> str:
    """Return the command in the ``MARK`` of a folder, empty if not written by this package."""
    document = read_json(folder / MARK)
    is_from_ppafo = isinstance(document, dict) and document.get("format") == MARK_FORMAT
    return str(document.get("command", "")) if is_from_ppafo else ""


def hashes_of(contents: Mapping[str, bytes]) -> dict[str, str]:
    """Return the SHA-256 of each file by name."""
    return {name: sha256(content).hexdigest() for name, content in sorted(contents.items())}


def write_marked_folder(folder: Path, contents: Mapping[str, bytes], command: str) -> None:
    """Write a folder with exactly these files and ``MARK``, if absent, empty or an earlier output of the command."""
    mark = {
        "format": MARK_FORMAT,
        "schema_version": 1,
        "command": command,
        "files": sorted(contents),
        HASHES: hashes_of(contents),
    }
    files = {**contents, MARK: f"{json_text(mark)}\n".encode()}
    write_owned_folder(folder, files, marked_folder(command))


def write_owned_folder(folder: Path, contents: Mapping[str, bytes], kind: FolderKind) -> None:
    """Write a folder with exactly these files, after ``check_owned_folder``."""
    check_owned_folder(folder, kind, contents)
    replace_folder(folder, contents)


def check_owned_folder(folder: Path, kind: FolderKind, kept: Mapping[str, bytes] = _NOTHING_KEPT) -> None:
    """Raise DataError for a folder with foreign or changed files, or without permission to write.

    Files in ``kept``, such as one that grows from run to run, may have been changed if they have the given content.
    """
    if is_address(folder):
        raise DataError(f"{folder}: is a remote address; a {kind.noun} needs a local folder")
    is_folder = os.path.isdir(folder)  # noqa: PTH112  # Path.is_dir raises where no file can have the name
    # A link to nowhere is there too, and would be replaced by a folder.
    if not is_folder and os.path.lexists(folder):
        raise DataError(f"{folder}: is a file; a {kind.noun} needs a folder")
    present = {entry.name for entry in entries_of(folder)} if is_folder else set()
    if not present:
        check_folder_can_be_replaced(folder)
        return
    # Only an earlier result of this kind is replaced, and only as long as nobody changed it.
    if kind.mark not in present:
        raise DataError(f"{folder}: is not empty and not a {kind.noun} (it has no {kind.mark}); choose another folder")
    hashes = kind.document_of(folder).get(HASHES)
    if not isinstance(hashes, dict):
        raise DataError(f"{folder / kind.mark}: has no file hashes (written by an earlier version of ppafo)")
    # Before hashes are compared: a file of somebody else's is the likelier and the clearer reason.
    foreign = sorted(_foreign_names(folder, {*hashes, kind.mark}))
    if foreign:
        raise DataError(
            f"{folder}: contains files that are not part of its {kind.noun} ({_shortened(foreign)}); move them or use "
            "another folder"
        )
    changed = []
    for name, stated in sorted(hashes.items()):
        if os.path.lexists(folder / name):
            try:
                content = read_regular_file(folder / name)
            except OSError:
                content = None  # a link to nowhere, a pipe: not what was written
            if content is None or (content != kept.get(name) and sha256(content).hexdigest() != stated):
                changed.append(name)
    if changed:
        raise DataError(
            f"{folder}: contains files that were changed since its {kind.noun} was written ({_shortened(changed)}); "
            "move them or use another folder"
        )
    check_folder_can_be_replaced(folder)


def _foreign_names(folder: Path, expected: Collection[str], prefix: str = "") -> Iterator[str]:
    """Yield names of folder entries, with ``prefix``, that are not among the ``expected`` files."""
    for entry in entries_of(folder):
        name = f"{prefix}{entry.name}"
        is_expected_folder = any(file.startswith(f"{name}/") for file in expected)
        if is_expected_folder and entry.is_dir() and not entry.is_symlink():
            yield from _foreign_names(entry, expected, f"{name}/")
        elif name not in expected or entry.is_dir():
            yield name


def entries_of(folder: Path) -> list[Path]:
    """Return the files and folders in a folder. Raises DataError if the folder cannot be read."""
    try:
        return list(folder.iterdir())
    except OSError as error:
        raise DataError(f"{folder}: cannot be read: {reason(error)}") from error


def _shortened(names: Sequence[str]) -> str:
    return ", ".join(names[:_MOST_NAMED]) + (", ..." if len(names) > _MOST_NAMED else "")


def read_json(path: Path) -> Any:
    """Return the content of a JSON file as plain data. Raises DataError for an invalid file."""
    try:
        return json_document(read_bytes(path, _MAXIMUM_BYTES_WRITTEN))
    except ValueError as error:
        raise DataError(f"{path}: is not JSON: {one_line(error)}") from error
