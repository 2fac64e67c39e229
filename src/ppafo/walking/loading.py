"""Loading of a walk scenario by name or file; every mistake is reported in a single line."""

from collections.abc import Iterable
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from ppafo.arguments import Overrides, checked
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import ScenarioError, at_fault
from ppafo.parameters import ParameterSet
from ppafo.parameters.loading import set_or_load
from ppafo.parameters.overrides import read_overrides
from ppafo.plugins import Plugins, name_plugins
from ppafo.simulation.loading import FILE as SCENARIO_FILE
from ppafo.simulation.loading import Layout, list_scenarios, request_again, request_of_file, scenario_of
from ppafo.simulation.overrides import over_layer
from ppafo.simulation.scenario import Scenario
from ppafo.walking.bottle.supply import BOTTLE, BOTTLE_NAME
from ppafo.walking.building import build_walk
from ppafo.walking.declaration import OF_A_WALK
from ppafo.walking.motion import walk_of
from ppafo.wording import argument_text

FILE = TomlKind("walk", "walk", resources.files("ppafo.walking") / "configurations", ScenarioError)
WALKING = Layout(FILE, OF_A_WALK, build_walk)
"""Layout of scenarios whose motion is a walk."""


def list_walks() -> tuple[str, ...]:
    """Return the names of the walk configurations included in the package.

    >>> import ppafo
    >>> ppafo.list_walks()[:3]
    ('off', 'proportional', 'proportional-regulators')
    """
    return FILE.names()


def check_duration_once(overrides: Iterable[str], minutes: float | None) -> None:
    """Raise ScenarioError if an override sets the duration in addition to the argument ``minutes``."""
    if minutes is not None and any(
        override.typed == "run.duration" for override in read_overrides(overrides, ScenarioError)
    ):
        argument = argument_text("overrides", option="--set")
        raise ScenarioError(
            f"{argument} run.duration and {argument_text('minutes')} both set the duration; omit one of them"
        )


@checked
def load_walk(
    scenario: str | Path,
    overrides: Overrides = (),
    *,
    gait: str | Path | None = None,
    bottle: str | Path | None = None,
    parameter_set: ParameterSet | str | Path | None = None,
    plugins: Plugins = (),
) -> Scenario:
    """Load a walk as a scenario in SI units.

    The default wearer is the subject of the gait named in the file or by ``gait``.

    Arguments:
        scenario: name of a walk, or a .toml file
        overrides: texts such as ``controller.peak_torque=6 N m``, or a dictionary
        gait: name or file of a gait, instead of the file's
        bottle: name or file of a bottle, instead of the file's
        parameter_set: parameter set of the device, instead of the file's
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        the Scenario, whose motion is a walk

    Raises:
        ScenarioError: a walk that cannot be used
        ParameterError: a parameter set, or a value of it, that cannot be used
        DataError: a gait that cannot be read

    >>> import ppafo
    >>> ppafo.load_walk("solenoid").name
    'solenoid'
    """
    name_plugins(plugins)
    chosen = {"gait": gait, BOTTLE_NAME: bottle}
    named = [f"{path}={from_here(value)}" for path, value in chosen.items() if value is not None]
    changes, replacing = read_overrides((*overrides, *named), ScenarioError), set_or_load(parameter_set)
    with at_fault("scenario"):
        request = request_of_file(
            scenario, changes, replacing, SCENARIO_FILE if str(scenario) in list_scenarios() else FILE
        )
    return scenario_of(request, WALKING)


def from_here(name: str | Path) -> str:
    """Return the path of a file from the working folder as an absolute one, which holds in any folder."""
    text = str(name)
    return str(Path(text).absolute()) if "/" in text or Path(text).suffix == ".toml" else text


def on_bottle(scenario: Scenario, bottle: str | Path | None, overrides: Iterable[str] = ()) -> Scenario:
    """Return the walk on another bottle, given by name or file; None keeps the walk's own bottle.

    ``overrides`` are values of the bottle, such as ``room.temperature=5 degC``. Raises ScenarioError or ParameterError
    if the walk cannot be combined with the bottle, and ScenarioError if the walk no longer matches its file and
    overrides.
    """
    request = replace(request_again(scenario.origin), file=scenario.name)
    if _without_bottle(scenario_of(request, WALKING)) != _without_bottle(scenario):
        raise ScenarioError(
            f"{scenario.name}: this walk differs from its file (the walk, the file or the package was changed after "
            f"loading): give {argument_text('bottle')} when loading the walk"
        )
    content, before = request.content, request.overrides
    if bottle is not None:
        # Another bottle replaces the whole section, including its overrides.
        content = {name: section for name, section in content.items() if name != BOTTLE}
        before = tuple(override for override in before if not override.typed.startswith(f"{BOTTLE}."))
    prefix = f"{BOTTLE}."
    texts = [text if text.startswith(prefix) else f"{prefix}{text}" for text in overrides]
    texts += [] if bottle is None else [f"{BOTTLE_NAME}={from_here(bottle)}"]
    combined = over_layer(content, before, read_overrides(texts, ScenarioError), scenario.name, WALKING.content)
    return scenario_of(replace(request, content=content, overrides=combined), WALKING)


def _without_bottle(scenario: Scenario) -> tuple[Any, ...]:
    """Return all attributes of a walk scenario that do not depend on its bottle, without the duration."""
    hardware = scenario.device, scenario.supply_lines, scenario.gas_model, scenario.sensors, scenario.controller
    return *hardware, scenario.run.step, replace(walk_of(scenario), bottle=None)
