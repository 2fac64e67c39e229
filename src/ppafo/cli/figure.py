"""``ppafo export figure DIR``: redraws the figures of a result folder without a new run."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ppafo.arguments import FigureWidth, File, Folder
from ppafo.cli import output
from ppafo.cli.output import CommandOutput
from ppafo.errors import DataError
from ppafo.storage.files import write_file
from ppafo.storage.owned_folder import MARK, entries_of, marking_command, read_json
from ppafo.storage.result_folder import MANIFEST, NETCDF_FILE, RUN_FILE, add_to_folder
from ppafo.units.shown import shown_in

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_NAMED = 6
"""Number of figures that are named."""


def export_figure(folder: Folder, *, out: File | None = None, width: FigureWidth | None = None) -> CommandOutput:
    """Redraw the figures of a result folder.

    Figures of runs, walks, studies and rig recordings are drawn again; of other results it is said which there are.

    folder: a result folder written by ppafo
    out: a .png, .svg or .pdf file; default figure.png and figure.svg in DIR
    width: width in print, such as "84 mm" for a column: 8 pt text, panels rearranged; default 145 mm and 10 pt

    >>> import ppafo
    >>> folder = ppafo.simulate("step-response").save("step")
    >>> print(export_figure(folder).text)
    written: step/figure.png, step/figure.svg
    """
    from ppafo.report.recording_figure import FIGURE_FORMATS

    # Before anything is read or drawn.
    if out is not None:
        if out.suffix.removeprefix(".") not in FIGURE_FORMATS:
            allowed = ", ".join(f".{name}" for name in FIGURE_FORMATS)
            raise DataError(f"--out {out}: the name must end in one of {allowed}")
        output.check_new_file(out)
    from ppafo.report.style import drawn_at, load_drawing, render_figure

    if not folder.is_dir():
        raise DataError(f"{folder}: is not a folder")
    names = sorted(entry.name for entry in entries_of(folder))
    load_drawing()

    with drawn_at(width):
        figures = _drawn(folder, names)
    if not figures:
        return _figures_to_open(folder, names, out, width)
    if out is None:
        files = {
            f"{stem}.{file_format}": content
            for stem, figure in figures.items()
            for file_format, content in render_figure(figure, ("png", "svg")).items()
        }
        add_to_folder(folder, files)
        written = [str(folder / name) for name in files]
    elif len(figures) == 1:
        (figure,) = figures.values()
        (content,) = render_figure(figure, [out.suffix.removeprefix(".")]).values()
        written = [str(write_file(out, content))]
    else:
        raise DataError(
            f"--out {out}: {folder} has {len(figures)} figures ({', '.join(figures)}); omit --out to write each "
            "beside its recording"
        )
    return CommandOutput(f"written: {', '.join(written)}", {"files": written})


def _drawn(folder: Path, names: list[str]) -> "dict[str, Figure]":
    """Return the figures of a run, a walk, a study or rig recordings by the stem of their files; else none."""
    from ppafo.analyses.endurance.discharge import WALK_FILE
    from ppafo.analyses.study_results import load_study_results
    from ppafo.report.recording_figure import draw_stored_walk, read_result, recording_figure, stated_units
    from ppafo.rig.experiments import RIG_FILE
    from ppafo.storage.reading import read_recording

    if RUN_FILE in names:
        return {"figure": read_result(folder).plot()}
    if MANIFEST in names:
        return {"figure": load_study_results(folder).plot()}
    if RIG_FILE not in names and not {NETCDF_FILE, MARK} <= {*names}:
        return {}
    # The document of the folder has the truth of a recording, and the end of a walk.
    file = folder / (RIG_FILE if RIG_FILE in names else WALK_FILE)
    document = read_json(file) if file.name in names else {}
    if not isinstance(document, dict):
        raise DataError(f"{file}: must be a JSON object")
    if file.name == WALK_FILE:
        return {"figure": draw_stored_walk(file, document, read_recording(folder / NETCDF_FILE))}
    drawn = {}
    for name in (name for name in names if name.endswith(".csv")):
        with shown_in(stated_units(file, document, "recordings", name)):
            drawn[name.removesuffix(".csv")] = recording_figure(read_recording(folder / name))
    return drawn


def _figures_to_open(folder: Path, names: list[str], out: Path | None, width: float | None) -> CommandOutput:
    """List the figures of a result that cannot be drawn again. Raises DataError if a file or a width is requested."""
    if MARK not in names:
        raise DataError(f"{folder}: is not a result folder of ppafo; give a folder written by a ppafo command")
    command = marking_command(folder)
    pictures = [name for name in names if name.endswith(".png")]
    remedy = ""
    # Not every command is a function of the package.
    if pictures and hasattr(sys.modules["ppafo"], command):
        stem = pictures[0].removesuffix(".png")
        call = f"ppafo.{command}(...).plot({stem!r}, width='84 mm').savefig('{stem}.pdf')"
        remedy = f"; for another format or width, use Python with the arguments of the command: {call}"
    if out is None and width is None:
        named = ", ".join(pictures[:_NAMED]) + (", ..." if len(pictures) > _NAMED else "")
        has = f"has its figures ({named})" if pictures else "has no figures"
        pages = (name for ending in (".html", ".txt") for name in names if name.endswith(ending))
        opened = str(folder / next(pages, MARK))
        document = {"files": [], "command": command, "figures": pictures, "open": opened}
        return CommandOutput(f"{folder}: the result of 'ppafo {command}' {has}; open {opened}{remedy}", document)
    option = f"--width {1e3 * width:g} mm" if out is None and width is not None else f"--out {out}"
    raise DataError(
        f"{option}: figures of 'ppafo {command}' cannot be drawn again, only figures of runs, walks, studies "
        f"and recordings of the simulated test bench{remedy}"
    )
