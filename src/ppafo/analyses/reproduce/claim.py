"""Claim of a publication with our value and its verdict, and statements of the paper's text on a recording."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from ppafo.documents.json_text import fields_of
from ppafo.parameters.publications.publication import ClaimEntry, paper_entries
from ppafo.report.writing import format_reported_quantity, quantity

Verdict = Literal[
    "consistent", "inconsistent_as_reported", "met_by_fitted_settings", "plausible", "undetermined", "not_testable"
]
VERDICTS: dict[Verdict, str] = {verdict: verdict.replace("_", " ") for verdict in get_args(Verdict)}
"""Verdicts on a claim, in words; only the first two follow from reported numbers alone."""
MEANINGS: dict[Verdict, tuple[str, str]] = {
    "consistent": ("✓", "the reported numbers agree with each other"),
    "inconsistent_as_reported": ("✗", "the reported numbers do not agree with each other"),
    "met_by_fitted_settings": ("≈", "simulated with settings chosen to meet this claim, which does not confirm them"),
    "plausible": ("~", "simulated with assumed settings that were not chosen to meet this claim"),
    "undetermined": ("?", "depends on settings that are not reported"),
    "not_testable": ("○", "needs a measurement that is not published"),
}
"""Symbol and meaning of each verdict."""


@dataclass(frozen=True, slots=True)
class Claim:
    """Claim of a publication, with the value computed by this package and the verdict.

    ``entry``: the statement, with its number or words and the range in which it holds
    ``value``: our value in the unit of the entry; None if it is no single number, or not computed
    ``note``: reason of the verdict
    ``assumptions``: assumptions of our value beyond the publication
    ``found``: text displayed in place of ``value``; empty if not needed
    ``range``: smallest and largest of our values over unknown quantities
    ``citation``: publication; empty for the paper
    ``arguments``: arguments of the computation [SI]
    """

    entry: ClaimEntry
    verdict: Verdict = "not_testable"
    value: float | None = None
    note: str = ""
    assumptions: tuple[str, ...] = ()
    found: str = ""
    range: tuple[float, float] | None = None
    citation: str = ""
    arguments: Mapping[str, float] = field(default_factory=dict)

    @property
    def source(self) -> str:
        """Publication, unless it is the paper, with page, section or equation."""
        return ", ".join(filter(None, (self.entry.source or self.citation, self.entry.where)))

    @property
    def published(self) -> str:
        """Published value as displayed text with its direction; empty for a computation of our own."""
        entry = self.entry
        number = "" if entry.published is None else format_reported_quantity(entry.published, entry.unit or "-")
        return f"up to {number}" if number and entry.direction == "maximum" else entry.words or number

    @property
    def ours(self) -> str:
        """Value computed by this package for the claim, as displayed text."""
        return self.found or quantity(self.value, self.entry.unit or "-", 3)

    @property
    def limits(self) -> tuple[float, float]:
        """Range in which the claim holds, in its unit; a side that the file leaves open is infinite."""
        low, high = self.entry.at_least, self.entry.at_most
        return -math.inf if low is None else low, math.inf if high is None else high

    @property
    def is_missed(self) -> bool:
        """True if the range of the claim is closed and our value is outside."""
        low, high = self.limits
        return math.isfinite(high - low) and (self.value is None or not low <= self.value <= high)

    def document(self) -> dict[str, Any]:
        """Return the claim as plain data for ``claims.json``."""
        entry = self.entry
        return {
            **fields_of(entry, "id", "statement", "direction", "words", "own", "unit", "computation", "arguments"),
            **fields_of(self, "published", "value", "found", "range", "verdict", "assumptions", "note", "source"),
            "paper": entry.published,
            "agrees_from": entry.at_least,
            "agrees_to": entry.at_most,
        }


@dataclass(frozen=True, slots=True)
class Observation:
    """Statement of the paper's text, with the verdict of the simulated recording and the numbers behind it.

    ``difference`` is a deviation of the recording from the text beyond the statement; empty if there is none.
    """

    entry: ClaimEntry
    holds: bool
    evidence: str
    difference: str = ""


def claim_on_text(identifier: str, observations: Sequence[Observation], assumptions: tuple[str, ...]) -> Claim:
    """Return a claim that summarises the paper's statements on a recording, one observation for each."""
    missing = [observation.entry.id for observation in observations if not observation.holds]
    reserved = [observation for observation in observations if observation.holds and observation.difference]
    plain = len(observations) - len(missing) - len(reserved)
    notes = [f"Not shown: {', '.join(missing)}."] if missing else []
    notes += [f"With a reservation: {observation.entry.id}, {observation.difference}." for observation in reserved]
    return Claim(
        paper_entries()[identifier],
        "undetermined" if missing else "met_by_fitted_settings",
        float(plain),
        " ".join((*notes, "Each statement with its numbers is listed below.")),
        assumptions,
        f"{plain} shown, {len(reserved)} with a reservation" if reserved else f"{plain} shown",
    )


def observation(identifier: str, holds: bool, evidence: str, difference: str = "") -> Observation:
    """Return the observation for an entry of the paper's file; ``holds`` is the verdict of the recording."""
    return Observation(paper_entries()[identifier], holds, evidence, difference)


def verdict_counts(claims: Sequence[Claim]) -> dict[Verdict, int]:
    """Return the number of claims for each verdict, in the order of ``VERDICTS``."""
    return {verdict: sum(claim.verdict == verdict for claim in claims) for verdict in VERDICTS}


def count_sentence(claims: Sequence[Claim]) -> str:
    """Return the numbers of verdicts in words, for example ``16 claims: 2 consistent, 3 inconsistent as reported``."""
    counts = ", ".join(f"{count} {VERDICTS[verdict]}" for verdict, count in verdict_counts(claims).items() if count)
    return f"{len(claims)} claims: {counts}"
