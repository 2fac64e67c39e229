"""Faults of a document by path: refusal of all of them, with the line of each in the text of the file."""

import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import NoReturn

from ppafo.documents.toml_text import KEY_LINE
from ppafo.errors import Faults, PpafoError
from ppafo.wording import said_missing

_MAXIMUM_FAULTS = 5
_MEANT = re.compile(r"^unknown key .*, did you mean '(\w+)'\?")
_LONG_TEXT = re.compile(r"\"\"\".*?\"\"\"|'''.*?'''", re.DOTALL)


def refuse(faults: Mapping[str, str], place: str, error: type[PpafoError], line: Callable[[str], str]) -> NoReturn:
    """Raise ``error`` with faults by path, "" for a gap; ``line`` returns the place of a path in the file."""
    found = [error(f"{place}: {line(path)}{fault}") for path, fault in faults.items() if fault]
    # A key that is there under a wrong name is one mistake, not two.
    meant = [f"{path.rpartition('.')[0]}.{name}." for path, fault in faults.items() for name in _MEANT.findall(fault)]
    gaps = [
        path
        for path, fault in faults.items()
        if not fault and not f"{path}.".startswith(tuple(each.lstrip(".") for each in meant))
    ]
    wrong = found[:_MAXIMUM_FAULTS]
    if len(found) > _MAXIMUM_FAULTS:
        wrong.append(error(f"{place}: and {len(found) - _MAXIMUM_FAULTS} more like these"))
    Faults([*wrong, *([error(f"{place}: {said_missing(gaps)}")] if gaps else [])]).raise_all()
    raise AssertionError("without a fault there is nothing to refuse")


def line_of(text: str, path: str) -> str:
    """Return the place of a path in the text of a file, ``line 12: ``, else that of its table; empty without a text."""
    lines = _lines_in(text) if text else {}
    while path and path not in lines:
        path = path.rpartition(".")[0]
    return f"line {lines[path]}: " if path else ""


@lru_cache(maxsize=4)
def _lines_in(text: str) -> dict[str, int]:
    """Return the number of the line of each path in the text of a file; of a list of tables each has its number."""
    lines = dict[str, int]()
    table = ""
    for number, line in enumerate(_LONG_TEXT.sub(lambda found: "\n" * found[0].count("\n"), text).split("\n"), 1):
        if (found := KEY_LINE.match(line)) is None:
            continue
        name = re.sub(r"[\"'\s]", "", found["table"] or found["name"])
        if found["table"]:
            table = name
        if found["opens"] == "[[":
            lines.setdefault(name, number)
            count = 1
            while (table := f"{name}.{count}") in lines:
                count += 1
        lines.setdefault(table if found["table"] else f"{table}.{name}".lstrip("."), number)
    return lines
