"""Default controller gains of a device: rules of ``control.torque_loop`` and ``angle_loop`` for its loop and joint."""

import inspect
from collections.abc import Iterable
from dataclasses import replace

from ppafo.control import torque_loop
from ppafo.control.kind import ControllerKind
from ppafo.control.torque_loop import TorqueLoop
from ppafo.model.actuators.kind import Range
from ppafo.model.catalog import VALVES
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.model.declaration import PlainFunction, Quantity
from ppafo.model.gas import critical_pressure_ratio
from ppafo.parameters.device import VANE, Orifice, SonicOrifice
from ppafo.parameters.graph import GAS_PATHS, Link, follows
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.torque_loop import (
    GROUPS,
    LoopLink,
    LoopParts,
    MeanChambers,
    conductance_of_area,
    conductance_of_sonic,
    product_of,
)

SLOPE_GAINS = ("derivative_gain", "damping")
"""Gains on the rate of the error, which are 0 by default for every device."""
_GAS_PRODUCT_PATHS = ("gas.molar_mass", "gas.temperature")
_SAME_NUMBERS = {
    "supply_pressure": "supply.pressure",
    "dorsiflexion_pressure": "supply.dorsiflexion_pressure",
    "atmospheric_pressure": "supply.atmospheric_pressure",
    "angle_min": "actuator.angle_min",
    "angle_max": "actuator.angle_max",
    "friction_torque": "friction.dynamic_torque",
    "static_torque": "friction.static_torque",
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
    """Return the links of the numbers that a law may believe of its device, by name."""
    device = parts.device
    links: dict[str, Link] = {name: follows(path) for name, path in _SAME_NUMBERS.items()}
    links |= {
        "gas_product": Link(_GAS_PRODUCT_PATHS, product_of),
        "valve_conductance": _conductance("valve", device.valve.orifice),
        "leak_conductance": _conductance("actuator.leak", device.actuator.leak),
        "critical_ratio": follows("valve.critical_ratio")
        if parts.is_sonic
        else Link(GAS_PATHS[1:2], critical_pressure_ratio),
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
    return links


def _conductance(section: str, orifice: Orifice | SonicOrifice) -> Link:
    """Return the link to the conductance [kg/(s Pa)] of an orifice."""
    if isinstance(orifice, SonicOrifice):
        return Link((*_GAS_PRODUCT_PATHS, f"{section}.sonic_conductance"), conductance_of_sonic)
    return Link((*GAS_PATHS, f"{section}.area", f"{section}.discharge_coefficient"), conductance_of_area)


def opening_beyond_band(loop: TorqueLoop, dead_zone: float, dead_band: float) -> float:
    """Command [-] that opens a valve with a dead band by the opening for a dead zone."""
    return dead_band + (1.0 - dead_band) * torque_loop.dead_zone_opening(loop, dead_zone)


def is_gain(setting: Quantity) -> bool:
    """Return whether a setting is a gain that a loop decides, and not a number of the device."""
    return callable(setting.follows) and setting.follows is not torque_loop.whole_reach


def gain_link(parts: LoopParts, law: ControllerKind, rule: PlainFunction) -> Link | None:
    """Return the link of a default gain by its rule, whose arguments are groups; None where one of them is unknown."""
    names = list(inspect.signature(rule).parameters)
    direct = tuple[str, ...]()
    # The reach in an angle is not known: the dead zone of a law of the angle is to be given.
    if ("joint" in names and parts.controls_torque) or ("reach" in names and parts.controlled == ANGLE):
        return None
    if rule is torque_loop.integral_gain:
        # An integral goes with the proportional gain, also where that one is given.
        gain = (quantity.name for quantity in law.quantities if quantity.follows is torque_loop.proportional_gain)
        direct = (f"controller.{next(gain, '')}",)
    elif rule is torque_loop.dead_zone_opening:
        direct = ("controller.dead_zone",)
        if any(quantity.name == "dead_band" for quantity in VALVES[parts.device.valve.kind].quantities):
            rule = opening_beyond_band
            direct = (*direct, "valve.dead_band")
    return LoopLink(direct, rule, groups=tuple(name for name in names if name in GROUPS), parts=parts)


def loop_parts(scenario: Scenario, law: ControllerKind) -> LoopParts:
    """Return what decides the loop of a law in a scenario besides numbers."""
    seen = scenario.motion.motion_kind.sees(scenario)
    return LoopParts(scenario.device, seen, scenario.controlled, TORQUE in law.controls)


def default_links(scenario: Scenario, settings: Iterable[Quantity]) -> dict[str, tuple[Link, ...]]:
    """Return the links of those controller settings that numbers of the device decide unless given, by path."""
    following = [setting for setting in settings if setting.follows]
    if not following:
        return {}
    law = scenario.motion.motion_kind.law(scenario)
    parts = loop_parts(scenario, law)
    believed = nominal_links(parts)
    links = {
        f"controller.{item.name}": (
            believed.get(item.follows) if isinstance(item.follows, str) else gain_link(parts, law, item.follows),
            item.default or 0.0,
        )
        for item in following
    }
    return {path: (replace(link, gap=gap),) for path, (link, gap) in links.items() if link is not None}
