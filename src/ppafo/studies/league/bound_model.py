"""The chambers as expressions of CasADi: the flow laws of the engine, smooth enough for an optimiser.

Three differences to the engine: near equal pressures the straight line and the root meet in one smooth curve, a
supply that takes no gas back closes smoothly too, and the two ways of the valve have an opening each, of which the sum
is at most 1. Both open at once stands for a valve that switches between them infinitely fast, so that no control of
the valve can do better.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ppafo.model.orifice import FlowCurve
from ppafo.model.plant import PlantParameters

Openings = Callable[..., tuple[Any, Any, Any, Any]]
"""From the shares of time of a valve's ways, towards chamber 1 first, to source 1, vent 1, source 2 and vent 2."""

CLOSING = 1.0e-3
"""Share of the choked flow about which the flow from a supply that takes no gas back rounds off to nothing."""


@dataclass(frozen=True, slots=True)
class ChamberRates:
    """Rates of both pressures [Pa/s] and gas taken from the source [kg/s], as expressions."""

    pressure_1: Any
    pressure_2: Any
    supplied: Any


@dataclass(frozen=True, slots=True)
class Volumes:
    """Volumes of both chambers [m^3] and the rate of the first [m^3/s], rows of all points; the second shrinks."""

    first: Any
    second: Any
    rate: Any


def proportional_openings(towards_1: Any, towards_2: Any) -> tuple[Any, Any, Any, Any]:
    """Openings of the spool valve: what feeds one chamber vents the other."""
    return towards_1, towards_2, towards_2, towards_1


def solenoid_openings(towards_1: Any, towards_2: Any) -> tuple[Any, Any, Any, Any]:
    """Openings of the solenoid pair: a chamber that is not fed is vented."""
    return towards_1, 1.0 - towards_1, towards_2, 1.0 - towards_2


VALVE_OPENINGS: dict[str, Openings] = {"proportional": proportional_openings, "solenoid": solenoid_openings}
"""By the kind of the valve."""


def smooth_flow(pressure_a: Any, pressure_b: Any, conductance: float, curve: FlowCurve) -> Any:
    """Mass flow from a to b [kg/s] as an expression: that of ``orifice_flow``, smooth at equal pressures."""
    import casadi

    upstream = casadi.fmax(pressure_a, pressure_b)
    gap = (pressure_a - pressure_b) / upstream
    size = casadi.fabs(gap)
    polynomial: Any = 0.0
    for coefficient in (curve.c6, curve.c5, curve.c4, curve.c3, curve.c2, curve.c1, curve.c0):
        polynomial = polynomial * size + coefficient
    # Half the gap of the straight line: the flow near equal pressures is then hardly ever below the engine's, and a
    # bound may have too much flow but not too little.
    meeting = 0.5 * (1.0 - curve.linear_ratio)
    subsonic = polynomial * gap * (gap**4 + meeting**4) ** -0.125
    is_subsonic = size < 1.0 - curve.critical_ratio
    return conductance * upstream * casadi.if_else(is_subsonic, subsonic, casadi.sign(gap))


def supply_flow(source: float, pressure: Any, plant: PlantParameters) -> Any:
    """Mass flow from a supply at ``source`` [Pa] through the whole valve [kg/s], none back unless it is relieving."""
    import casadi

    flow = smooth_flow(source, pressure, plant.valve_conductance, plant.valve_curve)
    rounding = CLOSING * plant.valve_conductance * source
    return flow if plant.relieving else 0.5 * (flow + casadi.sqrt(flow * flow + rounding * rounding))


def chamber_rates(
    plant: PlantParameters,
    openings: Openings,
    volumes: Volumes,
    pressures: tuple[Any, Any],
    ways: tuple[Any, ...],
) -> ChamberRates:
    """Rates of isothermal chambers at absolute pressures [Pa], for shares of time of each way. Eqs (3) to (9)."""
    pressure_1, pressure_2 = pressures
    source_1, vent_1, source_2, vent_2 = openings(*ways)
    full, curve, ambient = plant.valve_conductance, plant.valve_curve, plant.atmospheric_pressure
    leak = smooth_flow(pressure_1, pressure_2, plant.leak_conductance, plant.leak_curve)
    fed_1 = source_1 * supply_flow(plant.supply_pressure, pressure_1, plant)
    fed_2 = source_2 * supply_flow(plant.dorsiflexion_pressure, pressure_2, plant)
    gain_1 = fed_1 - vent_1 * smooth_flow(pressure_1, ambient, full, curve) - leak
    gain_2 = fed_2 - vent_2 * smooth_flow(pressure_2, ambient, full, curve) + leak
    return ChamberRates(
        (plant.gas_product * gain_1 - pressure_1 * volumes.rate) / volumes.first,
        (plant.gas_product * gain_2 + pressure_2 * volumes.rate) / volumes.second,
        fed_1 + fed_2,
    )
