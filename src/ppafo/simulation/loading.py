"""Loading of a scenario in SI units by name, file or plain values; each mistake gives a one-line error."""

import copy
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from ppafo.documents.faults import line_of, refuse
from ppafo.documents.regular_file import decoded
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import Faults, KindError, ScenarioError, refused_as
from ppafo.parameters import ParameterSet
from ppafo.parameters.declared import KIND, Content, layout_of, value_at
from ppafo.parameters.overrides import FORMS, Override, either, in_two_forms, read_overrides
from ppafo.simulation.building import build_scenario, read_hardware
from ppafo.simulation.declaration import OF_A_VANE
from ppafo.simulation.document import DocumentReader
from ppafo.simulation.numbers import check_parts
from ppafo.simulation.overrides import override_document
from ppafo.simulation.scenario import Origin, Scenario
from ppafo.wording import one_line, override_text

FILE = TomlKind("scenario", "scenario", resources.files("ppafo") / "scenarios", ScenarioError)


@dataclass(frozen=True, slots=True)
class Layout:
    """Layout of the files of one scenario type: file type, possible content, builder."""

    file: TomlKind
    content: Content
    build: Callable[[DocumentReader], Scenario]


VANE = Layout(FILE, OF_A_VANE, build_scenario)
"""Scenarios of a vane alone; the scenarios of a leg are in a package above this one."""


def list_scenarios() -> tuple[str, ...]:
    """Return the names of the shipped scenarios.

    >>> import ppafo
    >>> [name for name in ppafo.list_scenarios() if name.startswith("torque-task-p")]
    ['torque-task-proportional']
    """
    return FILE.names()


def load_scenario(
    name_or_path: str | Path, overrides: Iterable[str] = (), parameter_set: ParameterSet | None = None
) -> Scenario:
    """Return a scenario by the name of a shipped one or by the path of a TOML file, in SI units.

    ``overrides`` are texts whose path starts in the scenario, ``run.duration=1 s``, or in its device,
    ``valve.area=12.6mm^2``. ``parameter_set`` replaces the set that the scenario names; the scenario's changes of its
    device apply to this one. Raises ScenarioError or ParameterError for anything that cannot be used.
    """
    return scenario_of(request_of_file(name_or_path, read_overrides(overrides, ScenarioError), parameter_set), VANE)


def request_of_file(
    name_or_path: str | Path,
    overrides: tuple[Override, ...] = (),
    parameter_set: ParameterSet | None = None,
    file: TomlKind = FILE,
) -> DocumentReader:
    """Return the request for the scenario of a file."""
    source = FILE.parse(file.read(name_or_path), label(str(name_or_path)), Path(name_or_path).parent)
    return DocumentReader(
        source.label,
        source.document,
        text=decoded(source.content),
        path=str(name_or_path),
        folder=source.folder,
        overrides=overrides,
        parameter_set=parameter_set,
    )


def scenario_or_load(
    scenario: Scenario | str | Path,
    overrides: Iterable[str] = (),
    load: Callable[[str | Path, Iterable[str]], Scenario] = load_scenario,
) -> Scenario:
    """Return a loaded scenario unchanged, or load one by name or path; ScenarioError for overrides of a loaded one."""
    if not isinstance(scenario, Scenario):
        return load(scenario, overrides)
    if tuple(overrides):
        raise ScenarioError(f"{scenario.name}: a loaded scenario accepts no overrides; give them when loading it")
    check_parts(scenario)
    return scenario


def scenario_from_dict(content: Mapping[str, Any], overrides: Iterable[str] = ()) -> Scenario:
    """Return a scenario from nested dictionaries laid out as a scenario file.

    Quantities are texts with their unit, ``{"angle": "75 deg"}``; relative paths start from the working folder. Raises
    ScenarioError or ParameterError for anything that cannot be used.
    """
    return scenario_of(request_of_dict(content, overrides), VANE)


def request_of_dict(content: Mapping[str, Any], overrides: Iterable[str]) -> DocumentReader:
    """Return the request for a scenario of nested dictionaries; ScenarioError for other data or too deep nesting."""
    if not isinstance(content, Mapping):
        raise ScenarioError(f"a scenario must be a dictionary like a scenario file, not a {type(content).__name__}")
    file = _name_in_messages(content)
    FILE.check_depth(content, file)
    # A copy: the scenario is loaded anew from it, whatever becomes of the caller's dictionaries.
    document = copy.deepcopy(dict(content))
    return DocumentReader(file, document, overrides=read_overrides(overrides, ScenarioError))


def request_again(origin: Origin) -> DocumentReader:
    """Return the request from which a scenario was built."""
    file = origin.file
    content = origin.content
    name, folder = (_name_in_messages(content), Path()) if file is None else (label(file), Path(file).parent)
    overrides = read_overrides(origin.overrides, ScenarioError)
    return DocumentReader(name, content, path=file, folder=folder, overrides=overrides)


def _name_in_messages(content: Mapping[str, Any]) -> str:
    """Return the name in messages of a document without a file."""
    name = content.get("name")
    return f"scenario '{label(name)}'" if isinstance(name, str) else "scenario"


def scenario_of(request: DocumentReader, layout: Layout) -> Scenario:
    """Check the keys of the file itself, apply the overrides, then check that all required keys are given."""
    file = request.file
    given = request.document
    content = layout.content
    # A set in the place of a scenario would else be refused key by key.
    if "default_valve" in given and not {"run", "controller"} & given.keys():
        of_set = (f"device.set={file}", f"device.valve={one_line(given['default_valve'])}")
        raise ScenarioError(f"{file}: is a parameter set, not a scenario; {override_text(of_set)} takes it")
    # Faults of the file itself are said as such; an override may give a value that it lacks.
    _check_layout(request, content, may_have_gaps=bool(request.overrides))
    reading = override_document(request, content)
    if wrong := Faults(reading.wrong):
        # A kind that is not known has no values: where one is given, it is the mistake.
        _check_layout(reading, content, of_kinds_alone=True)
        with wrong:
            if value_at(reading.document, "device.set") is not None:
                read_hardware(reading)
        wrong.raise_all()
    if request.overrides:
        _check_layout(reading, content)
    paths = [f"{section}.{name}" for section in FORMS for name in value_at(reading.document, section) or ()]
    pair = in_two_forms(paths)
    if pair is not None:
        raise reading.refusal(pair[1], either(pair[1]))
    return layout.build(reading)


def _check_layout(
    reading: DocumentReader,
    content: Content,
    may_have_gaps: bool = False,
    of_kinds_alone: bool = False,
) -> None:
    """Raise ScenarioError for unknown keys and kinds, wrong texts, and missing keys unless ``may_have_gaps``.

    Beside these, numbers that cannot be read are named. With ``of_kinds_alone`` only an unknown ``kind`` is an error.
    """
    file = reading.file
    document = reading.document

    def place(path: str) -> str:
        is_of_file = value_at(document, path) == value_at(reading.content or document, path)
        return line_of(reading.text, path) if is_of_file else ""

    with refused_as(ScenarioError, file, KindError):
        fields = content.declare(document)
    found = dict(layout_of(fields, reads_numbers=False).faults(document))
    gaps = [path for path, fault in found.items() if not fault]
    faults = [path for path, fault in found.items() if fault and (not of_kinds_alone or path.endswith(f".{KIND}"))]
    if not faults and (may_have_gaps or of_kinds_alone or not gaps):
        return
    # Where something is wrong anyway, numbers that cannot be read are named with it.
    found = found if of_kinds_alone else dict(layout_of(fields).faults(document))
    said = {
        path: fault
        for path, fault in found.items()
        if (path in faults if of_kinds_alone else fault or not may_have_gaps)
    }
    refuse(said, file, ScenarioError, place)
