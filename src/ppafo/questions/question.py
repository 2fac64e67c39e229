"""What a question can do once it is solved, whichever it is."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.answers import Answer

if TYPE_CHECKING:
    import matplotlib.figure


class Solved:
    """What a solved question can do, whichever it is; ``answer_of`` of the module that defines its class answers it."""

    __slots__ = ()

    def answer(self) -> Answer:
        """Return the answer: sections for people, data for programs."""
        answer: Answer = sys.modules[type(self).__module__].answer_of(self)
        return answer

    def __str__(self) -> str:
        """Return what the command prints."""
        from ppafo.answers.writing import text_of

        return text_of(self.answer())

    def __repr__(self) -> str:
        """Return the class and the title of the answer."""
        return f"<{type(self).__name__}: {self.answer().title}>"

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
