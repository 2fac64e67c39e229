"""The torque task: what the paper claims of it in numbers, and what its text tells of both valves."""

from collections.abc import Sequence

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.parameters.publications.publication import paper_entries
from ppafo.questions.reproduce.bench import AssumedValue
from ppafo.questions.reproduce.claim import Claim, Observation, Verdict, observation, stated_claim
from ppafo.simulation.simulate import Result

_MEASURED = "The paper measured its number."
_PERCENT = 100.0
FEWEST_REVERSALS = paper_entries()["solenoid_oscillates_on_ramp"].at_least or 0.0


def torque_task_claims(solenoid: Result, proportional: Result, assumed: Sequence[AssumedValue]) -> list[Claim]:
    """Return the claims on tracking error and gas, from the metrics of both runs; gas is what the supply gave.

    Each has the window that the task as completed here has to meet.
    """
    error_solenoid, error_proportional = (run.metrics["rms_error"].value for run in (solenoid, proportional))
    gas_solenoid, gas_proportional = (
        GRAMS_PER_KILOGRAM * run.metrics["gas_supplied"].value for run in (solenoid, proportional)
    )
    rests_on = tuple(value.sentence() for value in assumed)

    def less_in_percent(new: float, old: float) -> float | None:
        # Where there is nothing to save from, nothing can be said.
        return _PERCENT * (1.0 - new / old) if old > 0.0 else None

    def claim(identifier: str, value: float | None, note: str) -> Claim:
        entry = paper_entries()[identifier]
        assert entry.at_least is not None, f"{identifier} has a window"
        assert entry.at_most is not None, f"{identifier} has a window"
        window = entry.at_least, entry.at_most
        verdict: Verdict = "not_testable"
        if value is not None:
            verdict = "reproduced_with_assumptions" if window[0] <= value <= window[1] else "contradicted"
        note = f"{note} Accepted from {window[0]:g} to {window[1]:g} {entry.unit}."
        return stated_claim(identifier, value, verdict, note, rests_on, window=window)

    supplied = f"Simulated: gas taken from the supply over the whole task. {_MEASURED}"
    return [
        claim(
            "torque_rms_improvement",
            less_in_percent(error_proportional, error_solenoid),
            f"Simulated: {error_proportional:.3f} against {error_solenoid:.3f} N m over the whole task.",
        ),
        claim("co2_solenoid", gas_solenoid, supplied),
        claim("co2_proportional", gas_proportional, supplied),
        claim(
            "co2_saving",
            less_in_percent(gas_proportional, gas_solenoid),
            f"Simulated: {gas_proportional:.3g} instead of {gas_solenoid:.3g} g. {_MEASURED}",
        ),
    ]


def torque_task_observations(solenoid: Result, proportional: Result) -> list[Observation]:
    """Return what the text tells of the torque task, each with our numbers."""

    def count(result: Result, part: str) -> int | None:
        metric = result.metrics.get(f"oscillations_{part}")
        return None if metric is None else round(metric.value)

    def reversals(number: int | None, part: str) -> str:
        if number is None:
            return f"this reference has no {part}"
        return f"{number} torque reversal{'' if number == 1 else 's'} on the {part}"

    ramp, hold = count(solenoid, "ramp"), count(solenoid, "hold")
    own_ramp, own_hold = count(proportional, "ramp"), count(proportional, "hold")
    tracks_better, errors = False, "this reference has no ramp and hold"
    parts = [(run.metrics.get("rms_error_ramp"), run.metrics.get("rms_error_hold")) for run in (solenoid, proportional)]
    (on_ramp, on_hold), (own_on_ramp, own_on_hold) = parts
    if on_ramp and on_hold and own_on_ramp and own_on_hold:
        gains = on_ramp.value - own_on_ramp.value, on_hold.value - own_on_hold.value
        tracks_better = gains[0] > 0.0 and gains[0] > gains[1]
        errors = (
            f"RMS error on the ramp {own_on_ramp.value:.2f} against {on_ramp.value:.2f} N m, "
            f"on the hold {own_on_hold.value:.2f} against {on_hold.value:.2f} N m"
        )
    return [
        observation(
            "solenoid_oscillates_on_ramp",
            ramp is not None and ramp >= FEWEST_REVERSALS,
            f"{reversals(ramp, 'ramp')} that swing over 5 % of the largest reference",
        ),
        observation("solenoid_quiet_on_hold", hold == 0, reversals(hold, "hold")),
        observation(
            "proportional_does_not_oscillate",
            own_ramp == 0 and own_hold == 0,
            f"{reversals(own_ramp, 'ramp')}, {reversals(own_hold, 'hold')}",
        ),
        observation("proportional_tracks_better_on_ramp", tracks_better, errors),
    ]
