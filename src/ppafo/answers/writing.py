"""The one writer of answers: every file of an answer by name, and the folder that holds exactly these."""

from pathlib import Path

from ppafo.answers.answer import Answer, Figure
from ppafo.answers.page import page_of
from ppafo.answers.style import render_figure
from ppafo.answers.text import text_of
from ppafo.documents.json_text import json_text
from ppafo.storage.owned_folder import write_marked_folder

REPORT = "report.html"
FORMATS = ("png", "svg")


def files_of(answer: Answer) -> dict[str, bytes]:
    """Return text, JSON, page, figures and further files of an answer by name; figures are drawn here."""
    drawn = {figure.name: _files_of_figure(figure) for figure in answer.figures}
    return {
        **{f"{name}.{form}": content for name, forms in drawn.items() for form, content in forms.items()},
        **{name: content() for name, content in answer.files.items()},
        f"{answer.name}.json": f"{json_text(answer.data)}\n".encode(),
        f"{answer.name}.txt": f"{text_of(answer)}\n".encode(),
        REPORT: page_of(answer, {name: forms.get("svg") or forms["gif"] for name, forms in drawn.items()}),
    }


def _files_of_figure(figure: Figure) -> dict[str, bytes]:
    """Return the contents of a figure by the ending of their names."""
    drawn = figure.draw()
    return {"gif": drawn} if isinstance(drawn, bytes) else render_figure(drawn, FORMATS)


def write_answer(answer: Answer, folder: Path) -> None:
    """Make a folder hold the files of an answer, and no others; DataError where it holds anything of others."""
    write_marked_folder(folder, files_of(answer), answer.command or answer.name)
