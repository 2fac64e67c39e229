"""Nominal device of a model-based controller, from the numbers of the actual device."""

from collections.abc import Callable
from typing import Any, NamedTuple

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.control.kind import nominal_term
from ppafo.model.actuators.kind import Range
from ppafo.model.binding import made_of
from ppafo.model.gas import critical_pressure_ratio, specific_gas_constant
from ppafo.model.orifice import area_conductance, sonic_conductance_mass
from ppafo.parameters.declaration import AREA_FORM, SONIC_FORM
from ppafo.parameters.device import VANE, Device, Orifice, SonicOrifice
from ppafo.parameters.graph import LinkFunction
from ppafo.simulation.mean_chambers import MeanChambers, Surroundings, chambers_of

_GAS_PATHS = ("gas.molar_mass", "gas.heat_capacity_ratio", "gas.temperature")
_GAS_PRODUCT_PATHS = ("gas.molar_mass", "gas.temperature")
_SAME_NUMBERS = {
    "supply_pressure": "supply.pressure",
    "dorsiflexion_pressure": "supply.dorsiflexion_pressure",
    "atmospheric_pressure": "supply.atmospheric_pressure",
    "angle_min": "actuator.angle_min",
    "angle_max": "actuator.angle_max",
}
VALVE, LEAK = "valve", "actuator.leak"
"""Sections of the orifices."""
AREA_PATHS, SONIC_PATHS = (
    {section: tuple(f"{section}.{quantity.name}" for quantity in form) for section in (VALVE, LEAK)}
    for form in (AREA_FORM, SONIC_FORM)
)
"""Paths of the numbers of an orifice, by section, for each of the two forms."""
LEAST_SHARE = 0.05
"""Smallest dead volume as a fraction of the chamber volume at mid-range [-]."""
USUAL_RANGE = 1.0e6
"""Range of the usual pressure transducers for supplies up to 7 bar [Pa absolute]."""
COMPRESSED = 1.25
"""Smallest converter range divided by the supply pressure [-]; a full-scale reading means a broken wire."""


def always_zero(number: float) -> float:
    """Return 0 for any finite number, elementwise for a column."""
    return 0.0 * number


# The source is there because a term needs one.
_ZERO = LinkFunction(("supply.pressure",), always_zero)
"""Term whose value is always 0."""


def product_of(molar_mass: float, temperature: float) -> float:
    """Specific gas constant times temperature, R T / M [J/kg], from molar mass [kg/mol] and temperature [K]."""
    return specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass) * temperature


def conductance_of_area(molar_mass: float, ratio: float, temperature: float, area: float, discharge: float) -> float:
    """Mass-flow conductance [kg/(s Pa)] of an orifice area [m^2], from molar mass [kg/mol], k [-], temperature [K].

    Equation (6).
    """
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass)
    return area_conductance(area, discharge, ratio, constant, temperature)


def conductance_of_sonic(molar_mass: float, temperature: float, sonic: float) -> float:
    """Mass-flow conductance [kg/(s Pa)] of a sonic conductance [m^3/(s Pa)] of ISO 6358-1.

    Takes molar mass [kg/mol] and temperature [K].
    """
    return sonic_conductance_mass(sonic, specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass), temperature)


def converter_range(supply: float, dorsiflexion: float) -> float:
    """Full-scale pressure of the converter [Pa]: 1 MPa, or 1.25 times the larger supply pressure if that is more."""
    return max(USUAL_RANGE, COMPRESSED * max(supply, dorsiflexion))


class _NominalParts(NamedTuple):
    """Function that computes the chambers of the actuator at the usual angle."""

    mean_chambers: Callable[[Any, Range, Surroundings], MeanChambers]


def torque_per_pressure(settings: Any, stops: Range, around: Surroundings, *, parts: _NominalParts) -> float:
    """Torque per pressure of chamber 1 [m^3] at the usual angle."""
    return parts.mean_chambers(settings, stops, around).torque_per_pressure_1


def dead_volume_1(settings: Any, stops: Range, around: Surroundings, *, parts: _NominalParts) -> float:
    """Dead volume [m^3] of an equivalent vane: equal volume of chamber 1 at mid-range."""
    mean = parts.mean_chambers(settings, stops, around)
    return rest_of(mean.volume_1, mean.torque_per_pressure_1, stops)


def dead_volume_2(settings: Any, stops: Range, around: Surroundings, *, parts: _NominalParts) -> float:
    """Dead volume [m^3] of an equivalent vane: equal volume of chamber 2 at mid-range."""
    mean = parts.mean_chambers(settings, stops, around)
    return rest_of(mean.volume_2, mean.torque_per_pressure_1, stops)


def rest_of(volume: float, growth: float, stops: Range) -> float:
    """Dead volume [m^3] from volume at mid-range [m^3] and growth [m^3/rad]; at least a twentieth of that volume."""
    return max(volume - 0.5 * growth * (stops.angle_max - stops.angle_min), LEAST_SHARE * volume)


def nominal_terms(device: Device) -> dict[str, LinkFunction]:
    """Return the functions that determine each ``nominal_`` setting, by the names of ``nominal_term``."""
    terms = {name: LinkFunction((path,)) for name, path in _SAME_NUMBERS.items()} | _chamber_terms(device)
    terms |= {
        "gas_product": LinkFunction(_GAS_PRODUCT_PATHS, product_of),
        "valve_conductance": _conductance(VALVE, device.valve.orifice),
        "leak_conductance": _conductance(LEAK, device.actuator.leak),
        "critical_ratio": LinkFunction(SONIC_PATHS[VALVE][1:])
        if isinstance(device.valve.orifice, SonicOrifice)
        else LinkFunction(_GAS_PATHS[1:2], critical_pressure_ratio),
        "converter_range": LinkFunction(("supply.pressure", "supply.dorsiflexion_pressure"), converter_range),
        "dead_band": LinkFunction(("valve.dead_band",)) if device.valve.kind == "proportional" else _ZERO,
    }
    return {nominal_term(name): term for name, term in terms.items()}


def _conductance(section: str, orifice: Orifice | SonicOrifice) -> LinkFunction:
    """Return the function that determines the conductance [kg/(s Pa)] of an orifice."""
    if isinstance(orifice, SonicOrifice):
        return LinkFunction((*_GAS_PRODUCT_PATHS, SONIC_PATHS[section][0]), conductance_of_sonic)
    return LinkFunction((*_GAS_PATHS, *AREA_PATHS[section]), conductance_of_area)


def _chamber_terms(device: Device) -> dict[str, LinkFunction]:
    """Return the functions for torque constant, growth and dead volumes; for other actuators, of an equivalent vane."""
    if device.actuator.kind == VANE:
        names = ("torque_constant", "displacement_per_radian", "dead_volume_1", "dead_volume_2")
        return {name: LinkFunction((f"actuator.{name}",)) for name in names}
    chambers = chambers_of(device)

    def term(frame: Callable[..., float]) -> LinkFunction:
        made = made_of(frame, f"{frame.__name__}_of_device", _NominalParts(chambers.function))
        return LinkFunction(chambers.sources, made, chambers.rows)

    return {
        "torque_constant": term(torque_per_pressure),
        # By virtual work a chamber grows with the angle as its torque does with the pressure.
        "displacement_per_radian": term(torque_per_pressure),
        "dead_volume_1": term(dead_volume_1),
        "dead_volume_2": term(dead_volume_2),
    }
