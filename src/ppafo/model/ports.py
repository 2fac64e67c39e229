"""What a chamber is connected to during one step: equation (8), for a steady or a changing valve.

A ``SinglePort`` joins a chamber to one node, source or atmosphere. A ``BlendedPort`` joins it to both, each with the
mean opening over the step: that is how a valve that moves or switches inside a step is seen by the chamber. Flows
are positive into the chamber. Both kinds offer the same two functions; the engine is composed with one pair.

A source lets gas in only, unless its regulator is a relieving one: a flow back into a node is multiplied by what that
node takes back, 1 for the atmosphere and for a relieving supply, 0 for a supply with a check valve.
"""

from typing import NamedTuple

from ppafo.model.orifice import FlowCurve, check_valve_flow, check_valve_flow_slopes, orifice_flow, orifice_flow_slopes


class SinglePort(NamedTuple):
    """One open path: conductance [kg/(s Pa)], absolute pressure of the node [Pa], and 1 if that is the source.

    ``takes_back`` is 1 where gas may flow back into the node, else 0.
    """

    conductance: float
    node_pressure: float
    source_fraction: float
    takes_back: float


class BlendedPort(NamedTuple):
    """Two open paths: conductances [kg/(s Pa)] to the source and to the atmosphere and their pressures [Pa].

    ``takes_back`` is 1 where gas may flow back into the source, else 0.
    """

    source_conductance: float
    source_pressure: float
    vent_conductance: float
    vent_pressure: float
    takes_back: float


class PortFlow(NamedTuple):
    """Flow into the chamber [kg/s] and the part of it that comes from the source [kg/s]."""

    total: float
    from_source: float


class PortFlowSlopes(NamedTuple):
    """As ``PortFlow``, with the derivatives with respect to the chamber's pressure [kg/(s Pa)]."""

    total: float
    total_slope: float
    from_source: float
    source_slope: float


def admitted_flow(flow: float, takes_back: float) -> float:
    """Flow out of a node [kg/s], positive out of it: none back into one that takes nothing back. Equation (8)."""
    return max(flow, flow * takes_back)


def single_port_flow(pressure: float, port: SinglePort, curve: FlowCurve) -> PortFlow:
    """Flow [kg/s] into a chamber at ``pressure`` [Pa absolute] through one open path. Equations (6) to (8)."""
    flow = check_valve_flow(port.node_pressure, pressure, port.conductance, port.takes_back, curve)
    return PortFlow(flow, flow * port.source_fraction)


def single_port_flow_slopes(pressure: float, port: SinglePort, curve: FlowCurve) -> PortFlowSlopes:
    """As ``single_port_flow``, with derivatives."""
    flow, _, slope = check_valve_flow_slopes(port.node_pressure, pressure, port.conductance, port.takes_back, curve)
    return PortFlowSlopes(
        total=flow,
        total_slope=slope,
        from_source=flow * port.source_fraction,
        source_slope=slope * port.source_fraction,
    )


def blended_port_flow(pressure: float, port: BlendedPort, curve: FlowCurve) -> PortFlow:
    """Flow [kg/s] into a chamber at ``pressure`` [Pa absolute] through two open paths. Equations (6) to (8)."""
    source = check_valve_flow(port.source_pressure, pressure, port.source_conductance, port.takes_back, curve)
    vent = orifice_flow(port.vent_pressure, pressure, port.vent_conductance, curve)
    return PortFlow(source + vent, source)


def blended_port_flow_slopes(pressure: float, port: BlendedPort, curve: FlowCurve) -> PortFlowSlopes:
    """As ``blended_port_flow``, with derivatives."""
    source, _, source_slope = check_valve_flow_slopes(
        port.source_pressure, pressure, port.source_conductance, port.takes_back, curve
    )
    vent, _, vent_slope = orifice_flow_slopes(port.vent_pressure, pressure, port.vent_conductance, curve)
    return PortFlowSlopes(
        total=source + vent, total_slope=source_slope + vent_slope, from_source=source, source_slope=source_slope
    )
