"""Claim of the paper with our value and its verdict, and statements of its text on a recording."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

from ppafo.parameters.publications.publication import paper_entries
from ppafo.report.writing import format_reported_quantity, quantity

Verdict = Literal[
    "consistent", "inconsistent_as_reported", "met_by_fitted_settings", "plausible", "undetermined", "not_testable"
]
VERDICTS: dict[Verdict, str] = {verdict: verdict.replace("_", " ") for verdict in get_args(Verdict)}
"""Verdicts on a claim, in words; only the first two follow from reported numbers alone."""
MEANINGS: dict[Verdict, str] = {
    "consistent": "the reported numbers agree with each other",
    "inconsistent_as_reported": "the reported numbers do not agree with each other",
    "met_by_fitted_settings": "simulated with settings chosen to meet this claim, which does not confirm them",
    "plausible": "simulated with assumed settings that were not chosen to meet this claim",
    "undetermined": "depends on settings that are not reported",
    "not_testable": "needs a measurement that is not published",
}


@dataclass(frozen=True, slots=True)
class Claim:
    """Claim of the paper, with the value computed by this package and the verdict.

    ``paper``, ``value``: published value and our value, both in ``unit``; None if not a single number
    ``words``, ``found``: text displayed in place of ``paper`` and ``value``; empty if not needed
    ``source``: page, section or equation of the paper
    ``assumptions``: assumptions of our value beyond the paper
    ``note``: reason of the verdict
    ``window``: range into which ``value`` must fall for this package to be sound; None for other claims
    ``range``: smallest and largest of our values over unknown quantities
    """

    id: str
    statement: str
    verdict: Verdict
    source: str
    note: str
    paper: float | None = None
    value: float | None = None
    unit: str = "-"
    assumptions: tuple[str, ...] = ()
    window: tuple[float, float] | None = None
    words: str = ""
    found: str = ""
    range: tuple[float, float] | None = None

    @property
    def published(self) -> str:
        """Published value of the claim as displayed text."""
        return self.words if self.paper is None else format_reported_quantity(self.paper, self.unit)

    @property
    def ours(self) -> str:
        """Value computed by this package for the claim, as displayed text."""
        return self.found or quantity(self.value, self.unit, 3)

    @property
    def is_missed(self) -> bool:
        """True if the claim has a window and our value is outside."""
        if self.window is None:
            return False
        return self.value is None or not self.window[0] <= self.value <= self.window[1]

    def document(self) -> dict[str, Any]:
        """Return the claim as plain data for ``claims.json``."""
        values = {name: getattr(self, name) for name in _DOCUMENT}
        return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}


_DOCUMENT = (
    *("id", "statement", "paper", "words", "value", "found", "range", "unit"),
    *("verdict", "assumptions", "source", "note"),
)
"""Fields of a claim in ``claims.json``, in order."""


@dataclass(frozen=True, slots=True)
class Observation:
    """Statement of the paper's text, with the verdict of the simulated recording and the numbers behind it.

    ``difference`` is a deviation of the recording from the text beyond the statement; empty if there is none.
    """

    id: str
    statement: str
    holds: bool
    evidence: str
    source: str
    difference: str = ""


def stated_claim(
    identifier: str,
    value: float | None,
    verdict: Verdict,
    note: str,
    assumptions: tuple[str, ...] = (),
    **more: Any,
) -> Claim:
    """Build the claim of an entry of the paper's file from the computed value, the verdict and further fields."""
    entry = paper_entries()[identifier]
    return Claim(
        id=identifier,
        statement=entry.statement,
        verdict=verdict,
        source=entry.where,
        note=note,
        paper=entry.published,
        value=value,
        unit=entry.unit or "-",
        assumptions=assumptions,
        words=entry.words,
        **more,
    )


def claim_on_text(
    identifier: str, statement: str, observations: Sequence[Observation], assumptions: tuple[str, ...]
) -> Claim:
    """Return a claim that summarises the paper's statements on a recording, one observation for each."""
    missing = [observation.id for observation in observations if not observation.holds]
    reserved = [observation for observation in observations if observation.holds and observation.difference]
    plain = len(observations) - len(missing) - len(reserved)
    notes = [f"Not shown: {', '.join(missing)}."] if missing else []
    notes += [f"With a reservation: {observation.id}, {observation.difference}." for observation in reserved]
    return Claim(
        id=identifier,
        statement=statement,
        value=float(plain),
        verdict="undetermined" if missing else "met_by_fitted_settings",
        source="; ".join(dict.fromkeys(observation.source for observation in observations)),
        note=" ".join((*notes, "Each statement with its numbers is listed below.")),
        assumptions=assumptions,
        words=f"{len(observations)} statements",
        found=f"{plain} shown, {len(reserved)} with a reservation" if reserved else f"{plain} shown",
    )


def observation(identifier: str, holds: bool, evidence: str, difference: str = "") -> Observation:
    """Return the observation for an entry of the paper's file; ``holds`` is the verdict of the recording."""
    entry = paper_entries()[identifier]
    return Observation(identifier, entry.statement, holds, evidence, entry.where, difference)


def verdict_counts(claims: Sequence[Claim]) -> dict[Verdict, int]:
    """Return the number of claims for each verdict, in the order of ``VERDICTS``."""
    return {verdict: sum(claim.verdict == verdict for claim in claims) for verdict in VERDICTS}


def count_sentence(verdicts: Sequence[Verdict]) -> str:
    """Return the numbers of verdicts in words, for example ``16 claims: 2 consistent, 3 inconsistent as reported``."""
    counts = ", ".join(f"{count} {words}" for key, words in VERDICTS.items() if (count := verdicts.count(key)))
    return f"{len(verdicts)} claims: {counts}"
