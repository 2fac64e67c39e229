"""Execution of scenarios by name, file or object: a vane alone or a walking leg."""

import contextlib
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ppafo.arguments import Overrides, Threads, checked
from ppafo.errors import PpafoError
from ppafo.loading import reloaded, scenario_or_load
from ppafo.model.columns import first
from ppafo.plugins import Plugins, name_plugins
from ppafo.simulation import simulate as of_loaded
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.scenario import RunSettings, Scenario
from ppafo.simulation.simulate import Result
from ppafo.units.shown import shown_in

if TYPE_CHECKING:
    from ppafo.simulation.gains import Gains
    from ppafo.simulation.tracking import Tracking
    from ppafo.simulation.tracking.remedies import Remedy

MOST_TRIED = 16
"""Largest number of remedies simulated for a verdict."""
_STRIDES_TRIED = 8.0
"""Number of strides simulated for a remedy of a walk."""


@checked
def simulate(scenario: Scenario | str | Path, overrides: Overrides = (), *, plugins: Plugins = ()) -> Result:
    """Run one scenario: a task, or a walk with the device.

    A walk is simulated with the device only; ``compare_walks`` also simulates the same walk without it.

    Arguments:
        scenario: a Scenario, the name of a shipped one, or a .toml file
        overrides: texts as on the command line, ``["supply.pressure=70 psi_g"]``, or a dictionary,
            ``{"supply.pressure": "70 psi_g", "reference.level": 4.0}``, in which a number is in SI
        plugins: modules of your own, files or names, whose objects files may name:
            ``["laws.py"]`` for ``kind = "laws:KIND"``

    Returns:
        a Result: status, recording and metrics in SI units; a run that diverged has this status, and its recording ends
        at the time of failure

    Raises:
        ScenarioError: a scenario that cannot be used
        ParameterError: a parameter set, or a value of it, that cannot be used

    >>> import ppafo
    >>> result = ppafo.simulate("torque-task-proportional", {"reference.level": 4.0})
    >>> print(f"{result.metrics['rms_error'].value:.3f} N m")
    0.196 N m
    """
    name_plugins(plugins)
    return of_loaded.simulate(scenario_or_load(scenario, overrides))


def gains(scenario: Scenario) -> "Gains | None":
    """Return the gains of a scenario's torque controller; None for a controller without gains."""
    from ppafo.simulation.gains import gains_of

    law = scenario.law
    return None if law is None else gains_of(scenario, law)


def most_reversals(scenario: Scenario) -> float:
    """Return the largest ``command_reversals`` without oscillation; inf for a controller that may switch."""
    from ppafo.simulation import tracking as rules

    law = scenario.law
    if law is None:
        return math.inf
    return rules.most_reversals(scenario, law, first(scenario.run.duration), scenario.motion.stride_time)


def tried(scenario: Scenario, verdict: "Tracking | None") -> "Tracking | None":
    """Return a tracking verdict with the first remedy that succeeds in a simulation.

    Remedies are the overrides named in the verdict; for a walk, only the first strides are simulated. If only a
    remedy of a less certain cause succeeds, that cause becomes the cause of the verdict. If none succeeds, the verdict
    gets the remedy with the smallest remaining error, provided that this is less than half of the original one.
    """
    if verdict is None or verdict.accepted:
        return verdict
    causes = [(verdict.cause, remedy) for remedy in verdict.remedies]
    causes += [(other.text, remedy) for other in verdict.others for remedy in other.remedies]
    if not causes:
        return verdict
    from ppafo.simulation.tracking.remedies import change_text
    from ppafo.simulation.tracking.verdict import is_undecided, time_text

    # What was changed in Python would be lost with overrides.
    is_of_file = replace(reloaded(scenario, ()), run=scenario.run) == scenario
    candidates: list[tuple[str, Remedy, Scenario]] = []
    for cause, remedy in causes[:MOST_TRIED]:
        with contextlib.suppress(PpafoError):
            again = reloaded(scenario, remedy.overrides) if is_of_file else with_numbers(scenario, remedy.numbers)
            candidates.append((cause, remedy, replace(again, run=_trial_run(again))))
    try:
        results = of_loaded.simulate_many([candidate for *_, candidate in candidates])
    except PpafoError:
        return verdict
    best: tuple[Remedy, float] | None = None
    for (cause, remedy, _), result in zip(candidates, results, strict=True):
        left = result.tracking
        if not result.status.is_completed or is_undecided(result):
            continue
        if left is None:
            told = f"with {remedy.text} it follows, as a further run shows"
            return replace(verdict, cause=cause, tried=told, mended=remedy.overrides if is_of_file else ())
        if cause == verdict.cause and left.error < 0.5 * verdict.error and (best is None or left.error < best[1]):
            best = (remedy, left.error)
    if best is not None:
        with shown_in(verdict.units):
            error = change_text(verdict.controlled, best[1])
        left_text = f"an RMS error of {error} is left{time_text(verdict.since)}"
        return replace(verdict, tried=f"with {best[0].text} {left_text}, as a further run shows")
    names = ", ".join(dict.fromkeys(each.partition("=")[0] for remedy in verdict.remedies for each in remedy.overrides))
    if not names:
        return verdict
    advice = f"{verdict.advice}; " if verdict.advice else ""
    return replace(verdict, tried=f"{advice}other values of {names} alone did not suffice")


def _trial_run(scenario: Scenario) -> RunSettings:
    """Return the run settings for a remedy: unchanged for a task, first strides for a walk."""
    run, duration = scenario.run, _STRIDES_TRIED * scenario.motion.stride_time
    if scenario.follows_reference or not 0.0 < duration < run.duration:
        return run
    # A whole number of output intervals, as the walk itself has.
    return replace(run, duration=round(duration / run.output_interval) * run.output_interval)


@checked
def simulate_many(
    scenarios: Sequence[Scenario | str | Path], *, threads: Threads | None = None, plugins: Plugins = ()
) -> list[Result]:
    """Run many scenarios in parallel, each with the result of a single run.

    Arguments:
        scenarios: Scenario objects, names of shipped ones, or .toml files
        threads: number of threads; default: all cores
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        the Result of each scenario, in their order

    Raises:
        ScenarioError: a scenario that cannot be used
        ParameterError: a parameter set, or a value of it, that cannot be used

    >>> import ppafo
    >>> runs = ppafo.simulate_many(["torque-task-proportional", "torque-task-solenoid"])
    >>> [f"{run.metrics['gas_supplied'].value:.2e} kg" for run in runs]
    ['4.16e-04 kg', '1.16e-03 kg']
    """
    name_plugins(plugins)
    return of_loaded.simulate_many([scenario_or_load(scenario) for scenario in scenarios], threads)
