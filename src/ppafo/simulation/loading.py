"""From a name, a file or plain Python values to a scenario; every mistake is one clear line."""

import copy
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from ppafo.documents.models import first_problem, is_gap
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import ScenarioError, one_line
from ppafo.parameters import ParameterSet
from ppafo.simulation.building import OverriddenDocument, ScenarioRequest, apply_overrides, build_scenario
from ppafo.simulation.declaration import OF_A_VANE, Declared
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.schema import scenario_file, whole_scenario_file

FILE = TomlKind("scenario", "scenario", resources.files("ppafo") / "scenarios", ScenarioError)


@dataclass(frozen=True, slots=True)
class Layout:
    """How the files of one kind of scenario are laid out and built: the kind of file, what it holds, model, builder.

    ``model`` has the kinds that are loaded, ``whole`` all of them: messages speak of these.
    """

    file: TomlKind
    declared: Declared
    model: Callable[[], type[BaseModel]]
    whole: Callable[[], type[BaseModel]]
    build: Callable[[ScenarioRequest, OverriddenDocument], Scenario]


VANE = Layout(FILE, OF_A_VANE, scenario_file, whole_scenario_file, build_scenario)
"""Scenarios of a vane alone; a room above this one has those of a leg."""


def list_scenarios() -> tuple[str, ...]:
    """Return the names of the scenarios that come with the package."""
    return FILE.names()


def load_scenario(
    name_or_path: str | Path, overrides: Iterable[str] = (), parameter_set: ParameterSet | None = None
) -> Scenario:
    """Return a scenario by its name in the package or by the path of a TOML file, in SI units.

    ``overrides`` are texts whose path begins in the scenario, ``run.duration=1 s``, or in its device,
    ``valve.area=12.6mm^2``. ``parameter_set`` takes the place of the set that the scenario names; what the scenario
    changes in its device is changed in this one. ScenarioError or ParameterError for anything that cannot be used.
    """
    document = FILE.parse(FILE.read(name_or_path), label(str(name_or_path)))
    folder, file = Path(name_or_path).parent, str(name_or_path)
    return scenario_of(ScenarioRequest(label(file), file, folder, document, tuple(overrides), parameter_set), VANE)


def scenario_or_load(
    scenario: Scenario | str | Path,
    overrides: Iterable[str] = (),
    load: Callable[[str | Path, Iterable[str]], Scenario] = load_scenario,
) -> Scenario:
    """Return a scenario as it is, or load it by name or path; ScenarioError for overrides of one that is loaded."""
    if not isinstance(scenario, Scenario):
        return load(scenario, overrides)
    if tuple(overrides):
        raise ScenarioError(f"{scenario.name}: overrides are for the name or file of a scenario, not for a loaded one")
    return scenario


def scenario_from_dict(content: Mapping[str, Any], overrides: Iterable[str] = ()) -> Scenario:
    """Return a scenario from nested dictionaries that are laid out as a scenario file is.

    Quantities are texts with their unit, ``{"angle": "75 deg"}``; relative paths begin in the working folder.
    ScenarioError or ParameterError for anything that cannot be used.
    """
    return scenario_of(request_of_dict(content, overrides), VANE)


def request_of_dict(content: Mapping[str, Any], overrides: Iterable[str]) -> ScenarioRequest:
    """Return the request for a scenario of nested dictionaries; ScenarioError where they are none or too deep."""
    if not isinstance(content, Mapping):
        raise ScenarioError(f"a scenario is a dictionary laid out as a scenario file, not a {type(content).__name__}")
    name = content.get("name")
    file = f"scenario '{label(name)}'" if isinstance(name, str) else "scenario"
    FILE.check_depth(content, file)
    return ScenarioRequest(file, None, Path(), copy.deepcopy(dict(content)), tuple(overrides))


def scenario_of(request: ScenarioRequest, layout: Layout) -> Scenario:
    """Check the keys of the file itself, put the overrides in, and then require all that is needed."""
    if "default_valve" in request.content and not {"run", "controller"} & request.content.keys():
        raise ScenarioError(
            f"{request.file}: is a parameter set, not a scenario; "
            f"run one with it: SCENARIO --set device.set={request.file} "
            f"--set device.valve={one_line(request.content['default_valve'])}"
        )
    declared = layout.declared
    declared.find_kinds(request.content, request.file)
    if request.overrides:
        wrong = [item for item in _problems(request.content, layout) if not is_gap(item)]
        _refuse(wrong, request.file, layout)
    changed = apply_overrides(request.content, request.overrides, request.file, declared)
    declared.find_kinds(changed.document, request.file)
    _refuse(_problems(changed.document, layout), request.file, layout)
    return layout.build(request, changed)


def _problems(document: dict[str, Any], layout: Layout) -> list[ErrorDetails]:
    """Return unknown keys, unknown kinds and gaps."""
    for model in (layout.model, layout.whole):
        try:
            model().model_validate(document)
        except ValidationError as error:
            found = error.errors(include_url=False)
        else:
            return []
    return found


def _refuse(problems: list[ErrorDetails], file: str, layout: Layout) -> None:
    if problems:
        raise ScenarioError(f"{file}: {first_problem(problems, layout.whole())}")
