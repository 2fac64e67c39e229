"""Declarations of all numbers of a parameter set: section, name, SI unit, range and meaning.

The schema, the conversion to SI, the messages and the table of ``ppafo sets show`` use this list. A pressure level is
in ``Pa_a``, absolute. The limits are wide: they exclude typing errors and numbers that no solver could handle.
"""

import functools
import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from ppafo.errors import UnitError
from ppafo.model.actuators.vane import KIND as VANE
from ppafo.model.catalog import ACTUATORS, VALVES, device_effects
from ppafo.model.declaration import Quantity, quantities_of
from ppafo.model.effects.kind import Effect
from ppafo.model.effects.restitution import EFFECT as RESTITUTION
from ppafo.parameters.device import Actuator, Flow, FootPlate, Friction, Gas, Orifice, SonicOrifice, Supply
from ppafo.units import SI, from_si, split_pressure_kind, to_si
from ppafo.units.shown import shown_unit

SPECIES_PATH = "gas.species"
RELIEVING_PATH = "supply.relieving"
RELIEVING = "true where the regulators take gas back from a chamber above their pressure; false unless given"

GAS = quantities_of(Gas)
AREA_FORM = quantities_of(Orifice)
SONIC_FORM = quantities_of(SonicOrifice)
ORIFICE = AREA_FORM + SONIC_FORM
ACTUATOR = (*VANE.quantities, *quantities_of(Actuator), *RESTITUTION.quantities)
_OF_A_VANE = frozenset(quantity.name for quantity in VANE.quantities)
FRICTION = quantities_of(Friction)
FOOT_PLATE = quantities_of(FootPlate)
SUPPLY = quantities_of(Supply)
FLOW = quantities_of(Flow)

REPORTED = (
    Quantity("choked_flow_constant", "s/m", "C1 of equation (6)"),
    Quantity("subsonic_flow_constant", "s/m", "C2 of equation (7)"),
    Quantity("critical_pressure_ratio", "", "upstream over downstream pressure where flow chokes"),
    Quantity("acceleration_over_velocity", "1/s", "free decay: angular acceleration over angular velocity, -beta/I"),
    Quantity("velocity_over_acceleration", "s", "free decay: angular velocity over angular acceleration, -I/beta"),
    Quantity("stopping_deceleration", "rad/s^2", "deceleration near standstill, dynamic friction over inertia"),
    Quantity("smallest_angle", "rad", "smallest angle that was used or measured"),
    Quantity("largest_angle", "rad", "largest angle that was used or measured"),
    Quantity("rated_rotation", "rad", "angle through which the actuator turns by its designation"),
    Quantity("other_supply_pressure", "Pa_a", "a second supply pressure used in experiments"),
    Quantity("demanded_torque", "N m", "maximum torque that a task requires"),
    Quantity("torque_efficiency", "", "work at the shaft over the work p dV of the gas"),
    Quantity("walking_torque", "N m", "peak torque of the device while it walks"),
    Quantity("walking_torque_pressure", "Pa_a", "supply pressure of that torque"),
    Quantity("rated_torque", "N m", "largest torque of the actuator"),
    Quantity("rated_torque_pressure", "Pa_a", "supply pressure of that torque"),
)
REPORTED_FORMULA = "choked_flow_exponent"
REPORTED_OF_A_VALVE = (
    Quantity("mass_flow", "kg/s", "measured flow, fully open, into the atmosphere"),
    Quantity("flow_pressure", "Pa_a", "supply pressure of the measured flow"),
    Quantity("single_fill_gas", "kg", "gas used in a task that fills one chamber once"),
)

SECTIONS: dict[str, tuple[Quantity, ...]] = {
    "gas": GAS,
    "actuator": ACTUATOR,
    "actuator.leak": ORIFICE,
    "friction": FRICTION,
    "foot_plate": FOOT_PLATE,
    "supply": SUPPLY,
    "flow": FLOW,
    "reported": REPORTED,
}

FLAT_SECTIONS = ("gas", "actuator", "friction", "foot_plate", "supply", "flow")
"""Sections of a set with one number for each name."""

OF_SECOND_CHAMBER = frozenset(
    {
        "actuator.dead_volume_2",
        "supply.dorsiflexion_pressure",
        "initial.pressure_2",
        *(f"actuator.leak.{quantity.name}" for quantity in ORIFICE),
    }
)
"""Paths of numbers that an actuator with one chamber lacks."""
WHY_ONE_CHAMBER = "the actuator has one chamber (no column volume_2 in its volume table)"

_ALTERNATIVE_UNITS = {"N m s/rad": ("N m s",)}


def alternatives(quantity: Quantity) -> tuple[str, ...]:
    """Return the SI units accepted for a quantity; for a damping also without 1/rad, as in the paper."""
    return (quantity.unit, *_ALTERNATIVE_UNITS.get(quantity.unit, ()))


def is_within(value: Any, quantity: Quantity) -> Any:
    """Return True if an SI value is within its declared limits; elementwise for an array."""
    is_above = value >= quantity.minimum if quantity.minimum_allowed else value > quantity.minimum
    return is_above & (value <= quantity.maximum)


def members(section: str, actuator_kind: str) -> tuple[Quantity, ...]:
    """Return the declared quantities of a section of ``SECTIONS``; of an actuator those of its type."""
    if section != "actuator" or actuator_kind == VANE.name:
        return SECTIONS[section]
    shared = (quantity for quantity in ACTUATOR if quantity.name not in _OF_A_VANE)
    return (*ACTUATORS[actuator_kind].quantities, *shared)


def quantities(
    valve_kinds: Mapping[str, str], actuator_kind: str = VANE.name, has_one_chamber: bool = False
) -> Mapping[str, Quantity]:
    """Return the declarations of all numbers by path, given valve kinds by name, and the actuator."""
    # Effects are part of the key: another package's may be loaded between two calls.
    return _by_path(tuple(valve_kinds.items()), actuator_kind, has_one_chamber, device_effects())


@functools.lru_cache(maxsize=32)
def _by_path(
    valve_kinds: tuple[tuple[str, str], ...],
    actuator_kind: str,
    has_one_chamber: bool,
    effects: tuple[Effect, ...],
) -> Mapping[str, Quantity]:
    sections = [(section, members(section, actuator_kind)) for section in SECTIONS]
    sections += [(effect.section, effect.quantities) for effect in effects]
    for name, kind in valve_kinds:
        sections.append((f"valves.{name}", ORIFICE + VALVES[kind].quantities))
        sections.append((f"reported.valves.{name}", REPORTED_OF_A_VALVE))
    declared = (
        replace(quantity, name=f"{section}.{quantity.name}") for section, items in sections for quantity in items
    )
    absent = OF_SECOND_CHAMBER if has_one_chamber else frozenset()
    return MappingProxyType({quantity.name: quantity for quantity in declared if quantity.name not in absent})


def fits(unit: str, si_unit: str) -> bool:
    """Return True if a unit converts to an SI unit."""
    try:
        to_si(1.0, unit, si_unit)
    except UnitError:
        return False
    return True


def range_rule(quantity: Quantity, given: str = "") -> str:
    """Return the rule for a value out of range, such as ``must be at least 0 m^2 (area of the opening)``.

    The limits are in the unit ``given`` by the user if it is known and fits, else in the display unit.
    """
    given = quantity.unit if given == SI else given
    unit = given if given and fits(given, quantity.unit) else shown_unit(quantity.unit)
    # The limits of a pressure are absolute; in gauge they would move with the atmosphere.
    unit = f"{split_pressure_kind(unit)[0]}_a" if quantity.unit == "Pa_a" else "" if unit == "1" else unit
    beyond = "at least" if quantity.minimum_allowed else "more than"
    # A limit that is not allowed itself is declared as the last number before it.
    is_allowed = math.nextafter(quantity.maximum, math.inf) != 1.0
    ends = ((beyond, quantity.minimum), ("at most" if is_allowed else "below", quantity.maximum))
    limits = (
        f"{word} {from_si(end, unit, quantity.unit):.6g} {unit}".rstrip() for word, end in ends if math.isfinite(end)
    )
    return f"must be {' and '.join(limits)}" + (f" ({quantity.summary})" if quantity.summary else "")
