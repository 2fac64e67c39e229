"""An answer as text for a terminal: aligned columns, remarks below them."""

from collections.abc import Sequence

from ppafo.answers.answer import Answer, Cell, Column, Section, Table
from ppafo.answers.display_units import display_difference, display_unit, display_value, title_with_unit

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
