"""Nominal device of a model-based controller, from the numbers of the actual device."""

from ppafo.control.kind import nominal_term
from ppafo.model.actuators.kind import Range
from ppafo.model.gas import critical_pressure_ratio
from ppafo.parameters.device import VANE, Orifice, SonicOrifice
from ppafo.parameters.graph import Link, follows
from ppafo.simulation.mean_chambers import MeanChambers
from ppafo.simulation.torque_loop import LoopLink, LoopParts, conductance_of_area, conductance_of_sonic, product_of

_GAS_PATHS = ("gas.molar_mass", "gas.heat_capacity_ratio", "gas.temperature")
_GAS_PRODUCT_PATHS = ("gas.molar_mass", "gas.temperature")
_SAME_NUMBERS = {
    "supply_pressure": "supply.pressure",
    "dorsiflexion_pressure": "supply.dorsiflexion_pressure",
    "atmospheric_pressure": "supply.atmospheric_pressure",
    "angle_min": "actuator.angle_min",
    "angle_max": "actuator.angle_max",
}
LEAST_SHARE = 0.05
"""Smallest dead volume as a fraction of the chamber volume at mid-range [-]."""
USUAL_RANGE = 1.0e6
"""Range of the usual pressure transducers for supplies up to 7 bar [Pa absolute]."""
COMPRESSED = 1.25
"""Smallest converter range divided by the supply pressure [-]; a full-scale reading means a broken wire."""


def converter_range(supply: float, dorsiflexion: float) -> float:
    """Full-scale pressure of the converter [Pa]: 1 MPa, or 1.25 times the larger supply pressure if that is more."""
    return max(USUAL_RANGE, COMPRESSED * max(supply, dorsiflexion))


def torque_per_pressure(mean: MeanChambers) -> float:
    """Torque per pressure of chamber 1 [m^3] at the usual angle."""
    return mean.torque_per_pressure_1


def dead_volume_1(mean: MeanChambers, stops: Range) -> float:
    """Dead volume [m^3] of an equivalent vane: equal volume of chamber 1 at mid-range."""
    return rest_of(mean.volume_1, mean.torque_per_pressure_1, stops)


def dead_volume_2(mean: MeanChambers, stops: Range) -> float:
    """Dead volume [m^3] of an equivalent vane: equal volume of chamber 2 at mid-range."""
    return rest_of(mean.volume_2, mean.torque_per_pressure_1, stops)


def rest_of(volume: float, growth: float, stops: Range) -> float:
    """Dead volume [m^3] from volume at mid-range [m^3] and growth [m^3/rad]; at least a twentieth of that volume."""
    return max(volume - 0.5 * growth * (stops.angle_max - stops.angle_min), LEAST_SHARE * volume)


def nominal_links(parts: LoopParts) -> dict[str, Link]:
    """Return the links of each ``nominal_`` setting, by the names of ``nominal_term``."""
    device = parts.device
    links: dict[str, Link] = {name: follows(path) for name, path in _SAME_NUMBERS.items()}
    links |= {
        "gas_product": Link(_GAS_PRODUCT_PATHS, product_of),
        "valve_conductance": _conductance("valve", device.valve.orifice),
        "leak_conductance": _conductance("actuator.leak", device.actuator.leak),
        "critical_ratio": follows("valve.critical_ratio")
        if parts.is_sonic
        else Link(_GAS_PATHS[1:2], critical_pressure_ratio),
        "converter_range": Link(("supply.pressure", "supply.dorsiflexion_pressure"), converter_range),
        # A link needs a source: here it is multiplied by 0.
        "dead_band": follows("valve.dead_band")
        if device.valve.kind == "proportional"
        else Link(("supply.pressure",), factor=0.0),
    }
    if device.actuator.kind == VANE:
        names = ("torque_constant", "displacement_per_radian", "dead_volume_1", "dead_volume_2")
        links |= {name: follows(f"actuator.{name}") for name in names}
    else:
        # By virtual work a chamber grows with the angle as its torque does with the pressure.
        torque = LoopLink((), torque_per_pressure, groups=("usual",), parts=parts)
        links |= {"torque_constant": torque, "displacement_per_radian": torque}
        links |= {
            volume.__name__: LoopLink((), volume, groups=("usual", "stops"), parts=parts)
            for volume in (dead_volume_1, dead_volume_2)
        }
    return {nominal_term(name): link for name, link in links.items()}


def _conductance(section: str, orifice: Orifice | SonicOrifice) -> Link:
    """Return the link to the conductance [kg/(s Pa)] of an orifice."""
    if isinstance(orifice, SonicOrifice):
        return Link((*_GAS_PRODUCT_PATHS, f"{section}.sonic_conductance"), conductance_of_sonic)
    return Link((*_GAS_PATHS, f"{section}.area", f"{section}.discharge_coefficient"), conductance_of_area)
