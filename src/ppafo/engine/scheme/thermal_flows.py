"""Flows of gas with an energy balance: what each carries, what the walls give, and how all of them answer.

The energy of a chamber is counted as its content, ``P V M / (R T_0)`` [kg]: the mass that would give its pressure at
the reference temperature. Content over true mass is ``T / T_0``. Gas comes from the source and from the atmosphere at
``T_0``.
"""

import math
from typing import NamedTuple

from ppafo.engine.scheme.stage_flows import LeakSlopes
from ppafo.model.plant import PlantState, ThermalParameters, ThermalState
from ppafo.model.ports import PortFlow, PortFlowSlopes
from ppafo.model.thermal import enthalpy_flow_ratio, mass_flow_ratio


class ThermalFlows(NamedTuple):
    """Rates of both contents and both masses, of the gas drawn from the source and of the vane leak (1 to 2) [kg/s].

    Then the contents that come from the source, that pass both ports, and that the walls give [kg/s].
    """

    content_1: float
    content_2: float
    mass_1: float
    mass_2: float
    supplied: float
    leaked: float
    source_content: float
    port_content: float
    heat: float


class FlowSlopes(NamedTuple):
    """Gamma h times the derivatives of ``ThermalFlows`` with respect to both contents; walls and work left out."""

    content_1_by_1: float
    content_1_by_2: float
    content_2_by_1: float
    content_2_by_2: float
    mass_1_by_1: float
    mass_1_by_2: float
    mass_2_by_1: float
    mass_2_by_2: float
    supplied_by_1: float
    supplied_by_2: float
    leaked_by_1: float
    leaked_by_2: float
    source_content_by_1: float
    source_content_by_2: float


class Transport(NamedTuple):
    """Mass [kg/s] and content [kg/s] that a flow carries, each over the flow at the reference temperature [-]."""

    mass: float
    content: float


def transport(thermal: ThermalParameters, flow: float, root_from: float, root_to: float) -> Transport:
    """What a flow carries, by the sign of its direction; roots of ``T / T_0`` on both sides [-]."""
    root = root_from if flow >= 0.0 else root_to
    return Transport(mass_flow_ratio(root), enthalpy_flow_ratio(root, thermal.heat_capacity_ratio))


def wall_rate(thermal: ThermalParameters, volume: float, content: float, mass: float) -> float:
    """Content [kg/s] that the wall of a chamber gives to its gas."""
    return thermal.wall_exchange * volume * (1.0 - content / mass)


def thermal_flows(
    thermal: ThermalParameters,
    state: PlantState,
    masses: ThermalState,
    volume_1: float,
    volume_2: float,
    growth: float,
    in_1: PortFlow,
    in_2: PortFlow,
    leak: float,
) -> ThermalFlows:
    """All rates from the flows at the reference temperature [kg/s]: enthalpy that passes, work, heat of the walls."""
    root_1 = math.sqrt(state.mass_1 / masses.mass_1)
    root_2 = math.sqrt(state.mass_2 / masses.mass_2)
    vent_1 = in_1.total - in_1.from_source
    vent_2 = in_2.total - in_2.from_source
    source_1_carries = transport(thermal, in_1.from_source, 1.0, root_1)
    source_2_carries = transport(thermal, in_2.from_source, 1.0, root_2)
    vent_1_carries = transport(thermal, vent_1, 1.0, root_1)
    vent_2_carries = transport(thermal, vent_2, 1.0, root_2)
    leak_carries = transport(thermal, leak, root_1, root_2)
    supplied_1 = in_1.from_source * source_1_carries.mass
    supplied_2 = in_2.from_source * source_2_carries.mass
    leaked = leak * leak_carries.mass
    source_1 = in_1.from_source * source_1_carries.content
    source_2 = in_2.from_source * source_2_carries.content
    enthalpy_1 = source_1 + vent_1 * vent_1_carries.content
    enthalpy_2 = source_2 + vent_2 * vent_2_carries.content
    heat_1 = wall_rate(thermal, volume_1, state.mass_1, masses.mass_1)
    heat_2 = wall_rate(thermal, volume_2, state.mass_2, masses.mass_2)
    leaked_enthalpy = leak * leak_carries.content
    work = (thermal.heat_capacity_ratio - 1.0) * growth
    return ThermalFlows(
        content_1=enthalpy_1 - leaked_enthalpy - work * state.mass_1 / volume_1 + heat_1,
        content_2=enthalpy_2 + leaked_enthalpy + work * state.mass_2 / volume_2 + heat_2,
        mass_1=supplied_1 + vent_1 * vent_1_carries.mass - leaked,
        mass_2=supplied_2 + vent_2 * vent_2_carries.mass + leaked,
        supplied=supplied_1 + supplied_2,
        leaked=leaked,
        source_content=source_1 + source_2,
        port_content=enthalpy_1 + enthalpy_2,
        heat=heat_1 + heat_2,
    )


def flow_slopes(
    thermal: ThermalParameters,
    root_1: float,
    root_2: float,
    weight_1: float,
    weight_2: float,
    in_1: PortFlowSlopes,
    in_2: PortFlowSlopes,
    leak: LeakSlopes,
) -> FlowSlopes:
    """How all flows answer to both contents; weights are gamma h times pressure over content [Pa s/kg]."""
    leak_carries = transport(thermal, leak.flow, root_1, root_2)
    source_1 = transport(thermal, in_1.from_source, 1.0, root_1)
    source_2 = transport(thermal, in_2.from_source, 1.0, root_2)
    vent_1 = transport(thermal, in_1.total - in_1.from_source, 1.0, root_1)
    vent_2 = transport(thermal, in_2.total - in_2.from_source, 1.0, root_2)
    vent_slope_1 = in_1.total_slope - in_1.source_slope
    vent_slope_2 = in_2.total_slope - in_2.source_slope
    by_1 = leak.by_1 * weight_1
    by_2 = leak.by_2 * weight_2
    return FlowSlopes(
        content_1_by_1=(in_1.source_slope * source_1.content + vent_slope_1 * vent_1.content) * weight_1
        - by_1 * leak_carries.content,
        content_1_by_2=-by_2 * leak_carries.content,
        content_2_by_1=by_1 * leak_carries.content,
        content_2_by_2=(in_2.source_slope * source_2.content + vent_slope_2 * vent_2.content) * weight_2
        + by_2 * leak_carries.content,
        mass_1_by_1=(in_1.source_slope * source_1.mass + vent_slope_1 * vent_1.mass) * weight_1
        - by_1 * leak_carries.mass,
        mass_1_by_2=-by_2 * leak_carries.mass,
        mass_2_by_1=by_1 * leak_carries.mass,
        mass_2_by_2=(in_2.source_slope * source_2.mass + vent_slope_2 * vent_2.mass) * weight_2
        + by_2 * leak_carries.mass,
        supplied_by_1=in_1.source_slope * source_1.mass * weight_1,
        supplied_by_2=in_2.source_slope * source_2.mass * weight_2,
        leaked_by_1=by_1 * leak_carries.mass,
        leaked_by_2=by_2 * leak_carries.mass,
        source_content_by_1=in_1.source_slope * source_1.content * weight_1,
        source_content_by_2=in_2.source_slope * source_2.content * weight_2,
    )


def flow_response(slopes: FlowSlopes, content_1: float, content_2: float) -> ThermalFlows:
    """Gamma h times the change of all flows but heat [kg/s] while both contents change at two rates [kg/s]."""
    return ThermalFlows(
        content_1=slopes.content_1_by_1 * content_1 + slopes.content_1_by_2 * content_2,
        content_2=slopes.content_2_by_1 * content_1 + slopes.content_2_by_2 * content_2,
        mass_1=slopes.mass_1_by_1 * content_1 + slopes.mass_1_by_2 * content_2,
        mass_2=slopes.mass_2_by_1 * content_1 + slopes.mass_2_by_2 * content_2,
        supplied=slopes.supplied_by_1 * content_1 + slopes.supplied_by_2 * content_2,
        leaked=slopes.leaked_by_1 * content_1 + slopes.leaked_by_2 * content_2,
        source_content=slopes.source_content_by_1 * content_1 + slopes.source_content_by_2 * content_2,
        port_content=(slopes.content_1_by_1 + slopes.content_2_by_1) * content_1
        + (slopes.content_1_by_2 + slopes.content_2_by_2) * content_2,
        heat=0.0,
    )


def combine_flows(one: ThermalFlows, factor_one: float, other: ThermalFlows, factor_other: float) -> ThermalFlows:
    """Two sets of rates [kg/s], each times a factor [-], added."""
    return ThermalFlows(
        content_1=factor_one * one.content_1 + factor_other * other.content_1,
        content_2=factor_one * one.content_2 + factor_other * other.content_2,
        mass_1=factor_one * one.mass_1 + factor_other * other.mass_1,
        mass_2=factor_one * one.mass_2 + factor_other * other.mass_2,
        supplied=factor_one * one.supplied + factor_other * other.supplied,
        leaked=factor_one * one.leaked + factor_other * other.leaked,
        source_content=factor_one * one.source_content + factor_other * other.source_content,
        port_content=factor_one * one.port_content + factor_other * other.port_content,
        heat=factor_one * one.heat + factor_other * other.heat,
    )
