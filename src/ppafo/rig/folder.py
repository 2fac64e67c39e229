"""Folders of synthetic recordings: one CSV for each experiment, and ``rig.json`` with the truth behind all of them."""

from pathlib import Path
from typing import Any

from ppafo.documents.json_text import json_text
from ppafo.errors import DataError, reason
from ppafo.rig.record import NOTICE, RigRecording
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.storage.files import LEFT_ASIDE, add_files, check_files_can_be_added
from ppafo.storage.owned_folder import read_json

RIG_FILE = "rig.json"
FORMAT = "ppafo rig"


def csv_name(experiment: str) -> str:
    """Return the file name of an experiment's recording."""
    return f"{experiment}.csv"


def check_rig_folder(folder: Path, experiment: str) -> None:
    """Raise DataError, before anything runs, for a folder that cannot be written or belongs to something else."""
    _check_own(folder, csv_name(experiment))
    check_files_can_be_added(folder, [csv_name(experiment), RIG_FILE])


def write_rig_recording(folder: Path, made: RigRecording) -> tuple[str, ...]:
    """Write recording and truth into a folder beside those of other experiments; returns the file names.

    DataError for a folder that belongs to something else.
    """
    name = csv_name(made.truth["experiment"])
    _check_own(folder, name)
    recordings = {**_earlier(folder), name: dict(made.truth)}
    document = {
        "format": FORMAT,
        "schema_version": 1,
        "notice": NOTICE,
        "recordings": {key: recordings[key] for key in sorted(recordings)},
    }
    # By rig.json a folder is known to be the rig's: it is there first, whenever the process is killed.
    add_files(folder, {RIG_FILE: f"{json_text(document)}\n".encode(), name: marked_csv_bytes(made.recording)})
    return name, RIG_FILE


def _check_own(folder: Path, name: str) -> None:
    """Refuse a folder of others, and a file of others that a recording would replace."""
    earlier = _earlier(folder)
    try:
        there = {entry.name for entry in folder.iterdir()} if folder.is_dir() else set()
    except OSError as error:
        raise DataError(f"{folder}: cannot be read: {reason(error)}") from error
    present = {entry for entry in there if LEFT_ASIDE not in entry}
    if present and RIG_FILE not in present:
        raise DataError(f"{folder}: is not empty and has no recordings of the rig ({RIG_FILE}); choose another folder")
    if name in present and name not in earlier:
        raise DataError(f"{folder}: has a {name} that the rig did not write; move it or choose another folder")


def _earlier(folder: Path) -> dict[str, Any]:
    """Return what ``rig.json`` says of recordings that are already in a folder; refuse a file of another kind."""
    path = folder / RIG_FILE
    if not path.exists():
        return {}
    try:
        document = read_json(path)
    except DataError as error:
        raise DataError(f"{error}, so it is not overwritten") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{path}: was not written by the rig, so it is not overwritten")
    recordings = document.get("recordings")
    if not isinstance(recordings, dict):
        raise DataError(f"{path}: has no 'recordings', so it is not overwritten")
    return recordings
