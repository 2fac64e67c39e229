"""Result folders: recording as NetCDF and CSV, and ``run.json`` with everything that led to it.

A folder is complete or not there. Only an empty folder or an earlier result is ever replaced.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ppafo.documents.json_text import json_text
from ppafo.errors import DataError
from ppafo.signals import Recording
from ppafo.storage.comma_separated import csv_bytes
from ppafo.storage.files import read_bytes
from ppafo.storage.netcdf import netcdf_bytes, read_netcdf
from ppafo.storage.owned_folder import FolderKind, check_owned_folder, read_json, write_owned_folder

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
    contents = {
        NETCDF_FILE: netcdf,
        CSV_FILE: csv_bytes(recording),
        **attachments,
    }
    described = {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "files": sorted([*contents, RUN_FILE]),
        "recording": {**_description(recording), "sha256": _checksum(netcdf)},
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
    _check_unchanged(place / NETCDF_FILE, document["recording"].get("sha256"))
    return StoredResult(place, read_netcdf(place / NETCDF_FILE), document)


def _check_unchanged(path: Path, checksum: object) -> None:
    """Refuse a damaged recording before it is opened: the HDF5 library can hang on one."""
    if _checksum(read_bytes(path)) != checksum:
        raise DataError(f"{path}: is not the file that was written with {RUN_FILE}; run the scenario again")


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


def _description(recording: Recording) -> dict[str, Any]:
    return {
        "label": recording.label,
        "samples": len(recording),
        "kind": recording.kind,
        "channels": {name: recording.unit(name) for name in recording.names},
    }


def _files_of(folder: Path) -> set[str]:
    """Return the names that an earlier result may have: its own list, and figures drawn since."""
    return {*_KNOWN_FILES, *map(str, read_document(folder)["files"])}


_RESULT = FolderKind("ppafo result", RUN_FILE, _files_of)
