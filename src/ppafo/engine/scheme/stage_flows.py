"""The flows of one stage of a step: through the ports of both chambers and across the vane. Equations (6) to (9).

The lanes find them in loops of their own, apart from the stage that is made of them: a flow waits long for its
division and its root, and in a short loop the processor works on several lanes meanwhile.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from ppafo.model.orifice import orifice_flow, orifice_flow_slopes
from ppafo.model.plant import PlantParameters
from ppafo.model.ports import PortFlow, PortFlowSlopes


class LeakSlopes(NamedTuple):
    """Flow across the vane from chamber 1 to 2 [kg/s], its derivatives with respect to both pressures [kg/(s Pa)]."""

    flow: float
    by_1: float
    by_2: float


class SlopedFlows(NamedTuple):
    """Flows into both chambers and across the vane, with derivatives."""

    in_1: PortFlowSlopes
    in_2: PortFlowSlopes
    leak: LeakSlopes


class StageFlows(NamedTuple):
    """Flows into both chambers and across the vane from chamber 1 to 2 [kg/s]."""

    in_1: PortFlow
    in_2: PortFlow
    leak: float


def sloped_flows(
    plant: PlantParameters,
    pressure_1: float,
    pressure_2: float,
    port_1: Any,
    port_2: Any,
    port_flow_slopes: Callable[..., PortFlowSlopes],
) -> SlopedFlows:
    """All flows at two chamber pressures [Pa absolute], with derivatives."""
    flow, by_1, by_2 = orifice_flow_slopes(pressure_1, pressure_2, plant.leak_conductance, plant.leak_curve)
    return SlopedFlows(
        in_1=port_flow_slopes(pressure_1, port_1, plant.valve_curve),
        in_2=port_flow_slopes(pressure_2, port_2, plant.valve_curve),
        leak=LeakSlopes(flow, by_1, by_2),
    )


def stage_flows(
    plant: PlantParameters,
    pressure_1: float,
    pressure_2: float,
    port_1: Any,
    port_2: Any,
    port_flow: Callable[..., PortFlow],
) -> StageFlows:
    """All flows at two chamber pressures [Pa absolute]."""
    return StageFlows(
        in_1=port_flow(pressure_1, port_1, plant.valve_curve),
        in_2=port_flow(pressure_2, port_2, plant.valve_curve),
        leak=orifice_flow(pressure_1, pressure_2, plant.leak_conductance, plant.leak_curve),
    )
