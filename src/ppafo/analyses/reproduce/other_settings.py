"""What the paper says of switching rate, gains, dead zone and improved control, against runs with such settings."""

from dataclasses import replace

import numpy as np

from ppafo.analyses.reproduce.claim import Claim, stated_claim
from ppafo.analyses.reproduce.decision_phases import PhasedRuns
from ppafo.errors import ParameterError, ScenarioError, SimulationError
from ppafo.parameters.publications.publication import paper_entries
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.simulate import Result, simulate

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
"""An on-off law with a dead zone narrower than what the solenoid pair can hold within one sample."""
FASTER = ("controller.rate=100 Hz", "valve.switching_interval=10 ms")
"""Five times the switching rate: the set has the printed 20 Hz of the component as its shortest time between two."""
_RESTS_ON = ("the torque task as completed here",)


def control_claims(solenoid: Result, proportional: Result, runs: PhasedRuns) -> list[Claim]:
    """Return the claims on switching rate, gains, dead zone and improved control, none of which is decided here.

    ``runs`` are the solenoid pair's over the unknown phase of its decisions.
    """
    beyond = paper_entries()["beyond_improved_control"]
    return [
        _limited_by_switching(solenoid, runs),
        _undetermined("gains_minimise_error", proportional, TUNED),
        _undetermined("dead_zone_amplifies_delay", solenoid, DEAD_ZONE),
        stated_claim(beyond.id, None, "undetermined", beyond.not_testable),
    ]


def _error_with(run: Result, overrides: tuple[str, ...]) -> float | str:
    """Return the RMS torque error [N m] of a run's task under other settings, or why there is none."""
    # Another law takes nothing that was set for this one.
    kept = [override for override in run.scenario.origin.overrides if not override.startswith("controller.")]
    try:
        return simulate(load_scenario(run.scenario.name, [*kept, *overrides])).metrics["rms_error"].value
    except (ParameterError, ScenarioError, SimulationError) as error:
        return str(error)


def _limited_by_switching(solenoid: Result, runs: PhasedRuns) -> Claim:
    """Return by how much less error the same rule makes with valves that switch five times as often."""
    entry, faster = paper_entries()["limited_by_switching"], _error_with(solenoid, FASTER)
    if isinstance(faster, str):
        return stated_claim(entry.id, None, "undetermined", f"{entry.note} {faster}.")
    less = 100.0 * (1.0 - faster / runs.errors)
    median, low, high = float(np.median(less)), float(less.min()), float(less.max())
    sentence = f"{median:.0f} % less error at 100 Hz" + (f" ({low:.0f} to {high:.0f})" if high > low else "")
    claim = stated_claim(entry.id, median, "undetermined", entry.note, _RESTS_ON, None, sentence)
    return replace(claim, range=(low, high))


def _undetermined(identifier: str, run: Result, overrides: tuple[str, ...]) -> Claim:
    """Return a claim that settings which are not reported decide, with the error of a run's task under other ones."""
    entry, error, other = paper_entries()[identifier], run.metrics["rms_error"].value, _error_with(run, overrides)
    if isinstance(other, str):
        return stated_claim(identifier, None, "undetermined", f"{entry.note} {other}.")
    change = 100.0 * (other / error - 1.0)
    sentence = f"{abs(change):.0f} % {'more' if change > 0.0 else 'less'} error"
    note = f"{entry.note} In this task {other:.3f} instead of {error:.3f} N m."
    return stated_claim(identifier, change, "undetermined", note, _RESTS_ON, None, sentence)
