"""Execution of scenarios by name, file or object: a vane alone or a walking leg."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ppafo.arguments import Overrides, Threads, checked
from ppafo.loading import scenario_or_load
from ppafo.plugins import Plugins, name_plugins
from ppafo.simulation import simulate as of_loaded
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result

if TYPE_CHECKING:
    from ppafo.simulation.gains import Gains
    from ppafo.simulation.tracking import Tracking


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
    return replace(of_loaded.simulate(scenario_or_load(scenario, overrides)), tries=_tried)


def _tried(scenario: Scenario, verdict: "Tracking | None") -> "Tracking | None":
    """Return a verdict with the first of its remedies that succeeds in a further run."""
    from ppafo.remedy_trials import tried

    return tried(scenario, verdict)


def gains(scenario: Scenario) -> "Gains | None":
    """Return the gains of a scenario's torque controller; None for a controller without gains."""
    from ppafo.simulation.gains import gains_of

    law = scenario.law
    return None if law is None else gains_of(scenario, law)


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
    results = of_loaded.simulate_many([scenario_or_load(scenario) for scenario in scenarios], threads)
    return [replace(result, tries=_tried) for result in results]
