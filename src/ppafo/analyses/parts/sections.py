"""Report sections on the parts of a device: the parts, and the figures to check.

A doubtful figure is a pair of a part and the name of a figure that is quoted or assumed.
"""

from collections.abc import Iterable
from typing import Any

from ppafo.parameters.parts import Part
from ppafo.report import finding
from ppafo.report.finding import facts


def part_titles(parts: Iterable[Part]) -> finding.Section:
    """Return a section with maker and model of each part, without duplicates, for the page."""
    return finding.Section("Parts", facts({part.name: part.title for part in parts}.items()), is_detail=True)


def parts_to_check(doubtful: Iterable[tuple[Part, str]], used: Iterable[Part]) -> list[finding.Section]:
    """Return the sections on figures to check before buying: unknown ones of the ``used`` parts, and doubtful ones.

    A line for each part names the unknown figures that count as ideal: no delay, no dead band, no pressure limit. The
    table of doubtful figures has a row for each part; the page also has the reason for each of these figures.
    """
    unknown = [
        f"{part.name}: {', '.join(part.ideal).replace('_', ' ')} unknown, taken as ideal"
        for part in {(part.group, part.name): part for part in used}.values()
        if part.ideal
    ]
    sections = [finding.Section("Unknown data of the parts", remarks=unknown)] if unknown else []
    pairs = tuple(doubtful)
    if not pairs:
        return sections
    # A row for each part, since a person orders parts; a reason for each figure, since each has its own.
    figures_by_part: dict[str, list[str]] = {}
    reasons = []
    for part, name in pairs:
        figure, words = part.figures[name], name.replace("_", " ")
        figures_by_part.setdefault(part.name, []).append(f"{words} ({figure.origin})")
        value = f"{figure.value:g} {figure.unit}".rstrip()
        reasons.append(f"{part.name}: {words} {value} is {figure.origin}: {figure.note or figure.source}")
    rows = facts((name, ", ".join(figures)) for name, figures in figures_by_part.items())
    meaning = "quoted from a secondary source, or assumed; 'ppafo sets parts PART' gives the reasons"
    return [
        *sections,
        finding.Section("Check before buying", rows, [meaning]),
        finding.Section("Why these figures are uncertain", remarks=reasons, is_detail=True),
    ]


def doubts_data(doubtful: Iterable[tuple[Part, str]]) -> list[dict[str, Any]]:
    """Return doubtful figures as plain data: part, name, and figure as stated."""
    return [
        {"part": part.name, "figure": name, **part.figures[name].model_dump(mode="json")} for part, name in doubtful
    ]
