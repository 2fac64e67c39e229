"""The torque task: what the paper claims of it in numbers, of its control, and what its text tells of both valves.

What of it is due to the control law and what to the valve is shown by other laws on the same task and device.
"""

from collections.abc import Sequence

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import ParameterError, ScenarioError, SimulationError
from ppafo.parameters.publications.publication import paper_entries
from ppafo.questions.reproduce.bench import AssumedValue
from ppafo.questions.reproduce.claim import Claim, Observation, Verdict, observation, stated_claim
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.simulate import Result, simulate

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


TUNED = (
    "controller.kind=pid",
    "controller.rate=1 kHz",
    "controller.proportional_gain=1.2 1/(N m)",
    "controller.integral_gain=23 1/(N m s)",
    "controller.derivative_gain=0.0095 s/(N m)",
    "controller.derivative_filter=3.1 ms",
    "controller.anti_windup=4.8 1/s",
)
"""Gains of a PID that were searched for the least error and gas, on an ideal and on a slow, late and noisy valve."""
DEAD_ZONE = (
    "controller.kind=on_off_dead_zone",
    "controller.rate=20 Hz",
    "controller.dead_zone=0.2 N m",
    "controller.release=0.05 N m",
    "controller.opening=1",
)
"""Narrower than what the solenoid pair can hold within one sample."""
FASTER = ("controller.rate=100 Hz", "valve.switching_interval=10 ms")
"""Both: the set has the printed 20 Hz of the component as the shortest time between two switchings."""


def control_claims(solenoid: Result, proportional: Result) -> list[Claim]:
    """Return what the paper says of gains, dead zone, switching rate and improved control, and of size and weight."""
    pair, spool = (run.metrics["rms_error"].value for run in (solenoid, proportional))
    found = [
        _compared("gains_minimise_error", spool, _with(proportional, TUNED), -1.0),
        _compared("dead_zone_amplifies_delay", pair, _with(solenoid, DEAD_ZONE), 1.0),
        _compared("limited_by_switching", pair, _with(solenoid, FASTER), -1.0),
    ]
    untested = (paper_entries()[name] for name in ("beyond_improved_control", "large_and_heavy"))
    return [*found, *(stated_claim(entry.id, None, "not_testable", entry.not_testable) for entry in untested)]


def _with(run: Result, overrides: tuple[str, ...]) -> float | str:
    """Return the RMS error [N m] of a run's task with another law, or why there is none."""
    origin = run.scenario.origin
    try:
        own = [override for override in origin.overrides if not override.startswith("controller.")]
        return simulate(load_scenario(run.scenario.name, [*own, *overrides])).metrics["rms_error"].value
    except (ParameterError, ScenarioError, SimulationError) as error:
        return str(error)


def _compared(identifier: str, error: float, other: float | str, sign: float) -> Claim:
    """Return the claim on by how much, in percent, another law's error is more (sign 1) or less (-1) than an error."""
    entry = paper_entries()[identifier]
    if isinstance(other, str):
        return stated_claim(identifier, None, "not_testable", f"{entry.note} {other}.")
    value = sign * _PERCENT * (other / error - 1.0)
    holds = (entry.at_least is None or value > entry.at_least) and (entry.at_most is None or value <= entry.at_most)
    verdict: Verdict = "reproduced_with_assumptions" if holds else "contradicted"
    note = f"{entry.note} Simulated: {other:.3f} against {error:.3f} N m."
    return stated_claim(identifier, value, verdict, note, ("the torque task as completed here",))
