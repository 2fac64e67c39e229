"""Figures redrawn from the files of a result folder, without a new run."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.analyses.endurance.discharge import WALK_FILE
from ppafo.analyses.study_results import load_study_results
from ppafo.errors import DataError
from ppafo.report.recording_figure import recording_figure
from ppafo.report.stored_figure import draw_stored_walk, read_result, stated_units
from ppafo.rig.experiments import RIG_FILE
from ppafo.storage.owned_folder import MARK, entries_of, read_json
from ppafo.storage.reading import read_recording
from ppafo.storage.result_folder import MANIFEST, NETCDF_FILE, RUN_FILE
from ppafo.units.shown import shown_in

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_FIGURE = "figure"


def names_in(folder: Path) -> list[str]:
    """Return the sorted names of the files and folders in a folder."""
    if not folder.is_dir():
        raise DataError(f"{folder}: is not a folder")
    return sorted(entry.name for entry in entries_of(folder))


def draw_folder(folder: Path, names: list[str]) -> "dict[str, Figure]":
    """Return the figures of a result folder by the stem of their file names.

    A folder of a run, a walk, a study or rig recordings has figures; the result is empty for other folders.
    """
    if RUN_FILE in names:
        return {_FIGURE: read_result(folder).plot()}
    if MANIFEST in names:
        return {_FIGURE: load_study_results(folder).plot()}
    if RIG_FILE in names:
        file = folder / RIG_FILE
        document, tables = _document(file), [name for name in names if name.endswith(".csv")]
        drawn = {}
        for name in tables:
            # The truth of a recording is in the document of its folder.
            with shown_in(stated_units(file, document, "recordings", name)):
                drawn[name.removesuffix(".csv")] = recording_figure(read_recording(folder / name))
        return drawn
    if NETCDF_FILE in names and MARK in names:
        # Of a walk its end is recorded.
        file = folder / WALK_FILE
        document = _document(file) if WALK_FILE in names else {}
        return {_FIGURE: draw_stored_walk(file, document, read_recording(folder / NETCDF_FILE))}
    return {}


def _document(file: Path) -> dict[str, Any]:
    """Return the content of a JSON file that contains an object."""
    document = read_json(file)
    if not isinstance(document, dict):
        raise DataError(f"{file}: must be a JSON object")
    return document
