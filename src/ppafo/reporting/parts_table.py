"""A catalogue of parts as text and as data."""

import textwrap
from collections.abc import Iterable
from typing import Any

from ppafo.parameters.parts import Catalogue, Part
from ppafo.reporting.shown_values import aligned_rows, shown_number, shown_value

_WIDTH = 110
_HEAD = ("part", "maker and model", "mass", "figures to look up", "not known")


def parts_lines(catalogue: Catalogue) -> list[str]:
    """Return one table a group, with what is quoted or assumed and what nobody could name."""
    lines = [f"{catalogue.name}: {catalogue.title}", *textwrap.wrap(" ".join(catalogue.notes.split()), _WIDTH)]
    for group, parts in catalogue.groups.items():
        if parts:
            rows = [_HEAD, *(_row(part) for part in parts.values())]
            lines += ["", group, *(f"  {line}" for line in aligned_rows(rows, left=len(_HEAD)))]
    return lines


def part_lines(part: Part) -> list[str]:
    """Return all that is known of a part, figure by figure."""
    kind = f", {part.kind}" if part.kind else ""
    lines = [f"{part.name}: {part.title} ({part.group}{kind})"]
    lines += [text for text in (part.document, part.note) if text]
    rows = [("figure", "value", "origin", "source")]
    rows += [
        (name, f"{shown_number(figure.value)} {figure.unit}".rstrip(), figure.origin, figure.source)
        for name, figure in part.figures.items()
    ]
    lines += ["", *aligned_rows(rows, left=4)]
    for name, figure in part.figures.items():
        lines += textwrap.wrap(f"{name}: {figure.note}", _WIDTH, subsequent_indent="    ") if figure.note else []
    if part.unknown:
        lines += ["", f"not known: {', '.join(part.unknown)}"]
    return lines


def parts_document(catalogue: Catalogue, parts: Iterable[Part]) -> dict[str, Any]:
    """Return parts as data: figures as given, and values in SI units."""
    return {
        "catalogue": catalogue.name,
        "parts": [
            {
                "name": part.name,
                "group": part.group,
                "kind": part.kind or None,
                "maker": part.maker,
                "model": part.model,
                "document": part.document,
                "note": part.note,
                "figures": {name: figure.model_dump(mode="json") for name, figure in part.figures.items()},
                "values": dict(part.values),
                "unknown": list(part.unknown),
            }
            for part in parts
        ],
    }


def _row(part: Part) -> tuple[str, ...]:
    mass = shown_value(part.full_mass, "kg")
    return part.name, part.title, mass, ", ".join(part.doubtful) or "-", ", ".join(part.unknown) or "-"
