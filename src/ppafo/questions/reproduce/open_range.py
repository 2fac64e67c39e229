"""How far the paper leaves a number of ours open: what completions give that agree with all that it says otherwise."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ppafo.parameters.publications.publication import ClaimEntry, paper_entries
from ppafo.questions.league.sampled_bound import COMMANDS
from ppafo.questions.reproduce.bench import NoEvidence, SyntheticEvidence, step_error_values
from ppafo.questions.reproduce.claim import Claim, load_printed
from ppafo.questions.reproduce.torque_task import control_values, improved_control
from ppafo.questions.unreported.answer import Family, weighted_quantiles
from ppafo.questions.unreported.settings import (
    EVIDENCE,
    OBSERVABLES,
    ON_OFF_RATE,
    PROPORTIONAL,
    STEP_RUN,
    Floats,
    effective,
    step_columns,
)
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario

CHOSEN = 0.05
"""A number is chosen where less than this fraction of what was open is as near to the published one as ours."""
SAMPLED = 512
"""Draws by weight of completions that are run with other laws, and whose step responses are compared with the rig's."""
SEARCHED = 64
"""Draws by weight of completions at 20 Hz whose best decisions are searched: a quarter of a second each."""
IMPROVED, STATED_RATE = "beyond_improved_control", 20.0
"""The claim on improved control, and the rate [Hz] that it is made of."""
WITHOUT_RANGE = {"large_and_heavy": "no range: there is no number"}
WEIGHED = "completions that agree with the other evidence"
AT_STATED_RATE = f"the best decisions in {WEIGHED} and switch at 20 Hz"


def with_open_ranges(claims: Sequence[Claim], family: Family, synthetic: SyntheticEvidence | NoEvidence) -> list[Claim]:
    """Return the claims on experiments with the 5 to 95 % that the other evidence leaves of each number."""
    sampled = drawn_by_weight(family.weights, SAMPLED)
    places, times = np.unique(sampled, return_counts=True)
    draws = {name: values[places] for name, values in family.draws.items()}
    more = _of_completions(draws, synthetic) if places.size else {}
    found = []
    for claim in claims:
        entry = paper_entries().get(claim.id)
        if claim.id in more:
            found.append(_with_range(claim, more[claim.id], times.astype(float)))
        elif claim.id == IMPROVED:
            found.append(_with_range(claim, *improved_by_weight(family), AT_STATED_RATE))
        elif entry is not None and entry in EVIDENCE and entry.published is not None:
            weights = family.weights_without((entry.id, *entry.same_data))
            found.append(_with_range(claim, OBSERVABLES[entry.observable](family.metrics), weights))
        else:
            found.append(claim if claim.left_open else replace(claim, open_by=WITHOUT_RANGE.get(claim.id, "")))
    return found


def drawn_by_weight(weights: Floats, count: int) -> NDArray[np.intp]:
    """Return places of ``count`` draws with probabilities as weights, evenly spread over these; none without weight."""
    total = np.cumsum(weights)
    if total.size == 0 or not total[-1] > 0.0:
        return np.empty(0, dtype=np.intp)
    return np.asarray(np.searchsorted(total, total[-1] * (np.arange(count) + 0.5) / count), dtype=np.intp)


def improved_by_weight(family: Family, commands: Sequence[float] = COMMANDS) -> tuple[Floats, Floats]:
    """Return by how much [%] the best decisions at 20 Hz exceed the proportional valve's error, and how often each.

    In SEARCHED draws by weight of the completions at this rate; each (different draws,).
    """
    weights = np.where(family.draws[ON_OFF_RATE] == STATED_RATE, family.weights, 0.0)
    places, times = np.unique(drawn_by_weight(weights, SEARCHED), return_counts=True)
    draws = {name: values[places] for name, values in family.draws.items()}
    return improved_control(draws, family.metrics[PROPORTIONAL]["rms_error"][places], commands), times.astype(float)


def _of_completions(draws: Mapping[str, Floats], synthetic: SyntheticEvidence | NoEvidence) -> dict[str, Floats]:
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


def _with_range(claim: Claim, values: Floats, weights: Floats, weighed: str = WEIGHED) -> Claim:
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
        open_by=f"{weighed} (effective sample size {effective(weights[kept]):.0f})",
        is_chosen=is_chosen,
    )
