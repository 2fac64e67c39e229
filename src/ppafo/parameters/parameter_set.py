"""Parameter set: values with origin, as given and in SI."""

import contextlib
import math
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import ParameterError, UnitError, refused_as
from ppafo.model.catalog import ACTUATORS
from ppafo.model.declaration import Number, Quantity
from ppafo.parameters.declaration import alternatives, fits, is_within, quantities, range_rule
from ppafo.parameters.declared import Many, Words
from ppafo.parameters.graph import (
    ATMOSPHERE_PATH,
    DISPLACEMENT_PATH,
    PRESSURE_PATH,
    SAME_PRESSURE,
    SECOND_PRESSURE_PATH,
    TORQUE_CONSTANT_PATH,
    Link,
    follows,
    gauge_link,
)
from ppafo.parameters.joint import ANKLE, JointNames
from ppafo.parameters.records import fields_of
from ppafo.units import SI, base_value, format_quantity, split_quantity, to_si
from ppafo.units.shown import shown_unit, units_beside
from ppafo.wording import check_known

if TYPE_CHECKING:  # few devices have a measured actuator
    from ppafo.model.actuators.table import Table

Origin = Literal["published", "datasheet", "derived", "identified", "fitted", "assumed"]
"""Provenance of a value; ``fitted`` values hold for one model of the recordings only."""


CONFIDENCE = 0.95
"""Confidence level [-] of the interval whose half-width an entry states."""


_Origin = Annotated[Origin, Words("origin of the value", allowed=get_args(Origin))]
_Source = Annotated[str, Words("source: page, equation, data sheet, recording")]
_Note = Annotated[str, Words("reason, conflict or remark")]
SOURCE = "override"


@dataclass(frozen=True, slots=True)
class Entry:
    """Number in a parameter set, in its given unit, with origin and source."""

    value: Annotated[float, Number("", "the number, in the unit beside it", plain=True)]
    unit: Annotated[str, Words("such as 'mm^2', 'psi_g' (gauge), 'psi_a' (absolute); '' for a number", is_filled=False)]
    origin: _Origin
    source: _Source
    note: _Note = ""
    uncertainty: Annotated[
        float | None, Number("", "half width of the 95 % interval, same unit", minimum=0.0, plain=True)
    ] = None
    key: Annotated[
        str, Words("statement that gives the number, with which it is audited: 'PUBLICATION/ID[.ARGUMENT]'")
    ] = ""


@dataclass(frozen=True, slots=True)
class TextEntry:
    """Name, formula, or true or false in a parameter set, with origin and source."""

    value: Annotated[str | bool, Words("name or formula")]
    origin: _Origin
    source: _Source
    note: _Note = ""


@dataclass(frozen=True, slots=True)
class Citation:
    """Publication or report behind a parameter set; unknown fields are left out."""

    title: Annotated[str, Words()]
    authors: Annotated[tuple[str, ...], Many(Words("", True))] = ()
    year: Annotated[int | None, Number("", "year of publication", None, 1800.0, 2200.0, whole=True)] = None
    doi: Annotated[str, Words()] = ""
    note: Annotated[str, Words()] = ""


NUMBER_ENTRY, TEXT_ENTRY, CITATION = map(fields_of, (Entry, TextEntry, Citation))
FLAG_ENTRY = {**TEXT_ENTRY, "value": Words("true or false", True, form=bool)}


def written(entry: Entry | TextEntry | Citation) -> dict[str, Any]:
    """Return the table of an entry in a file, without defaults."""
    return {
        item.name: list(value) if isinstance(value, tuple) else value
        for item in fields(entry)
        if (value := getattr(entry, item.name)) != item.default
    }


@dataclass(frozen=True, slots=True, repr=False)
class ParameterSet:
    """Parameter set: values as given, with provenance; gaps and conflicts are allowed until ``build_device``.

    ``file`` is the label used in messages. ``numbers`` and ``texts`` are keyed by paths such as
    ``actuator.leak.area`` or ``valves.solenoid.area``. ``valve_kinds`` gives the catalogue kind of each valve,
    ``actuator_kind`` the kind of the actuator, ``actuator_file`` the file of a measured actuator and ``actuator_table``
    its curves. ``joint`` names the turned joint. ``parent`` is the set from which this one was copied, a bundled name
    or a path relative to the working directory; '' without one. ``shown`` maps each SI unit to the unit used by the
    author, in which numbers are displayed, overridden ones too.
    """

    file: str
    name: str
    title: str
    citation: Citation | None
    notes: str
    completed_by: str
    parent: str
    default_valve: str
    valve_kinds: Mapping[str, str]
    actuator_kind: str
    actuator_file: str
    actuator_table: "Table | None"
    numbers: Mapping[str, Entry]
    texts: Mapping[str, TextEntry]
    accepted: Mapping[str, str]
    joint: JointNames = ANKLE
    shown: Mapping[str, str] = field(default_factory=dict, compare=False)

    def __repr__(self) -> str:
        """Return name, title, number of values, and valves; ``ppafo sets show`` lists every value."""
        valves = ", ".join(f"{name} ({kind})" for name, kind in self.valve_kinds.items())
        return f"ParameterSet '{self.name}': {self.title}\n  {len(self.entries())} values; valves: {valves}"

    def entries(self) -> dict[str, Entry | TextEntry]:
        """Return all values of the set by path, as given: texts, then numbers."""
        return {**self.texts, **self.numbers}

    def declarations(self) -> Mapping[str, Quantity]:
        """Return the declarations of all numbers that this set may contain, by path."""
        return quantities(self.valve_kinds, self.actuator_kind, self.has_one_chamber)

    @property
    def has_one_chamber(self) -> bool:
        """True if the actuator has one chamber, so that the set has no numbers of a second one."""
        return self.actuator_table is not None and ACTUATORS[self.actuator_kind].has_one_chamber(self.actuator_table)


_SPEAKING = {
    "Pa_a": (PRESSURE_PATH, SECOND_PRESSURE_PATH),
    "N m": ("friction.static_torque",),
    "rad": ("actuator.angle_max", "actuator.angle_min"),
}
"""Paths of the values whose unit sets the display unit of a quantity, by SI unit."""
PATHS_THAT_SET_UNITS = (
    "reference.",
    "motion.",
    "initial.",
    "supply.",
    "controller.peak_torque",
    *_SPEAKING["N m"],
    *_SPEAKING["rad"],
)
"""Prefixes of the paths whose unit, in an override or a study, sets the display unit of all levels of the quantity.

A unit of a controller setting or a sensor is of this number alone: a tolerance in rad leaves angles in deg.
"""
_SPEAKING_ENDS = {
    "kg/s": (".mass_flow",),
    "m^3/(s Pa)": (".sonic_conductance",),
    "m^2": (".area",),
    "m^3": (".dead_volume_1", ".dead_volume"),
}
"""Path suffixes of the values whose unit sets the display unit of a quantity, by SI unit."""


def written_units(numbers: Mapping[str, Entry]) -> dict[str, str]:
    """Return the author's units for pressures, torques, angles and flows, by SI unit.

    ``numbers`` are the entries of the set by path. Quantities without a number are left out.
    """
    by_end = {
        si_unit: tuple(path for path in numbers if path.endswith(ends)) for si_unit, ends in _SPEAKING_ENDS.items()
    }
    speaking = {**_SPEAKING, **by_end}
    units: dict[str, str] = {}
    for si_unit, paths in speaking.items():
        for unit in [numbers[path].unit for path in reversed(paths) if path in numbers]:
            units |= units_beside(si_unit, unit) if fits(unit, si_unit) else {}
    return units


def units_of_texts(texts: Iterable[object]) -> dict[str, str]:
    """Return the units used in texts for pressures, torques and angles, by SI unit.

    The last text with a quantity decides. Plain numbers and numbers in ``SI`` are ignored.
    """
    units: dict[str, str] = {}
    for unit in map(unit_in, texts):
        for si_unit in _SPEAKING if unit not in ("", SI) else ():
            units |= units_beside(si_unit, unit) if fits(unit, si_unit) else {}
    return units


def chosen_units(texts: Iterable[object]) -> dict[str, str]:
    """Return the units used in texts as in ``units_of_texts``, without default units of the package.

    A file in default units makes no choice: the units of a parameter set take precedence.
    """
    return {si_unit: unit for si_unit, unit in units_of_texts(texts).items() if unit != shown_unit(si_unit, {})}


def unit_in(text: object) -> str:
    """Return the unit in a text of number and unit; empty for anything else."""
    with contextlib.suppress(UnitError):
        return split_quantity(text)[1] if isinstance(text, str) else ""
    return ""


def chosen_valve(parameter_set: ParameterSet, valve: str | None) -> str:
    """Return the name of the requested valve, else of the default valve of the set.

    Raises ParameterError if the set has no such valve.
    """
    name = valve or parameter_set.default_valve
    check_known(name, parameter_set.valve_kinds, ParameterError, f"{parameter_set.file}: there is no valve '{name}'")
    return name


def atmospheric_pressure(parameter_set: ParameterSet) -> float:
    """Return the atmospheric pressure [Pa absolute], the zero of the set's gauge pressures.

    Raises ParameterError if the set does not give it as an absolute pressure.
    """
    entry = parameter_set.numbers.get(ATMOSPHERE_PATH)
    if entry is None:
        return STANDARD_ATMOSPHERE
    if not entry.unit.endswith("_a"):
        unit = entry.unit
        raise ParameterError(
            f"{parameter_set.file}: {ATMOSPHERE_PATH} = {entry.value:g} {unit} must be an absolute pressure, such as "
            "'101.3 kPa_a'"
        )
    return entry_in_si(entry, parameter_set.declarations()[ATMOSPHERE_PATH], STANDARD_ATMOSPHERE)


def links_of_set(
    parameter_set: ParameterSet, valve: str, set_paths: Collection[str] = (), atmosphere: float | None = None
) -> dict[str, tuple[Link, ...]]:
    """Return the links of a set with one of its valves: gauge pressures to the atmosphere, a regulator to the other.

    The second regulator follows the first if the set has the same pressure for both, unless ``set_paths`` contains only
    the second; of an actuator with one chamber it follows the atmosphere. The pressures are compared at ``atmosphere``
    [Pa absolute], by default the set's. The displacement of a vane per radian follows its torque constant, by virtual
    work, unless the set states it.
    """
    numbers = parameter_set.numbers
    of_device = {re.sub(f"^valves[.]{re.escape(valve)}[.]", "valve.", path): entry for path, entry in numbers.items()}
    links = {
        path: gauge_link(path, entry.value, entry.unit)
        for path, entry in of_device.items()
        if not path.startswith(("reported.", "valves."))
    }
    if parameter_set.has_one_chamber:
        # A port between two atmospheres passes nothing, as one that is plugged.
        links[SECOND_PRESSURE_PATH] = (follows(ATMOSPHERE_PATH),)
    elif SECOND_PRESSURE_PATH not in numbers:
        links[SECOND_PRESSURE_PATH] = (follows(PRESSURE_PATH),)
    elif has_one_pressure(parameter_set, atmosphere) and not (
        SECOND_PRESSURE_PATH in set_paths and PRESSURE_PATH not in set_paths
    ):
        links[SECOND_PRESSURE_PATH] = (follows(PRESSURE_PATH, when_set=True), *links[SECOND_PRESSURE_PATH])
    if DISPLACEMENT_PATH in parameter_set.declarations() and DISPLACEMENT_PATH not in numbers:
        links[DISPLACEMENT_PATH] = (follows(TORQUE_CONSTANT_PATH),)
    return {path: links for path, links in links.items() if links}


def has_one_pressure(parameter_set: ParameterSet, atmosphere: float | None = None) -> bool:
    """Return True if both regulators have equal pressure, with the given atmosphere [Pa absolute] or the set's."""
    entries = [parameter_set.numbers.get(path) for path in (PRESSURE_PATH, SECOND_PRESSURE_PATH)]
    declared = parameter_set.declarations()
    zero = atmospheric_pressure(parameter_set) if atmosphere is None else atmosphere
    try:
        first, second = (entry_in_si(entry, declared[PRESSURE_PATH], zero) for entry in entries if entry is not None)
    except (UnitError, ValueError):  # one of them is missing, or is no pressure
        return False
    return math.isclose(first, second, rel_tol=SAME_PRESSURE)


def with_followers(parameter_set: ParameterSet) -> ParameterSet:
    """Return the set completed with linked numbers that it does not state.

    The second regulator gets the pressure of the first. The displacement of a vane per radian gets its torque constant:
    by virtual work, T dtheta = (P1 - P2) dV.
    """
    pressure, constant = (parameter_set.numbers.get(path) for path in (PRESSURE_PATH, TORQUE_CONSTANT_PATH))
    followers = {}
    if pressure is not None and not parameter_set.has_one_chamber:
        note = f"follows {PRESSURE_PATH}"
        followers[SECOND_PRESSURE_PATH] = replace(pressure, note=note, key="")
    if constant is not None and DISPLACEMENT_PATH in parameter_set.declarations():
        followers[DISPLACEMENT_PATH] = Entry(
            value=constant.value,
            unit=f"{constant.unit}/rad",
            origin="derived",
            source="virtual work",
            note=f"follows {TORQUE_CONSTANT_PATH}",
            uncertainty=constant.uncertainty,
        )
    return replace(parameter_set, numbers={**followers, **parameter_set.numbers})


def entry_in_si(entry: Entry, quantity: Quantity, atmosphere: float) -> float:
    """Convert the value of an entry to the SI unit of its quantity. Raises UnitError for a wrong dimension."""
    return in_first_unit(quantity, lambda unit: to_si(entry.value, entry.unit, unit, atmosphere))


def in_first_unit(quantity: Quantity, convert: Callable[[str], float]) -> float:
    """Convert to the first SI unit of a quantity that ``convert`` accepts. Raises UnitError for a wrong dimension."""
    preferred, *others = alternatives(quantity)
    try:
        return convert(preferred)
    except UnitError:
        for unit in others:
            with contextlib.suppress(UnitError):
                return convert(unit)
        # The first refusal names the unit that the declaration prefers.
        raise


def allowed_number(written: str, entry: Any, quantity: Quantity, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Return the checked SI value of an entry or part figure; messages begin with the text ``written``.

    Raises ParameterError if the unit has a wrong dimension or the value is out of range.
    """
    with refused_as(ParameterError, written, UnitError):
        value = entry_in_si(entry, quantity, atmosphere)
    if not is_within(value, quantity):
        raise ParameterError(f"{written}: {range_rule(quantity, entry.unit)}")
    return value


def number_in_si(parameter_set: ParameterSet, path: str) -> float | None:
    """Return the value of a parameter [SI]; None if the set lacks it.

    A value of a wrong dimension is converted to the base units of its own unit, so that the audit can report the unit
    once and still compare the number elsewhere.
    """
    entry = parameter_set.numbers.get(path)
    if entry is None:
        return None
    try:
        return entry_in_si(entry, parameter_set.declarations()[path], atmospheric_pressure(parameter_set))
    except UnitError:
        return base_value(entry.value, entry.unit)


def entry_text(entry: Entry | TextEntry) -> str:
    """Format the value of any entry: number with unit, text, true or false."""
    if isinstance(entry, Entry):
        return format_quantity(entry.value, entry.unit)
    return str(entry.value).lower() if isinstance(entry.value, bool) else entry.value


def overridden_paths(parameter_set: ParameterSet) -> frozenset[str]:
    """Return the paths whose values come from overrides."""
    return frozenset(path for path, entry in parameter_set.entries().items() if entry.source == SOURCE)
