"""The torque task: what the paper claims of tracking error and gas, and what its text tells of both valves."""

from dataclasses import replace
from functools import partial

import numpy as np

from ppafo.analyses.reproduce.claim import Claim, Observation, Verdict, observation, stated_claim
from ppafo.analyses.reproduce.decision_phases import PhasedRuns
from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import count_of
from ppafo.parameters.publications.publication import paper_entries
from ppafo.signals.recording import Floats
from ppafo.simulation.simulate import Result

FEWEST_REVERSALS = paper_entries()["solenoid_oscillates_on_ramp"].at_least or 0.0
"""Reversals of the torque on the ramp from which on the text's oscillation shows."""


def torque_task_claims(runs: PhasedRuns, proportional: Result, rests_on: tuple[str, ...]) -> list[Claim]:
    """Return the claims on tracking error and gas over all phases of the pair's decisions; gas is from the supply.

    ``rests_on`` are the assumptions of the task beside the paper.
    """
    error = proportional.metrics["rms_error"].value
    gas = GRAMS_PER_KILOGRAM * proportional.metrics["gas_supplied"].value
    over = f"Median and range of {runs.errors.size} runs over the unknown phase of the decisions, either valve first."
    # Where the pair makes no error, or takes no gas, there is nothing to save from.
    with np.errstate(divide="ignore", invalid="ignore"):
        better, saved = 100.0 * (1.0 - error / runs.errors), 100.0 * (1.0 - gas / runs.gas)
    claim = partial(_claim_over_phases, rests_on=rests_on)
    # No decimals of what varies by several percent over the phases.
    return [
        claim("torque_rms_improvement", better, 0, over),
        claim("co2_solenoid", runs.gas, 1, over),
        claim("co2_proportional", np.array([gas]), 2, "Decided every millisecond, so that no phase matters."),
        claim("co2_saving", saved, 0, f"{over} It follows from the two amounts: no evidence of its own."),
    ]


def _claim_over_phases(identifier: str, values: Floats, decimals: int, note: str, rests_on: tuple[str, ...]) -> Claim:
    """Return a claim on the median of values (runs,), in its unit, which has to meet the window of the task."""
    entry = paper_entries()[identifier]
    assert entry.at_least is not None, f"{identifier} has a window"
    assert entry.at_most is not None, f"{identifier} has a window"
    window = entry.at_least, entry.at_most
    if not np.isfinite(values).all():
        return stated_claim(identifier, None, "undetermined", note, rests_on, window)
    median, low, high = float(np.median(values)), float(values.min()), float(values.max())
    text = f"{median:.{decimals}f} {entry.unit}"
    if high > low:
        text = f"{text} ({low:.{decimals}f} to {high:.{decimals}f})"
    verdict: Verdict = "met_by_fitted_settings" if window[0] <= median <= window[1] else "undetermined"
    note = f"{note} Accepted from {window[0]:g} to {window[1]:g} {entry.unit}."
    return replace(stated_claim(identifier, median, verdict, note, rests_on, window, text), range=(low, high))


def torque_task_observations(solenoid: Result, proportional: Result) -> list[Observation]:
    """Return what the text tells of the torque task, each with our numbers."""
    pair_on_ramp, pair_on_hold = _reversals(solenoid, "ramp"), _reversals(solenoid, "hold")
    spool_on_ramp, spool_on_hold = _reversals(proportional, "ramp"), _reversals(proportional, "hold")
    return [
        observation(
            "solenoid_oscillates_on_ramp",
            pair_on_ramp is not None and pair_on_ramp >= FEWEST_REVERSALS,
            f"{_reversals_text(pair_on_ramp, 'ramp')} that swing over 5 % of the largest reference",
        ),
        observation("solenoid_quiet_on_hold", pair_on_hold == 0, _reversals_text(pair_on_hold, "hold")),
        observation(
            "proportional_does_not_oscillate",
            spool_on_ramp == 0 and spool_on_hold == 0,
            f"{_reversals_text(spool_on_ramp, 'ramp')}, {_reversals_text(spool_on_hold, 'hold')}",
        ),
        _tracks_better_on_ramp(solenoid, proportional),
    ]


def _reversals(result: Result, part: str) -> int | None:
    """Return how often the torque turns on the ramp or the hold; None where the reference has no such part."""
    metric = result.metrics.get(f"oscillations_{part}")
    return None if metric is None else round(metric.value)


def _reversals_text(reversals: int | None, part: str) -> str:
    if reversals is None:
        return f"this reference has no {part}"
    return f"{count_of(reversals, 'torque reversal')} on the {part}"


def _tracks_better_on_ramp(solenoid: Result, proportional: Result) -> Observation:
    """Return whether the proportional valve lowers the RMS error on the ramp, and by more than on the hold."""
    (pair_ramp, pair_hold), (spool_ramp, spool_hold) = (
        (run.metrics.get("rms_error_ramp"), run.metrics.get("rms_error_hold")) for run in (solenoid, proportional)
    )
    identifier = "proportional_tracks_better_on_ramp"
    if not (pair_ramp and pair_hold and spool_ramp and spool_hold):
        return observation(identifier, False, "this reference has no ramp and hold")
    lower_on_ramp = pair_ramp.value - spool_ramp.value
    lower_on_hold = pair_hold.value - spool_hold.value
    return observation(
        identifier,
        lower_on_ramp > 0.0 and lower_on_ramp > lower_on_hold,
        f"RMS error on the ramp {spool_ramp.value:.2f} against {pair_ramp.value:.2f} N m, "
        f"on the hold {spool_hold.value:.2f} against {pair_hold.value:.2f} N m",
    )
