"""Folder of synthetic recordings: a CSV file for each experiment, and ``rig.json`` with all true values."""

from pathlib import Path
from typing import Any

from ppafo.documents.json_text import json_text
from ppafo.errors import DataError
from ppafo.rig.experiments import NOTICE, RigRecording
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.storage.files import LEFT_ASIDE, add_files, check_files_can_be_added
from ppafo.storage.owned_folder import entries_of, read_json

RIG_FILE = "rig.json"
_FORMAT = "ppafo rig"


def check_rig_folder(folder: Path, experiment: str) -> None:
    """Raise DataError if a folder is not writable or contains files of another origin; called before a run."""
    _earlier(folder, f"{experiment}.csv")
    check_files_can_be_added(folder, [f"{experiment}.csv", RIG_FILE])


def write_rig_recording(folder: Path, recorded: RigRecording) -> tuple[str, ...]:
    """Write recording and true parameters into a folder, and return the file names.

    Raises DataError if the folder contains files of another origin.
    """
    name = f"{recorded.truth['experiment']}.csv"
    recordings = {**_earlier(folder, name), name: dict(recorded.truth)}
    document = {
        "format": _FORMAT,
        "schema_version": 1,
        "notice": NOTICE,
        "recordings": {key: recordings[key] for key in sorted(recordings)},
    }
    # By rig.json a folder is known to be the rig's: it is there first, whenever the process is killed.
    add_files(folder, {RIG_FILE: f"{json_text(document)}\n".encode(), name: marked_csv_bytes(recorded.recording)})
    return name, RIG_FILE


def _earlier(folder: Path, name: str) -> dict[str, Any]:
    """Return the entries of ``rig.json`` for the recordings already in a folder.

    Raises DataError if the folder was not written by the rig, or if the recording ``name`` would replace a file of
    another origin.
    """
    # A file that a killed writer left behind is the writer's own.
    entries = entries_of(folder) if folder.is_dir() else []
    present = {entry.name for entry in entries if LEFT_ASIDE not in entry.name}
    recordings: Any = {}
    if RIG_FILE in present:
        document = read_json(folder / RIG_FILE)
        is_of_rig = isinstance(document, dict) and document.get("format") == _FORMAT
        recordings = document.get("recordings") if is_of_rig else None
    if not isinstance(recordings, dict) or (present and RIG_FILE not in present):
        raise DataError(
            f"{folder}: is not empty and contains no {RIG_FILE} of the simulated test bench; choose another folder"
        )
    if name in present and name not in recordings:
        raise DataError(
            f"{folder}: contains '{name}', which was not written by the simulated test bench; move this file or choose "
            "another folder"
        )
    return dict(recordings)
