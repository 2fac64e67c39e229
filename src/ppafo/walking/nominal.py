"""What the observer of the chambers believes of a device: which numbers of it each setting ``nominal_`` follows."""

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.model.catalog import VALVES
from ppafo.model.columns import first
from ppafo.model.declaration import NOMINAL
from ppafo.model.gas import critical_pressure_ratio, specific_gas_constant
from ppafo.model.orifice import area_conductance, sonic_conductance_mass
from ppafo.model.regulator import SupplyLines
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.parameters.graph import Term
from ppafo.simulation.declaration import SUPPLY_LINE, SUPPLY_LINES

_GAS = ("gas.molar_mass", "gas.heat_capacity_ratio", "gas.temperature")
_MASS = ("gas.molar_mass", "gas.temperature")
_AREA = ("valve.area", "valve.discharge_coefficient")
_SONIC = ("valve.sonic_conductance", "valve.critical_ratio")
_ANY = ("supply.pressure",)
"""A source for what no number decides."""

_SAME = {
    "supply_pressure": "supply.pressure",
    "dorsiflexion_pressure": "supply.dorsiflexion_pressure",
    "atmospheric_pressure": "supply.atmospheric_pressure",
    "displacement_per_radian": "actuator.displacement_per_radian",
    "dead_volume_1": "actuator.dead_volume_1",
    "dead_volume_2": "actuator.dead_volume_2",
    "angle_min": "actuator.angle_min",
    "angle_max": "actuator.angle_max",
}
_PAIRS = ("solenoid", "solenoid_recycling")
_SPOOL = "proportional"


def yes(number: float) -> float:
    """1, whatever a finite number is."""
    return 1.0 + 0.0 * number


def no(number: float) -> float:
    """0, whatever a finite number is."""
    return 0.0 * number


def flow_of_area(molar_mass: float, ratio: float, temperature: float, area: float, discharge: float) -> float:
    """R T times the conductance of an area [m^3/s], from molar mass [kg/mol], k [-], temperature [K]. Equation (6)."""
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass)
    return constant * temperature * area_conductance(area, discharge, ratio, constant, temperature)


def flow_of_sonic(molar_mass: float, temperature: float, sonic: float) -> float:
    """R T times a sonic conductance [m^3/s], from molar mass [kg/mol] and temperature [K]. ISO 6358-1."""
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass)
    return constant * temperature * sonic_conductance_mass(sonic, constant, temperature)


def per_content(number: float, molar_mass: float, temperature: float) -> float:
    """A number per mass [1/kg] as one per content p V [1/J], from molar mass [kg/mol] and temperature [K]."""
    return number / (specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass) * temperature)


def as_content(number: float, molar_mass: float, temperature: float) -> float:
    """A mass [kg] as a content p V [J], from molar mass [kg/mol] and temperature [K]."""
    return number * specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass) * temperature


def time_of_joint(joining: float, holding: float) -> float:
    """How long both chambers are joined, or chamber 2 then keeps its gas [s]."""
    return joining + holding


def nominal_terms(device: Device, lines: SupplyLines | None) -> dict[str, Term]:
    """Return what each ``nominal_`` setting follows, by the names of ``NOMINAL``.

    The valve of another package is not known: then ``nominal_flow`` is 0, and the observer off.
    """
    valve, kind = device.valve, VALVES[device.valve.kind]
    names = tuple(item.name for item in kind.quantities)
    is_pair, is_known = valve.kind in _PAIRS, valve.kind in (*_PAIRS, _SPOOL)
    is_sonic = isinstance(valve.orifice, SonicOrifice)
    flow = Term((*_MASS, _SONIC[0]), flow_of_sonic) if is_sonic else Term((*_GAS, *_AREA), flow_of_area)
    found = {name: Term((path,)) for name, path in _SAME.items()}
    found |= {
        "flow": flow if is_known else Term(_ANY, no),
        "critical_ratio": Term(_SONIC[1:]) if is_sonic else Term(_GAS[1:2], critical_pressure_ratio),
        # Not a number that varies: the source is there because a term needs one.
        "relieving": Term(_ANY, yes if device.supply.relieving else no),
        "pair": Term(_ANY, yes if is_pair else no),
        "lag": Term(tuple(f"valve.{name}" for name in names), kind.lag, kind.settings)
        if valve.kind == _SPOOL and kind.lag is not None
        else Term(_ANY, no),
        "joining_time": Term(("valve.joining_time", "valve.holding_time"), time_of_joint)
        if "joining_time" in names
        else Term(_ANY, no),
    }
    for name in ("opening_delay", "closing_delay", "switching_interval", "dead_band"):
        found[name] = Term((f"valve.{name}",)) if name in names and is_known else Term(_ANY, no)
    for number, line in enumerate(SUPPLY_LINES, start=1):
        path = f"{SUPPLY_LINE}.{line}"
        of_line = {
            "line_droop": Term((f"{path}.droop", *_MASS), per_content),
            "line_largest_flow": Term((f"{path}.largest_flow", *_MASS), as_content),
            "line_volume": Term((f"{path}.volume",)),
        }
        found |= {f"{name}_{number}": Term(_ANY, no) if lines is None else term for name, term in of_line.items()}
    found["line_relieving"] = Term(_ANY, yes if lines is not None and first(lines.relieving) else no)
    return {NOMINAL[name]: term for name, term in found.items()}
