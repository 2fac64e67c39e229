"""How far the paper leaves a number of ours open: what completions give that agree with all that it says otherwise."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ppafo.parameters.publications.publication import ClaimEntry, paper_entries
from ppafo.questions.reproduce.claim import Claim
from ppafo.questions.unreported.answer import Family, weighted_quantiles
from ppafo.questions.unreported.settings import EVIDENCE, OBSERVABLES, effective

CHOSEN = 0.05
"""A number is chosen where less than this fraction of what was open is as near to the published one as ours."""


def with_open_ranges(claims: Sequence[Claim], family: Family) -> list[Claim]:
    """Return the claims, those on numbers that completions have with the 5 to 95 % that the other evidence leaves."""
    observed = {entry.id for entry in EVIDENCE if entry.published is not None}
    return [_with_range(claim, family) if claim.id in observed else claim for claim in claims]


def unread(claims: Sequence[str]) -> list[ClaimEntry]:
    """Return the statements of the paper that neither the claims and observations of these ids nor completions test."""
    read = {*claims, *(entry.id for entry in EVIDENCE)}
    return [entry for entry in paper_entries().values() if entry.id not in read]


def _with_range(claim: Claim, family: Family) -> Claim:
    entry = paper_entries()[claim.id]
    weights = family.weights_without((entry.id, *entry.same_data))
    found = OBSERVABLES[entry.observable](family.metrics)
    kept = weights > 0.0
    low, high = weighted_quantiles(found[kept], weights[kept], (0.05, 0.95))
    if claim.value is None or claim.paper is None or not np.isfinite([low, high]).all():
        return claim
    as_near = np.abs(found[kept] - claim.paper) <= abs(claim.value - claim.paper)
    return replace(
        claim,
        left_open=(low, high),
        open_by=f"completions that agree with the other evidence (effective sample size {effective(weights):.0f})",
        is_chosen=bool(weights[kept][as_near].sum() < CHOSEN * weights.sum()),
    )
