"""What a solved question can do, whichever it is: answer, draw, save, become plain data."""

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.answers.answer import Answer

if TYPE_CHECKING:
    import matplotlib.figure


class Solved:
    """What a solved question can do, whichever it is; ``answer_of`` in module ``answer`` of its folder answers it."""

    __slots__ = ()

    def answer(self) -> Answer:
        """Return the answer: sections for people, data for programs."""
        home = importlib.import_module(f"{type(self).__module__.rpartition('.')[0]}.answer")
        answer: Answer = home.answer_of(self)
        return answer

    def to_dict(self) -> dict[str, Any]:
        """Return what ``--json`` prints, as plain data in SI."""
        return dict(self.answer().data)

    def plot(self, name: str | None = None) -> "matplotlib.figure.Figure":
        """Return a figure of the answer, the first unless named; LookupError where it has none of that name."""
        figures = {figure.name: figure for figure in self.answer().figures}
        chosen = figures.get(name or next(iter(figures), ""))
        drawn = None if chosen is None else chosen.draw()
        if drawn is None or isinstance(drawn, bytes):
            raise LookupError(f"there is no figure '{name or ''}'; available: {', '.join(figures) or 'none'}")
        return drawn

    def save(self, folder: str | Path) -> None:
        """Write text, JSON, page and figures into a folder: absent, empty or an earlier answer, else DataError."""
        from ppafo.answers.writing import write_answer

        write_answer(self.answer(), Path(folder))
