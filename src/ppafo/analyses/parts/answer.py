"""Report of a catalogue of parts, or of a single part, with the origin of every figure."""

import textwrap
from dataclasses import dataclass
from typing import Any

from ppafo.documents.json_text import fields_of
from ppafo.parameters.parts import Catalogue, Part
from ppafo.report import finding
from ppafo.report.finding import Finding, columns_of
from ppafo.report.kind import Kind

_NO = "none"
_WIDTH = 110
"""Line length of the printed notes of a catalogue [characters]."""


@dataclass(frozen=True, slots=True)
class Parts:
    """Catalogue of parts, and the selected part; ``part`` is None for the whole catalogue."""

    catalogue: Catalogue
    part: Part | None

    def json_document(self) -> dict[str, Any]:
        """Return every figure of the parts, with its origin and source, as plain data."""
        chosen = self.catalogue.parts if self.part is None else (self.part,)
        return {
            "catalogue": self.catalogue.name,
            "parts": [
                {
                    **fields_of(part, "name", "group", "maker", "model", "document", "note"),
                    "kind": part.kind or None,
                    "figures": {name: figure.model_dump(mode="json") for name, figure in part.figures.items()},
                    "values": dict(part.values),
                    "unknown": list(part.unknown),
                }
                for part in chosen
            ],
        }


def finding_of_catalogue(catalogue: Catalogue) -> Finding[Parts]:
    """Return a catalogue as a finding: a table for each group, with mass, doubtful and unknown figures of each part."""
    # Notes are written over several lines of a file: how they were broken there means nothing.
    notes = "\n".join(textwrap.wrap(" ".join(catalogue.notes.split()), _WIDTH))
    head = ("part", "maker and model", ("mass", Kind(quantity="part mass")), "figures to check", "unknown figures")
    tables = []
    for group, members in catalogue.groups.items():
        rows = [
            (part.name, part.title, part.full_mass, ", ".join(part.doubtful) or _NO, _unknown_figures(part) or _NO)
            for part in members.values()
        ]
        tables.append(finding.Section(group.capitalize(), columns_of(head, rows), left=len(head)))
    return Finding(
        name="parts",
        kicker="Parts",
        title=catalogue.title,
        said=[f"{catalogue.name}: {catalogue.title}", *([notes] if notes else [])],
        parts=tables,
        found=Parts(catalogue, None),
        kind="measured",
    )


def _unknown_figures(part: Part) -> str:
    """Return the figures that the catalogue states as unknown, then those without a value, which count as ideal."""
    return ", ".join(dict.fromkeys((*part.unknown, *part.ideal)))


def finding_of_part(catalogue: Catalogue, part: Part) -> Finding[Parts]:
    """Return a part as a finding: a table of all figures as stated, with origin and source."""
    kind = f", {part.kind}" if part.kind else ""
    figures = [
        (name, f"{figure.value:.4g} {figure.unit}".rstrip(), figure.origin, figure.source)
        for name, figure in part.figures.items()
    ]
    remarks = [f"{name}: {figure.note}" for name, figure in part.figures.items() if figure.note]
    remarks += [f"unknown figures: {unknown}"] if (unknown := _unknown_figures(part)) else []
    head = ("figure", "value", "origin", "source")
    return Finding(
        name="parts",
        kicker="Parts",
        title=part.title,
        said=[f"{part.name}: {part.title} ({part.group}{kind})", *filter(None, (part.document, part.note))],
        parts=[finding.Section(columns=columns_of(head, figures), remarks=remarks, left=len(head))],
        found=Parts(catalogue, part),
        kind="measured",
    )
