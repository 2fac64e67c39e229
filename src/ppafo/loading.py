"""From a name or a file to a scenario, whatever moves its ankle: a vane alone, or a leg that walks.

The code of walks, which is much, is loaded only where one is asked for.
"""

from collections.abc import Iterable
from pathlib import Path

from ppafo.documents.toml_text import beside, label
from ppafo.errors import ScenarioError, nearest_name
from ppafo.parameters import ParameterSet
from ppafo.simulation import loading as of_vanes
from ppafo.simulation.scenario import Scenario

_OF_A_VANE = ("motion", "initial", "reference")
"""Sections that no walk has, and of which every other scenario has one."""


def load_scenario(
    name_or_path: str | Path, overrides: Iterable[str] = (), parameter_set: ParameterSet | None = None
) -> Scenario:
    """Return a scenario, walks among them, by its name in the package or by the path of a TOML file, in SI units.

    ``overrides`` are texts whose path begins in the scenario, ``run.duration=1 s``, or in its device,
    ``valve.area=12.6mm^2``. ``parameter_set`` takes the place of the set that the scenario names; what the scenario
    changes in its device is changed in this one. ScenarioError, ParameterError or DataError for anything that cannot be
    used.
    """
    name = str(name_or_path)
    if name in of_vanes.list_scenarios():
        return of_vanes.load_scenario(name, overrides, parameter_set)
    from ppafo.walking.loading import FILE, list_walks, load_walk

    if name in list_walks():
        return load_walk(name, overrides, parameter_set=parameter_set)
    path = Path(name_or_path)
    if path.suffix != ".toml" and not path.is_file():
        known = (*of_vanes.list_scenarios(), *list_walks())
        raise ScenarioError(
            f"there is no scenario or walk '{label(name)}'{nearest_name(name, known)}; available: {', '.join(known)}, "
            "or give a .toml file"
        )
    document = FILE.parse(FILE.read(path), label(name))
    is_of_vane = any(section in document for section in _OF_A_VANE)
    if is_of_vane:
        return of_vanes.load_scenario(path, overrides, parameter_set)
    return load_walk(path, overrides, parameter_set=parameter_set)


def scenario_or_load(scenario: Scenario | str | Path, overrides: Iterable[str] = ()) -> Scenario:
    """Return a scenario as it is, or load it by name or path; ScenarioError for overrides of one that is loaded."""
    return (
        of_vanes.scenario_or_load(scenario, overrides)
        if isinstance(scenario, Scenario)
        else load_scenario(scenario, overrides)
    )


def placed(name: str, folder: Path) -> str:
    """Return the name of a shipped scenario or walk, or the path of a file, relative ones from a folder."""
    return beside(name, folder, of_vanes.list_scenarios())


def reloaded(scenario: Scenario, more: Iterable[str]) -> Scenario:
    """Return a scenario read again from where it came from, with further overrides.

    A Python object that controls it stays in charge.
    """
    origin, custom = scenario.origin, scenario.control.custom
    every = (*origin.overrides, *more)
    if origin.file is None:
        read = of_vanes.scenario_from_dict(origin.content, every)
    else:
        read = load_scenario(origin.file, every)
    return read if custom is None else read.controlled_by(custom)
