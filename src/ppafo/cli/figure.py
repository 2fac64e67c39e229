"""``ppafo export figure DIR``: draws what a folder of results holds again, without running anything again."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.cli import output
from ppafo.cli.arguments import File, Folder
from ppafo.cli.output import Said
from ppafo.errors import DataError, reason

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_FIGURE = "figure"
_FORMATS = ("png", "svg")
_PICTURES = (".png", ".gif")
_NAMED = 6


def export_figure(folder: Folder, *, out: File | None = None) -> Said:
    """Redraw the figures of a result folder.

    Where the folder has its figures already, it is said which.

    folder: a result folder written by ppafo
    out: a .png, .svg or .pdf file; default figure.png and figure.svg in DIR
    """
    from ppafo.answers.recording_figure import FIGURE_FORMATS
    from ppafo.answers.style import render_figure
    from ppafo.storage.files import write_file
    from ppafo.storage.result_folder import add_to_folder

    if out is not None and out.suffix.removeprefix(".") not in FIGURE_FORMATS:
        allowed = ", ".join(f".{name}" for name in FIGURE_FORMATS)
        raise DataError(f"--out {out}: the name must end in one of {allowed}")
    if out is not None:
        output.check_new_file(out)
    names = _names(folder)
    from ppafo.answers.drawing import load_drawing

    load_drawing()
    drawn = _draw_folder(folder, names)
    if not drawn:
        return _what_is_there(folder, out, names)
    if out is not None and len(drawn) > 1:
        raise DataError(
            f"--out {out}: {folder} has {len(drawn)} figures, {', '.join(drawn)}; without --out each is "
            "written beside its recording"
        )
    if out is not None:
        (content,) = render_figure(next(iter(drawn.values())), [out.suffix.removeprefix(".")]).values()
        written = [str(write_file(out, content))]
    else:
        files = {
            f"{stem}.{form}": content
            for stem, figure in drawn.items()
            for form, content in render_figure(figure, _FORMATS).items()
        }
        add_to_folder(folder, files)
        written = [str(folder / name) for name in files]
    return Said(f"written: {', '.join(written)}", {"files": written})


def _names(folder: Path) -> list[str]:
    """Return the names of what is in the folder, in order."""
    if not folder.is_dir():
        raise DataError(f"{folder}: is not a folder")
    try:
        return sorted(entry.name for entry in folder.iterdir())
    except OSError as error:
        raise DataError(f"{folder}: cannot be read: {reason(error)}") from error


def _draw_folder(folder: Path, names: list[str]) -> "dict[str, Figure]":
    """Return figures by the stem of their files: of a run, a walk, a study or recordings of the rig; none of others."""
    from ppafo.answers.recording_figure import draw_stored_result
    from ppafo.questions.sweep.answer import load_study_results
    from ppafo.rig.experiments import RIG_FILE
    from ppafo.storage import read_result
    from ppafo.storage.result_folder import MARK, NETCDF_FILE, RUN_FILE
    from ppafo.study.manifest import MANIFEST

    if RUN_FILE in names:
        return {_FIGURE: draw_stored_result(read_result(folder))}
    if MANIFEST in names:
        return {_FIGURE: load_study_results(folder).plot()}
    if RIG_FILE in names:
        return _draw_rig(folder, names)
    if NETCDF_FILE in names and MARK in names:
        return {_FIGURE: _draw_walk(folder, names)}
    return {}


def _draw_rig(folder: Path, names: list[str]) -> "dict[str, Figure]":
    """Return a figure of each recording of the rig; gauge pressure counts from the atmosphere of its device."""
    from ppafo.answers.recording_figure import recording_figure, stated_atmosphere
    from ppafo.rig.experiments import RIG_FILE
    from ppafo.storage import read_recording

    file = folder / RIG_FILE
    document, tables = _document(file), [name for name in names if name.endswith(".csv")]
    zeros = {name: stated_atmosphere(file, document, "recordings", name, "device") for name in tables}
    return {
        name.removesuffix(".csv"): recording_figure(read_recording(folder / name), atmosphere=zero)
        for name, zero in zeros.items()
    }


def _draw_walk(folder: Path, names: list[str]) -> "Figure":
    """Return the figure of the end of a walk."""
    from ppafo.answers.recording_figure import draw_stored_walk
    from ppafo.questions.endurance.draw import WALK_FILE
    from ppafo.storage import read_recording
    from ppafo.storage.result_folder import NETCDF_FILE

    file = folder / WALK_FILE
    document = _document(file) if WALK_FILE in names else {}
    return draw_stored_walk(file, document, read_recording(folder / NETCDF_FILE))


def _document(file: Path) -> dict[str, Any]:
    """Return the names and values of a JSON file."""
    from ppafo.storage.result_folder import read_json

    document = read_json(file)
    if not isinstance(document, dict):
        raise DataError(f"{file}: is not a table of names and values")
    return document


def _what_is_there(folder: Path, out: Path | None, names: list[str]) -> Said:
    """Say which figures a folder of ppafo has and which file to open; DataError where the folder is another."""
    from ppafo.storage.result_folder import MARK, marking_command

    if MARK not in names:
        raise DataError(f"{folder}: is not a result folder of ppafo")
    command = marking_command(folder)
    pictures = [name for name in names if name.endswith(_PICTURES)]
    page = next((name for name in names if name.endswith(".html")), None)
    shown = ", ".join(pictures[:_NAMED]) + (", ..." if len(pictures) > _NAMED else "")
    has = f"has its figures ({shown})" if pictures else "has no figures"
    opened = page or next((name for name in names if name.endswith(".txt")), MARK)
    said = f"{folder}: the result of 'ppafo {command}' {has}; open {folder / opened}"
    if out is not None:
        raise DataError(f"--out {out}: nothing is drawn anew: {said}")
    return Said(said, {"files": [], "command": command, "figures": pictures, "open": str(folder / opened)})
