"""Other publications, run again: each claim judged by what its file says agrees with it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ppafo.answers.typesetting import format_printed_quantity, quantity
from ppafo.documents.toml_text import label
from ppafo.errors import ScenarioError, nearest_name
from ppafo.progress import Progress, Report
from ppafo.questions.reproduce.claim import Verdict
from ppafo.questions.reproduce.publication import FILE, Publication, PublishedClaim, load_publication

SEED, ALL = "ppafo-2011", "all"
"""The study of the paper that this package is made from, and all studies one after the other."""

_WORDS = {
    SEED: "the paper that this package starts from: step response and torque task",
    ALL: "every study, one table",
}


@dataclass(frozen=True, slots=True)
class JudgedClaim:
    """A claim of a publication with our number in its unit, None where nothing is computed, and the verdict."""

    claim: PublishedClaim
    value: float | None
    verdict: Verdict

    @property
    def published(self) -> str:
        """What is published, as it is shown."""
        entry = self.claim.entry
        return entry.words or format_printed_quantity(entry.published or 0.0, entry.unit or "-")

    @property
    def ours(self) -> str:
        """Our number as it is shown."""
        return quantity(self.value, self.claim.entry.unit or "-", 3)

    @property
    def note(self) -> str:
        """Why the verdict is what it is."""
        return self.claim.entry.note or self.claim.entry.not_testable

    def document(self, study: str) -> dict[str, Any]:
        """Return the claim as plain data for ``claims.json``."""
        entry = self.claim.entry
        return {
            "study": study,
            "id": entry.id,
            "statement": entry.statement,
            "paper": entry.published,
            "published": self.published,
            "value": self.value,
            "unit": entry.unit,
            "agrees_from": entry.at_least,
            "agrees_to": entry.at_most,
            "verdict": self.verdict,
            "synthetic": False,
            "computation": entry.computation,
            "arguments": dict(entry.arguments),
            "assumptions": list(entry.assumed),
            "source": self.claim.source,
            "note": self.note,
        }


@dataclass(frozen=True, slots=True)
class Study:
    """A publication and its judged claims."""

    publication: Publication
    claims: tuple[JudgedClaim, ...]


def study_names() -> tuple[str, ...]:
    """Return every name that ``--study`` takes."""
    return (SEED, *FILE.names(), ALL)


def list_studies() -> list[dict[str, Any]]:
    """Return name and subject of every study."""
    words = {name: load_publication(name).title for name in FILE.names()}
    return [{"name": name, "title": ({**_WORDS, **words})[name]} for name in study_names()]


def check_study(study: str, overrides: Sequence[str]) -> None:
    """Refuse a study that does not exist, and changed values with any but the paper's own; ScenarioError."""
    if study not in study_names() and Path(study).suffix != ".toml":
        known = ", ".join(study_names())
        hint = nearest_name(study, study_names())
        raise ScenarioError(f"there is no study '{label(study)}'{hint}; available: {known}, or give a .toml file")
    if overrides and study != SEED:
        raise ScenarioError(f"--set {overrides[0]}: goes with the study '{SEED}' only; leave --set or --study out")


def run_studies(study: str, report: Report) -> tuple[Study, ...]:
    """Return one study, or all but that of the paper, with every claim judged; ScenarioError, SimulationError."""
    names = FILE.names() if study == ALL else (study,)
    return tuple(_run(load_publication(name), report) for name in names)


def judge(claim: PublishedClaim) -> JudgedClaim:
    """Return a claim with our number and the verdict; SimulationError where a walk fails."""
    value, entry = claim.value(), claim.entry
    if value is None:
        return JudgedClaim(claim, None, "not_testable")
    low = entry.at_least is None or value >= entry.at_least
    high = entry.at_most is None or value <= entry.at_most
    held: Verdict = "reproduced_with_assumptions" if entry.assumed else "reproduced"
    return JudgedClaim(claim, value, held if low and high else "contradicted")


def _run(publication: Publication, report: Report) -> Study:
    claims = []
    for claim in publication.claims:
        report(Progress(f"{publication.name}: {claim.entry.id}"))
        claims.append(judge(claim))
    return Study(publication, tuple(claims))
