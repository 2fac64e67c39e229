"""What is in a parameter set, value by value."""

import textwrap
from typing import Any

from ppafo.parameters import ParameterSet

_WIDTH = 110
_SECTIONS = ("gas", "actuator", "friction", "foot_plate", "supply", "flow", "effects", "valves", "reported")
_COLUMNS = ("path", "value", "unit", "origin", "source")


def values_document(parameter_set: ParameterSet) -> dict[str, Any]:
    """Return every value of a set with its source, as plain data."""
    citation = parameter_set.citation
    entries = sorted(parameter_set.entries().items(), key=_section_order)
    return {
        "name": parameter_set.name,
        "title": parameter_set.title,
        "citation": None if citation is None else citation.model_dump(mode="json"),
        "notes": parameter_set.notes.strip(),
        "completed_by": parameter_set.completed_by,
        "parent": parameter_set.parent,
        "default_valve": parameter_set.default_valve,
        "valves": dict(parameter_set.valve_kinds),
        "actuator": parameter_set.actuator_kind,
        "values": [{"path": path, **entry.model_dump(mode="json")} for path, entry in entries],
        "accepted": dict(parameter_set.accepted),
    }


def _section_order(item: tuple[str, object]) -> int:
    """Sort by section only, so that within a section texts come first and numbers as they are declared."""
    return _SECTIONS.index(item[0].partition(".")[0])


def values_text(document: dict[str, Any]) -> str:
    """Return the table of ``values_document``."""
    lines = [f"{document['name']}: {document['title']}"]
    lines += textwrap.wrap(document["notes"], _WIDTH)
    if document["citation"] is not None:
        lines += ["", *textwrap.wrap(_citation(document["citation"]), _WIDTH)]
    valves = ", ".join(f"{name} ({kind})" for name, kind in document["valves"].items())
    lines += ["", f"valves: {valves}; default {document['default_valve']}; actuator: {document['actuator']}", ""]
    lines += _table(document["values"])
    for finding, reason in document["accepted"].items():
        lines += ["", *textwrap.wrap(f"accepted: {finding}: {reason}", _WIDTH, subsequent_indent="    ")]
    return "\n".join(lines)


def _citation(citation: dict[str, Any]) -> str:
    authors = ", ".join(citation["authors"])
    year = f" ({citation['year']})" if citation["year"] else ""
    doi = f" doi:{citation['doi']}" if citation["doi"] else ""
    return f"{authors}{': ' if authors else ''}{citation['title']}{year}.{doi} {citation['note']}".strip()


def _table(values: list[dict[str, Any]]) -> list[str]:
    """Return aligned rows, each followed by its note."""
    rows = [_cells(value) for value in values]
    widths = [max(len(row[column]) for row in (_COLUMNS, *rows)) for column in range(len(_COLUMNS))]
    lines = [_row(_COLUMNS, widths), _row(tuple("-" * width for width in widths), widths)]
    for value, row in zip(values, rows, strict=True):
        lines.append(_row(row, widths))
        lines += textwrap.wrap(value["note"], _WIDTH, initial_indent="    ", subsequent_indent="    ")
    return lines


def _cells(value: dict[str, Any]) -> tuple[str, ...]:
    number = value["value"]
    is_number = not isinstance(number, str | bool)
    written = f"{number:.6g}" if is_number else str(number).lower() if isinstance(number, bool) else number
    if value.get("uncertainty") is not None:
        written += f" +- {value['uncertainty']:.3g}"
    return (value["path"], written, value.get("unit", ""), value["origin"], value["source"])


def _row(cells: tuple[str, ...], widths: list[int]) -> str:
    return "  ".join(f"{cell:<{width}}" for cell, width in zip(cells, widths, strict=True)).rstrip()
