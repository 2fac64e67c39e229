"""Finding of an analysis as values: sentences, tables of columns, panels. In SI until it becomes text.

A ``Finding`` is all that an analysis returns; text, JSON, page, figures and folder are made of it here.
"""

import html
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from ppafo.documents.json_text import json_text, plain
from ppafo.report.kind import PLAIN, ConfidenceInterval, Kind
from ppafo.report.notebook import shown
from ppafo.report.panels import Panel, draw_panels
from ppafo.report.style import render_figure
from ppafo.report.writing import align_columns, inline_figure, render_page
from ppafo.signals import RecordingKind
from ppafo.units.shown import in_units, units_in_force
from ppafo.version import __version__

if TYPE_CHECKING:
    import matplotlib.figure

T_co = TypeVar("T_co", covariant=True)
Cell = str | float | ConfidenceInterval | None
"""A number in SI, an estimate with its interval, a text, or None where there is nothing to say."""
NOTHING = "-"
"""The text of a cell in which there is nothing to say."""
MARK = "*"
"""Mark before a highlighted row."""
REPORT = "report.html"
FORMATS = ("png", "svg")
"""Formats of a figure in a folder."""
_UNIT_IN_BRACKETS = re.compile(r"\([^(]*\)$")
_ORIGINS = {
    "simulated": "Every run is of the model; nothing on this page was measured.",
    "synthetic": "The recordings are synthetic: the simulated test bench made them, nothing was measured.",
    "measured": "",
}
"""Statement of a page on the origin of its numbers, by kind."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table: title, kind of its numbers, and the cells in SI; ``is_change`` for differences of levels."""

    title: str
    values: Sequence[Cell]
    kind: Kind = PLAIN
    is_change: bool = False

    @property
    def head(self) -> str:
        """The title with the unit in which its numbers are shown."""
        unit = self.kind.shown_change_unit if self.is_change else self.kind.shown_unit
        return f"{self.title} ({unit})" if unit and self.kind.quantity else self.title

    @property
    def texts(self) -> list[str]:
        """The cells as text: numbers in the shown unit and form, whole plain ones with commas, a dash for nothing."""
        kind, texts = self.kind, []
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
    """Return the columns of some rows, each with a title, or with a title and the kind of its numbers."""
    pairs = [(title, PLAIN) if isinstance(title, str) else title for title in titles]
    # Without a row there still are titles.
    cells = list(zip(*rows, strict=True)) or [()] * len(pairs)
    return [Column(title, values, kind) for (title, kind), values in zip(pairs, cells, strict=True)]


def facts(rows: Iterable[Sequence[Cell]]) -> list[Column]:
    """Return a list of facts, name and value: columns without a title."""
    return columns_of(("", ""), rows)


@dataclass(frozen=True, slots=True)
class Section:
    """A part of a finding, of which all may be left out: a heading, what is said, a table, a figure, a text to copy.

    The table: ``columns``, of which the first ``left`` are names and set to the left; without titles they are a list of
    facts. ``marked`` are the numbers of the rows, from 0, that stand out; ``remarks`` stand below.

    The figure: ``name`` is the stem of its files, empty where there is none. It is made of ``panels``, or of a function
    that makes them where the figure is wanted: ``across`` side by side, each of a ``size`` [inches], under a ``title``
    and with a ``note``. Or ``draw`` makes all of it, which may be the bytes of an animation (GIF). The ``caption`` is
    on the page.

    ``code`` is a text to copy. A part that ``is_detail`` is on the page only.
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
    code: str = ""
    left: int = 1
    marked: Collection[int] = ()
    is_detail: bool = False
    draw: "Callable[[], matplotlib.figure.Figure | bytes] | None" = None

    @property
    def has_head(self) -> bool:
        """Tell whether the columns have titles."""
        return any(column.title for column in self.columns)

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """The table as text, without its head."""
        return list(zip(*(column.texts for column in self.columns), strict=True))

    def drawn(self, kind: RecordingKind) -> "matplotlib.figure.Figure | bytes":
        """Return the figure, of which panels say what kind of numbers they show."""
        if self.draw is not None:
            return self.draw()
        panels = self.panels() if callable(self.panels) else self.panels
        return draw_panels(panels, self.across, self.size, self.title, self.note, kind)


@dataclass(frozen=True, slots=True)
class LivePart:
    """A part of a page that simulates: HTML with its own script, and the policy that allows that script alone.

    ``remark`` is a sentence on how its runs begin otherwise than the page's, empty where they do not; without
    ``html`` it says why nothing simulates.
    """

    policy: str = ""
    html: str = ""
    remark: str = ""


def _units_of(finding: "Finding[Any]", *_: Any, **__: Any) -> Mapping[str, str]:
    """Return the units in which a finding is shown, whatever else its function takes."""
    return finding.units


@dataclass(frozen=True, slots=True, repr=False)
class Finding(Generic[T_co]):
    """Finding of an analysis: ``found`` are the numbers in SI, which are also its JSON; the rest presents them.

    A ``found`` that is more than its numbers says its JSON itself, as ``json_document()``. ``name`` is the stem of its
    files and its command, unless ``command`` says another; ``kicker`` says above the title what kind of page this is.
    ``passed`` is false where a check failed. ``kind`` says where the numbers come from. ``files`` are further files by
    name. ``page`` makes a page of its own from the drawn figures. ``live`` makes the part of the page that simulates,
    None where there can be none. ``units`` are those in which it is shown, by unit in SI: in force as it was made.
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
    live: Callable[[], LivePart | None] | None = None
    kind: RecordingKind = "simulated"
    page: Callable[[Mapping[str, bytes]], bytes] | None = None
    units: Mapping[str, str] = field(default_factory=units_in_force)

    @property
    def figures(self) -> dict[str, Section]:
        """The parts that have a figure, by the stem of its files."""
        return {part.name: part for part in self.parts if part.name}

    def __str__(self) -> str:
        """Return what the command prints."""
        return text_of(self)

    def __iter__(self) -> Iterator[Any]:
        """Go through what was found, where that has items, as the findings of an audit; TypeError where it has none."""
        found: Any = self.found
        return iter(found)

    def __repr__(self) -> str:
        """Return what was found, and of what."""
        return f"<{self.kicker}: {self.title}>"

    def _repr_html_(self) -> str:
        """Return the page as a frame, which a notebook shows."""
        page = html.escape(files_of(self)[REPORT].decode())
        return f'<iframe srcdoc="{page}" width="100%" height="700" style="border: 0"></iframe>'

    @in_units(_units_of)
    def to_dict(self) -> dict[str, Any]:
        """Return what ``--json`` prints, as plain data in SI."""
        document = getattr(self.found, "json_document", None)
        return dict(plain(self.found) if document is None else document())

    @in_units(_units_of)
    def plot(self, name: str | None = None) -> "matplotlib.figure.Figure":
        """Return a figure of the result, the first unless named; LookupError where it has none of that name."""
        figures = self.figures
        chosen = figures.get(name or next(iter(figures), ""))
        drawn = None if chosen is None else chosen.drawn(self.kind)
        if drawn is None or isinstance(drawn, bytes):
            raise LookupError(f"there is no figure '{name or ''}'; available: {', '.join(figures) or 'none'}")
        return shown(drawn)

    def save(self, folder: str | Path) -> None:
        """Write text, JSON, page and figures into a folder: absent, empty or an earlier result, else DataError."""
        from ppafo.storage.result_folder import write_marked_folder

        write_marked_folder(Path(folder), files_of(self), self.command or self.name)


@in_units(_units_of)
def text_of(finding: Finding[Any]) -> str:
    """Return what is said first and every part that is no mere detail of the page."""
    blocks = ["\n".join(finding.said)]
    for part in finding.parts:
        if not part.is_detail:
            body = [*part.said, *_table_lines(part), *part.remarks, *([part.code] if part.code else [])]
            # A heading over nothing is left out, and a part of the page alone, a figure, has no text.
            blocks.append("\n".join([part.heading, *body] if part.heading and body else body))
    return "\n\n".join(block for block in blocks if block)


def _table_lines(part: Section) -> list[str]:
    """Return the table of a part as aligned lines, its head first, its marked rows after a mark; none without rows."""
    rows: list[tuple[str, ...]] = part.rows
    if not rows:
        return []
    if not part.has_head:
        return align_columns(rows, len(part.columns))
    rows = [tuple(column.head for column in part.columns), *rows]
    if part.marked:
        marks = ["", *(MARK if number in part.marked else "" for number in range(len(part.rows)))]
        rows = [(mark, *row) for mark, row in zip(marks, rows, strict=True)]
    return align_columns(rows, part.left + bool(part.marked))


@in_units(_units_of)
def page_of(finding: Finding[Any], drawn: Mapping[str, bytes]) -> bytes:
    """Return the page of a finding; ``drawn`` has the SVG or GIF content of each of its figures by name."""
    if finding.page is not None:
        return finding.page(drawn)
    values = {
        "finding": finding,
        "parts": [
            (part, _head_of(part), inline_figure(drawn[part.name]) if part.name else "") for part in finding.parts
        ],
        "origin": _ORIGINS[finding.kind],
        "versions": f"ppafo {__version__}",
        "live": None if finding.live is None else finding.live(),
    }
    return render_page("finding.html.jinja", values).encode()


def _head_of(part: Section) -> list[str]:
    """Return the titles of a table; a unit in brackets at the end of one is not broken over two lines."""
    if not part.has_head:
        return []
    heads = [column.head for column in part.columns]
    return [_UNIT_IN_BRACKETS.sub(lambda unit: unit[0].replace(" ", "\N{NO-BREAK SPACE}"), head) for head in heads]


@in_units(_units_of)
def files_of(finding: Finding[Any]) -> dict[str, bytes]:
    """Return text, JSON, page, figures and further files of a finding by name; figures are drawn here."""
    drawn: dict[str, Mapping[str, bytes]] = {}
    for name, part in finding.figures.items():
        figure = part.drawn(finding.kind)
        drawn[name] = {"gif": figure} if isinstance(figure, bytes) else render_figure(figure, FORMATS)
    on_page = {name: formats.get("svg") or formats["gif"] for name, formats in drawn.items()}
    return {
        **{f"{name}.{form}": content for name, formats in drawn.items() for form, content in formats.items()},
        **{name: content() for name, content in finding.files.items()},
        f"{finding.name}.json": f"{json_text(finding.to_dict())}\n".encode(),
        f"{finding.name}.txt": f"{text_of(finding)}\n".encode(),
        REPORT: page_of(finding, on_page),
    }
