"""Parameter set files: layout from the declarations, loading by name or path, and writing."""

import functools
import re
from collections.abc import Iterator
from dataclasses import asdict, replace
from importlib import resources
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.arguments import Name, Overrides, checked
from ppafo.documents.models import SchemaVersion, make_schema, one_of, optional, table, validate
from ppafo.documents.problems import NAME
from ppafo.documents.toml_text import TomlKind, assignments, beside, label
from ppafo.errors import ParameterError, UnitError, refused_as
from ppafo.kinds import Kinds
from ppafo.model.catalog import ACTUATORS, EFFECTS, VALVES, device_effects, find_effects
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import SECTION
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

# A dotted path names a valve: a dot or a blank in its name would make it another path.
_VALVE_NAME = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]


def _by_name(model: Any) -> Any:
    named = Field(json_schema_extra={"additionalProperties": False})
    return Annotated[GenericAlias(dict, (_VALVE_NAME, model)), named]


def _section(name: str, quantities: tuple[Quantity, ...], extra: dict[str, Any] | None = None) -> Any:
    fields = {quantity.name: optional(Entry, f"{quantity.summary} [{quantity.unit or '-'}]") for quantity in quantities}
    return table(name, fields | (extra or {}))


def _capital(kind: str) -> str:
    return re.sub(r"[^A-Za-z0-9_]", "_", kind.capitalize())


def _actuator_section(kind: str) -> Any:
    """Return the validation model of the actuator section; key ``kind`` is optional for a vane."""
    described = ACTUATORS[kind].summary
    named = Field(kind, description=described) if kind == VANE else Field(description=described)
    leak = _section("Leak", declaration.ORIFICE)
    extra: dict[str, Any] = {
        "kind": (Literal[kind], named),
        "leak": optional(leak, "leak from chamber 1 to chamber 2"),
    }
    if ACTUATORS[kind].model.table is not None:
        extra["file"] = (str, Field(min_length=1, description="file name, relative to the folder of the set"))
    name = "Actuator" if kind == VANE else f"{_capital(kind)}Actuator"
    return _section(name, declaration.actuator_quantities(kind), extra)


def _sections() -> dict[str, Any]:
    """Return the validation models of all sections; all are optional, since a set may be incomplete."""
    valve_reports = _section("ReportedOfAValve", declaration.REPORTED_OF_A_VALVE)
    reported = {
        declaration.REPORTED_FORMULA: optional(TextEntry, "exponent inside C1, a formula in k"),
        "valves": optional(_by_name(valve_reports), "reported values of the valves, by valve name"),
    }
    return {
        "gas": _section("Gas", declaration.GAS, {"species": optional(TextEntry, "name of the gas")}),
        "actuator": one_of([_actuator_section(kind) for kind in ACTUATORS.loaded()]),
        "friction": _section("Friction", declaration.FRICTION),
        "foot_plate": _section("FootPlate", declaration.FOOT_PLATE),
        "supply": _section("Supply", declaration.SUPPLY, {"relieving": optional(FlagEntry, declaration.RELIEVING)}),
        "flow": _section("Flow", declaration.FLOW),
        SECTION: table(
            "Effects",
            {
                effect.name: optional(_section(f"{_capital(effect.name)}Effect", effect.quantities), effect.summary)
                for effect in device_effects()
            },
        ),
        "reported": _section("Reported", declaration.REPORTED, reported),
    }


def parameter_file() -> type[BaseModel]:
    """Return the validation model of a parameter set file, for the loaded valves, actuators and effects.

    If a file names no valve, actuator or effect, all kinds of this package are used.
    """
    named = (VALVES.loaded_or_own(), ACTUATORS.loaded_or_own(), EFFECTS.loaded())
    return _parameter_file(tuple(kind for kinds in named for kind in kinds.items()))


def whole_parameter_file() -> type[BaseModel]:
    """Return the validation model of a parameter set file with all valves, actuators and effects of this package."""
    for kinds in _KINDS:
        kinds.load_own()
    return parameter_file()


_KINDS: tuple[Kinds[Any], ...] = (VALVES, ACTUATORS, EFFECTS)


_WORD = Annotated[str, Field(pattern=r"^[a-z][a-z ]{0,39}$")]
_JOINT = table(
    "JointNames",
    {
        "name": (_WORD, Field(description="name of the joint, such as 'elbow'")),
        "positive": (_WORD, Field(description="what a growing angle is called, such as 'flexion'")),
        "negative": optional(_WORD, "what a falling angle is called; the opposite unless given"),
    },
)


@functools.lru_cache(maxsize=4)
def _parameter_file(_kinds: Any) -> type[BaseModel]:
    fields: dict[str, Any] = {
        "schema_version": (SchemaVersion, ...),
        "name": (str, Field(pattern=NAME)),
        "title": (str, Field(min_length=1)),
        "citation": optional(Citation, "where the set was published"),
        "notes": (str, ""),
        "completed_by": (str, Field("", description="name of a set that completes this one")),
        "parent": (
            str,
            Field(
                "",
                description="parent set, a name or a path relative to this file; the audit lists the changes",
            ),
        ),
        "default_valve": (str, Field(description="name of the valve that a device has by default")),
        "accepted": (list[Accepted], Field(default_factory=list, description="contradictions kept for a reason")),
    }
    fields["joint"] = optional(_JOINT, "the joint that the actuator turns, in words; the ankle unless given")
    fields |= {name: optional(model, f"section {name}") for name, model in _sections().items()}
    valves = [
        _section(
            f"{_capital(kind)}Valve",
            declaration.ORIFICE + VALVES[kind].quantities,
            {"kind": (Literal[kind], Field(description=VALVES[kind].summary))},
        )
        for kind in VALVES.loaded()
    ]
    fields["valves"] = (_by_name(one_of(valves)), Field(min_length=1, description="valves by name"))
    return table("ParameterFile", fields)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a parameter set file, with the valves, actuators and effects of all packages."""
    for kinds in _KINDS:
        kinds.load_all()
    return make_schema(parameter_file(), "ppafo parameter set")


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
    # The valves, the actuator and the effects that a set names, other packages' too, are loaded before it is checked.
    valves, actuator, effects = (document.get(name) for name in ("valves", "actuator", SECTION))
    for valve in valves.values() if isinstance(valves, dict) else ():
        kind = valve.get("kind") if isinstance(valve, dict) else None
        if isinstance(kind, str):
            VALVES.get(kind)
    # An actuator without a kind is a vane.
    if isinstance(actuator, dict) and isinstance(actuator.setdefault("kind", VANE), str):
        ACTUATORS.get(actuator["kind"])
    find_effects(f"{SECTION}.{name}" for name in (effects if isinstance(effects, dict) else ()))
    parsed: Any = validate(parameter_file(), document, file, ParameterError, whole_parameter_file)
    parameter_set = _flatten(parsed, file, folder or Path())
    chosen_valve(parameter_set, None)
    declared = parameter_set.declarations()
    of_second = OF_SECOND_CHAMBER.intersection(parameter_set.numbers if parameter_set.has_one_chamber else ())
    if of_second:
        raise ParameterError(f"{parameter_set.file}: {WHY_ONE_CHAMBER}; remove {', '.join(sorted(of_second))}")
    for path, entry in parameter_set.numbers.items():
        # Only what is reported of a valve by name can be undeclared: the layout of the file knows all other paths.
        if path not in declared:
            valve = path.split(".")[2]
            hint = nearest_name(valve, parameter_set.valve_kinds)
            raise ParameterError(f"{parameter_set.file}: {path}: there is no valve '{valve}'{hint}")
        with refused_as(ParameterError, f"{parameter_set.file}: {path}.unit", UnitError):
            check_unit(entry.unit, alternatives(declared[path])[0])
    return replace(parameter_set, shown=written_units(parameter_set.numbers))


def _flatten(parsed: Any, file: str, folder: Path) -> ParameterSet:
    leaves = dict(_leaves(parsed, ""))
    actuator, measured = parsed.actuator, None
    # Few devices have a measured actuator, so what reads its file is loaded late.
    if actuator is not None and ACTUATORS[actuator.kind].model.table is not None:
        from ppafo.model.actuators.table import Table
        from ppafo.parameters.actuator_table import read_actuator_table

        # A file of another form, of another package's kind, has no reader here.
        if ACTUATORS[actuator.kind].model.table is Table:
            measured = read_actuator_table(folder / actuator.file)
    joint = ANKLE
    if (words := parsed.joint) is not None:
        negative = words.negative or OPPOSITES.get(words.positive)
        if negative is None:
            hint = nearest_name(words.positive, OPPOSITES)
            raise ParameterError(
                f"{file}: joint.positive = '{words.positive}': the name of the opposite direction is unknown{hint}; "
                "also give joint.negative"
            )
        joint = JointNames(words.name, words.positive, negative)
    return ParameterSet(
        file=file,
        name=parsed.name,
        title=parsed.title,
        citation=parsed.citation,
        notes=parsed.notes,
        completed_by=parsed.completed_by,
        parent=beside(parsed.parent, folder, list_sets()) if parsed.parent else "",
        default_valve=parsed.default_valve,
        valve_kinds={name: valve.kind for name, valve in parsed.valves.items()},
        actuator_kind=VANE if actuator is None else actuator.kind,
        actuator_file=getattr(actuator, "file", ""),
        actuator_table=measured,
        numbers={path: leaf for path, leaf in leaves.items() if isinstance(leaf, Entry)},
        texts={path: leaf for path, leaf in leaves.items() if isinstance(leaf, TextEntry)},
        flags={path: leaf for path, leaf in leaves.items() if isinstance(leaf, FlagEntry)},
        accepted={finding.finding: finding.reason for finding in parsed.accepted},
        joint=joint,
    )


def _leaves(node: object, path: str) -> Iterator[tuple[str, object]]:
    """Yield every entry of a validated file with its dotted path."""
    if isinstance(node, Entry | TextEntry | FlagEntry):
        yield path, node
        return
    children = dict(node) if isinstance(node, BaseModel | dict) else {}
    for name, child in children.items():
        yield from _leaves(child, f"{path}.{name}" if path else name)


def parameter_set_toml(parameter_set: ParameterSet) -> str:
    """Return the TOML text of a set: header, citation, all values with provenance, accepted contradictions."""
    head = {
        "name": parameter_set.name,
        "title": parameter_set.title,
        "default_valve": parameter_set.default_valve,
        "completed_by": parameter_set.completed_by,
        "parent": parameter_set.parent,
        "notes": parameter_set.notes,
    }
    lines = [*assignments({"schema_version": 1, **{key: value for key, value in head.items() if value}})]
    if parameter_set.citation is not None:
        lines += ("", "[citation]", *assignments(parameter_set.citation.model_dump(exclude_defaults=True)))
    if parameter_set.joint != ANKLE:
        lines += ("", "[joint]", *assignments(asdict(parameter_set.joint)))
    if parameter_set.actuator_kind != VANE:
        file = {"file": parameter_set.actuator_file} if parameter_set.actuator_file else {}
        lines += ("", "[actuator]", *assignments({"kind": parameter_set.actuator_kind, **file}))
    # Section by section, in the order in which the sections first occur.
    entries = parameter_set.entries()
    sections = list(dict.fromkeys(path.rpartition(".")[0] for path in entries))
    heads = {
        valve: ("", f"[valves.{valve}]", *assignments({"kind": kind}))
        for valve, kind in parameter_set.valve_kinds.items()
    }
    for path in sorted(entries, key=lambda path: sections.index(path.rpartition(".")[0])):
        if path.startswith("valves."):
            lines += heads.pop(path.split(".")[1], ())
        lines += ("", f"[{path}]", *assignments(entries[path].model_dump(exclude_defaults=True)))
    # A valve of which nothing but its kind is known has a table all the same.
    for lines_of_valve in heads.values():
        lines += lines_of_valve
    for finding, reason in parameter_set.accepted.items():
        lines += ("", "[[accepted]]", *assignments({"finding": finding, "reason": reason}))
    return "\n".join(lines) + "\n"
