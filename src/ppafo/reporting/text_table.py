"""Tables of text for a terminal."""

from collections.abc import Sequence

Rows = Sequence[Sequence[str]]


def text_table(head: Sequence[str], rows: Rows) -> list[str]:
    """Return aligned lines: the first column to the left, all others to the right."""
    everything = [list(head), *(list(row) for row in rows)]
    widths = [max(len(row[column]) for row in everything) for column in range(len(head))]
    return ["  ".join(_padded(row, widths)).rstrip() for row in everything]


def _padded(row: Sequence[str], widths: Sequence[int]) -> list[str]:
    first = f"{row[0]:<{widths[0]}}"
    return [first, *(f"{cell:>{width}}" for cell, width in zip(row[1:], widths[1:], strict=True))]
