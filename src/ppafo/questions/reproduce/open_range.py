"""How far the paper leaves a number of ours open: what completions give that agree with all that it says otherwise."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ppafo.parameters.publications.publication import ClaimEntry, paper_entries
from ppafo.questions.reproduce.bench import NoEvidence, SyntheticEvidence, step_error_values
from ppafo.questions.reproduce.claim import Claim, load_printed
from ppafo.questions.reproduce.torque_task import control_values
from ppafo.questions.unreported.answer import Family, weighted_quantiles
from ppafo.questions.unreported.settings import EVIDENCE, OBSERVABLES, STEP_RUN, Floats, effective, step_columns
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario

CHOSEN = 0.05
"""A number is chosen where less than this fraction of what was open is as near to the published one as ours."""
LIKELIEST = 128
"""Completions that are run with other laws, and whose step responses are compared with the rig's."""
WITHOUT_RANGE = {
    # The search for the best decisions takes seconds for each completion.
    "beyond_improved_control": "no range here: 'python scripts/comparison_findings.py --only Improved' finds one",
    "large_and_heavy": "no range: there is no number",
}
WEIGHED = "completions that agree with the other evidence"


def with_open_ranges(claims: Sequence[Claim], family: Family, synthetic: SyntheticEvidence | NoEvidence) -> list[Claim]:
    """Return the claims on experiments with the 5 to 95 % that the other evidence leaves of each number."""
    likeliest = np.argsort(-family.weights)[:LIKELIEST]
    chosen = family.weights[likeliest]
    more = _of_likeliest({name: values[likeliest] for name, values in family.draws.items()}, synthetic)
    found = []
    for claim in claims:
        entry = paper_entries().get(claim.id)
        if claim.id in more:
            found.append(_with_range(claim, more[claim.id], chosen))
        elif entry is not None and entry in EVIDENCE and entry.published is not None:
            weights = family.weights_without((entry.id, *entry.same_data))
            found.append(_with_range(claim, OBSERVABLES[entry.observable](family.metrics), weights))
        else:
            found.append(claim if claim.left_open else replace(claim, open_by=WITHOUT_RANGE.get(claim.id, "")))
    return found


def _of_likeliest(draws: Mapping[str, Floats], synthetic: SyntheticEvidence | NoEvidence) -> dict[str, Floats]:
    """Return what the claims on control and on the step response come to in completions (draws,), by id."""
    found = control_values(dict(draws))
    if not isinstance(synthetic, NoEvidence):
        base = load_scenario("step-response", STEP_RUN)
        result = run_ensemble(base, step_columns(dict(draws)), (), ("angle", "pressure_1", "pressure_2"))
        found |= step_error_values(result.times, result.traces, synthetic.step)
    return found


def unread(claims: Sequence[str]) -> list[ClaimEntry]:
    """Return the statements of the paper that nothing reads: none of these claims, no completion and no set."""
    of_sets = {entry.key.partition("/")[2] for entry in load_printed().parameter_set.numbers.values()}
    read = {*claims, *(entry.id for entry in EVIDENCE), *of_sets}
    return [entry for entry in paper_entries().values() if entry.id not in read]


def _with_range(claim: Claim, values: Floats, weights: Floats) -> Claim:
    """Return a claim with the range of weighted values, and the mark where ours was chosen for it."""
    kept = (weights > 0.0) & np.isfinite(values)
    low, high = weighted_quantiles(values[kept], weights[kept], (0.05, 0.95))
    if claim.value is None or not np.isfinite([low, high]).all():
        return claim
    is_chosen = False
    if claim.paper is not None and not claim.is_synthetic:
        as_near = np.abs(values[kept] - claim.paper) <= abs(claim.value - claim.paper)
        is_chosen = bool(weights[kept][as_near].sum() < CHOSEN * weights[kept].sum())
    return replace(
        claim,
        left_open=(low, high),
        open_by=f"{WEIGHED} (effective sample size {effective(weights[kept]):.0f})",
        is_chosen=is_chosen,
    )
