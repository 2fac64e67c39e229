"""The paper's claims as a table of text, for a terminal."""

from collections.abc import Sequence

from ppafo.reporting.typesetting import printed_quantity, quantity
from ppafo.studies.reproduction.claim import VERDICTS, Claim, verdict_counts

_HEAD = ("claim", "paper", "ours", "verdict")
_NOTHING = "-"


def claims_table(claims: Sequence[Claim]) -> list[str]:
    """Return aligned lines, at most 100 characters wide: claim, the paper's number, ours, verdict; then the counts."""
    rows = [_row(claim) for claim in claims]
    widths = [max(len(row[column]) for row in (_HEAD, *rows)) for column in range(len(_HEAD))]
    rule = tuple("-" * width for width in widths)
    lines = [
        "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in (_HEAD, rule, *rows)
    ]
    return [*lines, "", count_sentence(claims)]


def count_sentence(claims: Sequence[Claim]) -> str:
    """Return how many claims have each verdict, for example ``18 claims: 3 reproduced, 4 contradicted``."""
    counts = verdict_counts(claims)
    told = ", ".join(f"{count} {VERDICTS[verdict]}" for verdict, count in counts.items() if count)
    return f"{len(claims)} claims: {told}"


def _row(claim: Claim) -> tuple[str, ...]:
    ours = _NOTHING if claim.value is None else quantity(claim.value, claim.unit)
    return claim.id, printed_quantity(claim.paper, claim.unit), ours, claim.verdict_words
