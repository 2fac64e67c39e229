"""Numbers that a design may choose: read from the file, and from places in the unit interval to SI values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, Field

from ppafo.documents.models import STRICT, Texts
from ppafo.errors import StudyError, UnitError, nearest_name
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import AREA_FORM, SONIC_FORM, is_within
from ppafo.parameters.parts import Part
from ppafo.questions.design.front import Floats
from ppafo.simulation.numbers import TIMES, declared_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.units import parse_quantity

SIZE = "actuator.size"
DEAD_VOLUME = "actuator.dead_volume"
OWN = {
    SIZE: Quantity(
        "size",
        "",
        "scale of the actuator's torque constant, volume per angle and mass relative to the part",
        None,
        0.05,
        20.0,
    ),
    DEAD_VOLUME: Quantity("dead_volume", "m^3", "dead volume of each chamber", None, 1.0e-9, 1.0e-1),
}
"""Variables that stand for several numbers of the device."""

_BY_PARTS = {
    "actuator.torque_constant": SIZE,
    "actuator.volume_per_angle": SIZE,
    "actuator.dead_volume_1": DEAD_VOLUME,
    "actuator.dead_volume_2": DEAD_VOLUME,
}
_AREA = {f"valve.{item.name}" for item in AREA_FORM}
_SONIC = {f"valve.{item.name}" for item in SONIC_FORM}


class VariableTable(BaseModel):
    """A number that may be chosen: between two limits, or one of some values."""

    model_config = STRICT

    lowest: Annotated[str | None, Field(description="smallest value with its unit")] = None
    highest: Annotated[str | None, Field(description="largest value with its unit")] = None
    values: Annotated[Texts, Field(description="values to choose from, with unit; needed for times and rates")] = ()
    scale: Annotated[Literal["linear", "log"], Field(description="spacing of values between the limits")] = "linear"


@dataclass(frozen=True, slots=True)
class Variable:
    """A number to choose, in SI: its path, its limits or the values that it may have, and how it is spread.

    ``kinds`` names the kinds of valve for which it means something, none for all.
    """

    path: str
    unit: str
    summary: str
    lowest: float
    highest: float
    values: tuple[float, ...]
    is_logarithmic: bool
    kinds: tuple[str, ...] = ()

    def value(self, place: Floats) -> Floats:
        """Return the values (candidates,) in SI at places from 0 to 1."""
        if self.values:
            count = len(self.values)
            return np.array(self.values)[np.minimum((place * count).astype(np.int64), count - 1)]
        if self.is_logarithmic:
            return np.asarray(np.exp(np.log(self.lowest) + place * np.log(self.highest / self.lowest)))
        return self.lowest + place * (self.highest - self.lowest)


def read_variables(
    tables: Mapping[str, VariableTable],
    scenarios: Mapping[str, Sequence[Scenario]],
    valves: Sequence[Part],
    file: str,
) -> tuple[Variable, ...]:
    """Return the variables of a file; StudyError for a path that no scenario has, or limits that it refuses.

    ``scenarios`` are those of all tasks by kind of valve.
    """
    everything = [scenario for of_kind in scenarios.values() for scenario in of_kind]
    known = {path: quantity for scenario in everything for path, quantity in declared_numbers(scenario).items()}
    known = {path: quantity for path, quantity in known.items() if path not in _BY_PARTS} | OWN
    atmosphere = everything[0].device.supply.atmospheric_pressure
    found = []
    for path, table in tables.items():
        place = f"{file}: variables.'{path}'"
        _check_path(path, known, valves, place)
        kinds = _kinds(path, scenarios)
        found.append(replace(_variable(path, table, known[path], atmosphere, place), kinds=kinds))
    return tuple(found)


def _kinds(path: str, scenarios: Mapping[str, Sequence[Scenario]]) -> tuple[str, ...]:
    """Return the kinds of valve whose scenarios have a number, none where all of them do."""
    having = {
        kind: path in OWN or any(path in declared_numbers(scenario) for scenario in of_kind)
        for kind, of_kind in scenarios.items()
    }
    return () if all(having.values()) else tuple(kind for kind, has in having.items() if has)


def _check_path(path: str, known: Mapping[str, Quantity], valves: Sequence[Part], place: str) -> None:
    if path in _BY_PARTS:
        raise StudyError(f"{place}: is fixed by the chosen actuator; vary '{_BY_PARTS[path]}' instead")
    if path not in known:
        hint = nearest_name(path, known) or f"; for example {', '.join([*OWN, 'supply.pressure', 'controller.rate'])}"
        raise StudyError(f"{place}: no scenario of the tasks has such a value{hint}")
    other = _SONIC if path in _AREA else _AREA if path in _SONIC else frozenset[str]()
    for valve in valves:
        if {f"valve.{name}" for name in valve.values} & other:
            raise StudyError(f"{place}: valve '{valve.name}' gives its orifice in the other form")


def _variable(path: str, table: VariableTable, quantity: Quantity, atmosphere: float, place: str) -> Variable:
    between = [text for text in (table.lowest, table.highest) if text is not None]
    if bool(table.values) == bool(between) or len(between) == 1:
        raise StudyError(f"{place}: give either lowest and highest, or values")
    if path in TIMES and not table.values:
        raise StudyError(
            f"{place}: is a time or rate of the run; list the values to choose from, values = ['500 Hz', '1 kHz']"
        )
    numbers = [_number(text, quantity, atmosphere, place) for text in table.values or between]
    lowest, highest = min(numbers), max(numbers)
    if not table.values and numbers[0] >= numbers[1]:
        raise StudyError(f"{place}: lowest = '{table.lowest}' must be below highest = '{table.highest}'")
    if table.scale == "log" and lowest <= 0.0:
        raise StudyError(f"{place}: scale = 'log' needs limits above 0")
    return Variable(
        path,
        quantity.unit,
        quantity.summary,
        lowest,
        highest,
        tuple(numbers) if table.values else (),
        table.scale == "log",
    )


def _number(text: str, quantity: Quantity, atmosphere: float, place: str) -> float:
    try:
        value = parse_quantity(text, "" if quantity.unit == "1" else quantity.unit, atmosphere)
    except UnitError as error:
        raise StudyError(f"{place}: '{text}': {error}") from error
    if not is_within(value, quantity):
        lower = f"{'at least' if quantity.minimum_allowed else 'more than'} {quantity.minimum:g}"
        unit = quantity.unit if quantity.unit != "1" else ""
        raise StudyError(f"{place}: '{text}': must be {lower} and at most {quantity.maximum:g} {unit}".rstrip())
    return value
