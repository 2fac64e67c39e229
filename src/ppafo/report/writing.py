"""The one writer of answers: as text, as a page, and every file by name in a folder that holds exactly these."""

import base64
import html
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.documents.json_text import json_text
from ppafo.report import Answer, Cell, Column, Figure, Section, Table
from ppafo.report.display_units import display_difference, display_unit, display_value, title_with_unit
from ppafo.report.style import render_figure
from ppafo.storage.result_folder import write_marked_folder
from ppafo.version import __version__

if TYPE_CHECKING:
    from markupsafe import Markup

UNKNOWN = "\N{EN DASH}"
_DIGITS = "-0123456789"
_SUPERSCRIPTS = str.maketrans(_DIGITS, "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_SUBSCRIPTS = str.maketrans(_DIGITS, "₋₀₁₂₃₄₅₆₇₈₉")
_TIMES, _MINUS = "\N{MULTIPLICATION SIGN}", "\N{MINUS SIGN}"
_APOSTROPHE, _NO_BREAK = "\N{RIGHT SINGLE QUOTATION MARK}", "\N{NO-BREAK SPACE}"
_QUOTED = "\N{LEFT DOUBLE QUOTATION MARK}\\1\N{RIGHT DOUBLE QUOTATION MARK}"
_PRESSURE_UNITS = {"Pa_a": "Pa (absolute)", "Pa_d": "Pa", "psi_g": "psig", "psi_a": "psia", "psi_d": "psi"}
_POWER_OF_TEN = re.compile(r"(?<=\d)e([+-]?\d+)\b")
_EXPONENT = re.compile(r"\^(-?\d+)")
_INDEX = re.compile(r"\b(C|P|V|CO)([12])\b")
_PRESSURE = re.compile(rf"\b({'|'.join(_PRESSURE_UNITS)})\b")
_PRODUCT = re.compile(r"(?<=\d) x (?=\d)")
_NEGATIVE = re.compile(r"(?<![\w.)-])-(?=[\dA-Z])")
_DIFFERENCE = re.compile(r"(?<=[\w)]) - (?=[\w(])")
_WORD_APOSTROPHE = re.compile(r"(?<=\w)'(?=\w)")
_QUOTATION = re.compile(r"'([^']+)'")
_BEFORE_UNIT = re.compile(
    r"(?<=[\d⁰¹²³⁴⁵⁶⁷⁸⁹]) (?=(?:%|deg|psi[ga]?|ms|s|mm²|cm³|m³|m|kg|g|J|K|N|Hz|kHz|Pa|rad|1)(?![\w]))"
)
_IN_UNIT = re.compile(r"(?<=[\d\s](?:N|g)) (?=m)")
_PATH = re.compile(r"\b[a-z_]+(?:\.[a-z0-9_]+)+\b")


def typeset(text: str) -> str:
    """Return a plain text with superscripts and indices, signs, quotation marks, and psig instead of psi_g."""
    text = _POWER_OF_TEN.sub(lambda found: f" {_TIMES} 10{str(int(found[1])).translate(_SUPERSCRIPTS)}", text)
    text = _EXPONENT.sub(lambda found: found[1].translate(_SUPERSCRIPTS), text)
    text = _INDEX.sub(lambda found: found[1] + found[2].translate(_SUBSCRIPTS), text)
    text = _PRESSURE.sub(lambda found: _PRESSURE_UNITS[found[1]], text)
    text = _PRODUCT.sub(f" {_TIMES} ", text)
    text = _DIFFERENCE.sub(f" {_MINUS} ", _NEGATIVE.sub(_MINUS, text))
    text = _QUOTATION.sub(_QUOTED, _WORD_APOSTROPHE.sub(_APOSTROPHE, text))
    return _IN_UNIT.sub(_NO_BREAK, _BEFORE_UNIT.sub(_NO_BREAK, text))


def with_paths_as_code(text: str) -> "Markup":
    """Return a text as HTML in which every dotted path of a value, such as ``valve.area``, is marked as code."""
    from markupsafe import Markup, escape

    return Markup(_PATH.sub(lambda found: f"<code>{found[0]}</code>", str(escape(text))))


def sentence(text: str) -> str:
    """Return a text with a capital at its beginning and a full stop at its end; a path or symbol stays as it is."""
    stripped = text.strip()
    if not stripped:
        return ""
    is_symbol = any(mark in stripped.partition(" ")[0].rstrip(".:,") for mark in "._")
    capital = stripped if is_symbol else stripped[0].upper() + stripped[1:]
    return capital if capital.endswith((".", "!", "?")) else f"{capital}."


def quantity(value: float | None, unit: str, digits: int = 4) -> str:
    """Return number and unit in plain text, ``0.1000 N m``; a dash where there is no number.

    A plain number has the unit ``-`` and, where it is whole, is written as a whole number.
    """
    if value is None:
        return UNKNOWN
    if value == 0.0 or (unit == "-" and value == int(value)):
        number = f"{value:.0f}"
    else:
        number = f"{value:#.{digits}g}".removesuffix(".")
    return f"{number} {'' if unit == '-' else unit}".rstrip()


def format_reported_quantity(value: float, unit: str) -> str:
    """Return number and unit with no more digits than the number was printed with."""
    return f"{value:g} {'' if unit == '-' else unit}".rstrip()


MARK = "*"
_NOTHING = "-"


def text_of(answer: Answer) -> str:
    """Return the lead and every section that is no mere detail of the page."""
    blocks = ["\n".join(answer.lead), *(_section_text(section) for section in answer.sections if not section.is_detail)]
    return "\n\n".join(block for block in blocks if block)


def head_texts(table: Table) -> list[str]:
    """Return the titles of the columns with the units in which they are shown."""
    return [_title(column) for column in table.head]


def row_texts(table: Table) -> list[list[str]]:
    """Return the cells as text, numbers in the units in which they are shown."""
    columns = table.head or (Column(""),) * len(table.rows[0] if table.rows else ())
    return [[cell_text(cell, column) for cell, column in zip(row, columns, strict=True)] for row in table.rows]


def cell_text(cell: Cell, column: Column) -> str:
    """Return a cell as text: a number in its shown unit and form, whole plain numbers with commas, a dash for None."""
    if cell is None:
        return _NOTHING
    if isinstance(cell, str):
        return cell
    if isinstance(cell, int) and not column.quantity:
        return f"{cell:,}"
    number = (display_difference if column.is_change else display_value)(float(cell), column.quantity)
    return f"{number:{column.form}}"


def align_columns(rows: Sequence[Sequence[str]], left: int = 1) -> list[str]:
    """Return rows of texts as lines of aligned columns: the first ``left`` to the left, all others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(_pad_row(row, widths, left)).rstrip() for row in rows]


def _section_text(section: Section) -> str:
    body = [*section.paragraphs, *(_table_lines(section.table) if section.table else []), *section.remarks]
    body += [section.code] if section.code else []
    return "\n".join([section.heading, *body] if section.heading and body else body)


def _table_lines(table: Table) -> list[str]:
    rows = row_texts(table)
    if not table.rows:
        return []
    if not table.head:
        return align_columns(rows, len(rows[0]))
    rows = [head_texts(table), *rows]
    if table.marked:
        marks = ["", *(MARK if place in table.marked else "" for place in range(len(table.rows)))]
        rows = [[mark, *row] for mark, row in zip(marks, rows, strict=True)]
    return align_columns(rows, table.left + bool(table.marked))


def _title(column: Column) -> str:
    if column.is_change and column.quantity == "pressure":
        return f"{column.title} (psi)"
    return title_with_unit(column.title, column.quantity) if display_unit(column.quantity) else column.title


def _pad_row(row: Sequence[str], widths: Sequence[int], left: int) -> list[str]:
    cells = zip(row, widths, strict=True)
    return [f"{cell:<{width}}" if place < left else f"{cell:>{width}}" for place, (cell, width) in enumerate(cells)]


_ORIGINS = {
    "simulated": "Every run is of the model; nothing on this page was measured.",
    "synthetic": "The recordings are synthetic: the simulated test bench made them, nothing was measured.",
    "measured": "",
}


def page_of(answer: Answer, drawn: Mapping[str, bytes]) -> bytes:
    """Return the page of an answer; ``drawn`` has the SVG or GIF content of each of its figures by name."""
    if answer.page is not None:
        return answer.page(drawn)
    values = {
        "answer": answer,
        "sections": [_section(section, drawn) for section in answer.sections],
        "origin": _ORIGINS[answer.kind],
        "data": f"{answer.name}.json",
        "versions": f"ppafo {__version__}",
        "live": None if answer.live is None else answer.live(),
    }
    return render_page("answer.html.jinja", values).encode()


def _section(section: Section, drawn: Mapping[str, bytes]) -> dict[str, Any]:
    table, figure = section.table, section.figure
    return {
        "heading": section.heading,
        "paragraphs": section.paragraphs,
        "head": [_unbroken_unit(text) for text in head_texts(table)] if table else [],
        "rows": row_texts(table) if table else [],
        "left": table.left if table else 1,
        "marked": table.marked if table else (),
        "remarks": section.remarks,
        "code": section.code,
        "figure": inline_figure(drawn[figure.name]) if figure else "",
        "caption": figure.caption if figure else "",
    }


def _unbroken_unit(title: str) -> str:
    """Return the title of a column whose unit, at its end, is not broken over two lines."""
    words, bracket, unit = title.rpartition("(")
    return words + bracket + unit.replace(" ", "\N{NO-BREAK SPACE}") if bracket and title.endswith(")") else title


def render_page(template: str, values: Mapping[str, Any], package: str = "ppafo.report") -> str:
    """Return a template of a package filled with values; texts are escaped, a value that is missing is an error."""
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    packages = dict.fromkeys((package, "ppafo.report"))
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(name) for name in packages]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["typeset"] = typeset
    environment.filters["sentence"] = sentence
    environment.filters["coded"] = with_paths_as_code
    return environment.get_template(template).render(values)


def inline_figure(content: bytes) -> str:
    """Return the content of an SVG or GIF file as the address of an image that is part of the page."""
    kind = "gif" if content.startswith(b"GIF8") else "svg+xml"
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


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


def notebook_of(answer: Answer) -> str:
    """Return the page of an answer as a frame, which a notebook shows."""
    page = files_of(answer)[REPORT].decode()
    return f'<iframe srcdoc="{html.escape(page)}" width="100%" height="700" style="border: 0"></iframe>'


def write_answer(answer: Answer, folder: Path) -> None:
    """Make a folder hold the files of an answer, and no others; DataError where it holds anything of others."""
    write_marked_folder(folder, files_of(answer), answer.command or answer.name)
