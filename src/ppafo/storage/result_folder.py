"""Recordings from wherever they are, and result folders: NetCDF, CSV, and ``run.json`` with all that led to them.

A folder is complete or not there. Only an empty folder or an earlier result is ever replaced.

Folders that a command makes whole: it takes one that is absent, empty or its own from earlier, and no other. One that
is taken ends up with exactly the new files; until they are all written it stays as it was.
"""

import hashlib
import os
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.json_text import json_document, json_text
from ppafo.errors import DataError, one_line, reason, refused_as
from ppafo.signals import Recording, recording_kind
from ppafo.storage.comma_separated import csv_bytes, read_csv
from ppafo.storage.files import add_files, check_folder_can_be_replaced, read_bytes, replace_folder
from ppafo.storage.netcdf import netcdf_bytes, read_netcdf
from ppafo.storage.trial_reading import check_can_be_read

_MAXIMUM_BYTES_WRITTEN = 16_000_000
"""No document of ours comes near; one repeats what a scenario file of at most 1 MB says, but not sixteen times."""
_NAMED = 3


@dataclass(frozen=True, slots=True)
class FolderKind:
    """What a command writes: what messages call it, the file by which it is recognised, the names of all its files.

    ``files_of(folder)`` gives the names that an earlier run may have left; DataError where the mark is somebody else's.
    ``earlier_files_of`` gives those of an earlier version that had another mark, none where there is no such result.
    """

    noun: str
    mark: str
    files_of: Callable[[Path], Collection[str]]
    earlier_files_of: Callable[[Path], Collection[str]] = lambda _folder: ()


MARK = "ppafo.json"
"""The file by which the folder of a command is recognised that has no document of its own kind."""

_FORMAT = "ppafo files"


_FIGURES = ("figure-3-identification", "figure-7-step-response", "figure-8-torque-task", "unreported-settings")
_EXPERIMENTS = ("step-response", "torque-task-solenoid", "torque-task-proportional")
_UNMARKED: dict[str, dict[str, tuple[str, ...]]] = {
    "reproduce": {
        "claims.json": (
            "report.html",
            *(f"{name}.csv" for name in _EXPERIMENTS),
            *(f"{name}.{ending}" for name in _FIGURES for ending in ("png", "svg")),
        )
    },
    "endurance": {"endurance.json": ("endurance.md", "bottle.csv", "endurance.png", "endurance.svg")},
    "walk": {"walk.json": (), "wearers.json": ()},
}
"""Commands whose folders of version 0.1 have another mark: its name, and the files beside it that it does not list."""


def marked_folder(command: str) -> FolderKind:
    """Return the kind of folder that a command writes which marks it by ``MARK``.

    Its list of files is a DataError where another command wrote the folder.
    """

    def files_of(folder: Path) -> set[str]:
        if marking_command(folder) != command:
            raise DataError(f"{folder}: is not a result of 'ppafo {command}' (see {MARK}); choose another folder")
        document = read_json(folder / MARK)
        files = document.get("files")
        return {MARK, *map(str, files if isinstance(files, list) else ())}

    return FolderKind(f"result of 'ppafo {command}'", MARK, files_of, partial(_unmarked_files, command=command))


def marking_command(folder: Path) -> str:
    """Return the command that ``MARK`` in a folder names, empty where it is not one of ours."""
    document = read_json(folder / MARK)
    is_own = isinstance(document, dict) and document.get("format") == _FORMAT
    return str(document.get("command", "")) if is_own else ""


def add_to_marked_folder(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write files into a folder, replacing those of the same names; where it has ``MARK``, they are listed in it."""
    command = marking_command(folder) if (folder / MARK).is_file() else ""
    mark = {}
    if command:
        files = sorted({*contents, *marked_folder(command).files_of(folder)} - {MARK})
        mark = {MARK: f"{json_text(_mark(command, files))}\n".encode()}
    add_files(folder, {**contents, **mark})


def _mark(command: str, files: Collection[str]) -> dict[str, Any]:
    return {"format": _FORMAT, "schema_version": 1, "command": command, "files": sorted(files)}


def _unmarked_files(folder: Path, command: str) -> set[str]:
    """Return the names in a folder that version 0.1 of a command wrote; none where it did not."""
    for mark, beside in _UNMARKED.get(command, {}).items():
        document = read_json(folder / mark) if (folder / mark).is_file() else None
        is_own = isinstance(document, dict) and (
            document.get("format") == f"ppafo {mark.removesuffix('.json')}" or isinstance(document.get("claims"), list)
        )
        if isinstance(document, dict) and is_own:
            listed = document.get("files")
            return {mark, *beside, *map(str, listed if isinstance(listed, list) else ())}
    return set()


def write_marked_folder(folder: Path, contents: Mapping[str, bytes], command: str) -> None:
    """Make a folder hold exactly these files and ``MARK``, where it is absent, empty or that command's own."""
    marked = {**contents, MARK: f"{json_text(_mark(command, contents))}\n".encode()}
    write_owned_folder(folder, marked, marked_folder(command))


def check_owned_folder(folder: Path, kind: FolderKind) -> None:
    """Refuse a folder that holds anything of somebody else's, or that cannot be made. It is a DataError."""
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
    """Return what a JSON file of ours holds, as plain data. DataError where it is none."""
    try:
        return json_document(read_bytes(path, _MAXIMUM_BYTES_WRITTEN))
    except ValueError as error:
        raise DataError(f"{path}: is not JSON: {one_line(error)}") from error


def _check_own(folder: Path, kind: FolderKind) -> None:
    present = {entry.name for entry in _listed(folder)}
    if not present:
        return
    own = kind.files_of(folder) if kind.mark in present else kind.earlier_files_of(folder)
    if not own:
        raise DataError(f"{folder}: is not empty and not a {kind.noun} (it has no {kind.mark}); choose another folder")
    foreign = sorted(_foreign(folder, own))
    if foreign:
        shown = ", ".join(foreign[:_NAMED]) + (", ..." if len(foreign) > _NAMED else "")
        raise DataError(
            f"{folder}: contains files that are not part of its {kind.noun} ({shown}); move them or use another folder"
        )


def _listed(folder: Path) -> list[Path]:
    try:
        return list(folder.iterdir())
    except OSError as error:
        raise DataError(f"{folder}: cannot be read: {reason(error)}") from error


def _foreign(folder: Path, own: Collection[str], above: str = "") -> Iterator[str]:
    """Names in a folder, with those of its own folders ``above``, that are none of the result's own files."""
    for entry in _listed(folder):
        name = f"{above}{entry.name}"
        if entry.is_dir() and not entry.is_symlink() and any(file.startswith(f"{name}/") for file in own):
            yield from _foreign(entry, own, f"{name}/")
        elif name not in own or entry.is_dir():
            yield name


RUN_FILE = "run.json"
NETCDF_FILE = "recording.nc"
CSV_FILE = "recording.csv"
FORMAT = "ppafo result"
SCHEMA_VERSION = 1

_KNOWN_FILES = (RUN_FILE, NETCDF_FILE, CSV_FILE, "figure.png", "figure.svg")


@dataclass(frozen=True, slots=True, repr=False)
class StoredResult:
    """What a result folder holds: the recording, and ``run.json`` as plain data."""

    folder: Path
    recording: Recording
    document: Mapping[str, Any]

    def __repr__(self) -> str:
        return f"StoredResult in {self.folder}: {', '.join(self.document)}\n{self.recording!r}"


def write_result(
    folder: str | Path, recording: Recording, document: Mapping[str, Any], attachments: Mapping[str, bytes]
) -> Path:
    """Write a result folder with ``document`` in ``run.json`` and attachments by file name; returns the folder."""
    place = Path(folder)
    netcdf = netcdf_bytes(recording, document.get("scenario"))
    contents = {NETCDF_FILE: netcdf, CSV_FILE: csv_bytes(recording), **attachments}
    described = {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "files": sorted([*contents, RUN_FILE]),
        "recording": {
            "label": recording.label,
            "samples": len(recording),
            "kind": recording.kind,
            "channels": {name: recording.unit(name) for name in recording.names},
            "sha256": _checksum(netcdf),
        },
        **document,
    }
    write_owned_folder(place, {**contents, RUN_FILE: f"{json_text(described)}\n".encode()}, _RESULT)
    return place


def check_result_folder(folder: str | Path) -> None:
    """Refuse a folder that holds anything but an earlier result, or that cannot be made."""
    check_owned_folder(Path(folder), _RESULT)


def read_result(folder: str | Path) -> StoredResult:
    """Return what a result folder holds. DataError for a folder that holds none."""
    place = Path(folder)
    if not place.is_dir():
        raise DataError(f"{folder}: is not a folder")
    document = read_document(place)
    if _checksum(read_bytes(place / NETCDF_FILE)) != document["recording"].get("sha256"):
        # Refused before it is opened: the HDF5 library can hang on a damaged one.
        raise DataError(
            f"{place / NETCDF_FILE}: is not the file that was written with {RUN_FILE}; run the scenario again"
        )
    return StoredResult(place, read_netcdf(place / NETCDF_FILE), document)


def _checksum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def read_document(folder: str | Path) -> dict[str, Any]:
    """Return ``run.json`` of a result folder as plain data, or refuse what is not one. DataError says why."""
    path = Path(folder) / RUN_FILE
    document = read_json(path)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{path}: is not of a ppafo result (its 'format' is not '{FORMAT}')")
    if document.get("schema_version") != SCHEMA_VERSION:
        version = document.get("schema_version")
        raise DataError(f"{path}: has schema_version {version!r}, this version of ppafo reads {SCHEMA_VERSION}")
    if not isinstance(document.get("recording"), dict) or not isinstance(document.get("files"), list):
        raise DataError(f"{path}: does not state what its recording and its files are")
    return document


def _files_of(folder: Path) -> set[str]:
    """Return the names that an earlier result may have: its own list, and figures drawn since."""
    return {*_KNOWN_FILES, *map(str, read_document(folder)["files"])}


_RESULT = FolderKind("ppafo result", RUN_FILE, _files_of)


WALK_RECORDING = "recording.nc"
"""What the folder of a walk has in place of a result."""


def read_recording(path: str | Path, atmosphere: float = STANDARD_ATMOSPHERE) -> Recording:
    """Return the recording in a ``.nc`` or ``.csv`` file, or in a result folder or that of a walk.

    Gauge pressure in a CSV file counts from ``atmosphere`` [Pa absolute]. DataError for a file that is not usable.
    """
    place = Path(path)
    if place.is_dir():
        recording = place / WALK_RECORDING
        if recording.is_file() and not (place / RUN_FILE).exists():
            return _of_strangers(recording)
        if not (place / RUN_FILE).exists():
            raise DataError(
                f"{place}: contains no result of a walk or a simulation (no {WALK_RECORDING}, no {RUN_FILE})"
            )
        return read_result(place).recording
    if place.suffix == ".nc":
        return _of_strangers(place)
    if place.suffix == ".csv":
        found = read_csv(place, atmosphere=atmosphere)
        run_file = place.parent / RUN_FILE
        if place.name != CSV_FILE or not run_file.exists():
            return found
        # The recording of a result folder is what ``run.json`` beside it says of it.
        described = read_document(place.parent)["recording"]
        with refused_as(DataError, run_file, DataError):
            kind = recording_kind(str(described.get("kind", found.kind)))
        return replace(found, label=str(described.get("label", found.label)), kind=kind)
    raise DataError(f"{path}: is neither a .nc or .csv file nor a result folder")


def _of_strangers(path: Path) -> Recording:
    """Return the recording in a NetCDF file that another process has read first.

    The HDF5 library can crash on a damaged file, or go round in it for ever, and would take this process with it.
    """
    check_can_be_read(path, "ppafo.storage.netcdf", "read_netcdf", "h5py")
    return read_netcdf(path)
