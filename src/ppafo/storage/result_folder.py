"""Result folders (NetCDF, CSV, and ``run.json`` with everything that led to them), and reading of recordings.

Result folders are written atomically. A command only replaces a folder that is absent, empty or an earlier result of
its own; the folder then has exactly the new files, and stays unchanged until all of these are written. The mark of a
folder states the hash of each file, and only unchanged files are replaced: no file that a user changed, and no file
listed by a foreign mark, is ever removed.
"""

import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.arguments import Pressure, Word, checked
from ppafo.arguments.door import argument_text
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.json_text import json_document, json_text
from ppafo.documents.regular_file import read_regular_file
from ppafo.errors import DataError, refused_as
from ppafo.signals import Recording, recording_kind
from ppafo.storage.comma_separated import csv_bytes, read_csv
from ppafo.storage.files import add_files, check_folder_can_be_replaced, is_address, read_bytes, replace_folder
from ppafo.storage.netcdf import netcdf_bytes
from ppafo.wording import one_line, reason

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame  # type: ignore[import-untyped]
    from xarray import Dataset

    from ppafo.storage.column_map import ColumnMap

_MAXIMUM_BYTES_WRITTEN = 16_000_000
"""Largest size of a JSON document of this package [bytes], far above any that is written.

A document repeats the content of a scenario file, at most 1 MB, less than sixteen times.
"""
_NAMED = 3
"""Largest number of files named in a message."""


@dataclass(frozen=True, slots=True)
class FolderKind:
    """Kind of output folder: ``noun`` is its name in messages, ``mark`` the file by which it is recognised.

    ``document_of(folder)`` reads the mark, which states the hashes of all other files by name; it raises DataError for
    a foreign mark.
    """

    noun: str
    mark: str
    document_of: Callable[[Path], Mapping[str, Any]]


MARK = "ppafo.json"
"""Mark of an output folder of a command that writes no document of its own kind."""

_FORMAT = "ppafo files"
_HASHES = "sha256"
_NOTHING_KEPT: Mapping[str, bytes] = MappingProxyType({})


def marked_folder(command: str) -> FolderKind:
    """Return the folder kind of a command that marks its folders by ``MARK``."""

    def document_of(folder: Path) -> Any:
        if marking_command(folder) != command:
            raise DataError(f"{folder}: is not a result of 'ppafo {command}' (see {MARK}); choose another folder")
        return read_json(folder / MARK)

    return FolderKind(f"result of 'ppafo {command}'", MARK, document_of)


def marking_command(folder: Path) -> str:
    """Return the command named by ``MARK`` in a folder, empty if this package did not write it."""
    document = read_json(folder / MARK)
    is_own = isinstance(document, dict) and document.get("format") == _FORMAT
    return str(document.get("command", "")) if is_own else ""


def add_to_folder(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write files into a folder, replacing files with the same names, and add them to the mark of the folder."""
    marks = {}
    for name in (MARK, RUN_FILE):
        document = read_json(folder / name) if (folder / name).is_file() else None
        if isinstance(document, dict) and document.get("format") in (_FORMAT, FORMAT) and _HASHES in document:
            hashes, stated = document[_HASHES], document.get("files")
            if not isinstance(hashes, dict) or not isinstance(stated, list) or not all(type(x) is str for x in stated):
                raise DataError(f"{folder / name}: does not state what its files are")
            document[_HASHES] = dict(sorted({**hashes, **_hashes(contents)}.items()))
            document["files"] = sorted({*stated, *contents})
            marks[name] = f"{json_text(document)}\n".encode()
    add_files(folder, {**contents, **marks})


def _hashes(contents: Mapping[str, bytes]) -> dict[str, str]:
    return {name: sha256(content).hexdigest() for name, content in sorted(contents.items())}


def write_marked_folder(folder: Path, contents: Mapping[str, bytes], command: str) -> None:
    """Write a folder with exactly these files and ``MARK`` if it is absent, empty or the command's own."""
    mark = {
        "format": _FORMAT,
        "schema_version": 1,
        "command": command,
        "files": sorted(contents),
        _HASHES: _hashes(contents),
    }
    marked = {**contents, MARK: f"{json_text(mark)}\n".encode()}
    write_owned_folder(folder, marked, marked_folder(command))


def check_owned_folder(folder: Path, kind: FolderKind, kept: Mapping[str, bytes] = _NOTHING_KEPT) -> None:
    """Raise DataError for a folder that contains foreign or changed files, or that cannot be written.

    Files in ``kept``, such as one that grows from run to run, may have been changed if they have the given content.
    """
    if is_address(folder):
        raise DataError(f"{folder}: is an address; a {kind.noun} is written into a folder of this computer")
    is_folder = os.path.isdir(folder)  # noqa: PTH112  # Path.is_dir raises where no file can have the name
    # A link to nowhere is there too, and would be replaced by a folder.
    if not is_folder and os.path.lexists(folder):
        raise DataError(f"{folder}: is a file; a {kind.noun} needs a folder")
    present = {entry.name for entry in _listed(folder)} if is_folder else set()
    if present and kind.mark not in present:
        raise DataError(f"{folder}: is not empty and not a {kind.noun} (it has no {kind.mark}); choose another folder")
    # What is not empty must be as an earlier result of this kind left it.
    hashes = kind.document_of(folder).get(_HASHES) if present else {}
    if not isinstance(hashes, dict):
        raise DataError(
            f"{folder / kind.mark}: states no hashes of its files, as earlier versions of ppafo did not; remove the "
            "folder yourself, or choose another one"
        )
    # Before hashes are compared: a file of somebody else's is the likelier and the clearer reason.
    foreign = sorted(_foreign(folder, {*hashes, kind.mark})) if present else []
    if foreign:
        raise DataError(
            f"{folder}: contains files that are not part of its {kind.noun} ({_some(foreign)}); move them or use "
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
            f"{folder}: contains files that were changed since its {kind.noun} was written ({_some(changed)}); move "
            "them or use another folder"
        )
    check_folder_can_be_replaced(folder)


def write_owned_folder(folder: Path, contents: Mapping[str, bytes], kind: FolderKind) -> None:
    """Write a folder with exactly these files, after ``check_owned_folder``."""
    check_owned_folder(folder, kind, contents)
    replace_folder(folder, contents)


def read_json(path: Path) -> Any:
    """Return the content of a JSON file as plain data. Raises DataError for an invalid file."""
    try:
        return json_document(read_bytes(path, _MAXIMUM_BYTES_WRITTEN))
    except ValueError as error:
        raise DataError(f"{path}: is not JSON: {one_line(error)}") from error


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:_NAMED]) + (", ..." if len(names) > _NAMED else "")


def _listed(folder: Path) -> list[Path]:
    try:
        return list(folder.iterdir())
    except OSError as error:
        raise DataError(f"{folder}: cannot be read: {reason(error)}") from error


def _foreign(folder: Path, own: Collection[str], above: str = "") -> Iterator[str]:
    """Yield the names of entries in a folder that are not files of the result; ``above`` is the prefix of the names."""
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


@dataclass(frozen=True, slots=True, repr=False)
class StoredResult:
    """Content of a result folder: the recording, and ``run.json`` as plain data.

    ``drawn_by`` is the function that draws the figure.
    """

    folder: Path
    recording: Recording
    document: Mapping[str, Any]
    drawn_by: "Callable[[StoredResult], Figure] | None" = field(default=None, compare=False)

    def __repr__(self) -> str:
        return f"StoredResult in {self.folder}: {', '.join(self.document)}\n{self.recording!r}"

    def plot(self) -> "Figure":
        """Return the same figure as ``Result.plot``; ``.savefig(...)`` writes it to a file."""
        assert self.drawn_by is not None, "read by ppafo.read_result"
        return self.drawn_by(self)


def write_result(
    folder: str | Path, recording: Recording, document: Mapping[str, Any], attachments: Mapping[str, bytes]
) -> Path:
    """Write a result folder with ``document`` in ``run.json`` and attachments by file name. Returns the folder."""
    folder_path = Path(folder)
    netcdf = netcdf_bytes(recording, document.get("scenario"))
    contents = {NETCDF_FILE: netcdf, CSV_FILE: csv_bytes(recording), **attachments}
    hashes = _hashes(contents)
    described = {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "files": sorted([*contents, RUN_FILE]),
        _HASHES: hashes,
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
    """Raise DataError for a folder that contains anything but an earlier result, or that cannot be written."""
    check_owned_folder(Path(folder), _RESULT)


def read_stored(folder: str | Path) -> StoredResult:
    """Return the content of a result folder, without a function to draw it. Raises DataError for any other folder."""
    from ppafo.storage.netcdf_reading import read_netcdf

    folder_path = Path(folder)
    if not folder_path.is_dir():
        raise DataError(f"{folder}: is not a folder")
    if not (folder_path / RUN_FILE).is_file() and (folder_path / MARK).is_file():
        command = marking_command(folder_path)
        raise DataError(
            f"{folder}: is a result of 'ppafo {command}', not of a run; 'ppafo export figure' draws what has a figure, "
            "read_recording reads a file of it, and its JSON file has the numbers"
        )
    document = read_document(folder_path)
    if sha256(read_bytes(folder_path / NETCDF_FILE)).hexdigest() != document["recording"].get("sha256"):
        # Refused before it is opened: the HDF5 library can hang on a damaged one.
        raise DataError(
            f"{folder_path / NETCDF_FILE}: is not the file that was written with {RUN_FILE}; run the scenario again"
        )
    return StoredResult(folder_path, read_netcdf(folder_path / NETCDF_FILE), document)


def read_document(folder: str | Path) -> dict[str, Any]:
    """Return ``run.json`` of a result folder as plain data. Raises DataError if it is not a document of a result."""
    path = Path(folder) / RUN_FILE
    document = read_json(path)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{path}: is not of a ppafo result (its 'format' is not '{FORMAT}')")
    if document.get("schema_version") is True or document.get("schema_version") != SCHEMA_VERSION:
        version = document.get("schema_version")
        raise DataError(
            f"{path}: has schema_version {version!r}, this version of ppafo reads {SCHEMA_VERSION}; "
            f"make the result again with this version"
        )
    if not isinstance(document.get("recording"), dict) or not isinstance(document.get("files"), list):
        raise DataError(f"{path}: does not state what its recording and its files are")
    return document


_RESULT = FolderKind("ppafo result", RUN_FILE, read_document)


ColumnsLike = Annotated["ColumnMap | str | Path", Word("FILE.toml[:NAME]")]
"""Column map, or the name of one: file, and the name of the map if the file has several."""

TEXT_SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".log", ".asc")
"""Suffixes of text tables."""


@checked
def read_recording(
    path: "str | Path | DataFrame | Dataset",
    *,
    atmosphere: Pressure = STANDARD_ATMOSPHERE,
    columns: ColumnsLike | None = None,
) -> Recording:
    """Return the recording in a ``.nc`` or ``.parquet`` file, a table of text such as ``.csv``, or a result folder.

    A pandas DataFrame or an xarray Dataset is taken as well: columns ``name [unit]``, or units in its ``attrs``.

    Arguments:
        path: a file, a result folder, a pandas DataFrame or an xarray Dataset
        atmosphere: pressure [Pa absolute] from which gauge pressure in a table counts
        columns: a column map, or the name of one, ``logger.toml:bench``, for a table with other columns, signs or
            separators and for a ``.mat`` file

    Returns:
        a Recording, its channels of shape (samples,) in SI units, pressures absolute

    Raises:
        DataError: a file that is not usable

    >>> import ppafo
    >>> folder = ppafo.simulate("step-response").save("step")
    >>> ppafo.read_recording(folder).names[:3]
    ('angle', 'angular_velocity', 'pressure_1')
    """
    if not isinstance(path, str | Path):
        from ppafo.storage.frames import recording_of_frame  # a run reads no tables of others

        return recording_of_frame(path, atmosphere=atmosphere)
    file = Path(path)
    if columns is not None:
        from ppafo.storage.column_map import column_map_of
        from ppafo.storage.foreign import read_foreign

        column_map, map_name = column_map_of(columns)
        return read_foreign(file, column_map, atmosphere=atmosphere, map_name=map_name)
    if file.is_dir() and (file / RUN_FILE).exists():
        return read_stored(file).recording
    if file.is_dir():
        if not (file / NETCDF_FILE).is_file():
            raise DataError(f"{file}: contains no result of a walk or a simulation (no {NETCDF_FILE}, no {RUN_FILE})")
        file /= NETCDF_FILE
    if file.suffix == ".nc":
        from ppafo.storage.netcdf_reading import read_netcdf
        from ppafo.storage.trial_reading import check_can_be_read

        # The HDF5 library can crash on a damaged file, or go round in it for ever, and would take this process with it.
        check_can_be_read(file, read_netcdf, "h5py")
        return read_netcdf(file)
    if file.suffix.lower() in TEXT_SUFFIXES:
        recording = read_csv(file, atmosphere=atmosphere)
        run_file = file.parent / RUN_FILE
        if file.name != CSV_FILE or not run_file.exists():
            return recording
        described = read_document(file.parent)["recording"]
        with refused_as(DataError, run_file, DataError):
            kind = recording_kind(str(described.get("kind", recording.kind)))
        return replace(recording, label=str(described.get("label", recording.label)), kind=kind)
    if file.suffix.lower() == ".parquet":
        from ppafo.storage.frames import read_parquet

        return read_parquet(file, atmosphere)
    if file.suffix.lower() == ".mat":
        raise DataError(
            f"{file}: is a .mat file, whose variables have no units: name them in a column map, "
            f"{argument_text('columns', 'FILE.toml:NAME')}"
        )
    if not file.exists():
        raise DataError(f"{file}: no such file or folder")
    from ppafo.storage.frames import remedy_for

    named = argument_text("columns", "FILE.toml:NAME")
    other = f"; a table of text of another suffix is read through a column map, {named}"
    raise DataError(
        f"{file}: is no .nc, .parquet or {', '.join(TEXT_SUFFIXES)} file and no result folder"
        f"{remedy_for(file) or other}"
    )
