"""Report of an analysis as data: sentences, tables and figure panels, in SI units until converted to text.

Every analysis returns a ``Finding``; this module generates its text, JSON, page, figures and folder.
"""

import html
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from ppafo.documents.json_text import json_text, plain
from ppafo.errors import ArgumentError
from ppafo.report.kind import PLAIN, ConfidenceInterval, Kind
from ppafo.report.panels import Panel, draw_panels
from ppafo.report.style import drawn_at, render_figure, shown
from ppafo.report.writing import align_columns, inline_figure, render_page, terminal_width
from ppafo.signals import RecordingKind
from ppafo.units.shown import in_units, units_in_force
from ppafo.version import __version__
from ppafo.wording import changed_text

if TYPE_CHECKING:
    import matplotlib.figure

T_co = TypeVar("T_co", covariant=True)
Cell = str | float | ConfidenceInterval | None
"""Number in SI units, estimate with its confidence interval, text, or None for an empty cell."""
NOTHING = "-"
"""Text of an empty cell."""
MARK = "*"
"""Mark before a highlighted row of a table."""
REPORT = "report.html"
FORMATS = ("png", "svg")
"""File formats in which a figure is saved in a folder."""
_UNIT_IN_BRACKETS = re.compile(r"\([^(]*\)$")
_ORIGINS = {
    "simulated": "Every run is of the model; nothing on this page was measured.",
    "synthetic": "The recordings are synthetic: the simulated test bench made them, nothing was measured.",
    "measured": "",
}
"""Statement on a report page about the origin of its numbers, by kind of recording."""


@dataclass(frozen=True, slots=True)
class Column:
    """Column of a table: title, cells in SI units, kind of the numbers; ``is_change`` marks differences of values."""

    title: str
    values: Sequence[Cell]
    kind: Kind = PLAIN
    is_change: bool = False

    @property
    def head(self) -> str:
        """Title, with the display unit of the numbers in brackets."""
        unit = self.kind.shown_change_unit if self.is_change else self.kind.shown_unit
        return f"{self.title} ({unit})" if unit and self.kind.quantity else self.title

    @property
    def texts(self) -> list[str]:
        """Cells as text: numbers in display units, counts with thousands separators, a dash for a missing value."""
        kind = self.kind
        texts = []
        for value in self.values:
            if isinstance(value, str):
                text = value
            elif value is None or (isinstance(value, float) and math.isnan(value)):
                text = NOTHING
            elif isinstance(value, ConfidenceInterval):
                text = kind.change_interval(value) if self.is_change else kind.interval(value)
            # A count; a whole number of some quantity is shown in its unit and form.
            elif isinstance(value, int) and not kind.quantity:
                text = f"{value:,}"
            else:
                text = kind.change_number(value, kind.form) if self.is_change else kind.number(value)
            texts.append(text)
        return texts


def columns_of(titles: Sequence[str | tuple[str, Kind]], rows: Iterable[Sequence[Cell]]) -> list[Column]:
    """Return the columns of a table given by rows; each title is a text, or a pair of text and kind of the numbers."""
    pairs = [(title, PLAIN) if isinstance(title, str) else title for title in titles]
    # Without a row there still are titles.
    cells = list(zip(*rows, strict=True)) or [()] * len(pairs)
    return [Column(title, values, kind) for (title, kind), values in zip(pairs, cells, strict=True)]


def facts(rows: Iterable[Sequence[Cell]]) -> list[Column]:
    """Return a table of facts: columns of names and values, without titles."""
    return columns_of(("", ""), rows)


@dataclass(frozen=True, slots=True)
class Section:
    """Section of a report, with optional heading, sentences, table, figure, and code.

    Table: ``columns``, of which the first ``left`` are names and left-aligned; columns without titles form a list of
    facts. ``marked`` are the indices of highlighted rows, from 0. ``remarks`` are printed below the table.

    Figure: ``name`` is the stem of its files, empty without a figure. It is drawn from ``panels``, or from a function
    that returns panels on demand, with ``across`` panels per row, a panel ``size`` [inches], a ``title``, a ``note``
    and the ``kind`` of its numbers, that of the report by default. Alternatively ``draw`` returns the complete figure.
    ``caption`` is printed on the page.

    ``code`` is a text to be copied. A section with ``is_detail`` is on the page only.
    """

    heading: str = ""
    columns: Sequence[Column] = ()
    said: Sequence[str] = ()
    remarks: Sequence[str] = ()
    panels: Sequence[Panel] | Callable[[], Sequence[Panel]] = ()
    name: str = ""
    caption: str = ""
    across: int = 1
    size: tuple[float, float] = (5.2, 2.6)
    title: str = ""
    note: str = ""
    kind: RecordingKind | None = None
    code: str = ""
    left: int = 1
    marked: Collection[int] = ()
    is_detail: bool = False
    draw: "Callable[[], matplotlib.figure.Figure] | None" = None

    @property
    def has_head(self) -> bool:
        """True if any column of the table has a title."""
        return any(column.title for column in self.columns)

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Rows of the table as text, without the titles."""
        return list(zip(*(column.texts for column in self.columns), strict=True))

    def table_lines(self, width: int = 0) -> list[str]:
        """Table as aligned lines, with titles and marks of highlighted rows; empty without rows.

        Columns that exceed a ``width`` above 0 follow below, beside the names again.
        """
        rows: list[tuple[str, ...]] = self.rows
        if not rows:
            return []
        if not self.has_head:
            return align_columns(rows, len(self.columns))
        lines = [tuple(column.head for column in self.columns), *rows]
        if self.marked:
            marks = ["", *(MARK if number in self.marked else "" for number in range(len(rows)))]
            lines = [(mark, *line) for mark, line in zip(marks, lines, strict=True)]
        return align_columns(lines, self.left + bool(self.marked), width)

    def drawn(self, kind: RecordingKind) -> "matplotlib.figure.Figure":
        """Draw the figure of the section, marked as simulated or synthetic unless ``kind`` is measured."""
        if self.draw is not None:
            return self.draw()
        panels = self.panels() if callable(self.panels) else self.panels
        return draw_panels(panels, self.across, self.size, self.title, self.note, self.kind or kind)


_in_own_units = in_units(lambda finding, *_, **__: finding.units)


@dataclass(frozen=True, slots=True, repr=False)
class Finding(Generic[T_co]):
    """Report of an analysis: ``found`` are its results in SI units, and the other fields are for presentation.

    The JSON of a report is ``found`` as plain data, or the result of its method ``json_document()`` if defined.

    - ``name``: stem of the files, and name of the command unless ``command`` is set
    - ``kicker``, ``title``: line above the title, and title
    - ``said``: first sentences
    - ``parts``: sections
    - ``passed``: False if a check failed
    - ``files``: functions that return further files, by name
    - ``kind``: origin of the numbers: simulated, synthetic or measured
    - ``page``: function that makes a special page from the drawn figures
    - ``units``: display units by SI unit, by default the ones active at creation
    - ``overrides``: values that the caller changed, stated after the opening sentences; JSON has them if there are any
    """

    name: str
    kicker: str
    title: str
    said: Sequence[str]
    parts: Sequence[Section]
    found: T_co
    passed: bool = True
    files: Mapping[str, Callable[[], bytes]] = field(default_factory=dict)
    command: str = ""
    kind: RecordingKind = "simulated"
    page: Callable[[Mapping[str, bytes]], bytes] | None = None
    units: Mapping[str, str] = field(default_factory=units_in_force)
    overrides: Sequence[str] = ()

    @property
    def figures(self) -> dict[str, Section]:
        """Sections with a figure, by the stem of the figure's files."""
        return {section.name: section for section in self.parts if section.name}

    def __str__(self) -> str:
        """Return the text printed by the command."""
        return text_of(self, terminal_width())

    def __iter__(self) -> Iterator[Any]:
        """Iterate over the results, for example the findings of an audit; raises TypeError if they are not iterable."""
        found: Any = self.found
        return iter(found)

    def __repr__(self) -> str:
        """Return a short description: kind of report and title."""
        return f"<{self.kicker}: {self.title}>"

    def _repr_html_(self) -> str:
        """Return the page in an inline frame, for display in a notebook."""
        page = html.escape(files_of(self)[REPORT].decode())
        return f'<iframe srcdoc="{page}" width="100%" height="700" style="border: 0"></iframe>'

    @_in_own_units
    def to_dict(self) -> dict[str, Any]:
        """Return the data printed with ``--json``, as plain data in SI units."""
        given = {"overrides": list(self.overrides)} if self.overrides else {}
        return given | dict(plain(self.found))

    @_in_own_units
    def plot(self, name: str | None = None, width: float | str | None = None) -> "matplotlib.figure.Figure":
        """Return a figure of the report by name, by default the first; raises ArgumentError if there is none.

        ``width`` is the width in print, such as "84 mm", or a number [m], for which text and panels are arranged.
        """
        figures = self.figures
        chosen = figures.get(name or next(iter(figures), ""))
        with drawn_at(width):
            drawn = None if chosen is None else chosen.drawn(self.kind)
        if drawn is None:
            named = f"no figure '{name}'" if name else "no figure"
            available = (
                f"; available: {', '.join(figures)}" if figures else "; print the result, or save() its text and page"
            )
            raise ArgumentError(f"a result of '{self.name}' has {named}{available}")
        return shown(drawn)

    def save(self, folder: str | Path) -> None:
        """Write text, JSON, page and figures into a folder.

        The folder must be absent, empty or an earlier result; otherwise DataError is raised.
        """
        from ppafo.storage.owned_folder import write_marked_folder

        write_marked_folder(Path(folder), files_of(self), self.command or self.name)


@_in_own_units
def text_of(finding: Finding[Any], width: int = 0) -> str:
    """Return the report as text: opening sentences and sections, without the sections meant for the page only.

    Tables are folded to a ``width`` above 0 [characters].
    """
    blocks = ["\n".join(filter(None, (*finding.said, changed_text(finding.overrides))))]
    for section in finding.parts:
        if section.is_detail:
            continue
        body = [*section.said, *section.table_lines(width), *section.remarks, *([section.code] if section.code else [])]
        # A heading over nothing is left out, and a part of the page alone, a figure, has no text.
        blocks.append("\n".join([section.heading, *body] if section.heading and body else body))
    return "\n\n".join(block for block in blocks if block)


@_in_own_units
def files_of(finding: Finding[Any]) -> dict[str, bytes]:
    """Return text, JSON, page, figures and further files of a report by name; this draws the figures."""
    return {
        **page_files(finding),
        f"{finding.name}.json": f"{json_text(finding.to_dict())}\n".encode(),
        f"{finding.name}.txt": f"{text_of(finding)}\n".encode(),
    }


@_in_own_units
def page_files(finding: Finding[Any]) -> dict[str, bytes]:
    """Return page, figures and further files of a report by name; this draws the figures."""
    files = {name: content() for name, content in finding.files.items()}
    on_page = {}
    for name, section in finding.figures.items():
        formats = render_figure(section.drawn(finding.kind), FORMATS)
        files |= {f"{name}.{file_format}": content for file_format, content in formats.items()}
        on_page[name] = formats["svg"]
    if finding.page is not None:
        return files | {REPORT: finding.page(on_page)}
    parts = []
    for section in finding.parts:
        heads = [column.head for column in section.columns] if section.has_head else []
        # A unit in brackets stays on one line.
        heads = [_UNIT_IN_BRACKETS.sub(lambda unit: unit[0].replace(" ", "\N{NO-BREAK SPACE}"), head) for head in heads]
        parts.append((section, heads, inline_figure(on_page[section.name]) if section.name else ""))
    values = {
        "finding": finding,
        "changed": changed_text(finding.overrides),
        "parts": parts,
        "origin": _ORIGINS[finding.kind],
        "versions": f"ppafo {__version__}",
    }
    return files | {REPORT: render_page("finding.html.jinja", values).encode()}
