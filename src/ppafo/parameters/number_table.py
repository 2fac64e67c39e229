"""Table of numbers in a CSV file beside a parameter set: a header, and a line for each row; # begins a comment."""

from collections.abc import Sequence
from pathlib import Path

from ppafo.documents.regular_file import MAXIMUM_BYTES_TYPED, decoded, read_regular_file
from ppafo.errors import Faults, ParameterError
from ppafo.wording import finite_number, one_line, reason

LONGEST = 40
"""Maximum length of a cell in characters, in messages and as a number."""
NumberedLine = tuple[int, list[str]]
"""Number of a line in its file, and its cells."""


def lines_of_table(path: Path, file: str, header: str) -> list[NumberedLine]:
    """Return header and rows of a file, ``file`` in messages; ``header`` is an example of the first line.

    Raises ParameterError for a file that cannot be read, is empty, or has other separators than commas.
    """
    try:
        text = decoded(read_regular_file(path, MAXIMUM_BYTES_TYPED))
    except UnicodeDecodeError as error:
        raise ParameterError(f"{file}: is not a text file in UTF-8 (byte {error.start} is invalid)") from error
    except (OSError, ValueError) as error:
        raise ParameterError(f"{file}: cannot be read: {reason(error)}") from error
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
    if not lines:
        raise ParameterError(f"{file}: is empty; its first line must be '{header}'")
    if "," not in lines[0][1] and any(mark in lines[0][1] for mark in ";\t"):
        raise ParameterError(f"{file}: columns must be separated by commas")
    return [(number, [cell.strip().strip('"') for cell in line.split(",")]) for number, line in lines]


def numbers_of_table(rows: Sequence[NumberedLine], names: Sequence[str], file: str) -> list[list[float]]:
    """Return the numbers of all rows in the order of the columns ``names``. Raises ParameterError with all faults."""
    wrong = Faults()
    found = []
    for number, cells in rows:
        line = f"{file}, line {number}"
        with wrong:
            if len(cells) != len(names):
                raise ParameterError(f"{line}: has {len(cells)} values, the header has {len(names)}")
            found.append([_number(cell, f"{line}: {name}") for name, cell in zip(names, cells, strict=True)])
    wrong.raise_all()
    if not found:
        raise ParameterError(f"{file}: has a header but no rows of numbers")
    return found


def _number(cell: str, place: str) -> float:
    """Return the number of a cell. Raises ParameterError for one that is not finite."""
    number = finite_number(cell) if len(cell) <= LONGEST else None
    if number is None:
        raise ParameterError(f"{place} = '{one_line(cell)[:LONGEST]}' is not a finite number")
    return number
