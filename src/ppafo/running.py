"""Runs one scenario by its name, by its file or as it is: a vane alone, or a leg that walks."""

from collections.abc import Sequence
from pathlib import Path

from ppafo.loading import scenario_or_load
from ppafo.plugins import Plugins, name_plugins
from ppafo.simulation import simulate as of_loaded
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result


def simulate(scenario: Scenario | str | Path, overrides: Sequence[str] = (), *, plugins: Plugins = ()) -> Result:
    """Run one scenario: an object, or the name of a shipped one or a file, with ``overrides`` as on the command line.

    A scenario that walks is one walk with the device; ``compare_walks`` shows it beside the same without. A run that
    diverges is a Result with that status, up to the time of failure. ``plugins`` are modules of your own, files or
    names, whose objects files may name: ``plugins=["laws.py"]`` for ``kind = "laws:KIND"``. ScenarioError or
    ParameterError for bad input.
    """
    name_plugins(plugins)
    return of_loaded.simulate(scenario_or_load(scenario, overrides))
