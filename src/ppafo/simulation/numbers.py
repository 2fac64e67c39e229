"""The numbers of a scenario by dotted path: which there are, and columns of them in their place for many runs."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.errors import ScenarioError, nearest_name
from ppafo.model.catalog import VALVES, device_effects, find_effects
from ppafo.model.declaration import Quantity, held_in
from ppafo.model.effects.kind import SECTION as EFFECT_SETTINGS
from ppafo.parameters.declaration import AREA_FORM, ORIFICE, SONIC_FORM, members
from ppafo.parameters.device import Device, Orifice, SonicOrifice
from ppafo.parameters.graph import ATMOSPHERE_PATH, Graph, holding, in_other_forms, left, resolved
from ppafo.parameters.overrides import either, in_two_forms, one_path
from ppafo.parameters.plant import number_under, part_of
from ppafo.simulation.clock import read_clock
from ppafo.simulation.declaration import LOCKED_ANGLE, TEXTS, Reading
from ppafo.simulation.motion_kind import Clock
from ppafo.simulation.overrides import apply_overrides
from ppafo.simulation.scenario import Scenario

TIMES = ("run.duration", "run.step", "run.output_interval", "controller.rate", "controller.period")
"""Paths that decide the clock of a run."""

_DEVICE_SECTIONS = ("gas", "actuator", "friction", "foot_plate", "supply", "flow")
_OF_DEVICE = (*_DEVICE_SECTIONS, "valve", EFFECT_SETTINGS)
_ORIFICES = {"valve": ("device", "valve", "orifice"), "actuator.leak": ("device", "actuator", "leak")}

_TEXTS = (
    *TEXTS,
    "gas.species",
    "supply.relieving",
    "motion.kind",
    "controller.kind",
    "reference.kind",
    "motion.profile.kind",
    "motion.shank.kind",
    "motion.shank.gait",
)
_RATE, _PERIOD = "controller.rate", "controller.period"
_UNIT_OF_TIMES = {"controller.rate": "Hz"}


def chosen_path(path: str, scenario: Scenario) -> str:
    """Return the path with ``valve.`` in place of ``valves.NAME.`` where that is the valve of the scenario."""
    return one_path(path, scenario.device.valve_name)


def declared_numbers(scenario: Scenario) -> dict[str, Quantity]:
    """Return the declaration of every number of a scenario and its device, by path; both forms of an orifice."""
    return device_numbers(scenario.device) | scenario.motion.motion_kind.quantities(scenario)


def device_numbers(device: Device) -> dict[str, Quantity]:
    """Return the declaration of every number of a device, by path; both forms of an orifice."""
    kind, species = device.actuator.kind, device.gas.species
    declared = [(section, quantity) for section in _DEVICE_SECTIONS for quantity in members(section, kind)]
    declared += [("actuator.leak", quantity) for quantity in ORIFICE]
    declared += [
        (effect.section, quantity) for effect in device_effects() for quantity in effect.quantities_in(species)
    ]
    declared += [("valve", quantity) for quantity in (*ORIFICE, *VALVES[device.valve.kind].quantities)]
    return {f"{section}.{quantity.name}": quantity for section, quantity in declared}


def with_numbers(scenario: Scenario, numbers: Mapping[str, Any]) -> Scenario:
    """Return the scenario with numbers replaced, by the paths of ``declared_numbers`` that are not in ``TIMES``.

    What follows a number that is replaced moves with it. An orifice given in the other form takes that form; both
    numbers of it must be there.
    """
    replaced = {chosen_path(path, scenario): number for path, number in numbers.items()}
    moved, changing = moving_together(scenario, replaced), _changing_form(scenario, replaced)
    # All links that are left are the scenario's own, for what is replaced follows nothing any more.
    if replaced:
        device = replace(scenario.device, links={})
        links = left(in_other_forms(scenario.graph, changing), replaced)
        scenario = replace(scenario, device=device, links=links)
    for section in changing:
        form = other_form(scenario.device, section)
        in_form = {name: moved.pop(f"{section}.{name}") for name in form}
        kind = SonicOrifice if "sonic_conductance" in form else Orifice
        scenario = _replace_number(scenario, _ORIFICES[section], kind(**in_form))
    for path, number in moved.items():
        scenario = _replace_number(scenario, _attributes(path, scenario), number)
    return scenario


def moving_together(scenario: Scenario, replaced: Mapping[str, Any]) -> dict[str, Any]:
    """Return numbers by path with all that follow them as in a file with these numbers; ``TIMES`` do not follow.

    What was changed since the scenario was loaded follows nothing any more.
    """
    links = links_that_hold(scenario)
    # What follows the sample period follows a rate that is given for it.
    period = {_PERIOD: 1.0 / replaced[_RATE]} if _RATE in replaced and _PERIOD not in replaced else {}
    moved = resolved(
        links,
        {**replaced, **period},
        lambda path: number_under(scenario, _attributes(path, scenario)),
        _changing_form(scenario, replaced),
    )
    return {path: number for path, number in moved.items() if path not in period}


def links_that_hold(scenario: Scenario) -> Graph:
    """Return the links of a scenario without links of numbers that were changed since it was loaded."""
    return holding(scenario.graph, lambda path: number_under(scenario, _attributes(path, scenario)))


def number_at(scenario: Scenario, path: str) -> float:
    """Return the number at a path of ``declared_numbers`` that is not in ``TIMES``, in SI units."""
    return float(number_under(scenario, _attributes(chosen_path(path, scenario), scenario)))


def other_form(device: Device, section: str) -> tuple[str, ...]:
    """Return the names of the form in which an orifice (``valve`` or ``actuator.leak``) is not given."""
    orifice = device.valve.orifice if section == "valve" else device.actuator.leak
    return tuple(quantity.name for quantity in (SONIC_FORM if isinstance(orifice, Orifice) else AREA_FORM))


def _changing_form(scenario: Scenario, paths: Collection[str]) -> list[str]:
    """Return the sections of the orifices that take the form in which they are not."""
    return [
        section
        for section in _ORIFICES
        if any(f"{section}.{name}" in paths for name in other_form(scenario.device, section))
    ]


def path_of_locked_angle(scenario: Scenario) -> str | None:
    """Return the path of the angle at which a vane stays, None where it moves."""
    if scenario.motion.locked_angle is None:
        return None
    return LOCKED_ANGLE if LOCKED_ANGLE in scenario.motion.motion_kind.places else "motion.profile.level"


def _attributes(path: str, scenario: Scenario) -> tuple[str, ...]:
    """Return the attributes that lead from the scenario to a number: its path, unless its motion says otherwise."""
    of_motion = scenario.motion.motion_kind.places
    if path in of_motion:
        return of_motion[path]
    names = tuple(path.split("."))
    return ("device", *names) if names[0] in _OF_DEVICE else names


def _replace_number(node: Any, attributes: tuple[str, ...], number: Any) -> Any:
    name, inside = attributes[0], attributes[1:]
    inner = _replace_number(part_of(node, name), inside, number) if inside else number
    if isinstance(node, Mapping):
        return {**node, name: inner}
    if any(field.name == name for field in fields(node)):
        return replace(node, **{name: inner})
    holder = held_in(node, name)
    assert holder is not None, f"a declared number '{name}' is in a {type(node).__name__}"
    return replace(node, **{holder: _replace_number(getattr(node, holder), attributes, number)})


@dataclass(frozen=True, slots=True)
class Columns:
    """A scenario and what varies in it, followers included: values (runs,) in SI by path, with their declarations.

    ``given`` are the paths that are no followers.
    """

    base: Scenario
    values: Mapping[str, Floats]
    declared: Mapping[str, Quantity]
    given: frozenset[str]

    @property
    def runs(self) -> int:
        """Number of runs."""
        return next(iter(self.values.values())).size

    def only(self, kept: Any) -> "Columns":
        """Return the columns of some runs, by a mask or by places."""
        return replace(self, values={path: column[kept] for path, column in self.values.items()})


def check_columns(base: Scenario, columns: Mapping[str, Any], gauge: Collection[str] = ()) -> Columns:
    """Return the columns with the chosen valve as ``valve``; ScenarioError for what no single run is to blame for.

    Those of the paths in ``gauge`` count from the atmosphere of their run.
    """
    if base.controller.is_outside and base.controller.custom is None:
        raise ScenarioError(f"{base.name}: nothing controls the valve; give a controller (controlled_by)")
    # Effects of other packages are known by their paths once they are loaded.
    find_effects(columns)
    declared = declared_numbers(base)
    values: dict[str, Floats] = {}
    for given, column in columns.items():
        path = chosen_path(given, base)
        _check_path(base, given, path, declared)
        # valve.area and valves.NAME.area are one number of the chosen valve.
        if path in values:
            raise ScenarioError(f"{base.name}: '{given}' and '{path}' are the same value; give one of them")
        values[path] = np.ascontiguousarray(column, dtype=np.float64)
    shapes = {path: column.shape for path, column in values.items()}
    if len(set(shapes.values())) != 1 or any(len(shape) != 1 or shape[0] == 0 for shape in shapes.values()):
        raise ScenarioError(
            f"{base.name}: an ensemble needs columns of one length, one value for each run, not {shapes or 'none'}"
        )
    pair = in_two_forms(values)
    if pair is not None:
        raise ScenarioError(f"{base.name}: '{pair[0]}' and '{pair[1]}' vary: {either(pair[0])}")
    for section in _ORIFICES:
        form = [f"{section}.{name}" for name in other_form(base.device, section)]
        missing = [path for path in form if path not in values]
        if missing and len(missing) < len(form):
            raise ScenarioError(
                f"{base.name}: {section} is given in the other form; to vary {' or '.join(form)} give a column for both"
            )
    every = moving_together(base, absolute(base, values, gauge))
    return Columns(base, every, {path: declared[path] for path in every}, frozenset(values))


def absolute(base: Scenario, columns: Mapping[str, Floats], gauge: Collection[str]) -> dict[str, Floats]:
    """Return the columns with absolute pressures in place of those that count from the atmosphere of their run."""
    atmosphere = columns.get(ATMOSPHERE_PATH, base.device.supply.atmospheric_pressure)
    return {path: column + atmosphere if path in gauge else column for path, column in columns.items()}


def _check_path(base: Scenario, given: str, path: str, declared: Mapping[str, Quantity]) -> None:
    if path in declared:
        return
    if path in _TEXTS:
        raise ScenarioError(f"{base.name}: '{given}' is a text and cannot vary; run an ensemble for each value")
    if base.controller.is_outside and path.startswith("controller."):
        raise ScenarioError(
            f"{base.name}: '{given}' cannot vary: a Python object has no declared settings; "
            "a module with a KIND has them (docs/how-to/extend.md)"
        )
    hint = nearest_name(path, declared) or f"; for example {', '.join(list(declared)[:6])}"
    raise ScenarioError(f"{base.name}: there is no number '{given}' that could vary{hint}")


TimeTexts = Mapping[str, Mapping[str, Any]]
"""The times of a scenario by section and name, as a file gives them."""


def clock_with(name: str, given: TimeTexts, times: Mapping[str, float]) -> Clock:
    """Return the clock [s] of a run with other times, which are read as overrides of the scenario ``name`` are.

    ScenarioError if they do not fit together.
    """
    document = {section: dict(texts) for section, texts in given.items()}
    for path, value in times.items():
        section, key = path.split(".")
        # A rate takes the place of a period that the file has, and the reverse.
        if section == "controller":
            document[section] = {}
        document[section][key] = f"{value!r} {_UNIT_OF_TIMES.get(path, 's')}"
    return read_clock(Reading(name, document, frozenset(times)))


def time_texts(base: Scenario) -> TimeTexts:
    """Return the times as the scenario's file gives them, or the numbers where the scenario was changed since."""
    document = apply_overrides(base.origin.content, base.origin.overrides, base.name).document
    texts = {
        section: {name: value for name, value in document[section].items() if f"{section}.{name}" in TIMES}
        for section in ("run", "controller")
    }
    # The file speaks for the scenario only as long as nobody has changed its times in Python.
    if read_clock(Reading(base.name, texts)) == clock_of(base):
        return texts
    run = {"duration": base.run.duration, "step": base.run.step, "output_interval": base.run.output_interval}
    return {
        "run": {name: f"{value!r} s" for name, value in run.items()},
        "controller": {"period": f"{base.controller.period!r} s"},
    }


def clock_of(base: Scenario) -> Clock:
    """Return the clock that a scenario has."""
    return Clock(base.run.duration, base.run.step, base.run.output_interval, base.controller.period)
