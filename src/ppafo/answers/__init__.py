"""What a question came to, and the one way in which it becomes text, JSON, a page and a folder."""

from ppafo.answers.answer import Answer, Column, Figure, LivePart, Section, Table

__all__ = ["Answer", "Column", "Figure", "LivePart", "Section", "Table"]
