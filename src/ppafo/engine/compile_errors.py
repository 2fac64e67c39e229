"""The compiler's many lines about a generated program, as one line about the file that a user wrote."""

import linecache
import re
from collections.abc import Callable
from typing import NamedTuple

from ppafo.engine.plain_python import refusal
from ppafo.engine.source_text import ORIGIN
from ppafo.errors import ProgramError, nearest_name, one_line

_LINE = re.compile(r'File ".*?", line (\d+):')
_ORIGIN = re.compile(rf"{re.escape(ORIGIN)} (?P<file>.*): (?P<lines>[\d ]+)$")
_ROW = re.compile(r"^(\w+) = namedtuple\('\w+', (\[.*\])\)$", re.MULTILINE)
_LONGEST = 300
_SIGNS = {"add": "+", "sub": "-", "mul": "*", "truediv": "/", "floordiv": "//", "mod": "%", "pow": "**", "neg": "-"}
_SIGNS |= {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="}


class Place(NamedTuple):
    """The line of a user's file where a statement begins, and the line where the next one does."""

    file: str
    line: int
    next_line: int


class Report(NamedTuple):
    """What the compiler said, the generated text, the line of it that is at fault, and that line as it was written."""

    said: str
    source: str
    text: str
    written: str


def mistake(said: str, source: str) -> ProgramError:
    """Return the error for a program that the compiler refused with a report of many lines."""
    lines = source.split("\n")
    numbers = [int(number) for number in _LINE.findall(said.partition("During:")[0] or said) or _LINE.findall(said)]
    # The first is the innermost; several are the ways through one function, in an order that changes.
    number = min(numbers, default=0)
    text = lines[number - 1].strip() if 0 < number <= len(lines) else ""
    found = place_in(lines, number) or _find_called(lines, text)
    if found is None:
        return ProgramError(
            f"the model cannot be compiled: {_problem(Report(said=said, source=source, text=text, written=text))}"
        )
    written = linecache.getline(found.file, found.line).strip()
    problem = _problem(Report(said=said, source=source, text=text, written=written or text))
    return refusal(found.file, _line_of(said, found), problem)


def place_in(lines: list[str], number: int) -> Place | None:
    """Where line ``number`` of a generated text comes from; None for lines that belong to no function of a file."""
    for start in range(min(number, len(lines)) - 1, -1, -1):
        origin = _ORIGIN.match(lines[start])
        if origin is None:
            if lines[start].startswith("@njit(") and start + 1 < number and not lines[start - 1].startswith(ORIGIN):
                return None
            continue
        at = [int(item) for item in origin["lines"].split()]
        index = number - 1 - (start + 2)
        if not 0 <= index < len(at) - 1:
            return None
        return Place(origin["file"], at[index], min(line for line in at if line > at[index]))
    return None


def _find_called(lines: list[str], text: str) -> Place | None:
    """Where the last function of a file that is called in a line of the loop was defined."""
    for name in reversed(re.findall(r"\w+", text)):
        for number, line in enumerate(lines, 1):
            if line.startswith(f"def {name}("):
                return place_in(lines, number)
    return None


def _line_of(report: str, place: Place) -> int:
    """The line of the statement on which the name that the report is about stands."""
    unknown = re.search(r"Unknown attribute '(\w+)'", report)
    if unknown:
        for line in range(place.line, place.next_line):
            if re.search(rf"\.\s*{unknown[1]}\b", linecache.getline(place.file, line)):
                return line
    return place.line


def _problem(report: Report) -> str:
    tellers: tuple[Callable[[Report], str], ...] = (_attribute, _returns, _operator, _arguments, _unpack)
    for teller in tellers:
        problem = teller(report)
        if problem:
            return problem
    lines = [line.strip() for line in report.said.splitlines() if line.strip()]
    lines = [line for line in lines if not line.startswith(("Failed in nopython", "During:", "File ", "- Resolution"))]
    where = f"'{report.written}' cannot be compiled: " if report.written else ""
    return where + one_line(lines[0] if lines else "no reason given")[:_LONGEST]


def _attribute(report: Report) -> str:
    found = re.search(r"Unknown attribute '(\w+)' of type (.+)", report.said)
    if found is None:
        return ""
    name, kind = found.groups()
    if kind.startswith("Module"):
        return f"'math.{name}' cannot be compiled"
    owner = re.search(rf"([\w.]+)\.{name}\b", report.text)
    what = owner[1] if owner else "it"
    fields = _fields(report.source, kind)
    hint = nearest_name(name, fields) or (f"; it has {', '.join(fields)}" if fields else "")
    return f"{what} has no '{name}'{hint}" if fields else f"{what} is {kind_of(kind)} and has no '{name}'"


def _fields(source: str, kind: str) -> list[str]:
    rows = {name: fields for name, fields in _ROW.findall(source)}
    return re.findall(r"\w+", rows.get(kind.partition("(")[0], ""))


def _returns(report: Report) -> str:
    found = re.search(r"Can't unify return type from the following types: (.+)", report.said)
    if found is None:
        return ""
    kinds = sorted({kind_of(kind) for kind in _split(found[1])})
    return f"the ways through the function return different things: {' or '.join(kinds)}"


def _operator(report: Report) -> str:
    found = re.search(r">>> (\w+)\((.*)\)", report.said)
    if found is None or "No implementation of function" not in report.said:
        return ""
    name, kinds = found[1], [kind_of(kind) for kind in _split(found[2])]
    what = f"'{_SIGNS[name]}'" if name in _SIGNS else f"{name}()"
    return f"{what} cannot be compiled for {' and '.join(kinds)}, in '{report.written}'"


def _arguments(report: Report) -> str:
    found = re.search(r"to signature '\((.*)\)' due to \"TypeError: (.+)\"", report.said)
    if found is None:
        return ""
    called = re.search(r"def (\w+)", report.written)
    given = re.search(r"\w(\([^=]*\))$", report.text)
    engine = f"the engine calls it with {given[1]}: " if called and given else ""
    name = called[1] if called else report.written
    return f"{name}({found[1]}): {engine}{found[2].rstrip('.')}"


def _unpack(report: Report) -> str:
    found = re.search(
        r"failed to unpack (.+)|Tuple '.*' length (?:mismatch|does not match)|wrong tuple length", report.said
    )
    if found is None:
        return ""
    kind = f", not {kind_of(found[1])}" if found[1] else ""
    return f"'{report.written}' needs as many values as there are names{kind}"


def kind_of(kind: str) -> str:
    """A type as the compiler writes it, in words."""
    kind = kind.strip()
    if re.match(r"(Literal\[int\]|u?int|float|bool)", kind):
        return "a number"
    if kind.startswith(("Tuple", "UniTuple")):
        return "a tuple"
    if kind.startswith("none") or kind == "None":
        return "nothing"
    named = re.match(r"\w+(?=\()", kind)
    return f"a {named[0].rpartition('_')[2]}" if named else kind


def _split(kinds: str) -> list[str]:
    """Types that stand between commas, of which some have commas in them."""
    parts, depth = [""], 0
    for character in kinds:
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(character, 0)
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return parts
