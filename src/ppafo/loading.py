"""Loading of scenarios by name or file: device alone, or on a walking leg.

The extensive code of walks is only loaded on request.
"""

import re
import shlex
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ppafo.arguments import Overrides, checked
from ppafo.documents.toml_text import assignments, beside, label, table_lines
from ppafo.errors import ScenarioError, StudyError
from ppafo.parameters import ParameterSet
from ppafo.parameters.declared import kind_at, schema_of
from ppafo.parameters.loading import set_or_load
from ppafo.parameters.overrides import over, read_overrides
from ppafo.plugins import Plugins, plugin_words
from ppafo.simulation import loading as of_vanes
from ppafo.simulation.declaration import OF_A_VANE
from ppafo.simulation.motion_kind import MOTIONS, is_walk
from ppafo.simulation.overrides import over_layer, override_document
from ppafo.simulation.scenario import Scenario
from ppafo.wording import known_names

_OF_WALKS = {"gait", "wearer", "bottle"}
_SETTING = re.compile(r"\s*controller\.(?!rate|period)")
"""Settings of a law: an object in its place ignores them, except rate and period, at which it is called."""
_IN_FILE = "# or in the file of a scenario, in place of the tables of these names"


def list_all_scenarios() -> tuple[str, ...]:
    """Return the names of bundled scenarios, then of bundled walks."""
    from ppafo.walking.loading import list_walks

    return *of_vanes.list_scenarios(), *list_walks()


@checked
def load_scenario(
    scenario: str | Path,
    overrides: Overrides = (),
    *,
    parameter_set: ParameterSet | str | Path | None = None,
    plugins: Plugins = (),
) -> Scenario:
    """Load a scenario or walk, by bundled name or path of a TOML file, in SI units.

    Arguments:
        scenario: name of a shipped scenario or walk, or a .toml file
        overrides: texts whose path starts in the scenario, ``run.duration=1 s``, or in its device,
            ``valve.area=12.6mm^2``, or a dictionary of such paths, in which a number is in SI
        parameter_set: a ParameterSet, a name or a file that replaces the set named in the scenario; the scenario's
            changes of its device apply to this set
        plugins: modules of your own, files or names, whose objects files may name:
            ``["laws.py"]`` for ``kind = "laws:KIND"``

    Returns:
        the Scenario, all numbers in SI units

    Raises:
        ScenarioError: a scenario that cannot be used
        ParameterError: a parameter set that cannot be used
        DataError: a file that the scenario names and that cannot be read

    >>> import ppafo
    >>> scenario = ppafo.load_scenario("torque-task-proportional", ["supply.pressure=70 psi_g"])
    >>> print(f"{scenario.device.supply.pressure:.0f} Pa absolute")
    583958 Pa absolute
    """
    # Vanes first: the code of walks is loaded for a walk only.
    name = str(scenario)
    path = Path(scenario)
    parameter_set = set_or_load(parameter_set)
    if name in of_vanes.list_scenarios():
        return of_vanes.load_scenario(name, overrides, parameter_set)
    from ppafo.walking.loading import FILE, list_walks, load_walk

    if name in list_walks():
        return load_walk(name, overrides, parameter_set=parameter_set)
    if path.suffix != ".toml" and not path.is_file() and not path.is_dir():
        known = list_all_scenarios()
        raise ScenarioError(
            f"there is no scenario or walk '{label(name)}'{known_names(name, known)}, or give a .toml file"
        )
    request = of_vanes.request_of_file(path, read_overrides(overrides, ScenarioError), parameter_set, FILE)
    return of_vanes.scenario_of(request, _layout(request.document))


@checked
def scenario_from_dict(content: Mapping[str, Any], overrides: Overrides = (), *, plugins: Plugins = ()) -> Scenario:
    """Build a scenario or walk from nested dictionaries in the layout of a scenario file.

    Arguments:
        content: tables of the file; quantities are texts with their unit, ``{"angle": "75 deg"}``, and relative paths
            start from the working folder
        overrides: texts such as ``valve.area=12.6mm^2``, or a dictionary
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        the Scenario

    Raises:
        ScenarioError: a scenario that cannot be used
        ParameterError: a parameter set, or a value of it, that cannot be used
        DataError: a gait or recording that cannot be read

    >>> import ppafo
    >>> import tomllib
    >>> from importlib.resources import files
    >>> content = tomllib.loads((files("ppafo") / "scenarios" / "step-response.toml").read_text("utf-8"))
    >>> ppafo.scenario_from_dict(content, ["run.duration=0.2 s"]).run.duration
    0.2
    """
    request = of_vanes.request_of_dict(content, overrides)
    return of_vanes.scenario_of(request, _layout(request.document))


def _layout(document: Mapping[str, Any]) -> of_vanes.Layout:
    """Return the file layout of a document, by its kind of motion."""
    kind = kind_at(document, "motion")
    # A motion that is not known is of a walk where the file has a key of walks alone.
    if not is_walk(kind) and (kind in MOTIONS or not _OF_WALKS & document.keys()):
        return of_vanes.VANE
    from ppafo.walking.loading import WALKING

    return WALKING


def scenario_or_load(scenario: Scenario | str | Path, overrides: Iterable[str] = ()) -> Scenario:
    """Return a loaded scenario unchanged, or load it. Raises ScenarioError for overrides of a loaded scenario."""
    return of_vanes.scenario_or_load(scenario, overrides, load_scenario)


def placed(name: str, folder: Path) -> str:
    """Make the relative path of a scenario file relative to ``folder``; a bundled name is unchanged."""
    return beside(name, folder, of_vanes.list_scenarios())


def reloaded(scenario: Scenario, more: Iterable[str]) -> Scenario:
    """Rebuild a scenario from the content of its file, with more overrides after its own.

    A Python object as its controller is kept.
    """
    before = of_vanes.request_again(scenario.origin)
    custom = scenario.controller.custom
    layout = _layout(before.document)
    later = read_overrides(more, ScenarioError)
    every = over_layer(
        before.document, before.overrides, later, scenario.name, layout.content, scenario.device.valve_name
    )
    read = of_vanes.scenario_of(replace(before, overrides=every), layout)
    return read if custom is None else read.controlled_by(custom)


def with_overrides(scenario: Scenario, overrides: Iterable[str]) -> Scenario:
    """Apply overrides to a scenario; StudyError if the scenario was changed in Python, which reloading would undo.

    A Python object that controls the scenario is kept.
    """
    changes = tuple(overrides)
    if not changes:
        return scenario
    of_object = [text for text in changes if scenario.controller.custom is not None and _SETTING.match(text)]
    if of_object:
        raise StudyError(
            f"override '{of_object[0]}': scenario '{scenario.name}' has a Python controller; set the value in it"
        )
    # Overrides begin at what the file said, so what was replaced in Python would silently come back.
    if reloaded(scenario, ()) != scenario:
        raise StudyError(
            f"scenario '{scenario.name}' was changed in Python, which overrides would undo; load it with the overrides"
        )
    return reloaded(scenario, changes)


def usage_text(scenario: Scenario) -> str:
    """Return the command that runs a scenario with its overrides, and the equivalent tables of a file."""
    origin = scenario.origin
    command = scenario.motion.motion_kind.command
    words = plugin_words(str(origin.content))
    words += [word for override in origin.overrides for word in ("--set", override)]
    name = origin.file or scenario.name
    return "\n".join((shlex.join(("ppafo", command, name, *words)), "", _IN_FILE, *_changed_tables(scenario)))


def _changed_tables(scenario: Scenario) -> Iterator[str]:
    """Yield the TOML lines of file tables changed by the overrides of a scenario."""
    request = of_vanes.request_again(scenario.origin)
    content = _layout(request.document).content
    given, changed = (override_document(each, content) for each in (replace(request, overrides=()), request))
    tables = dict(changed.document)
    if changed.device:
        device = tables.get("device", {})
        words = [override.words for override in changed.device]
        every = over(device.get("overrides", ()), words, valve=scenario.device.valve_name)
        tables["device"] = {**device, "overrides": list(every)}
    for name, table in tables.items():
        if table == given.document.get(name):
            continue
        yield from table_lines(name, table) if isinstance(table, Mapping) else assignments({name: table})


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a scenario file, for a vane alone or a walking leg."""
    from ppafo.walking.declaration import OF_A_WALK, load_kinds

    load_kinds()
    return schema_of("ppafo scenario", OF_A_VANE.declare, OF_A_WALK.declare)
