"""What an analysis found, and the one way in which it becomes text, JSON, a page and a folder."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import matplotlib.figure

    from ppafo.report.finding import Finding, LivePart

Cell = str | float | None
"""A number in SI, a text, or None where there is nothing to say."""


@dataclass(frozen=True, slots=True)
class Column:
    """The head of a column: its title, the kind of quantity below it (``display_units.QUANTITIES``), its number format.

    A column without a quantity holds plain numbers and texts. ``is_change`` is true for differences of two levels.
    """

    title: str
    quantity: str = ""
    form: str = ".4g"
    is_change: bool = False


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of cells below a head; a table without a head is a list of facts: name and value.

    ``marked`` are the numbers of the rows that stand out. The first ``left`` columns are names, set to the left.
    """

    head: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    marked: tuple[int, ...] = ()
    left: int = 1


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure that is drawn only when it is wanted: the stem of its files, its caption, what draws it.

    What draws may return the bytes of an animation (GIF) instead.
    """

    name: str
    caption: str
    draw: "Callable[[], matplotlib.figure.Figure | bytes]"


@dataclass(frozen=True, slots=True)
class Section:
    """A part of an answer: paragraphs, a table, remarks below it, a figure, a text to copy such as commands or TOML.

    A section that ``is_detail`` is on the page only.
    """

    heading: str = ""
    paragraphs: tuple[str, ...] = ()
    table: Table | None = None
    remarks: tuple[str, ...] = ()
    figure: Figure | None = None
    code: str = ""
    is_detail: bool = False


@dataclass(frozen=True, slots=True)
class Answer:
    """What an analysis found.

    ``name`` is the stem of its files, and the command's name unless ``command`` says another; ``kicker`` says above
    the title what kind of page this is. ``lead`` are the first paragraphs. ``data`` is plain and in SI. ``passed`` is
    false where a check failed. ``kind`` says where the numbers come from: ``simulated``, ``synthetic`` or ``measured``.
    ``files`` are further files by name. ``page`` makes a page of its own from the drawn figures. ``live`` makes the
    part of the page that simulates, None where there can be none.
    """

    name: str
    kicker: str
    title: str
    lead: tuple[str, ...]
    sections: tuple[Section, ...]
    data: Mapping[str, Any]
    passed: bool = True
    kind: Any = "simulated"
    files: Mapping[str, Callable[[], bytes]] = field(default_factory=dict)
    command: str = ""
    page: Callable[[Mapping[str, bytes]], bytes] | None = None
    live: "Callable[[], LivePart | None] | None" = None

    def finding(self) -> "Finding[Any]":
        """Return it in the form that is written."""
        from ppafo.report.finding import Finding, Part, columns_of
        from ppafo.report.kind import Kind

        parts = []
        for item in self.sections:
            table, figure = item.table, item.figure
            titles: list[Any] = []
            if table is not None:
                titles = [(head.title, Kind("", "", head.quantity, head.form)) for head in table.head]
                titles = titles or [""] * len(table.rows[0] if table.rows else ())
            parts.append(
                Part(
                    item.heading,
                    [] if table is None else columns_of(titles, table.rows),
                    item.paragraphs,
                    item.remarks,
                    name="" if figure is None else figure.name,
                    caption="" if figure is None else figure.caption,
                    draw=None if figure is None else figure.draw,
                    code=item.code,
                    left=1 if table is None else table.left,
                    marked=() if table is None else table.marked,
                    is_detail=item.is_detail,
                )
            )
        return Finding(
            self.name,
            self.kicker,
            self.title,
            self.lead,
            parts,
            self.data,
            self.passed,
            self.files,
            self.command,
            self.live,
            self.kind,
            self.page,
        )


__all__ = ["Answer", "Cell", "Column", "Figure", "Section", "Table"]
