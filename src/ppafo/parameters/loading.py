"""Parameter set files: loading by name or path, parsing, layout from the declarations, and writing."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from importlib import resources
from pathlib import Path
from typing import Any

from ppafo.arguments import Name, Overrides, checked
from ppafo.documents.toml_text import NAME, TomlKind, assignments, beside, label, table_lines
from ppafo.errors import KindError, ParameterError, UnitError, refused_as
from ppafo.model.catalog import ACTUATORS, EFFECTS, VALVES, find_effects
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import SECTION
from ppafo.parameters import declaration
from ppafo.parameters.building import build_device
from ppafo.parameters.declaration import OF_SECOND_CHAMBER, WHY_ONE_CHAMBER
from ppafo.parameters.declared import (
    FREE_KEY,
    JOINT_WORDS,
    Field,
    Fields,
    InnerTable,
    Many,
    Words,
    check_keys,
    inside,
    kind_at,
    layout_of,
    schema_of,
    value_at,
)
from ppafo.parameters.device import VANE, Device
from ppafo.parameters.joint import ANKLE, OPPOSITES, JointNames
from ppafo.parameters.opening_table import COLUMNS, SIZE, entries_of_opening
from ppafo.parameters.overrides import check_valve, read_overrides, with_overrides
from ppafo.parameters.parameter_set import (
    CITATION,
    FLAG_ENTRY,
    NUMBER_ENTRY,
    TEXT_ENTRY,
    Citation,
    Entry,
    ParameterSet,
    TextEntry,
    chosen_valve,
    written,
    written_units,
)
from ppafo.parameters.records import record_from
from ppafo.plugins import Plugins
from ppafo.units import check_unit
from ppafo.wording import nearest_name

FILE = TomlKind("parameter set", "parameters", resources.files("ppafo.parameters") / "sets", ParameterError)
_ORDER = "gas", "actuator", "friction", "foot_plate", "supply", "flow", SECTION, "reported", "valves"
"""Sections with values, in their order."""


def list_sets() -> tuple[str, ...]:
    """Return the names of the parameter sets that come with the package.

    >>> import ppafo
    >>> ppafo.list_sets()
    ('cylinder-lever', 'ppafo2011', 'ppafo2011-printed')
    """
    return FILE.names()


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
    return parse_parameter_set(FILE.read(parameter_set), label(str(parameter_set)), Path(parameter_set).parent)


def set_or_load(parameter_set: ParameterSet | str | Path | None) -> ParameterSet | None:
    """Return a ParameterSet unchanged, or load it by name or path; None for None."""
    if parameter_set is None or isinstance(parameter_set, ParameterSet):
        return parameter_set
    return load_parameter_set(parameter_set)


def parse_parameter_set(content: bytes, file: str, folder: Path | None = None) -> ParameterSet:
    """Parse the bytes of a parameter set file; ``file`` is the label in messages.

    The file of a measured actuator is searched relative to ``folder``. Raises ParameterError if the set is not usable.
    """
    source = FILE.parse(content, file)
    document = source.document
    with refused_as(ParameterError, file, KindError):
        fields = declared(document)
    if next(layout_of(fields).faults(document), None):
        # So that the messages know every kind of this package.
        for catalogue in (VALVES, ACTUATORS, EFFECTS):
            catalogue.load_own()
        check_keys(source, declared(document))
    parameter_set = _parameter_set(document, fields, file, folder or Path())
    # Refuses a default valve that the set does not have.
    chosen_valve(parameter_set, None)
    numbers = parameter_set.numbers
    known = parameter_set.declarations()
    if parameter_set.has_one_chamber and (of_second := OF_SECOND_CHAMBER.intersection(numbers)):
        raise ParameterError(f"{file}: {WHY_ONE_CHAMBER}; remove {', '.join(sorted(of_second))}")
    for path, entry in numbers.items():
        # The layout of the file declares all paths but reported.valves.NAME, whose valve may be absent.
        if path not in known:
            valve = path.split(".")[2]
            hint = nearest_name(valve, parameter_set.valve_kinds)
            raise ParameterError(f"{file}: {path}: there is no valve '{valve}'{hint}")
        with refused_as(ParameterError, f"{file}: {path}.unit", UnitError):
            check_unit(entry.unit)
    return replace(parameter_set, shown=written_units(numbers))


def declared(document: Mapping[str, Any]) -> dict[str, Field]:
    """Return every field that a parameter set with the kinds of a document may have, by path.

    Sections other than the valves are optional: a set may be incomplete. Raises KindError for a component that
    cannot be loaded.
    """
    find_effects(f"{SECTION}.{name}" for name in _table(document, SECTION))
    actuator = kind_at(document, "actuator") or VANE
    known_actuator = actuator if actuator in ACTUATORS else VANE
    names = [str(name) for name in _table(document, "valves")]
    kinds = {name: kind_at(document, f"valves.{name}") for name in names}
    known = {name: kind for name, kind in kinds.items() if kind in VALVES}
    reported = _table(_table(document, "reported"), "valves")
    quantities = declaration.quantities({**dict.fromkeys(reported, next(iter(VALVES))), **known}, known_actuator)
    is_measured = ACTUATORS[known_actuator].model.table is not None
    fields: dict[str, Field] = {
        **_HEAD,
        **{section: InnerTable(f"section {section}") for section in _ORDER},
        **inside("gas.species", TEXT_ENTRY, "name of the gas"),
        "actuator.kind": Words("", allowed=ACTUATORS, default=VANE),
        **({"actuator.file": Words("file name, relative to the folder of the set", True)} if is_measured else {}),
        **inside("supply.relieving", FLAG_ENTRY, declaration.RELIEVING),
        **inside(f"reported.{declaration.REPORTED_FORMULA}", TEXT_ENTRY, "exponent inside C1, a formula in k"),
        "valves": InnerTable("valves by name", True, FREE_KEY),
        "reported.valves": InnerTable("reported values of the valves, by valve name", keys=FREE_KEY),
        **{f"valves.{name}.kind": Words("", True, VALVES) for name in names},
    }
    for path in (f"valves.{name}.opening" for name, kind in kinds.items() if kind == "proportional"):
        file = "CSV file with the columns command and opening, relative to the folder of the set"
        fields |= {
            path: InnerTable("opening over the command, in place of a straight line beyond the dead band"),
            f"{path}.file": Words(file),
            **{f"{path}.{name}": Many(SIZE, f"{name} of each node, from 0 to 1") for name in COLUMNS},
            **{f"{path}.{name}": TEXT_ENTRY[name] for name in ("origin", "source", "note")},
        }
    for path, quantity in quantities.items():
        if not (path.startswith("valves.") and path.split(".")[1] not in known):
            fields |= inside(path, NUMBER_ENTRY, f"{quantity.summary} [{quantity.unit or '-'}]")
    return fields


def _table(document: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    table = document.get(name)
    return table if isinstance(table, Mapping) else {}


def _parameter_set(document: Mapping[str, Any], fields: Fields, file: str, folder: Path) -> ParameterSet:
    """Return the set of a document whose keys have been checked."""
    paths = [path for path, field in fields.items() if isinstance(field, InnerTable) and f"{path}.value" in fields]
    # Section by section, the valves last.
    paths.sort(key=lambda path: (_ORDER.index(path.partition(".")[0]), path.startswith("reported.valves.")))
    entries = {path: table for path in paths if (table := value_at(document, path)) is not None}
    texts = {}
    numbers = {}
    for path, table in entries.items():
        if isinstance(fields[f"{path}.value"], Quantity):
            numbers[path] = record_from(Entry, table)
        else:
            texts[path] = TextEntry(**table)
    for name, valve in document["valves"].items():
        if "opening" in valve:
            numbers |= entries_of_opening(valve["opening"], folder, f"{file}: valves.{name}.opening")
            find_effects(numbers)
    actuator = _table(document, "actuator")
    kind = actuator.get("kind", VANE)
    table = None
    if "file" in actuator:
        # Imported late, since few devices have a measured actuator.
        from ppafo.model.actuators.table import Table as Measured
        from ppafo.parameters.actuator_table import read_actuator_table

        with refused_as(ParameterError, f"{file}: actuator.file", ParameterError):
            # The file of another package's actuator may have another form, which is not read here.
            is_read = ACTUATORS[kind].model.table is Measured
            table = read_actuator_table(folder / actuator["file"]) if is_read else None
    citation = document.get("citation")
    parent = document.get("parent", "")
    joint = ANKLE
    if words := document.get("joint"):
        positive = words["positive"]
        negative = words.get("negative") or OPPOSITES.get(positive)
        if negative is None:
            raise ParameterError(
                f"{file}: joint.positive = '{positive}': the name of the opposite direction is unknown"
                f"{nearest_name(positive, OPPOSITES)}; also give joint.negative"
            )
        joint = JointNames(words["name"], positive, negative)
    return ParameterSet(
        file=file,
        **{name: document.get(name, "") for name in ("name", "title", "notes", "completed_by", "default_valve")},
        citation=None if citation is None else record_from(Citation, citation),
        parent=beside(parent, folder, list_sets()) if parent else "",
        valve_kinds={name: valve["kind"] for name, valve in document["valves"].items()},
        actuator_kind=kind,
        actuator_file=actuator.get("file", ""),
        actuator_table=table,
        numbers=numbers,
        texts=texts,
        accepted={item["finding"]: item["reason"] for item in document.get("accepted", ())},
        joint=joint,
    )


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a parameter set file, with the valves, actuators and effects of all packages."""
    for catalogue in (VALVES, ACTUATORS, EFFECTS):
        catalogue.load_all()
    return schema_of("ppafo parameter set", declared)


_HEAD: Mapping[str, Field] = {
    "schema_version": Words("version of this layout", True, (1,)),
    "name": Words(required=True, pattern=NAME),
    "title": Words(required=True),
    **inside("citation", CITATION, "where the set was published"),
    "notes": Words(),
    "completed_by": Words("name of a set that completes this one"),
    "parent": Words("parent set, a name or a path relative to this file; the audit lists the changes"),
    "default_valve": Words("name of the valve that a device has by default", True),
    "accepted": Many(
        lambda _: {"finding": Words("as 'ppafo sets audit' prints it", True), "reason": Words(required=True)},
        "contradictions kept for a reason",
    ),
    "joint": InnerTable("the joint that the actuator turns, in words; the ankle unless given"),
    "joint.name": Words("name of the joint, such as 'elbow'", True, pattern=JOINT_WORDS),
    "joint.positive": Words("what a growing angle is called, such as 'flexion'", True, pattern=JOINT_WORDS),
    "joint.negative": Words("what a falling angle is called; the opposite unless given", pattern=JOINT_WORDS),
}
"""Keys of a parameter set file before its sections of values."""


def parameter_set_toml(parameter_set: ParameterSet) -> str:
    """Return the TOML text of a set: header, citation, all values with provenance, accepted contradictions."""
    keys = ("name", "title", "default_valve", "completed_by", "parent", "notes")
    head = {key: value for key in keys if (value := getattr(parameter_set, key))}
    lines = [*assignments({"schema_version": 1, **head})]
    if parameter_set.citation is not None:
        lines += table_lines("citation", written(parameter_set.citation))
    if parameter_set.joint != ANKLE:
        lines += table_lines("joint", asdict(parameter_set.joint))
    if parameter_set.actuator_kind != VANE:
        file = {"file": parameter_set.actuator_file} if parameter_set.actuator_file else {}
        lines += table_lines("actuator", {"kind": parameter_set.actuator_kind, **file})
    # Section by section, in the order in which the sections first occur.
    entries = parameter_set.entries()
    kinds_to_write = dict(parameter_set.valve_kinds)
    sections = list(dict.fromkeys(path.rpartition(".")[0] for path in entries))
    for path in sorted(entries, key=lambda path: sections.index(path.rpartition(".")[0])):
        valve = path.split(".")[1] if path.startswith("valves.") else ""
        if valve in kinds_to_write:
            lines += table_lines(f"valves.{valve}", {"kind": kinds_to_write.pop(valve)})
        lines += table_lines(path, written(entries[path]))
    # A valve of which nothing but its kind is known has a table all the same.
    for valve, kind in kinds_to_write.items():
        lines += table_lines(f"valves.{valve}", {"kind": kind})
    for finding, reason in parameter_set.accepted.items():
        lines += ("", "[[accepted]]", *assignments({"finding": finding, "reason": reason}))
    return "\n".join(lines) + "\n"
