"""From a name, a file or plain Python values to a scenario; every mistake is one clear line."""

import copy
from collections.abc import Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from ppafo.documents.models import first_problem, is_gap
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import ScenarioError, one_line
from ppafo.parameters import ParameterSet
from ppafo.simulation.building import ScenarioRequest, apply_overrides, build_scenario
from ppafo.simulation.declaration import find_kinds
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.schema import scenario_file

_FILE = TomlKind("scenario", "scenario", resources.files("ppafo") / "scenarios", ScenarioError)


def list_scenarios() -> tuple[str, ...]:
    """Return the names of the scenarios that come with the package."""
    return _FILE.names()


def load_scenario(
    name_or_path: str | Path, overrides: Iterable[str] = (), parameter_set: ParameterSet | None = None
) -> Scenario:
    """Return a scenario by its name in the package or by the path of a TOML file, in SI units.

    ``overrides`` are texts whose path begins in the scenario, ``run.duration=1 s``, or in its device,
    ``valve.area=12.6mm^2``. ``parameter_set`` takes the place of the set that the scenario names; what the scenario
    changes in its device is changed in this one. ScenarioError or ParameterError for anything that cannot be used.
    """
    document = _FILE.parse(_FILE.read(name_or_path), label(str(name_or_path)))
    folder, file = Path(name_or_path).parent, str(name_or_path)
    return _scenario(ScenarioRequest(label(file), file, folder, document, tuple(overrides), parameter_set))


def scenario_or_load(scenario: Scenario | str | Path, overrides: Iterable[str] = ()) -> Scenario:
    """Return a scenario as it is, or load it by name or path; ScenarioError for overrides of one that is loaded."""
    if not isinstance(scenario, Scenario):
        return load_scenario(scenario, overrides)
    if tuple(overrides):
        raise ScenarioError(f"{scenario.name}: overrides are for the name or file of a scenario, not for a loaded one")
    return scenario


def parse_scenario(content: bytes, file: str, overrides: Iterable[str] = (), folder: Path | None = None) -> Scenario:
    """Return the scenario in the bytes of a TOML file; relative paths in it begin in ``folder``.

    ScenarioError or ParameterError for anything that cannot be used.
    """
    document = _FILE.parse(content, label(file))
    return _scenario(ScenarioRequest(label(file), file, folder or Path(), document, tuple(overrides)))


def scenario_from_dict(content: Mapping[str, Any], overrides: Iterable[str] = ()) -> Scenario:
    """Return a scenario from nested dictionaries that are laid out as a scenario file is.

    Quantities are texts with their unit, ``{"angle": "75 deg"}``; relative paths begin in the working folder.
    ScenarioError or ParameterError for anything that cannot be used.
    """
    if not isinstance(content, Mapping):
        raise ScenarioError(f"a scenario is a dictionary laid out as a scenario file, not a {type(content).__name__}")
    name = content.get("name")
    file = f"scenario '{label(name)}'" if isinstance(name, str) else "scenario"
    _FILE.check_depth(content, file)
    return _scenario(ScenarioRequest(file, None, Path(), copy.deepcopy(dict(content)), tuple(overrides)))


def _scenario(request: ScenarioRequest) -> Scenario:
    """Check the keys of the file itself, put the overrides in, and then ask for all that is needed."""
    if "default_valve" in request.content and "run" not in request.content:
        raise ScenarioError(
            f"{request.file}: is a parameter set, not a scenario; "
            f"run one with it: SCENARIO --set device.set={request.file} "
            f"--set device.valve={one_line(request.content['default_valve'])}"
        )
    find_kinds(request.content, request.file)
    if request.overrides:
        wrong = [item for item in _problems(request.content) if not is_gap(item)]
        _refuse(wrong, request.file)
    changed = apply_overrides(request.content, request.overrides, request.file)
    find_kinds(changed.document, request.file)
    _refuse(_problems(changed.document), request.file)
    return build_scenario(request, changed)


def _problems(document: dict[str, Any]) -> list[ErrorDetails]:
    """Return unknown keys, unknown kinds and gaps."""
    try:
        scenario_file().model_validate(document)
    except ValidationError as error:
        return error.errors(include_url=False)
    return []


def _refuse(problems: list[ErrorDetails], file: str) -> None:
    if problems:
        raise ScenarioError(f"{file}: {first_problem(problems, scenario_file())}")
