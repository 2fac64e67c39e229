"""What an analysis found, as values: sentences, tables of columns, panels. SI until it is text.

A ``Finding`` is all that an analysis returns. Text, JSON, page, figures and folder are made of it in one place.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from ppafo.report import Answer, Cell, Figure, LivePart, Section, Table
from ppafo.report import Column as Head
from ppafo.report.solved import Solved
from ppafo.simulation.scenario import plain
from ppafo.studies.distributions import Interval
from ppafo.study.kind import PLAIN, Kind
from ppafo.study.panels import Panel, draw_panels

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table: title, kind of its numbers, and the cells in SI; ``is_change`` for differences of levels."""

    title: str
    values: Sequence[Cell | Interval]
    kind: Kind = PLAIN
    is_change: bool = False

    def _cell(self, value: Cell | Interval) -> Cell:
        if isinstance(value, float) and math.isnan(value):
            return None
        if not isinstance(value, Interval):
            return value
        return self.kind.change_interval(value) if self.is_change else self.kind.interval(value)

    @property
    def head(self) -> Head:
        """The head, as the writer of tables takes it."""
        return Head(self.title, self.kind.quantity, self.kind.form, self.is_change)

    @property
    def cells(self) -> list[Cell]:
        """The cells, as the writer of tables takes them."""
        return [self._cell(value) for value in self.values]


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a finding: what is said, a table, remarks below it, a figure of some panels, a text to copy.

    ``name`` is that of the files of the figure, ``across`` how many panels are side by side, ``size`` that of one
    [inches]. ``panels`` may be a function, called where the figure is wanted. A part that ``is_detail`` is on the page
    only.
    """

    heading: str = ""
    columns: Sequence[Column] = ()
    said: Sequence[str] = ()
    remarks: Sequence[str] = ()
    panels: Sequence[Panel] | Callable[[], Sequence[Panel]] = ()
    name: str = ""
    caption: str = ""
    across: int = 1
    size: tuple[float, float] = (6.6, 2.9)
    title: str = ""
    code: str = ""
    left: int = 1
    is_detail: bool = False

    def section(self) -> Section:
        """Return this part as the writer of pages takes it."""
        head = tuple(column.head for column in self.columns)
        rows = tuple(zip(*(column.cells for column in self.columns), strict=True))
        # A table whose columns have no title is a list of facts.
        table = Table(head if any(column.title for column in head) else (), rows, left=self.left) if rows else None
        figure = Figure(self.name, self.caption, self._draw) if self.name else None
        return Section(
            self.heading, tuple(self.said), table, tuple(self.remarks), figure, self.code, is_detail=self.is_detail
        )

    def _draw(self) -> Any:
        panels = self.panels() if callable(self.panels) else self.panels
        return draw_panels(panels, self.across, self.size, self.title)


@dataclass(frozen=True, slots=True, repr=False)
class Finding(Solved, Generic[T]):
    """What an analysis found: ``found`` are the numbers in SI, which are also its JSON; the rest says and shows them.

    A ``found`` that lies on the disk says its JSON itself, as ``json_document()``.
    ``name`` is the stem of its files and its command, unless ``command`` says another. ``passed`` is false where a
    check failed. ``live`` makes the part of the page that simulates.
    """

    name: str
    kicker: str
    title: str
    said: Sequence[str]
    parts: Sequence[Part]
    found: T
    passed: bool = True
    files: Mapping[str, Callable[[], bytes]] = field(default_factory=dict)
    command: str = ""
    live: Callable[[], LivePart | None] | None = None

    def answer(self) -> Answer:
        """Return the finding as the writer of text, pages and folders takes it."""
        document = getattr(self.found, "json_document", None)
        return Answer(
            name=self.name,
            kicker=self.kicker,
            title=self.title,
            lead=tuple(self.said),
            sections=tuple(part.section() for part in self.parts),
            data=plain(self.found) if document is None else document(),
            passed=self.passed,
            files=self.files,
            command=self.command,
            live=self.live,
        )
