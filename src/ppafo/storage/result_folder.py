"""Result folders: the recording as NetCDF and CSV, and ``run.json`` with all inputs of the run."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.json_text import json_text
from ppafo.errors import DataError
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import csv_bytes
from ppafo.storage.files import add_files, read_bytes
from ppafo.storage.netcdf import dataset_of, netcdf_bytes, read_netcdf
from ppafo.storage.owned_folder import (
    HASHES,
    MARK,
    MARK_FORMAT,
    FolderKind,
    check_owned_folder,
    hashes_of,
    marking_command,
    read_json,
    write_owned_folder,
)

if TYPE_CHECKING:
    import pandas  # type: ignore[import-untyped]
    import xarray
    from matplotlib.figure import Figure

RUN_FILE = "run.json"
MANIFEST = "study.json"
NETCDF_FILE = "recording.nc"
CSV_FILE = "recording.csv"
FORMAT = "ppafo result"
SCHEMA_VERSION = 1


@dataclass(frozen=True, slots=True, repr=False)
class StoredResult:
    """Content of a result folder: recording, metrics by name, and ``run.json`` as plain data.

    ``stored["torque"]`` and ``stored["pressure_1", "psi_g"]`` are the values of a channel, as of a ``Result``.
    ``atmosphere`` [Pa absolute] is the reference of gauge pressures, ``drawn_by`` draws the figure at a width, ``text``
    is the end of the run, its verdict and its metrics.
    """

    folder: Path
    recording: Recording
    document: Mapping[str, Any]
    metrics: Mapping[str, Any] = field(default_factory=dict)
    atmosphere: float = STANDARD_ATMOSPHERE
    drawn_by: "Callable[[StoredResult, float | str | None], Figure] | None" = field(default=None, compare=False)
    text: str = field(default="", compare=False)

    def __repr__(self) -> str:
        return f"StoredResult in {self.folder}: {self.text}\n{self.recording!r}"

    def __getitem__(self, channel: str | tuple[str, str]) -> Floats:
        """Return the values of a channel, in SI or in a given unit; ``time`` gives the sample times [s]."""
        return self.recording.values_of(channel, self.atmosphere)

    def __iter__(self) -> Iterator[str]:
        """Yield ``time`` and the channel names, as of a ``Result``."""
        yield from ("time", *self.recording.names)

    def dataset(self, units: Mapping[str, str] | None = None) -> "xarray.Dataset":
        """Return the recording as an xarray Dataset, like ``Result.dataset``."""
        return dataset_of(self.recording, self.document.get("scenario"), units, self.atmosphere)

    def to_dataframe(self, units: Mapping[str, str] | None = None) -> "pandas.DataFrame":
        """Return the channels as columns indexed by time [s], like ``Recording.to_dataframe``."""
        return self.recording.to_dataframe(units, self.atmosphere)

    def plot(self, width: float | str | None = None) -> "Figure":
        """Draw the same figure as ``Result.plot``; ``.savefig(...)`` writes it to a file."""
        assert self.drawn_by is not None, "read by ppafo.read_result"
        return self.drawn_by(self, width)


def write_result(
    folder: str | Path, recording: Recording, document: Mapping[str, Any], attachments: Mapping[str, bytes]
) -> Path:
    """Write a result folder with ``document`` in ``run.json`` and attachments by file name. Returns the folder."""
    folder_path = Path(folder)
    netcdf = netcdf_bytes(recording, document.get("scenario"))
    contents = {NETCDF_FILE: netcdf, CSV_FILE: csv_bytes(recording), **attachments}
    hashes = hashes_of(contents)
    described = {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "files": sorted([*contents, RUN_FILE]),
        HASHES: hashes,
        "recording": {
            "label": recording.label,
            "samples": len(recording),
            "kind": recording.kind,
            "channels": {name: recording.unit(name) for name in recording.names},
            "sha256": hashes[NETCDF_FILE],
        },
        **document,
    }
    write_owned_folder(folder_path, {**contents, RUN_FILE: f"{json_text(described)}\n".encode()}, _RESULT)
    return folder_path


def check_result_folder(folder: str | Path) -> None:
    """Raise DataError for a folder that is not writable or contains anything but an earlier result."""
    check_owned_folder(Path(folder), _RESULT)


def read_stored(folder: str | Path) -> StoredResult:
    """Read a result folder, without a function to draw it. Raises DataError for any other folder."""
    folder_path = Path(folder)
    if not folder_path.is_dir():
        raise DataError(f"{folder}: is not a folder")
    if not (folder_path / RUN_FILE).is_file() and (folder_path / MARK).is_file():
        raise DataError(
            f"{folder}: is a result of 'ppafo {marking_command(folder_path)}', not of a run; "
            f"read_recording('{folder}') gives the recording of a walk"
        )
    if not (folder_path / RUN_FILE).is_file() and (folder_path / MANIFEST).is_file():
        raise DataError(f"{folder}: contains the results of a study, not of a run")
    document = read_document(folder_path)
    if sha256(read_bytes(folder_path / NETCDF_FILE)).hexdigest() != document["recording"].get("sha256"):
        # Refused before it is opened: the HDF5 library can hang on a damaged one.
        raise DataError(f"{folder_path / NETCDF_FILE}: is not the file that was written with {RUN_FILE}")
    return StoredResult(folder_path, read_netcdf(folder_path / NETCDF_FILE), document)


def read_document(folder: str | Path) -> dict[str, Any]:
    """Read ``run.json`` of a result folder. Raises DataError if it is not a result document."""
    path = Path(folder) / RUN_FILE
    document = read_json(path)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{path}: does not belong to a ppafo result ('format' is not '{FORMAT}')")
    if document.get("schema_version") is True or document.get("schema_version") != SCHEMA_VERSION:
        version = document.get("schema_version")
        raise DataError(f"{path}: has schema_version {version!r}, this version of ppafo reads {SCHEMA_VERSION}")
    if not isinstance(document.get("recording"), dict) or not isinstance(document.get("files"), list):
        raise DataError(f"{path}: 'recording' must be a JSON object and 'files' a JSON list")
    return document


_RESULT = FolderKind("ppafo result", RUN_FILE, read_document)


def add_to_folder(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write files into a folder, replacing files with the same names, and add them to its mark."""
    marks = {}
    for name in (MARK, RUN_FILE):
        document = read_json(folder / name) if (folder / name).is_file() else None
        if isinstance(document, dict) and document.get("format") in (MARK_FORMAT, FORMAT) and HASHES in document:
            hashes = document[HASHES]
            stated = document.get("files")
            if (
                not isinstance(hashes, dict)
                or not isinstance(stated, list)
                or not all(type(name) is str for name in stated)
            ):
                raise DataError(f"{folder / name}: 'files' must be a JSON list of names, '{HASHES}' a JSON object")
            document[HASHES] = dict(sorted({**hashes, **hashes_of(contents)}.items()))
            document["files"] = sorted({*stated, *contents})
            marks[name] = f"{json_text(document)}\n".encode()
    add_files(folder, {**contents, **marks})
