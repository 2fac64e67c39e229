"""What a result can do, whichever it is: print, JSON, figures, a folder."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.report import Answer

if TYPE_CHECKING:
    import matplotlib.figure


class Solved:
    """What a result can do, whichever it is; ``answer_of`` of the module that defines its class lays it out."""

    __slots__ = ()

    def answer(self) -> Answer:
        """Return the result laid out: sections for people, data for programs."""
        answer: Answer = sys.modules[type(self).__module__].answer_of(self)
        return answer

    def __str__(self) -> str:
        """Return what the command prints."""
        from ppafo.report.writing import text_of

        return text_of(self.answer().finding())

    def __repr__(self) -> str:
        """Return the class and the title of the result."""
        return f"<{type(self).__name__}: {self.answer().title}>"

    def _repr_html_(self) -> str:
        """Return the page, which a notebook shows."""
        from ppafo.report.writing import notebook_of

        return notebook_of(self.answer().finding())

    def to_dict(self) -> dict[str, Any]:
        """Return what ``--json`` prints, as plain data in SI."""
        return dict(self.answer().data)

    def plot(self, name: str | None = None) -> "matplotlib.figure.Figure":
        """Return a figure of the result, the first unless named; LookupError where it has none of that name."""
        return self.answer().finding().plot(name)

    def save(self, folder: str | Path) -> None:
        """Write text, JSON, page and figures into a folder: absent, empty or an earlier result, else DataError."""
        self.answer().finding().save(folder)
