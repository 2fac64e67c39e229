"""One claim of the paper beside our number, with the verdict and what it rests on."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

Verdict = Literal["reproduced", "reproduced_with_assumptions", "contradicted", "not_testable"]

VERDICTS: dict[Verdict, str] = {
    "reproduced": "reproduced",
    "reproduced_with_assumptions": "reproduced with assumptions",
    "contradicted": "contradicted",
    "not_testable": "not testable",
}
"""Every verdict in words, from good to unknown."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A number that the paper states and ours, both in ``unit``; ``value`` None where there is nothing to compute.

    ``source`` is where the paper says it, ``assumptions`` what our number rests on beside the paper, ``note`` why the
    verdict is what it is. A claim that has to hold for this package to be sound has a window that it must fall into.
    ``is_synthetic`` says that our number comes from a measurement on the virtual rig: it shows that the procedure
    works, and nothing about the paper's device.
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

    @property
    def verdict_words(self) -> str:
        """The verdict in words, and that it rests on a synthetic measurement where it does."""
        words = VERDICTS[self.verdict]
        return f"{words.removeprefix('reproduced ')}, synthetic" if self.is_synthetic else words

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


def verdict_counts(claims: Sequence[Claim]) -> dict[Verdict, int]:
    """Return how many claims have each verdict, in the order of ``VERDICTS``."""
    return {verdict: sum(claim.verdict == verdict for claim in claims) for verdict in VERDICTS}
