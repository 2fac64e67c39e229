"""The torque task: what the paper claims of it in numbers, and what its text tells of both valves."""

from collections.abc import Sequence
from dataclasses import dataclass

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.questions.reproduce.assumed import AssumedValue
from ppafo.questions.reproduce.claim import Claim, Observation, Verdict
from ppafo.simulation.result import Result

_TASK = "section 'Task Assessments'"
_MEASURED = "The paper measured its number."
_PERCENT = 100.0
_FEWEST_OSCILLATIONS = 4
"""Fewer torque reversals than two to and fro on the ramp are no oscillation but a single overshoot."""


@dataclass(frozen=True, slots=True)
class _Stated:
    """A number that the paper states, with the window that the task as completed here has to meet."""

    id: str
    statement: str
    paper: float
    unit: str
    window: tuple[float, float]


_IMPROVEMENT = _Stated(
    "torque_rms_improvement",
    "The proportional valve improves the RMS torque error of the solenoid valves.",
    15.0,
    "%",
    (12.0, 18.0),
)
_GAS_SOLENOID = _Stated(
    "co2_solenoid", "Gas that the torque task takes with the solenoid valves.", 1.1, "g", (1.0, 1.2)
)
_GAS_PROPORTIONAL = _Stated(
    "co2_proportional", "Gas that the torque task takes with the proportional valve.", 0.4, "g", (0.36, 0.44)
)
_SAVING = _Stated("co2_saving", "Gas that the proportional valve saves.", 63.0, "%", (60.0, 66.0))


def torque_task_claims(solenoid: Result, proportional: Result, assumed: Sequence[AssumedValue]) -> list[Claim]:
    """Return the claims on tracking error and gas, from the metrics of both runs; gas is what the supply gave."""
    error_solenoid, error_proportional = (run.metrics["rms_error"].value for run in (solenoid, proportional))
    gas_solenoid, gas_proportional = (run.metrics["gas_supplied"].value for run in (solenoid, proportional))
    errors = f"Simulated: {error_proportional:.3f} against {error_solenoid:.3f} N m over the whole task."
    supplied = f"Simulated: gas taken from the supply over the whole task. {_MEASURED}"
    grams_solenoid, grams_proportional = (GRAMS_PER_KILOGRAM * gas for gas in (gas_solenoid, gas_proportional))
    saved = f"Simulated: {grams_proportional:.3g} instead of {grams_solenoid:.3g} g. {_MEASURED}"
    rests_on = tuple(value.sentence() for value in assumed)
    return [
        _claim(_IMPROVEMENT, _less_in_percent(error_proportional, error_solenoid), errors, rests_on),
        _claim(_GAS_SOLENOID, grams_solenoid, supplied, rests_on),
        _claim(_GAS_PROPORTIONAL, grams_proportional, supplied, rests_on),
        _claim(_SAVING, _less_in_percent(gas_proportional, gas_solenoid), saved, rests_on),
    ]


def _less_in_percent(new: float, old: float) -> float | None:
    """By how much the new value is smaller [%]; None where there is nothing to save from."""
    return _PERCENT * (1.0 - new / old) if old > 0.0 else None


def _claim(stated: _Stated, value: float | None, note: str, assumptions: tuple[str, ...]) -> Claim:
    low, high = stated.window
    verdict: Verdict = "not_testable"
    if value is not None:
        verdict = "reproduced_with_assumptions" if low <= value <= high else "contradicted"
    return Claim(
        id=stated.id,
        statement=stated.statement,
        paper=stated.paper,
        value=value,
        unit=stated.unit,
        verdict=verdict,
        source=_TASK,
        note=f"{note} Accepted from {low:g} to {high:g} {stated.unit}.",
        assumptions=assumptions,
        window=stated.window,
    )


def torque_task_observations(solenoid: Result, proportional: Result) -> list[Observation]:
    """Return what the text tells of the torque task, each with our numbers."""
    return [
        _oscillates(solenoid),
        _quiet_on_hold(solenoid),
        _does_not_oscillate(proportional),
        _tracks_better(solenoid, proportional),
    ]


def _count(result: Result, name: str) -> int | None:
    metric = result.metrics.get(name)
    return None if metric is None else round(metric.value)


def _reversals_text(count: int | None, where: str) -> str:
    if count is None:
        return f"this reference has no {where}"
    return f"{count} torque reversal{'' if count == 1 else 's'} on the {where}"


def _oscillates(solenoid: Result) -> Observation:
    ramp = _count(solenoid, "oscillations_ramp")
    return Observation(
        "solenoid_oscillates_on_ramp",
        "With the solenoid valves the torque oscillates on the ramp.",
        ramp is not None and ramp >= _FEWEST_OSCILLATIONS,
        f"{_reversals_text(ramp, 'ramp')} that swing over 5 % of the largest reference",
        f"{_TASK}, figure 8",
    )


def _quiet_on_hold(solenoid: Result) -> Observation:
    hold = _count(solenoid, "oscillations_hold")
    return Observation(
        "solenoid_quiet_on_hold",
        "The oscillation belongs to the initial ramp: on the hold the solenoid valves are quiet.",
        hold == 0,
        _reversals_text(hold, "hold"),
        f"{_TASK}, figure 8",
    )


def _does_not_oscillate(proportional: Result) -> Observation:
    ramp, hold = (_count(proportional, f"oscillations_{part}") for part in ("ramp", "hold"))
    return Observation(
        "proportional_does_not_oscillate",
        "With the proportional valve the torque does not oscillate.",
        ramp == 0 and hold == 0,
        f"{_reversals_text(ramp, 'ramp')}, {_reversals_text(hold, 'hold')}",
        f"{_TASK}, figure 8",
    )


def _tracks_better(solenoid: Result, proportional: Result) -> Observation:
    ramp, hold = (_errors(solenoid, proportional, part) for part in ("ramp", "hold"))
    holds, evidence = False, "this reference has no ramp and hold"
    if ramp is not None and hold is not None:
        gains = ramp[0] - ramp[1], hold[0] - hold[1]
        holds = gains[0] > 0.0 and gains[0] > gains[1]
        evidence = (
            f"RMS error on the ramp {ramp[1]:.2f} against {ramp[0]:.2f} N m, "
            f"on the hold {hold[1]:.2f} against {hold[0]:.2f} N m"
        )
    return Observation(
        "proportional_tracks_better_on_ramp",
        "The proportional valve tracks better, particularly during the initial ramp.",
        holds,
        evidence,
        "figure 8",
    )


def _errors(solenoid: Result, proportional: Result, part: str) -> tuple[float, float] | None:
    """RMS errors [N m] of both runs on one part of the task; None where a run has no such part."""
    first, second = (run.metrics.get(f"rms_error_{part}") for run in (solenoid, proportional))
    return None if first is None or second is None else (first.value, second.value)
