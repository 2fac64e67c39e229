"""Common reading of the text tables of motion analysis, ``.mot``, ``.sto`` and ``.trc``: lines, numbers, a clock."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ppafo.errors import DataError
from ppafo.signals.recording import Floats
from ppafo.storage.files import read_bytes, text_of
from ppafo.wording import one_line

LONGEST_SHOWN = 40
"""Characters of a cell that a message repeats."""
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)


def text_lines(path: str | Path) -> list[str]:
    """Return the lines of a text file, with any line ends; DataError where it is none.

    A table whose tabs a spreadsheet has saved as commas, and every line as wide as the widest, has its tabs again.
    """
    lines = text_of(read_bytes(path)).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    last = next((line.strip() for line in reversed(lines) if line.strip()), "")
    if "," not in last or any(" " in last or "\t" in line for line in lines):
        return lines
    return [line.replace(",", "\t").rstrip("\t") for line in lines]


def number_in(cell: str, line: int, label: str, gaps: Sequence[str] = ()) -> float:
    """Return the number in a cell, NaN for one of the texts in ``gaps``; DataError names line and column."""
    if cell.lower() in gaps:
        return float("nan")
    value = float(cell) if _NUMBER.fullmatch(cell) else float("nan")
    if not np.isfinite(value):
        shown = one_line(cell)[:LONGEST_SHOWN]
        raise DataError(
            f"line {line}, column {label!r}: {shown!r} is not a finite number; fill the gap or cut the file there"
        )
    return value


def check_growing(time: Floats, lines: Sequence[int]) -> None:
    """Refuse a time [s] that does not grow from row to row; ``lines`` are the lines of the rows in the file."""
    stalled = np.flatnonzero(np.diff(time) <= 0.0)
    if stalled.size:
        index = int(stalled[0]) + 1
        word = "stands still" if time[index] == time[index - 1] else "goes backwards"
        raise DataError(f"line {lines[index]}: the clock {word}: {time[index]:g} s follows {time[index - 1]:g} s")
