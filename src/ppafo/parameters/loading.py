"""Parameter set files: loading by name or path, parsing, layout from the declarations, and writing."""

import functools
import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from importlib import resources
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.arguments import Name, Overrides, checked
from ppafo.documents.models import SchemaVersion, make_schema, one_of, optional, table, validate
from ppafo.documents.problems import NAME
from ppafo.documents.toml_text import TomlKind, assignments, beside, label, table_lines
from ppafo.errors import ParameterError, UnitError, refused_as
from ppafo.model.actuators.kind import ActuatorKind
from ppafo.model.catalog import ACTUATORS, EFFECTS, VALVES, device_effects, find_effects
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import SECTION, Effect
from ppafo.model.valves.kind import ValveKind
from ppafo.parameters import declaration
from ppafo.parameters.building import build_device
from ppafo.parameters.declaration import OF_SECOND_CHAMBER, WHY_ONE_CHAMBER, alternatives
from ppafo.parameters.device import VANE, Device
from ppafo.parameters.joint import ANKLE, OPPOSITES, JointNames
from ppafo.parameters.overrides import check_valve, read_overrides, with_overrides
from ppafo.parameters.parameter_set import (
    Accepted,
    Citation,
    Entry,
    FlagEntry,
    ParameterSet,
    TextEntry,
    chosen_valve,
    written_units,
)
from ppafo.plugins import Plugins, name_plugins
from ppafo.units import check_unit
from ppafo.wording import nearest_name

_FILE = TomlKind("parameter set", "parameters", resources.files("ppafo.parameters") / "sets", ParameterError)


def list_sets() -> tuple[str, ...]:
    """Return the names of the parameter sets that come with the package.

    >>> import ppafo
    >>> ppafo.list_sets()
    ('cylinder-lever', 'ppafo2011', 'ppafo2011-printed')
    """
    return _FILE.names()


@checked
def load_device(
    parameter_set: ParameterSet | str | Path,
    *,
    overrides: Overrides = (),
    valve: Name | None = None,
    plugins: Plugins = (),
) -> Device:
    """Return the device of a parameter set with one of its valves (default: the set's own choice), in SI units.

    Arguments:
        parameter_set: a ParameterSet, the name of a shipped one, or a .toml file
        overrides: values to change, texts such as ``valve.area=12.6mm^2``, or a dictionary in which a number is in SI
        valve: name of a valve of the set; default: the set's own choice
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        the Device, all numbers in SI units

    Raises:
        ParameterError: a set that cannot be used, and an override of another valve than the one that is named

    >>> import ppafo
    >>> device = ppafo.load_device("ppafo2011", overrides={"supply.pressure": "70 psi_g"})
    >>> print(f"{device.supply.pressure:.0f} Pa absolute, {device.foot_plate.inertia:g} kg m^2")
    583958 Pa absolute, 0.0084 kg m^2
    """
    name_plugins(plugins)
    given = read_overrides(overrides)
    check_valve(given, valve, f"valve = '{valve}'")
    loaded = parameter_set if isinstance(parameter_set, ParameterSet) else load_parameter_set(parameter_set)
    return build_device(with_overrides(loaded, given, valve), valve)


@checked
def load_parameter_set(parameter_set: str | Path, *, plugins: Plugins = ()) -> ParameterSet:
    """Load a parameter set, by bundled name or path of a TOML file.

    ``plugins`` are modules of your own whose objects files may name, as of ``simulate``.

    >>> import ppafo
    >>> ppafo.load_parameter_set("ppafo2011").title
    'Portable powered ankle-foot orthosis, completed'
    """
    name_plugins(plugins)
    content, file = _FILE.read(parameter_set), label(str(parameter_set))
    return parse_parameter_set(content, file, Path(parameter_set).parent)


def set_or_load(parameter_set: ParameterSet | str | Path | None) -> ParameterSet | None:
    """Return a ParameterSet unchanged, or load it by name or path; None for None."""
    if parameter_set is None or isinstance(parameter_set, ParameterSet):
        return parameter_set
    return load_parameter_set(parameter_set)


def parse_parameter_set(content: bytes, file: str, folder: Path | None = None) -> ParameterSet:
    """Parse the bytes of a parameter set file; ``file`` is the label in messages.

    The file of a measured actuator is searched relative to ``folder``. Raises ParameterError if the set is not usable.
    """
    document = _FILE.parse(content, file)
    # The kind of an actuator is optional: by default it is a vane.
    if isinstance(actuator := document.get("actuator"), dict):
        actuator.setdefault("kind", VANE)
    _load_named_kinds(document)
    parsed = validate(parameter_file(), document, file, ParameterError, whole_parameter_file)
    parameter_set = _parameter_set(parsed, file, folder or Path())
    # Refuses a default valve that the set does not have.
    chosen_valve(parameter_set, None)
    _check_numbers(parameter_set)
    return replace(parameter_set, shown=written_units(parameter_set.numbers))


def _load_named_kinds(document: Mapping[str, Any]) -> None:
    """Load the valves, the actuator and the effects that an unchecked document names, those of other packages too."""
    valves, actuator, effects = (
        section if isinstance(section := document.get(name), dict) else {} for name in ("valves", "actuator", SECTION)
    )
    for catalogue, tables in ((VALVES, valves.values()), (ACTUATORS, [actuator])):
        for kind in [component.get("kind") for component in tables if isinstance(component, dict)]:
            if isinstance(kind, str):
                catalogue.get(kind)
    find_effects(f"{SECTION}.{name}" for name in effects)


def _parameter_set(parsed: Any, file: str, folder: Path) -> ParameterSet:
    """Return the set of a validated file, whose entries are now keyed by dotted path."""
    entries = dict(_entries(parsed, ""))
    actuator = parsed.actuator
    stated = ("name", "title", "citation", "notes", "completed_by", "default_valve")
    return ParameterSet(
        file=file,
        **{name: getattr(parsed, name) for name in stated},
        parent=beside(parsed.parent, folder, list_sets()) if parsed.parent else "",
        valve_kinds={name: valve.kind for name, valve in parsed.valves.items()},
        actuator_kind=VANE if actuator is None else actuator.kind,
        actuator_file=getattr(actuator, "file", ""),
        actuator_table=None if actuator is None else _measured_curves(actuator, folder),
        numbers={path: entry for path, entry in entries.items() if isinstance(entry, Entry)},
        texts={path: entry for path, entry in entries.items() if isinstance(entry, TextEntry)},
        flags={path: entry for path, entry in entries.items() if isinstance(entry, FlagEntry)},
        accepted={finding.finding: finding.reason for finding in parsed.accepted},
        joint=ANKLE if parsed.joint is None else _joint_names(parsed.joint, file),
    )


def _entries(node: object, path: str) -> Iterator[tuple[str, object]]:
    """Yield every entry of a validated file with its dotted path."""
    if isinstance(node, Entry | TextEntry | FlagEntry):
        yield path, node
    elif isinstance(node, BaseModel | dict):
        for name, child in dict(node).items():
            yield from _entries(child, f"{path}.{name}" if path else name)


def _measured_curves(actuator: Any, folder: Path) -> Any:
    """Return the curves in the file of a measured actuator; None for an actuator without such a file."""
    table_kind = ACTUATORS[actuator.kind].model.table
    if table_kind is None:
        return None
    # Imported late, since few devices have a measured actuator.
    from ppafo.model.actuators.table import Table
    from ppafo.parameters.actuator_table import read_actuator_table

    # The file of another package's actuator may have another form, which is not read here.
    return read_actuator_table(folder / actuator.file) if table_kind is Table else None


def _joint_names(words: Any, file: str) -> JointNames:
    """Return the names of the joint of a validated file. Raises ParameterError without a name for a falling angle."""
    negative = words.negative or OPPOSITES.get(words.positive)
    if negative is None:
        hint = nearest_name(words.positive, OPPOSITES)
        raise ParameterError(
            f"{file}: joint.positive = '{words.positive}': the name of the opposite direction is unknown{hint}; "
            "also give joint.negative"
        )
    return JointNames(words.name, words.positive, negative)


def _check_numbers(parameter_set: ParameterSet) -> None:
    """Raise ParameterError for a number of an absent second chamber or valve, and for a unit that does not fit."""
    file, numbers = parameter_set.file, parameter_set.numbers
    if parameter_set.has_one_chamber and (of_second := OF_SECOND_CHAMBER.intersection(numbers)):
        raise ParameterError(f"{file}: {WHY_ONE_CHAMBER}; remove {', '.join(sorted(of_second))}")
    declared = parameter_set.declarations()
    for path, entry in numbers.items():
        # The layout of the file declares all paths but reported.valves.NAME, whose valve may be absent.
        if path not in declared:
            valve = path.split(".")[2]
            hint = nearest_name(valve, parameter_set.valve_kinds)
            raise ParameterError(f"{file}: {path}: there is no valve '{valve}'{hint}")
        with refused_as(ParameterError, f"{file}: {path}.unit", UnitError):
            check_unit(entry.unit, alternatives(declared[path])[0])


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a parameter set file, with the valves, actuators and effects of all packages."""
    for catalogue in (VALVES, ACTUATORS, EFFECTS):
        catalogue.load_all()
    return make_schema(parameter_file(), "ppafo parameter set")


def whole_parameter_file() -> type[BaseModel]:
    """Return the validation model of a parameter set file with all valves, actuators and effects of this package."""
    for catalogue in (VALVES, ACTUATORS, EFFECTS):
        catalogue.load_own()
    return parameter_file()


def parameter_file() -> type[BaseModel]:
    """Return the validation model of a parameter set file, for the loaded valves, actuators and effects.

    If a file names no valve or actuator, all kinds of this package are used.
    """
    valves, actuators = VALVES.loaded_or_own(), ACTUATORS.loaded_or_own()
    return _file_model(tuple(valves.items()), tuple(actuators.items()), device_effects())


# A dotted path names a valve: a dot or a blank in its name would make it another path.
_VALVE_NAME = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
_VALVE_KEYS = Field(json_schema_extra={"additionalProperties": False})
_JOINT_WORDS = Annotated[str, Field(pattern=r"^[a-z][a-z ]{0,39}$")]
_JOINT = table(
    "JointNames",
    {
        "name": (_JOINT_WORDS, Field(description="name of the joint, such as 'elbow'")),
        "positive": (_JOINT_WORDS, Field(description="what a growing angle is called, such as 'flexion'")),
        "negative": optional(_JOINT_WORDS, "what a falling angle is called; the opposite unless given"),
    },
)
_HEAD: dict[str, Any] = {
    "schema_version": (SchemaVersion, ...),
    "name": (str, Field(pattern=NAME)),
    "title": (str, Field(min_length=1)),
    "citation": optional(Citation, "where the set was published"),
    "notes": (str, ""),
    "completed_by": (str, Field("", description="name of a set that completes this one")),
    "parent": (
        str,
        Field("", description="parent set, a name or a path relative to this file; the audit lists the changes"),
    ),
    "default_valve": (str, Field(description="name of the valve that a device has by default")),
    "accepted": (list[Accepted], Field(default_factory=list, description="contradictions kept for a reason")),
    "joint": optional(_JOINT, "the joint that the actuator turns, in words; the ankle unless given"),
}
"""Keys of a parameter set file before its sections of values."""


@functools.lru_cache(maxsize=4)
def _file_model(
    valves: tuple[tuple[str, ValveKind], ...],
    actuators: tuple[tuple[str, ActuatorKind], ...],
    effects: tuple[Effect, ...],
) -> type[BaseModel]:
    """Return the validation model of a file; sections other than the valves are optional: a set may be incomplete."""
    valve_report = _section("ReportedOfAValve", declaration.REPORTED_OF_A_VALVE)
    reported = {
        declaration.REPORTED_FORMULA: optional(TextEntry, "exponent inside C1, a formula in k"),
        "valves": optional(
            Annotated[GenericAlias(dict, (_VALVE_NAME, valve_report)), _VALVE_KEYS],
            "reported values of the valves, by valve name",
        ),
    }
    effect_sections = {
        effect.name: optional(_section(f"{effect.name.capitalize()}Effect", effect.quantities), effect.summary)
        for effect in effects
    }
    sections = {
        "gas": _section("Gas", declaration.GAS, species=optional(TextEntry, "name of the gas")),
        "actuator": one_of([_actuator_section(*actuator) for actuator in actuators]),
        "friction": _section("Friction", declaration.FRICTION),
        "foot_plate": _section("FootPlate", declaration.FOOT_PLATE),
        "supply": _section("Supply", declaration.SUPPLY, relieving=optional(FlagEntry, declaration.RELIEVING)),
        "flow": _section("Flow", declaration.FLOW),
        SECTION: table("Effects", effect_sections),
        "reported": _section("Reported", declaration.REPORTED, **reported),
    }
    valve_tables = [
        _section(
            f"{name.capitalize()}Valve",
            declaration.ORIFICE + kind.quantities,
            kind=(Literal[name], Field(description=kind.summary)),
        )
        for name, kind in valves
    ]
    optional_sections = {name: optional(model, f"section {name}") for name, model in sections.items()}
    by_valve = (
        Annotated[GenericAlias(dict, (_VALVE_NAME, one_of(valve_tables))), _VALVE_KEYS],
        Field(min_length=1, description="valves by name"),
    )
    return table("ParameterFile", _HEAD | optional_sections | {"valves": by_valve})


def _actuator_section(name: str, kind: ActuatorKind) -> Any:
    """Return the validation model of the actuator section; key ``kind`` is optional for a vane."""
    default: Any = VANE if name == VANE else ...
    keys: dict[str, Any] = {
        "kind": (Literal[name], Field(default, description=kind.summary)),
        "leak": optional(_section("Leak", declaration.ORIFICE), "leak from chamber 1 to chamber 2"),
    }
    if kind.model.table is not None:
        keys["file"] = (str, Field(min_length=1, description="file name, relative to the folder of the set"))
    model_name = "Actuator" if name == VANE else f"{name.capitalize()}Actuator"
    return _section(model_name, declaration.actuator_quantities(name), **keys)


def _section(name: str, quantities: tuple[Quantity, ...], /, **keys: Any) -> Any:
    """Return the validation model of a section: an optional entry for each quantity, and other ``keys``."""
    entries = {
        quantity.name: optional(Entry, f"{quantity.summary} [{quantity.unit or '-'}]") for quantity in quantities
    }
    return table(re.sub(r"\W", "_", name, flags=re.ASCII), entries | keys)


def parameter_set_toml(parameter_set: ParameterSet) -> str:
    """Return the TOML text of a set: header, citation, all values with provenance, accepted contradictions."""
    keys = ("name", "title", "default_valve", "completed_by", "parent", "notes")
    head = {key: value for key in keys if (value := getattr(parameter_set, key))}
    lines = [*assignments({"schema_version": 1, **head})]
    if parameter_set.citation is not None:
        lines += table_lines("citation", parameter_set.citation.model_dump(exclude_defaults=True))
    if parameter_set.joint != ANKLE:
        lines += table_lines("joint", asdict(parameter_set.joint))
    if parameter_set.actuator_kind != VANE:
        file = {"file": parameter_set.actuator_file} if parameter_set.actuator_file else {}
        lines += table_lines("actuator", {"kind": parameter_set.actuator_kind, **file})
    # Section by section, in the order in which the sections first occur.
    entries, kinds_to_write = parameter_set.entries(), dict(parameter_set.valve_kinds)
    sections = list(dict.fromkeys(path.rpartition(".")[0] for path in entries))
    for path in sorted(entries, key=lambda path: sections.index(path.rpartition(".")[0])):
        valve = path.split(".")[1] if path.startswith("valves.") else ""
        if valve in kinds_to_write:
            lines += table_lines(f"valves.{valve}", {"kind": kinds_to_write.pop(valve)})
        lines += table_lines(path, entries[path].model_dump(exclude_defaults=True))
    # A valve of which nothing but its kind is known has a table all the same.
    for valve, kind in kinds_to_write.items():
        lines += table_lines(f"valves.{valve}", {"kind": kind})
    for finding, reason in parameter_set.accepted.items():
        lines += ("", "[[accepted]]", *assignments({"finding": finding, "reason": reason}))
    return "\n".join(lines) + "\n"
