"""Result folders: recording as NetCDF and CSV, and ``run.json`` with everything that led to it.

A folder is complete or not there. Only an empty folder or an earlier result is ever replaced.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ppafo.documents.json_text import json_text
from ppafo.errors import DataError, one_line
from ppafo.signals import Recording
from ppafo.storage.comma_separated import csv_bytes
from ppafo.storage.files import check_folder_can_be_replaced, read_bytes, replace_folder
from ppafo.storage.netcdf import netcdf_bytes, read_netcdf

RUN_FILE = "run.json"
NETCDF_FILE = "recording.nc"
CSV_FILE = "recording.csv"
FORMAT = "ppafo result"
SCHEMA_VERSION = 1

_KNOWN_FILES = (RUN_FILE, NETCDF_FILE, CSV_FILE, "figure.png", "figure.svg")


@dataclass(frozen=True, slots=True)
class StoredResult:
    """What a result folder holds: the recording, and ``run.json`` as plain data."""

    folder: Path
    recording: Recording
    document: Mapping[str, Any]


def write_result(
    folder: str | Path, recording: Recording, document: Mapping[str, Any], attachments: Mapping[str, bytes]
) -> Path:
    """Write a result folder with ``document`` in ``run.json`` and attachments by file name; returns the folder."""
    place = Path(folder)
    check_result_folder(place)
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
    replace_folder(place, {**contents, RUN_FILE: f"{json_text(described)}\n".encode()})
    return place


def check_result_folder(folder: str | Path) -> None:
    """Refuse a folder that holds anything but an earlier result, or that cannot be made."""
    place = Path(folder)
    if os.path.isdir(place):  # noqa: PTH112  # Path.is_dir raises where no file can have the name
        _check_replaceable(place)
    elif os.path.lexists(place):
        raise DataError(f"{folder}: is a file; a result needs a folder")
    check_folder_can_be_replaced(place)


def read_result(folder: str | Path) -> StoredResult:
    """Return what a result folder holds."""
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


def _check_replaceable(place: Path) -> None:
    present = {entry.name for entry in place.iterdir()}
    if not present:
        return
    if RUN_FILE not in present:
        raise DataError(f"{place}: is not empty and not a ppafo result (it has no {RUN_FILE}); choose another folder")
    own = {*_KNOWN_FILES, *read_document(place)["files"]}
    foreign = sorted(name for name in present if name not in own or (place / name).is_dir())
    if foreign:
        shown = ", ".join(foreign[:3]) + (", ..." if len(foreign) > 3 else "")
        raise DataError(
            f"{place}: holds files that are not of its result ({shown}); move them or choose another folder"
        )


def read_document(folder: str | Path) -> dict[str, Any]:
    """Return ``run.json`` of a result folder as plain data, or refuse what is not one."""
    path = Path(folder) / RUN_FILE
    try:
        document = json.loads(read_bytes(path).decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise DataError(f"{path}: is not JSON: {one_line(error)}") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{path}: is not of a ppafo result (its 'format' is not '{FORMAT}')")
    if document.get("schema_version") != SCHEMA_VERSION:
        version = document.get("schema_version")
        raise DataError(f"{path}: has schema_version {version!r}, this version of ppafo reads {SCHEMA_VERSION}")
    if not isinstance(document.get("recording"), dict) or not isinstance(document.get("files"), list):
        raise DataError(f"{path}: does not say what its recording and its files are")
    return document


def _description(recording: Recording) -> dict[str, Any]:
    return {
        "label": recording.label,
        "samples": len(recording),
        "kind": recording.kind,
        "channels": {name: recording.unit(name) for name in recording.names},
    }
