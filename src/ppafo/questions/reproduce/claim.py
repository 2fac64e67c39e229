"""One claim of the paper beside our number, with the verdict and what it rests on; one sentence of its text."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

Verdict = Literal["reproduced", "reproduced_with_assumptions", "shown_on_synthetic", "contradicted", "not_testable"]

VERDICTS: dict[Verdict, str] = {
    "reproduced": "reproduced",
    "reproduced_with_assumptions": "reproduced with assumptions",
    "shown_on_synthetic": "shown on synthetic data",
    "contradicted": "contradicted",
    "not_testable": "not testable",
}
"""Every verdict in words, from good to unknown."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A number that the paper states and ours, both in ``unit``; ``value`` None where there is nothing to compute.

    ``source`` is where the paper says it, ``assumptions`` what our number rests on beside the paper, ``note`` why the
    verdict is what it is. A claim that has to hold for this package to be sound has a window that it must fall into.
    ``is_synthetic`` says that our number comes from a measurement on the virtual rig, with the paper's values planted.
    Such a claim is at best ``shown_on_synthetic``: the procedure works, which says nothing about the paper's device.
    """

    id: str
    statement: str
    paper: float
    value: float | None
    unit: str
    verdict: Verdict
    source: str
    note: str
    assumptions: tuple[str, ...] = ()
    window: tuple[float, float] | None = None
    is_synthetic: bool = False

    def __post_init__(self) -> None:
        if (self.is_synthetic and self.verdict.startswith("reproduced")) or (
            self.verdict == "shown_on_synthetic" and not self.is_synthetic
        ):
            raise ValueError(f"{self.id}: '{self.verdict}' does not match synthetic = {self.is_synthetic}")

    @property
    def verdict_words(self) -> str:
        """The verdict in words, and that it rests on a synthetic measurement where the verdict does not say so."""
        words = VERDICTS[self.verdict]
        is_plain = not self.is_synthetic or self.verdict == "shown_on_synthetic"
        return words if is_plain else f"{words}, synthetic"

    @property
    def is_missed(self) -> bool:
        """True where the claim has a window and our number is not in it."""
        if self.window is None:
            return False
        return self.value is None or not self.window[0] <= self.value <= self.window[1]

    def document(self) -> dict[str, Any]:
        """Return the claim as plain data for ``claims.json``."""
        return {
            "id": self.id,
            "statement": self.statement,
            "paper": self.paper,
            "value": self.value,
            "unit": self.unit,
            "verdict": self.verdict,
            "synthetic": self.is_synthetic,
            "assumptions": list(self.assumptions),
            "source": self.source,
            "note": self.note,
        }


@dataclass(frozen=True, slots=True)
class Observation:
    """What the text tells, whether the simulated recording shows it, and the numbers that decide it.

    ``difference`` says what the recording shows beyond the sentence, where that is not what the paper tells.
    """

    id: str
    statement: str
    holds: bool
    evidence: str
    source: str
    difference: str = ""


def verdict_counts(claims: Sequence[Claim]) -> dict[Verdict, int]:
    """Return how many claims have each verdict, in the order of ``VERDICTS``."""
    return {verdict: sum(claim.verdict == verdict for claim in claims) for verdict in VERDICTS}


def count_sentence(claims: Sequence[Claim]) -> str:
    """Return how many claims have each verdict, for example ``18 claims: 3 reproduced, 4 contradicted``."""
    return count_words([claim.verdict for claim in claims])


def count_words(verdicts: Sequence[Verdict]) -> str:
    """Return the same of verdicts alone."""
    found = ", ".join(f"{count} {words}" for key, words in VERDICTS.items() if (count := verdicts.count(key)))
    return f"{len(verdicts)} claims: {found}"
