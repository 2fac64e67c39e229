"""Numbers of a scenario and its device that can be fitted, by dotted path: declared and read, in SI units."""

from collections.abc import Mapping

from ppafo.errors import IdentificationError, nearest_name
from ppafo.model.declaration import Quantity
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.declaration import AREA_FORM, SECTIONS, SONIC_FORM
from ppafo.parameters.device import Device, Orifice
from ppafo.simulation import numbers
from ppafo.simulation.declaration import FREE, INITIAL
from ppafo.simulation.scenario import FreeMotion, Scenario

_CHOSEN_VALVE = "valve."
_DEVICE_SECTIONS = ("gas", "actuator", "friction", "foot_plate", "supply", "flow")
TIME_OFFSET = "recording.time_offset"
"""Path of a number that no scenario has: the time by which the samples of a recording are later than the run."""

RECORDING = (
    Quantity("time_offset", "s", "time by which the samples are later than the run, a late trigger", 0.0, -1.0, 1.0),
)


def full_path(path: str, scenario: Scenario) -> str:
    """Return the path as a parameter set has it: ``valve.area`` becomes ``valves.NAME.area`` of the chosen valve."""
    name = scenario.device.valve_name
    return f"valves.{name}.{path.removeprefix(_CHOSEN_VALVE)}" if path.startswith(_CHOSEN_VALVE) else path


def declared_numbers(scenario: Scenario) -> dict[str, Quantity]:
    """Return every number that can be fitted in this scenario, with its declaration, by path."""
    device = scenario.device
    found = {f"{section}.{item.name}": item for section in _DEVICE_SECTIONS for item in SECTIONS[section]}
    found |= {f"actuator.leak.{item.name}": item for item in _orifice_form(device.actuator.leak)}
    valve = (*_orifice_form(device.valve.orifice), *VALVES[device.valve.kind].quantities)
    found |= {f"valves.{device.valve_name}.{item.name}": item for item in valve}
    if isinstance(scenario.motion, FreeMotion):
        found |= {f"motion.{item.name}": item for item in FREE}
    found |= {f"initial.{item.name}": item for item in INITIAL}
    return found | {f"recording.{item.name}": item for item in RECORDING}


def declaration_of(path: str, scenario: Scenario) -> Quantity:
    """Return the declaration of the number at a path; IdentificationError with the nearest name for an unknown one."""
    known = declared_numbers(scenario)
    full = full_path(path, scenario)
    if full not in known:
        hint = nearest_name(full, known)
        raise IdentificationError(f"{scenario.name}: no number '{path}' can be fitted{hint}; known: {', '.join(known)}")
    return known[full]


def number_at(scenario: Scenario, path: str) -> float:
    """Return the number at a path in SI units; the time offset of a recording is 0 before it is fitted."""
    declaration_of(path, scenario)
    return 0.0 if path == TIME_OFFSET else numbers.number_at(scenario, path)


def with_numbers(scenario: Scenario, changed: Mapping[str, float]) -> Scenario:
    """Return the scenario with numbers replaced, by paths of ``declared_numbers``; a time offset is none of it."""
    return numbers.with_numbers(scenario, {path: number for path, number in changed.items() if path != TIME_OFFSET})


def _orifice_form(orifice: object) -> tuple[Quantity, ...]:
    return AREA_FORM if isinstance(orifice, Orifice) else SONIC_FORM


def broken_order(device: Device) -> str:
    """Return which rule of a device a set of numbers breaks, as a parameter set would say it; empty for none."""
    if device.friction.dynamic_torque > device.friction.static_torque:
        return "friction.dynamic_torque came out above friction.static_torque"
    if device.actuator.angle_min >= device.actuator.angle_max:
        return "actuator.angle_min came out above actuator.angle_max"
    return ""
