"""Numbers of a scenario and its device by dotted path: declared and replaced, in SI units.

A number may be an array (runs,), one value for each run of an ensemble; the scenario then represents all of them.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

from ppafo.control.controllers import switching
from ppafo.model.declaration import Quantity
from ppafo.model.effects.catalog import device_effects
from ppafo.model.effects.kind import SECTION as EFFECT_SETTINGS
from ppafo.model.regulator import SupplyLines
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.declaration import AREA_FORM, ORIFICE, SONIC_FORM, members
from ppafo.parameters.device import Device, Orifice, SonicOrifice
from ppafo.parameters.effects import all_settings
from ppafo.parameters.graph import Graph, holding, left, resolved
from ppafo.simulation import declaration
from ppafo.simulation.scenario import FreeMotion, PrescribedMotion, Scenario, worn_kind
from ppafo.simulation.supply_line import LINES, SECTION

HELD_ANGLE = "motion.angle"
TIMES = ("run.duration", "run.step", "run.output_interval", "controller.rate", "controller.period")
"""Paths that decide the clock of a run."""

_CHOSEN_VALVE = "valve."
_DEVICE_SECTIONS = ("gas", "actuator", "friction", "foot_plate", "supply", "flow")
_OF_SENSORS = {"angle_resolution": "angle_quantum", "pressure_resolution": "pressure_quantum"}
_OF_WALLS = {"wall_area_per_volume": "area_per_volume"}
_INITIAL = {"initial.pressure_1": "initial_pressure_1", "initial.pressure_2": "initial_pressure_2"}
_ORIFICES = {"actuator.leak": ("device", "actuator", "leak"), "valve": ("device", "valve", "orifice")}


def chosen_path(path: str, scenario: Scenario) -> str:
    """Return the path with ``valve.`` in place of ``valves.NAME.`` where that is the valve of the scenario."""
    own = f"valves.{scenario.device.valve_name}."
    return _CHOSEN_VALVE + path.removeprefix(own) if path.startswith(own) else path


def declared_numbers(scenario: Scenario) -> dict[str, Quantity]:
    """Return the declaration of every number of a scenario and its device, by path; both forms of an orifice."""
    worn = worn_kind(scenario)
    if worn is not None:
        own: dict[str, Quantity] = worn.quantities(scenario)
        return device_numbers(scenario.device) | own
    kinds = declaration.quantities(_kinds(scenario))
    return device_numbers(scenario.device) | kinds | _angle_of_held_vane(scenario)


def device_numbers(device: Device) -> dict[str, Quantity]:
    """Return the declaration of every number of a device, by path; both forms of an orifice."""
    found = {
        f"{section}.{item.name}": item
        for section in _DEVICE_SECTIONS
        for item in members(section, device.actuator.kind)
    }
    found |= {f"actuator.leak.{item.name}": item for item in ORIFICE}
    found |= {f"{effect.section}.{item.name}": item for effect in device_effects() for item in effect.quantities}
    return found | {f"valve.{item.name}": item for item in (*ORIFICE, *VALVES[device.valve.kind].quantities)}


def device_number_at(device: Device, path: str) -> float:
    """Return the number at a path of ``device_numbers``, in SI units; not of the form in which an orifice is not."""
    return float(_number(device, _place_in_device(path, device)))


def with_numbers(scenario: Scenario, numbers: Mapping[str, Any]) -> Scenario:
    """Return the scenario with numbers replaced, by the paths of ``declared_numbers`` that are not in ``TIMES``.

    What follows a number that is replaced moves with it. An orifice given in the other form takes that form; both
    numbers of it must be there.
    """
    given = {chosen_path(path, scenario): number for path, number in numbers.items()}
    chosen = moving_together(scenario, given)
    if given:
        device = replace(scenario.device, links={})
        scenario = replace(scenario, device=device, links=left(scenario.graph, given))
    for section, place in _ORIFICES.items():
        form = other_form(scenario.device, section)
        if any(f"{section}.{name}" in chosen for name in form):
            new = {name: chosen.pop(f"{section}.{name}") for name in form}
            kind = SonicOrifice if "sonic_conductance" in form else Orifice
            scenario = _replace_number(scenario, place, kind(**new))
    for path, number in chosen.items():
        scenario = _replace_number(scenario, _place(path, scenario), number)
    return scenario


def moving_together(scenario: Scenario, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return numbers by path with all that follow them as in a file with these numbers; those of ``TIMES`` do not.

    What was changed since the scenario was loaded follows nothing any more.
    """
    return resolved(links_that_hold(scenario), given, lambda path: _number(scenario, _place(path, scenario)))


def links_that_hold(scenario: Scenario) -> Graph:
    """Return the links of a scenario without those of numbers that were changed since it was loaded."""
    return holding(scenario.graph, lambda path: _number(scenario, _place(path, scenario)))


def number_at(scenario: Scenario, path: str) -> float:
    """Return the number at a path of ``declared_numbers`` that is not in ``TIMES``, in SI units."""
    return float(_number(scenario, _place(chosen_path(path, scenario), scenario)))


def _number(node: Any, place: tuple[str, ...]) -> Any:
    for part in place:
        node = _inner(node, part)
    return node


def _inner(node: Any, part: str) -> Any:
    if part == EFFECT_SETTINGS and isinstance(node, Device):
        return all_settings(node)
    return node[part] if isinstance(node, Mapping) else getattr(node, part)


def other_form(device: Device, section: str) -> tuple[str, ...]:
    """Return the names of the form in which an orifice (``valve`` or ``actuator.leak``) is not given."""
    orifice = device.valve.orifice if section == "valve" else device.actuator.leak
    return tuple(item.name for item in (SONIC_FORM if isinstance(orifice, Orifice) else AREA_FORM))


def _kinds(scenario: Scenario) -> dict[str, Any]:
    """Return a document that names the kinds of the scenario and nothing else; a constant command has no reference."""
    motion: dict[str, Any] = {"kind": "free"}
    if isinstance(scenario.motion, PrescribedMotion):
        motion = {"kind": "prescribed", "profile": {"kind": scenario.motion.profile.kind}}
    controller = {"kind": scenario.control.kind, "arithmetic": scenario.control.arithmetic}
    gas: dict[str, Any] = {} if scenario.thermal is None else {"gas_model": {"kind": declaration.THERMAL}}
    gas |= {} if scenario.supply_lines is None else {SECTION: {}}
    if scenario.control.kind == switching.CONSTANT.name:
        return {"motion": motion, "controller": controller, **gas}
    return {"motion": motion, "controller": controller, "reference": {"kind": scenario.reference.kind}, **gas}


def _angle_of_held_vane(scenario: Scenario) -> dict[str, Quantity]:
    motion = scenario.motion
    is_held = isinstance(motion, PrescribedMotion) and motion.profile.kind == "constant"
    return {HELD_ANGLE: declaration.ANGLE} if is_held else {}


def _place(path: str, scenario: Scenario) -> tuple[str, ...]:
    """Return the attributes (or keys) that lead from the scenario to a number."""
    section, _, name = path.rpartition(".")
    worn = worn_kind(scenario)
    if worn is not None and path in worn.places:
        return worn.places[path]
    if path in _INITIAL:
        return (_INITIAL[path],)
    if path == HELD_ANGLE and not isinstance(scenario.motion, FreeMotion):
        return ("motion", "profile", "settings", "level")
    if section.startswith(f"{SECTION}."):
        return ("supply_lines", f"{name}_{1 + LINES.index(section.removeprefix(f'{SECTION}.'))}")
    return {
        "motion": ("motion", name),
        "motion.profile": ("motion", "profile", "settings", name),
        "controller": ("control", "settings", name),
        "reference": ("reference", "settings", name),
        "sensors": ("sensors", _OF_SENSORS.get(name, name)),
        "gas_model": ("thermal", _OF_WALLS.get(name, name)),
    }.get(section, ("device", *_place_in_device(path, scenario.device)))


def _place_in_device(path: str, device: Device) -> tuple[str, ...]:
    section, _, name = path.rpartition(".")
    if section == "valve":
        return ("valve", "orifice" if name in _names(device.valve.orifice) else "settings", name)
    if section == "actuator" and name in device.actuator.settings:
        return (section, "settings", name)
    return tuple(path.split("."))


def _names(node: object) -> frozenset[str]:
    return frozenset(item.name for item in fields(node)) if is_dataclass(node) else frozenset()


def _replace_number(node: Any, parts: tuple[str, ...], number: Any) -> Any:
    inside = parts[1:]
    if isinstance(node, Mapping):
        return {**node, parts[0]: _replace_number(node[parts[0]], inside, number) if inside else number}
    inner = _replace_number(_inner(node, parts[0]), inside, number) if inside else number
    if isinstance(node, SupplyLines):
        return node._replace(**{parts[0]: inner})
    return replace(node, **{parts[0]: inner})
