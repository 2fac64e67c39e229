"""Text tables of motion analysis (``.mot``, ``.sto``, ``.trc``): lines, numbers, duplicated names."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ppafo.errors import DataError
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import finite_number
from ppafo.storage.files import read_bytes, text_of
from ppafo.wording import LONGEST_SHOWN, count_of, one_line

_MOST_SAID = 3
"""Largest number of duplicated names with a separate remark."""


def text_lines(path: str | Path) -> list[str]:
    """Read the lines of a text file, with any line ends. Raises DataError for a file that is not text.

    If a spreadsheet replaced the tabs of a table by commas and padded all lines to equal width, tabs are restored.
    """
    lines = text_of(read_bytes(path)).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    last = next((line.strip() for line in reversed(lines) if line.strip()), "")
    if "," not in last or any(" " in last or "\t" in line for line in lines):
        return lines
    return [line.replace(",", "\t").rstrip("\t") for line in lines]


def number_in(cell: str, line: int, label: str, gaps: Sequence[str] = ()) -> float:
    """Parse the number in a cell, NaN for a text in ``gaps``. Raises DataError, with line and column, otherwise."""
    if cell.lower() in gaps:
        return float("nan")
    value = finite_number(cell)
    if value is None:
        shown = one_line(cell)[:LONGEST_SHOWN]
        raise DataError(
            f"line {line}, column {label!r}: {shown!r} is not a finite number; fill the gap or cut the file there"
        )
    return value


def told_apart(names: Sequence[str], descriptions: Sequence[str] = ()) -> list[str]:
    """Return unique column names: duplicates get their descriptions as names, or numbers ``NAME#2``.

    Descriptions are used only if all columns of a name have one and none equals another name.
    """
    counts = Counter(names)
    twins = {name: [index for index, other in enumerate(names) if other == name] for name in counts if counts[name] > 1}
    apart = list(names)
    for name, places in twins.items():
        said = [descriptions[index].strip() if index < len(descriptions) else "" for index in places]
        are_names = all(said) and len(set(said)) == len(said) and not set(said) & {*apart, *counts}
        for number, index in enumerate(places):
            apart[index] = said[number] if are_names else f"{name}#{number + 1}"
    return apart


def doubled(names: Sequence[str], apart: Sequence[str]) -> dict[str, list[str]]:
    """Return the unique replacements of each duplicated name; ``apart`` are the names from ``told_apart``."""
    twins: dict[str, list[str]] = {}
    for name, own in zip(names, apart, strict=True):
        if name != own:
            twins.setdefault(name, []).append(own)
    return twins


def without_copies(columns: Mapping[str, Floats], twins: Mapping[str, Sequence[str]]) -> dict[str, Floats]:
    """Merge columns of a duplicated name with equal values into a single column of that name."""
    same = {
        name: own
        for name, own in twins.items()
        if all(np.array_equal(columns[own[0]], columns[other], equal_nan=True) for other in own[1:])
    }
    copies = {other for own in same.values() for other in own}
    first = {own[0]: name for name, own in same.items()}
    return {first.get(name, name): values for name, values in columns.items() if name in first or name not in copies}


def said_of_doubled(twins: Mapping[str, Sequence[str]], left: Mapping[str, object], noun: str) -> list[str]:
    """Return a remark on each duplicated name whose columns all remain in ``left``; above a limit, only a count."""
    said = [
        f"several {noun} are named {one_line(name)[:LONGEST_SHOWN]!r}: they were renamed {', '.join(map(repr, own))}"
        for name, own in twins.items()
        if all(other in left for other in own)
    ]
    more = len(said) - _MOST_SAID
    if more > 0:
        said[_MOST_SAID:] = [f"{noun} of {count_of(more, 'more repeated name')} were renamed likewise"]
    return said
