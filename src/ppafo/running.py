"""Runs scenarios by name, by file or as they are, a vane alone or a leg that walks."""

from collections.abc import Sequence
from pathlib import Path

from ppafo.arguments import Overrides, Threads, checked
from ppafo.loading import scenario_or_load
from ppafo.plugins import Plugins, name_plugins
from ppafo.simulation import simulate as of_loaded
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result


@checked()
def simulate(scenario: Scenario | str | Path, overrides: Overrides = (), *, plugins: Plugins = ()) -> Result:
    """Run one scenario: an object, or the name of a shipped one or a file.

    ``overrides`` are texts as on the command line, ``["supply.pressure=70 psi_g"]``, or a dictionary,
    ``{"supply.pressure": "70 psi_g", "reference.level": 4.0}``, in which a number is in SI.

    A scenario that walks is one walk with the device; ``compare_walks`` shows it beside the same without. A run that
    diverges is a Result with that status, up to the time of failure. ``plugins`` are modules of your own, files or
    names, whose objects files may name: ``plugins=["laws.py"]`` for ``kind = "laws:KIND"``. ScenarioError or
    ParameterError for bad input.
    """
    name_plugins(plugins)
    return of_loaded.simulate(scenario_or_load(scenario, overrides))


@checked("scenarios", "threads")
def simulate_many(
    scenarios: Sequence[Scenario | str | Path], *, threads: Threads | None = None, plugins: Plugins = ()
) -> list[Result]:
    """Run many scenarios side by side, objects, names or files, each exactly as if it ran alone.

    ``plugins`` are modules of your own whose objects files may name, as of ``simulate``.
    """
    name_plugins(plugins)
    return of_loaded.simulate_many([scenario_or_load(scenario) for scenario in scenarios], threads)
