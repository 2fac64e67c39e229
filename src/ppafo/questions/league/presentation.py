"""What the presentation of a league's task consists of: columns, sentences, data of its own, the look of its figure."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ppafo.answers.answer import Cell, Column
from ppafo.questions.league.solve import League
from ppafo.questions.league.standing import Robustness, Standing


@dataclass(frozen=True, slots=True)
class TableColumn:
    """A column of the table, and what stands in it [SI]."""

    column: Column
    cell: Callable[[League, Standing], Cell]


@dataclass(frozen=True, slots=True)
class Look:
    """The figure: size and left of the legend, axes in words, the measure across, and how far the bound is drawn.

    ``is_logarithmic`` gas is drawn with the bound going on beyond its minimum error; else gas begins at 0, and a line
    from each mark leads down to the minimum gas of its own.
    """

    size: tuple[float, float]
    right: float
    error: str
    error_label: str
    gas_label: str
    title: str
    is_logarithmic: bool


@dataclass(frozen=True, slots=True)
class Presentation:
    """How the league of a task is presented; each function gives what this task has and others have not."""

    format: str
    introduction: str
    caption: str
    draws_remark: str
    look: Look
    columns: tuple[TableColumn, ...]
    task_data: Callable[[League], dict[str, Any]]
    task_remarks: Callable[[League], Sequence[str]]
    bound_sentence: Callable[[str, Any], str]
    bound_data: Callable[[Any], dict[str, Any]]
    standing_data: Callable[[League, Standing], dict[str, Any]]
    standing_remarks: Callable[[League, Standing], Sequence[str]]
    robustness_data: Callable[[Robustness], dict[str, Any]]


def measure(title: str, name: str, quantity: str = "", form: str = ".4g") -> TableColumn:
    """Return the column of a measure."""
    return TableColumn(Column(title, quantity, form), lambda _, standing: standing.measures.get(name))


def of_draws(title: str, quantity: str, form: str, value: Callable[[Robustness], float]) -> TableColumn:
    """Return a column of what the draws gave; nothing without draws."""
    return TableColumn(
        Column(title, quantity, form),
        lambda _, standing: None if standing.robustness is None else value(standing.robustness),
    )
