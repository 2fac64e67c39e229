"""Real parts of a catalogue, listed with the origin of every figure; what other answers say of doubtful figures."""

import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ppafo.errors import ParameterError, nearest_name
from ppafo.parameters.parts import Catalogue, Part, load_catalogue
from ppafo.parameters.parts.catalogue import DEFAULT
from ppafo.report import Answer, Column, Section, Table
from ppafo.report.solved import Solved


@dataclass(frozen=True, slots=True, repr=False)
class Parts(Solved):
    """Parts of a catalogue: one, or all where ``part`` is None."""

    catalogue: Catalogue
    part: Part | None


def parts(part: str | None = None, catalogue: str | Path = DEFAULT) -> Parts:
    """Return one part by name, or all parts, of a catalogue: one of the package by name, or a TOML file.

    ParameterError for bad input.
    """
    loaded = load_catalogue(catalogue)
    named = {item.name: item for item in loaded.parts}
    if part is not None and part not in named:
        raise ParameterError(
            f"{loaded.file}: there is no part '{part}'{nearest_name(part, named)}; available: {', '.join(named)}"
        )
    return Parts(loaded, None if part is None else named[part])


_WIDTH = 110
_HEAD = (
    Column("part"),
    Column("maker and model"),
    Column("mass", "part mass"),
    Column("figures to check"),
    Column("not known"),
)
_FIGURE_HEAD = tuple(map(Column, ("figure", "value", "origin", "source")))


def answer_of(found: Parts) -> Answer:
    """Return the answer about one part or a whole catalogue."""
    catalogue, part = found.catalogue, found.part
    chosen = catalogue.parts if part is None else (part,)
    notes = "\n".join(textwrap.wrap(" ".join(catalogue.notes.split()), _WIDTH))
    return Answer(
        name="parts",
        kicker="Parts",
        title=catalogue.title if part is None else part.title,
        lead=(f"{catalogue.name}: {catalogue.title}", *([notes] if notes else [])) if part is None else _lead(part),
        sections=_groups(catalogue.groups) if part is None else (_figures(part),),
        data={"catalogue": catalogue.name, "parts": [_part_data(item) for item in chosen]},
        kind="measured",
    )


def doubts_sections(doubtful: Iterable[tuple[Part, str]]) -> tuple[Section, ...]:
    """Return which figures of parts are quoted or assumed, a row for each part; the page has the reasons too."""
    pairs = tuple(doubtful)
    if not pairs:
        return ()
    by_part: dict[str, list[str]] = {}
    for part, name in pairs:
        by_part.setdefault(part.name, []).append(f"{name.replace('_', ' ')} ({part.figures[name].origin})")
    where = (
        "quoted from a document that was not itself consulted, or assumed; 'ppafo sets parts PART' gives the reasons"
    )
    rows = tuple((name, ", ".join(figures)) for name, figures in by_part.items())
    return (
        Section("Check before buying", (where,), Table((), rows)),
        Section("Why these figures are uncertain", remarks=tuple(_reason(*pair) for pair in pairs), is_detail=True),
    )


def doubts_data(doubtful: Iterable[tuple[Part, str]]) -> list[dict[str, Any]]:
    """Return figures that are quoted or assumed as they were given, with their parts."""
    return [{"part": part.name, "figure": name, **_figure_data(part, name)} for part, name in doubtful]


def titles_section(parts: Iterable[Part]) -> Section:
    """Return maker and model of parts, each once, for the page."""
    rows = {part.name: part.title for part in parts}
    return Section("Parts", table=Table((), tuple(rows.items())), is_detail=True)


def _reason(part: Part, name: str) -> str:
    figure = part.figures[name]
    value = f"{figure.value:g} {figure.unit}".rstrip()
    return f"{part.name}: {name.replace('_', ' ')} {value} is {figure.origin}: {figure.note or figure.source}"


def _groups(groups: Mapping[str, Mapping[str, Part]]) -> tuple[Section, ...]:
    return tuple(
        Section(group.capitalize(), table=Table(_HEAD, tuple(map(_row, parts.values())), left=len(_HEAD)))
        for group, parts in groups.items()
        if parts
    )


def _row(part: Part) -> tuple[str | float, ...]:
    return part.name, part.title, part.full_mass, ", ".join(part.doubtful) or "-", ", ".join(part.unknown) or "-"


def _lead(part: Part) -> tuple[str, ...]:
    kind = f", {part.kind}" if part.kind else ""
    return (f"{part.name}: {part.title} ({part.group}{kind})", *filter(None, (part.document, part.note)))


def _figures(part: Part) -> Section:
    rows = tuple(
        (name, f"{figure.value:.4g} {figure.unit}".rstrip(), figure.origin, figure.source)
        for name, figure in part.figures.items()
    )
    notes = [f"{name}: {figure.note}" for name, figure in part.figures.items() if figure.note]
    notes += [f"not known: {', '.join(part.unknown)}"] if part.unknown else []
    return Section(table=Table(_FIGURE_HEAD, rows, left=4), remarks=tuple(notes))


def _part_data(part: Part) -> dict[str, Any]:
    return {
        "name": part.name,
        "group": part.group,
        "kind": part.kind or None,
        "maker": part.maker,
        "model": part.model,
        "document": part.document,
        "note": part.note,
        "figures": {name: _figure_data(part, name) for name in part.figures},
        "values": dict(part.values),
        "unknown": list(part.unknown),
    }


def _figure_data(part: Part, name: str) -> dict[str, Any]:
    figure: dict[str, Any] = part.figures[name].model_dump(mode="json")
    return figure
