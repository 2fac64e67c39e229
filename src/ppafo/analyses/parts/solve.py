"""Real parts of a catalogue, listed with the origin of every figure; what other analyses say of parts."""

import math
import textwrap
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from ppafo.arguments import Word, checked
from ppafo.errors import ParameterError, nearest_name
from ppafo.parameters.parts import Catalogue, Part, load_catalogue
from ppafo.parameters.parts.catalogue import DEFAULT
from ppafo.report import finding
from ppafo.report.finding import Finding, columns_of, facts
from ppafo.report.kind import Kind


@dataclass(frozen=True, slots=True)
class Parts:
    """Parts of a catalogue: one, or all where ``part`` is None."""

    catalogue: Catalogue
    part: Part | None

    def json_document(self) -> dict[str, Any]:
        """Return every figure of the parts, with its origin and source, as plain data."""
        chosen = self.catalogue.parts if self.part is None else (self.part,)
        return {
            "catalogue": self.catalogue.name,
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
                for part in chosen
            ],
        }


_WIDTH = 110
_HEAD = ("part", "maker and model", ("mass", Kind(quantity="part mass")), "figures to check", "not known")


@checked("part", "catalogue")
def parts(
    part: Annotated[str, Word("PART")] | None = None, *, catalogue: Annotated[str | Path, Word("FILE")] = DEFAULT
) -> Finding[Parts]:
    """List real parts with the origin of every figure.

    ParameterError for bad input.

    part: name of a part, for all its figures and their sources
    catalogue: a .toml file; default: the catalogue of the package

    >>> import ppafo
    >>> ppafo.parts("festo-mpye-5-m5-010-b").said[0]
    'festo-mpye-5-m5-010-b: Festo MPYE-5-M5-010-B (valves, proportional)'
    """
    loaded = load_catalogue(catalogue)
    named = {part.name: part for part in loaded.parts}
    if part is not None and part not in named:
        raise ParameterError(
            f"{loaded.file}: there is no part '{part}'{nearest_name(part, named)}; available: {', '.join(named)}"
        )
    chosen = None if part is None else named[part]
    if chosen is None:
        # Notes are written over several lines of a file: how they were broken there means nothing.
        notes = "\n".join(textwrap.wrap(" ".join(loaded.notes.split()), _WIDTH))
        said = [f"{loaded.name}: {loaded.title}", *([notes] if notes else [])]
        sections = []
        for group, members in loaded.groups.items():
            lists = ((part, ", ".join(part.doubtful), ", ".join(part.unknown)) for part in members.values())
            rows = [
                (part.name, part.title, part.full_mass, check or "-", unknown or "-") for part, check, unknown in lists
            ]
            sections.append(finding.Part(group.capitalize(), columns_of(_HEAD, rows), left=len(_HEAD)))
    else:
        kind = f", {chosen.kind}" if chosen.kind else ""
        said = [f"{chosen.name}: {chosen.title} ({chosen.group}{kind})", *filter(None, (chosen.document, chosen.note))]
        figures = [
            (name, f"{figure.value:.4g} {figure.unit}".rstrip(), figure.origin, figure.source)
            for name, figure in chosen.figures.items()
        ]
        remarks = [f"{name}: {figure.note}" for name, figure in chosen.figures.items() if figure.note]
        remarks += [f"not known: {', '.join(chosen.unknown)}"] if chosen.unknown else []
        head = ("figure", "value", "origin", "source")
        sections = [finding.Part(columns=columns_of(head, figures), remarks=remarks, left=4)]
    return Finding(
        name="parts",
        kicker="Parts",
        title=loaded.title if chosen is None else chosen.title,
        said=said,
        parts=sections,
        found=Parts(loaded, chosen),
        kind="measured",
    )


def parts_to_check(doubtful: Iterable[tuple[Part, str]]) -> list[finding.Part]:
    """Return which figures of parts are quoted or assumed, a row for each part; the page has the reasons too."""
    pairs = tuple(doubtful)
    if not pairs:
        return []
    # A row for each part, since a person orders parts; a reason for each figure, since each has its own.
    by_part: dict[str, list[str]] = {}
    reasons = []
    for part, name in pairs:
        figure, words = part.figures[name], name.replace("_", " ")
        by_part.setdefault(part.name, []).append(f"{words} ({figure.origin})")
        value = f"{figure.value:g} {figure.unit}".rstrip()
        reasons.append(f"{part.name}: {words} {value} is {figure.origin}: {figure.note or figure.source}")
    where = (
        "quoted from a document that was not itself consulted, or assumed; 'ppafo sets parts PART' gives the reasons"
    )
    return [
        finding.Part("Check before buying", facts((name, ", ".join(each)) for name, each in by_part.items()), [where]),
        finding.Part("Why these figures are uncertain", remarks=reasons, is_detail=True),
    ]


def doubts_data(doubtful: Iterable[tuple[Part, str]]) -> list[dict[str, Any]]:
    """Return figures that are quoted or assumed as they were given, with their parts."""
    return [
        {"part": part.name, "figure": name, **part.figures[name].model_dump(mode="json")} for part, name in doubtful
    ]


def rated_pressure(*parts: Part) -> float:
    """Return the highest pressure [Pa absolute] that all of some parts are made for; infinite where none states one."""
    return min(part.values.get("largest_pressure", math.inf) for part in parts)


def part_titles(parts: Iterable[Part]) -> finding.Part:
    """Return maker and model of parts, each once, for the page."""
    return finding.Part("Parts", facts({part.name: part.title for part in parts}.items()), is_detail=True)
