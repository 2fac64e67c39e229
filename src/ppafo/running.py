"""Runs scenarios by name, by file or as they are, a vane alone or a leg that walks."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ppafo.arguments import Overrides, Threads, checked
from ppafo.loading import scenario_or_load
from ppafo.model.columns import first
from ppafo.plugins import Plugins, name_plugins
from ppafo.simulation import simulate as of_loaded
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result

if TYPE_CHECKING:
    from ppafo.simulation.gains import Gains


@checked
def simulate(scenario: Scenario | str | Path, overrides: Overrides = (), *, plugins: Plugins = ()) -> Result:
    """Run one scenario: an object, or the name of a shipped one or a file.

    ``overrides`` are texts as on the command line, ``["supply.pressure=70 psi_g"]``, or a dictionary,
    ``{"supply.pressure": "70 psi_g", "reference.level": 4.0}``, in which a number is in SI.

    A scenario that walks is one walk with the device; ``compare_walks`` shows it beside the same without. A run that
    diverges is a Result with that status, up to the time of failure. ``plugins`` are modules of your own, files or
    names, whose objects files may name: ``plugins=["laws.py"]`` for ``kind = "laws:KIND"``. ScenarioError or
    ParameterError for bad input.

    >>> import ppafo
    >>> result = ppafo.simulate("torque-task-proportional", {"reference.level": 4.0})
    >>> print(f"{result.metrics['rms_error'].value:.3f} N m")
    0.196 N m
    """
    name_plugins(plugins)
    return of_loaded.simulate(scenario_or_load(scenario, overrides))


def gains(scenario: Scenario) -> "Gains | None":
    """Return the gains in force of a scenario's torque law; None for a law that has none."""
    from ppafo.simulation.gains import gains_of

    law = scenario.law
    return None if law is None else gains_of(scenario, law)


def most_reversals(scenario: Scenario) -> float:
    """Return the ``command_reversals`` of a run above which its loop oscillates; infinite for a law that may turn."""
    from ppafo.simulation import tracking as rules

    law = scenario.law
    if law is None:
        return math.inf
    return rules.most_reversals(scenario, law, first(scenario.run.duration), scenario.motion.stride_time)


@checked
def simulate_many(
    scenarios: Sequence[Scenario | str | Path], *, threads: Threads | None = None, plugins: Plugins = ()
) -> list[Result]:
    """Run many scenarios side by side, objects, names or files, each exactly as if it ran alone.

    ``plugins`` are modules of your own whose objects files may name, as of ``simulate``.

    >>> import ppafo
    >>> runs = ppafo.simulate_many(["torque-task-proportional", "torque-task-solenoid"])
    >>> [f"{run.metrics['gas_supplied'].value:.2e} kg" for run in runs]
    ['4.16e-04 kg', '1.16e-03 kg']
    """
    name_plugins(plugins)
    return of_loaded.simulate_many([scenario_or_load(scenario) for scenario in scenarios], threads)
