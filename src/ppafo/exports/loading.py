"""From a name or a file to the scenario or walk that is to be exported."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from ppafo.documents.toml_text import label
from ppafo.errors import ScenarioError, nearest_name
from ppafo.simulation.loading import list_scenarios, load_scenario
from ppafo.simulation.scenario import Scenario

if TYPE_CHECKING:
    from ppafo.walking.configuration import Configuration

Exportable: TypeAlias = "Scenario | Configuration"
"""What becomes a library or a module. The code of walks, which is much, is loaded only where one is exported."""

_OF_A_SCENARIO = ("motion", "initial", "reference")
"""Sections that no walk has, and of which every scenario has one."""


def load_exportable(name_or_path: str | Path, overrides: Iterable[str] = ()) -> Exportable:
    """Return a scenario or a walk by its name in the package or by the path of a TOML file, in SI units.

    ScenarioError or ParameterError for anything that cannot be used.
    """
    name = str(name_or_path)
    if name in list_scenarios():
        return load_scenario(name, overrides)
    from ppafo.walking.loading import FILE, list_walks, load_walk

    if name in list_walks():
        return load_walk(name, overrides)
    path = Path(name_or_path)
    if path.suffix != ".toml" and not path.is_file():
        known = (*list_scenarios(), *list_walks())
        raise ScenarioError(
            f"there is no scenario or walk '{label(name)}'{nearest_name(name, known)}; available: {', '.join(known)}, "
            "or give a .toml file"
        )
    document = FILE.parse(FILE.read(path), label(name))
    if any(section in document for section in _OF_A_SCENARIO):
        return load_scenario(path, overrides)
    return load_walk(path, overrides)
