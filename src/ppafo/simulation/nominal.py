"""Nominal device of a model-based law and of the chamber observer: the device numbers that it follows."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.control.kind import nominal_term
from ppafo.model.actuators.kind import Range
from ppafo.model.binding import made_of
from ppafo.model.catalog import VALVES
from ppafo.model.columns import first
from ppafo.model.gas import critical_pressure_ratio, specific_gas_constant
from ppafo.model.orifice import area_conductance, sonic_conductance_mass
from ppafo.model.valves.proportional import spool_lag
from ppafo.parameters.declaration import AREA_FORM, SONIC_FORM
from ppafo.parameters.device import VANE, Device, SonicOrifice
from ppafo.parameters.graph import LinkFunction
from ppafo.simulation.declaration import SUPPLY_LINE, SUPPLY_LINES
from ppafo.simulation.mean_chambers import MeanChambers, Surroundings, chambers_of

if TYPE_CHECKING:
    from ppafo.model.regulator import SupplyLines

_GAS = ("gas.molar_mass", "gas.heat_capacity_ratio", "gas.temperature")
_MASS = ("gas.molar_mass", "gas.temperature")
_ANY = ("supply.pressure",)
"""A source for what no number decides."""

_SAME = {
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
"""Paths of the numbers of an orifice in each of its forms, by its section."""
LEAST_SHARE = 0.05
"""Part of a chamber's volume in the middle of its range that is dead volume at least."""
USUAL_RANGE = 1.0e6
"""Pa: absolute pressure of the transducers that are usual with supplies up to 7 bar."""
COMPRESSED = 1.25
"""Part of a supply pressure up to which a converter is to show more: its largest reading counts as a broken wire."""
_PAIRS = ("solenoid", "solenoid_recycling")
_SPOOL = "proportional"


def yes(number: float) -> float:
    """Return 1 for any finite number, so that a column of numbers gives one of ones."""
    return 1.0 + 0.0 * number


def no(number: float) -> float:
    """Return 0 for any finite number, so that a column of numbers gives one of zeros."""
    return 0.0 * number


def flow_of_area(molar_mass: float, ratio: float, temperature: float, area: float, discharge: float) -> float:
    """R T times the conductance of an area [m^3/s], from molar mass [kg/mol], k [-], temperature [K]. Equation (6)."""
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass)
    return constant * temperature * area_conductance(area, discharge, ratio, constant, temperature)


def flow_of_sonic(molar_mass: float, temperature: float, sonic: float) -> float:
    """R T times a sonic conductance [m^3/s], from molar mass [kg/mol] and temperature [K]. ISO 6358-1."""
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass)
    return constant * temperature * sonic_conductance_mass(sonic, constant, temperature)


def product_of(molar_mass: float, temperature: float) -> float:
    """R T / M [J/kg], from molar mass [kg/mol] and temperature [K]."""
    return specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass) * temperature


def conductance_of_area(molar_mass: float, ratio: float, temperature: float, area: float, discharge: float) -> float:
    """Conductance of an area [kg/(s Pa)], from molar mass [kg/mol], k [-], temperature [K]. Equation (6)."""
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass)
    return area_conductance(area, discharge, ratio, constant, temperature)


def conductance_of_sonic(molar_mass: float, temperature: float, sonic: float) -> float:
    """Conductance of a sonic conductance [kg/(s Pa)], from molar mass [kg/mol] and temperature [K]. ISO 6358-1."""
    return sonic_conductance_mass(sonic, specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass), temperature)


def per_content(number: float, molar_mass: float, temperature: float) -> float:
    """A number per mass [1/kg] as one per content p V [1/J], from molar mass [kg/mol] and temperature [K]."""
    return number / (specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass) * temperature)


def as_content(number: float, molar_mass: float, temperature: float) -> float:
    """A mass [kg] as a content p V [J], from molar mass [kg/mol] and temperature [K]."""
    return number * specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass) * temperature


def converter_range(supply: float, dorsiflexion: float) -> float:
    """Pressure [Pa] that a converter shows at most: 1 MPa, or what a joint may compress a supply [Pa] to."""
    return max(USUAL_RANGE, COMPRESSED * max(supply, dorsiflexion))


def time_of_joint(joining: float, holding: float) -> float:
    """Time for which both chambers are joined, or for which chamber 2 then keeps its gas [s]."""
    return joining + holding


class NominalParts(NamedTuple):
    """Chambers of the actuator in the middle of its range."""

    mean_chambers: Callable[[Any, Range, Surroundings], MeanChambers]


def torque_per_pressure(settings: Any, stops: Range, around: Surroundings, *, parts: NominalParts) -> float:
    """Torque per pressure of chamber 1 [m^3] in the middle of the range."""
    return parts.mean_chambers(settings, stops, around).torque_per_pressure_1


def dead_volume_1(settings: Any, stops: Range, around: Surroundings, *, parts: NominalParts) -> float:
    """Dead volume [m^3] of a vane whose chamber 1 is as large in the middle of the range."""
    mean = parts.mean_chambers(settings, stops, around)
    return rest_of(mean.volume_1, mean.torque_per_pressure_1, stops)


def dead_volume_2(settings: Any, stops: Range, around: Surroundings, *, parts: NominalParts) -> float:
    """Dead volume [m^3] of a vane whose chamber 2 is as large in the middle of the range."""
    mean = parts.mean_chambers(settings, stops, around)
    return rest_of(mean.volume_2, mean.torque_per_pressure_1, stops)


def rest_of(volume: float, growth: float, stops: Range) -> float:
    """Remainder at a stop of a volume [m^3] at mid-range, at least a twentieth of it, for a growth [m^3/rad]."""
    return max(volume - 0.5 * growth * (stops.angle_max - stops.angle_min), LEAST_SHARE * volume)


def nominal_terms(device: Device, lines: "SupplyLines | None") -> dict[str, LinkFunction]:
    """Return what each ``nominal_`` setting follows, by the names of ``nominal_term``.

    The valve of another package is not known: then ``nominal_flow`` is 0, and the observer off.
    """
    valve, kind = device.valve, VALVES[device.valve.kind]
    names = tuple(quantity.name for quantity in kind.quantities)
    is_pair, is_known = valve.kind in _PAIRS, valve.kind in (*_PAIRS, _SPOOL)
    terms = {name: LinkFunction((path,)) for name, path in _SAME.items()} | _chamber_terms(device)
    terms |= {
        "gas_product": LinkFunction(_MASS, product_of),
        "valve_conductance": _conductance(device, VALVE),
        "leak_conductance": _conductance(device, LEAK),
        "flow": in_its_form(
            device,
            VALVE,
            LinkFunction((*_GAS, *AREA_PATHS[VALVE]), flow_of_area),
            LinkFunction((*_MASS, SONIC_PATHS[VALVE][0]), flow_of_sonic),
        )
        if is_known
        else LinkFunction(_ANY, no),
        "critical_ratio": in_its_form(
            device, VALVE, LinkFunction(_GAS[1:2], critical_pressure_ratio), LinkFunction(SONIC_PATHS[VALVE][1:])
        ),
        # Not a number that varies: the source is there because a term needs one.
        "relieving": LinkFunction(_ANY, yes if device.supply.takes_back else no),
        "pair": LinkFunction(_ANY, yes if is_pair else no),
        "delay": LinkFunction(("valve.delay",)) if valve.kind == _SPOOL else LinkFunction(_ANY, no),
        "lag": LinkFunction(tuple(f"valve.{name}" for name in names), spool_lag, (kind.settings,))
        if valve.kind == _SPOOL
        else LinkFunction(_ANY, no),
        "converter_range": LinkFunction(("supply.pressure", "supply.dorsiflexion_pressure"), converter_range),
        "joining_time": LinkFunction(("valve.joining_time", "valve.holding_time"), time_of_joint)
        if "joining_time" in names
        else LinkFunction(_ANY, no),
    }
    for name in ("opening_delay", "closing_delay", "switching_interval", "dead_band"):
        terms[name] = LinkFunction((f"valve.{name}",)) if name in names and is_known else LinkFunction(_ANY, no)
    for number, line in enumerate(SUPPLY_LINES, start=1):
        path = f"{SUPPLY_LINE}.{line}"
        of_line = {
            "line_droop": LinkFunction((f"{path}.droop", *_MASS), per_content),
            "line_largest_flow": LinkFunction((f"{path}.largest_flow", *_MASS), as_content),
            "line_volume": LinkFunction((f"{path}.volume",)),
        }
        terms |= {
            f"{name}_{number}": LinkFunction(_ANY, no) if lines is None else term for name, term in of_line.items()
        }
    terms["line_relieving"] = LinkFunction(_ANY, yes if lines is not None and first(lines.relieving) else no)
    return {nominal_term(name): term for name, term in terms.items()}


def _conductance(device: Device, section: str) -> LinkFunction:
    """Return what the conductance [kg/(s Pa)] of an orifice follows."""
    return in_its_form(
        device,
        section,
        LinkFunction((*_GAS, *AREA_PATHS[section]), conductance_of_area),
        LinkFunction((*_MASS, SONIC_PATHS[section][0]), conductance_of_sonic),
    )


def in_its_form(device: Device, section: str, of_area: LinkFunction, of_sonic: LinkFunction) -> LinkFunction:
    """Return the term of the form that the orifice of a section has, beside the one of its other form."""
    orifice = device.valve.orifice if section == VALVE else device.actuator.leak
    of_area, of_sonic = replace(of_area, orifice=section), replace(of_sonic, orifice=section)
    if isinstance(orifice, SonicOrifice):
        return replace(of_sonic, in_other_form=of_area)
    return replace(of_area, in_other_form=of_sonic)


def _chamber_terms(device: Device) -> dict[str, LinkFunction]:
    """Return what torque constant, growth and dead volumes follow; of another kind, of a vane like it."""
    own = {f"chamber_rest_{number}": LinkFunction((f"actuator.dead_volume_{number}",)) for number in (1, 2)}
    if device.actuator.kind == VANE:
        names = ("torque_constant", "displacement_per_radian", "dead_volume_1", "dead_volume_2")
        growth = LinkFunction(("actuator.displacement_per_radian",))
        return {name: LinkFunction((f"actuator.{name}",)) for name in names} | own | {"chamber_growth": growth}
    chambers = chambers_of(device)

    def term(frame: Callable[..., float]) -> LinkFunction:
        made = made_of(frame, f"{frame.__name__}_of_device", NominalParts(chambers.function))
        return LinkFunction(chambers.sources, made, chambers.rows)

    return own | {
        "chamber_growth": LinkFunction(chambers.sources, chambers.growth, chambers.rows),
        "torque_constant": term(torque_per_pressure),
        # By virtual work a chamber grows with the angle as its torque does with the pressure.
        "displacement_per_radian": term(torque_per_pressure),
        "dead_volume_1": term(dead_volume_1),
        "dead_volume_2": term(dead_volume_2),
    }
