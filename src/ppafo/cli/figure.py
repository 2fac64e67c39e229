"""``ppafo export figure DIR``: redraws the figures of a result folder without a new run."""

from ppafo.arguments import File, Folder
from ppafo.cli import output
from ppafo.cli.output import CommandOutput
from ppafo.errors import DataError

_FORMATS = ("png", "svg")


def export_figure(folder: Folder, *, out: File | None = None) -> CommandOutput:
    """Redraw the figures of a result folder.

    Figures of runs, walks, studies and rig recordings are drawn again; of other results it is said which there are.

    folder: a result folder written by ppafo
    out: a .png, .svg or .pdf file; default figure.png and figure.svg in DIR

    >>> import ppafo
    >>> folder = ppafo.simulate("step-response").save("step")
    >>> print(export_figure(folder).text)
    written: step/figure.png, step/figure.svg
    """
    from ppafo.report.recording_figure import FIGURE_FORMATS
    from ppafo.report.style import render_figure
    from ppafo.storage.files import write_file
    from ppafo.storage.result_folder import add_to_folder

    # Before anything is read or drawn.
    if out is not None:
        if out.suffix.removeprefix(".") not in FIGURE_FORMATS:
            allowed = ", ".join(f".{name}" for name in FIGURE_FORMATS)
            raise DataError(f"--out {out}: the name must end in one of {allowed}")
        output.check_new_file(out)
    from ppafo.analyses.stored_figures import draw_folder, names_in, what_is_there
    from ppafo.report.drawing import load_drawing

    names = names_in(folder)
    load_drawing()
    drawn = draw_folder(folder, names)
    if not drawn:
        message, document = what_is_there(folder, names)
        if out is not None:
            vectors = [str(folder / name) for name in names if name.endswith(".svg")]
            raise DataError(
                f"--out {out}: only figures of runs, walks, studies and rig recordings can be drawn again, not of "
                f"'ppafo {document['command']}'"
                + (f"; convert a vector figure to PDF with other software: {', '.join(vectors)}" if vectors else "")
            )
        return CommandOutput(message, document)
    if out is not None:
        if len(drawn) > 1:
            raise DataError(
                f"--out {out}: {folder} has {len(drawn)} figures ({', '.join(drawn)}); omit --out to write each "
                "beside its recording"
            )
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
    return CommandOutput(f"written: {', '.join(written)}", {"files": written})
