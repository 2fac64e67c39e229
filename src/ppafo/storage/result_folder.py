"""Recordings from wherever they are, and result folders: NetCDF, CSV, and ``run.json`` with all that led to them.

A folder is complete or not there. Only an empty folder or an earlier result is ever replaced.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.json_text import json_text
from ppafo.errors import DataError
from ppafo.signals import Recording, recording_kind
from ppafo.storage.comma_separated import csv_bytes, read_csv
from ppafo.storage.files import read_bytes
from ppafo.storage.netcdf import netcdf_bytes, read_netcdf
from ppafo.storage.owned_folder import FolderKind, check_owned_folder, read_json, write_owned_folder
from ppafo.storage.trial_reading import check_can_be_read

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
        try:
            kind = recording_kind(str(described.get("kind", found.kind)))
        except DataError as error:
            raise DataError(f"{run_file}: {error}") from error
        return replace(found, label=str(described.get("label", found.label)), kind=kind)
    raise DataError(f"{path}: is neither a .nc or .csv file nor a result folder")


def _of_strangers(path: Path) -> Recording:
    """Return the recording in a NetCDF file that another process has read first.

    The HDF5 library can crash on a damaged file, or go round in it for ever, and would take this process with it.
    """
    check_can_be_read(path, "ppafo.storage.netcdf", "read_netcdf", "h5py")
    return read_netcdf(path)
