"""Step of both chambers with an energy balance: the Rosenbrock method of ``pneumatics`` on energies and masses.

The energy of a chamber is counted as its gas content, ``P V M / (R T_0)`` [kg]: the mass that would give its pressure
at the reference temperature. Content over true mass is ``T / T_0``. Gas comes from the source and from the atmosphere
at ``T_0``. Where the gas is isothermal the content is the mass, so all that reads pressures from ``PlantState`` stays
as it is; here the true masses stand beside it. The matrix leaves out how the flows depend on the temperature upstream,
which changes no faster than a chamber fills; the method keeps its order with any matrix.

A chamber may give under pressure: ``V(angle, P)`` then takes part of what enters as work on its wall. With ``c`` the
content, ``e`` the rate of content that enters with gas and heat, ``g`` the rate at which the angle alone widens the
chamber, ``x = P/V dV/dP`` and the heat capacity ratio ``k``, the energy balance of ``P V/(k - 1)`` is

    dc/dt = e - (k - 1) c/V dV/dt,   dV/dt = g + dV/dP dP/dt,   P V = R T_0/M c.

The last one in time, ``dP/dt (V + P dV/dP) = R T_0/M dc/dt - P g``, takes dP/dt and dV/dt out of it:

    dc/dt = (e (1 + x) - (k - 1) c g/V) / (1 + k x).

A rigid chamber has ``x`` 0 (docs/equations.md).
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from ppafo.engine.scheme.pneumatics import (
    ALLOWED_OF_PRESSURE,
    GAMMA,
    SHORTEST,
    LeakSlopes,
    SlopedFlows,
    StageFlows,
    pressure_that_matters,
)
from ppafo.model.gas import enthalpy_flow_ratio, mass_flow_ratio
from ppafo.model.plant import (
    ActuatorFunctions,
    PlantParameters,
    PlantState,
    PortFlow,
    PortFlowSlopes,
    ThermalParameters,
    ThermalState,
    admitted_flow,
    chamber_pressures,
    chamber_volumes,
    pressures_per_mass,
)


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
    """Gamma h times the derivatives of ``ThermalFlows`` with respect to both contents; walls and work left out.

    Those of contents are what enters the chambers, of which they keep the shares ``kept_1`` and ``kept_2`` [-].
    """

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
    kept_1: float
    kept_2: float


class WarmChambers(NamedTuple):
    """Both chambers at one end of a step: volumes [m^3], and rates at which the angle widens them [m^3/s].

    ``give`` is P dV/dP over the volume [-], 0 of a rigid chamber.
    """

    volume_1: float
    volume_2: float
    growth_1: float
    growth_2: float
    give_1: float
    give_2: float


class Transport(NamedTuple):
    """Mass [kg/s] and content [kg/s] that a flow carries, each over the flow at the reference temperature [-]."""

    mass: float
    content: float


def transport(thermal: ThermalParameters, flow: float, root_from: float, root_to: float) -> Transport:
    """Mass and enthalpy carried by a flow, by its direction; roots of ``T / T_0`` on both sides [-]."""
    root = root_from if flow >= 0.0 else root_to
    return Transport(mass_flow_ratio(root), enthalpy_flow_ratio(root, thermal.heat_capacity_ratio))


ALLOWED_OF_TEMPERATURE = 2.5e-4
"""Error of one step over the reference temperature; with it a run keeps to 2e-3 of it."""
NEARLY_EQUAL = 1.0e-4
"""Difference of two pressures over one of them below which gas may turn within a step."""


def steeper_transport(
    thermal: ThermalParameters, flow: float, turns: float, root_from: float, root_to: float
) -> Transport:
    """Transport of a flow [kg/s]; below ``turns``, where it may reverse, the larger value of both sides.

    Cold gas that leaves a settled chamber would turn into warm gas that enters, more of it than the matrix knows: a
    matrix that is too steep damps that, one that is too flat makes it grow from step to step.
    """
    steeper = max(root_from, root_to)
    is_settled = abs(flow) < turns
    return transport(thermal, flow, steeper if is_settled else root_from, steeper if is_settled else root_to)


def wall_rate(thermal: ThermalParameters, volume: float, content: float, mass: float) -> float:
    """Content [kg/s] that the wall of a chamber gives to its gas."""
    return thermal.wall_exchange * volume * (1.0 - content / mass)


def kept_share(ratio: float, give: float) -> float:
    """Share of the energy that enters which stays in a chamber [-]; the rest is work on a wall that gives."""
    return (1.0 + give) / (1.0 + ratio * give)


def content_rate(thermal: ThermalParameters, entering: float, work: float, heat: float, give: float) -> float:
    """Rate of a content [kg/s] from what enters with gas, the work by the angle and the heat of the wall [kg/s]."""
    kept = 1.0 + give
    return (entering * kept - work + heat * kept) / (1.0 + thermal.heat_capacity_ratio * give)


def thermal_flows(
    thermal: ThermalParameters,
    state: PlantState,
    masses: ThermalState,
    at: WarmChambers,
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
    heat_1 = wall_rate(thermal, at.volume_1, state.mass_1, masses.mass_1)
    heat_2 = wall_rate(thermal, at.volume_2, state.mass_2, masses.mass_2)
    leaked_enthalpy = leak * leak_carries.content
    # In units of content, the work P dV of a chamber is (k - 1) times its content over its volume.
    less = thermal.heat_capacity_ratio - 1.0
    work_1 = less * at.growth_1 * state.mass_1 / at.volume_1
    work_2 = less * at.growth_2 * state.mass_2 / at.volume_2
    return ThermalFlows(
        content_1=content_rate(thermal, enthalpy_1 - leaked_enthalpy, work_1, heat_1, at.give_1),
        content_2=content_rate(thermal, enthalpy_2 + leaked_enthalpy, work_2, heat_2, at.give_2),
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
    near_1: float,
    near_2: float,
    at: WarmChambers,
) -> FlowSlopes:
    """Derivatives of all flows by both contents; weights are gamma h times pressure per content [Pa s/kg].

    ``near_1`` and ``near_2`` [Pa] are differences of pressure below which a flow may turn.
    """
    leak_carries = transport(thermal, leak.flow, root_1, root_2)
    source_1 = transport(thermal, in_1.from_source, 1.0, root_1)
    source_2 = transport(thermal, in_2.from_source, 1.0, root_2)
    vent_slope_1 = in_1.total_slope - in_1.source_slope
    vent_slope_2 = in_2.total_slope - in_2.source_slope
    turns_1, turns_2 = abs(vent_slope_1) * near_1, abs(vent_slope_2) * near_2
    vent_1 = steeper_transport(thermal, in_1.total - in_1.from_source, turns_1, 1.0, root_1)
    vent_2 = steeper_transport(thermal, in_2.total - in_2.from_source, turns_2, 1.0, root_2)
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
        kept_1=kept_share(thermal.heat_capacity_ratio, at.give_1),
        kept_2=kept_share(thermal.heat_capacity_ratio, at.give_2),
    )


def flow_response(slopes: FlowSlopes, content_1: float, content_2: float) -> ThermalFlows:
    """Gamma h times the change of all flows but heat [kg/s] while both contents change at two rates [kg/s]."""
    return ThermalFlows(
        content_1=slopes.kept_1 * (slopes.content_1_by_1 * content_1 + slopes.content_1_by_2 * content_2),
        content_2=slopes.kept_2 * (slopes.content_2_by_1 * content_1 + slopes.content_2_by_2 * content_2),
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


class ThermalMatrix(NamedTuple):
    """Matrix of both contents after the masses are eliminated, by rows; how the walls respond to the masses [-]."""

    slopes: FlowSlopes
    a: float
    b: float
    c: float
    d: float
    scale: float
    wall_1: float
    wall_2: float
    cooling_1: float
    cooling_2: float


class ThermalBegin(NamedTuple):
    """Both chambers at the begin of a step, and how their absolute pressures follow their contents [Pa/kg]."""

    chambers: WarmChambers
    per_content_1: float
    per_content_2: float


class ThermalGas(NamedTuple):
    """First stage of a step: its matrix, the stage, the changes in time, the gas and chambers it leads to."""

    matrix: ThermalMatrix
    first: ThermalFlows
    drift: ThermalFlows
    end: PlantState
    end_masses: ThermalState
    ended: WarmChambers


def thermal_matrix(
    thermal: ThermalParameters,
    state: PlantState,
    masses: ThermalState,
    at: WarmChambers,
    weight: float,
    slopes: FlowSlopes,
) -> ThermalMatrix:
    """The matrix of a step; ``weight`` is gamma h [s]."""
    cooling_1 = weight * thermal.wall_exchange * at.volume_1 / masses.mass_1
    cooling_2 = weight * thermal.wall_exchange * at.volume_2 / masses.mass_2
    wall_1 = cooling_1 * state.mass_1 / masses.mass_1
    wall_2 = cooling_2 * state.mass_2 / masses.mass_2
    ratio = thermal.heat_capacity_ratio
    work_1 = weight * (ratio - 1.0) * at.growth_1 / (at.volume_1 * (1.0 + ratio * at.give_1))
    work_2 = weight * (ratio - 1.0) * at.growth_2 / (at.volume_2 * (1.0 + ratio * at.give_2))
    kept_1, kept_2 = slopes.kept_1, slopes.kept_2
    # The masses are eliminated first: they respond to the contents alone, so that a 2 by 2 matrix is left.
    a = 1.0 - kept_1 * slopes.content_1_by_1 + work_1 + kept_1 * cooling_1 - kept_1 * wall_1 * slopes.mass_1_by_1
    b = -kept_1 * slopes.content_1_by_2 - kept_1 * wall_1 * slopes.mass_1_by_2
    c = -kept_2 * slopes.content_2_by_1 - kept_2 * wall_2 * slopes.mass_2_by_1
    d = 1.0 - kept_2 * slopes.content_2_by_2 + work_2 + kept_2 * cooling_2 - kept_2 * wall_2 * slopes.mass_2_by_2
    return ThermalMatrix(
        slopes=slopes,
        a=a,
        b=b,
        c=c,
        d=d,
        scale=1.0 / (a * d - b * c),
        wall_1=wall_1,
        wall_2=wall_2,
        cooling_1=cooling_1,
        cooling_2=cooling_2,
    )


def solve_thermal_stage(matrix: ThermalMatrix, right: ThermalFlows) -> ThermalFlows:
    """Stage slopes [kg/s] from the right-hand sides [kg/s]."""
    # Right-hand sides of the contents after the masses are eliminated.
    right_1 = right.content_1 + matrix.slopes.kept_1 * matrix.wall_1 * right.mass_1
    right_2 = right.content_2 + matrix.slopes.kept_2 * matrix.wall_2 * right.mass_2
    content_1 = (matrix.d * right_1 - matrix.b * right_2) * matrix.scale
    content_2 = (matrix.a * right_2 - matrix.c * right_1) * matrix.scale
    by_contents = flow_response(matrix.slopes, content_1, content_2)
    mass_1 = right.mass_1 + by_contents.mass_1
    mass_2 = right.mass_2 + by_contents.mass_2
    warmed_1 = matrix.wall_1 * mass_1 - matrix.cooling_1 * content_1
    warmed_2 = matrix.wall_2 * mass_2 - matrix.cooling_2 * content_2
    return ThermalFlows(
        content_1=content_1,
        content_2=content_2,
        mass_1=mass_1,
        mass_2=mass_2,
        supplied=right.supplied + by_contents.supplied,
        leaked=right.leaked + by_contents.leaked,
        source_content=right.source_content + by_contents.source_content,
        port_content=right.port_content + by_contents.port_content,
        heat=right.heat + warmed_1 + warmed_2,
    )


class WarmFunctions(NamedTuple):
    """Functions of chambers with an energy balance, which an actuator has of its own."""

    chambers_at_begin: Callable[..., ThermalBegin]
    chambers_at_end: Callable[..., WarmChambers]
    after_motion: Callable[..., PlantState]
    with_work: Callable[..., ThermalState]


def begin_thermal_gas(
    plant: PlantParameters,
    thermal: ThermalParameters,
    state: PlantState,
    masses: ThermalState,
    next_angle: float,
    flowing: SlopedFlows,
    step: float,
    *,
    parts: WarmFunctions,
) -> ThermalGas:
    """First stage of one step [s] in which the volumes run linearly towards ``next_angle`` [rad]."""
    at_begin = parts.chambers_at_begin(plant, state, next_angle, step)
    return begin_thermal_stage(plant, thermal, state, masses, at_begin, next_angle, flowing, step, parts=parts)


def chambers_at_begin(plant: PlantParameters, state: PlantState, next_angle: float, step: float) -> ThermalBegin:
    """Both chambers at the begin of a step [s] whose volumes run towards ``next_angle`` [rad]. Equation (3)."""
    volume_1, volume_2 = chamber_volumes(plant, state.angle)
    next_1, _ = chamber_volumes(plant, next_angle)
    # The chambers of a vane are opposite: what one gains in volume the other loses.
    growth = (next_1 - volume_1) / max(step, SHORTEST)
    per_content_1, per_content_2 = pressures_per_mass(plant, state.angle)
    return ThermalBegin(
        chambers=WarmChambers(
            volume_1=volume_1, volume_2=volume_2, growth_1=growth, growth_2=-growth, give_1=0.0, give_2=0.0
        ),
        per_content_1=per_content_1,
        per_content_2=per_content_2,
    )


def chambers_at_end(
    plant: PlantParameters, begun: WarmChambers, _state: PlantState, _end: PlantState, next_angle: float, _step: float
) -> WarmChambers:
    """Both chambers at ``next_angle`` [rad], to which a step [s] leads that has ``begun`` with these. Equation (3)."""
    volume_1, volume_2 = chamber_volumes(plant, next_angle)
    return begun._replace(volume_1=volume_1, volume_2=volume_2)


def begin_thermal_stage(
    plant: PlantParameters,
    thermal: ThermalParameters,
    state: PlantState,
    masses: ThermalState,
    at_begin: ThermalBegin,
    next_angle: float,
    flowing: SlopedFlows,
    step: float,
    *,
    parts: WarmFunctions,
) -> ThermalGas:
    """First stage of one step [s] with chambers that run to ``next_angle`` [rad], from all flows and their slopes."""
    in_1, in_2, leak = flowing.in_1, flowing.in_2, flowing.leak
    at = at_begin.chambers
    per_content_1, per_content_2 = at_begin.per_content_1, at_begin.per_content_2
    flow_1 = PortFlow(in_1.total, in_1.from_source)
    flow_2 = PortFlow(in_2.total, in_2.from_source)
    flows = thermal_flows(thermal, state, masses, at, flow_1, flow_2, leak.flow)
    weight = GAMMA * step
    root_1 = math.sqrt(state.mass_1 / masses.mass_1)
    root_2 = math.sqrt(state.mass_2 / masses.mass_2)
    near_1, near_2 = NEARLY_EQUAL * per_content_1 * state.mass_1, NEARLY_EQUAL * per_content_2 * state.mass_2
    weight_1, weight_2 = weight * per_content_1, weight * per_content_2
    slopes = flow_slopes(thermal, root_1, root_2, weight_1, weight_2, in_1, in_2, leak, near_1, near_2, at)
    matrix = thermal_matrix(thermal, state, masses, at, weight, slopes)
    # A growing volume lowers the pressure as a loss of content at this rate would.
    lost_1, lost_2 = -state.mass_1 * at.growth_1 / at.volume_1, -state.mass_2 * at.growth_2 / at.volume_2
    drift = flow_response(slopes, lost_1, lost_2)
    first = solve_thermal_stage(matrix, combine_flows(flows, 1.0, drift, 1.0))
    change = combine_flows(first, step, first, 0.0)
    end, end_masses = with_thermal_gas(state, masses, change)
    return ThermalGas(
        matrix=matrix,
        first=first,
        drift=drift,
        end=end,
        end_masses=end_masses,
        ended=parts.chambers_at_end(plant, at, state, end, next_angle, step),
    )


def end_pressures(plant: PlantParameters, begun: ThermalGas) -> tuple[float, float]:
    """Absolute pressures [Pa] to which the first stage leads. Equation (3)."""
    return (
        begun.end.mass_1 * plant.gas_product / begun.ended.volume_1,
        begun.end.mass_2 * plant.gas_product / begun.ended.volume_2,
    )


def second_thermal_stage(thermal: ThermalParameters, begun: ThermalGas, flowing: StageFlows) -> ThermalFlows:
    """Flows of mass [kg/s] and of energy [W] in the second stage of a step, of gas with an energy balance."""
    flows = thermal_flows(thermal, begun.end, begun.end_masses, begun.ended, flowing.in_1, flowing.in_2, flowing.leak)
    # Right-hand side of ROS2: the flows at the end of the first stage less twice that stage, less the drift.
    right = combine_flows(combine_flows(flows, 1.0, begun.first, -2.0), 1.0, begun.drift, -1.0)
    return solve_thermal_stage(begun.matrix, right)


def thermal_change(
    plant: PlantParameters, thermal: ThermalParameters, begun: ThermalGas, second: ThermalFlows, step: float
) -> ThermalFlows:
    """Changes [kg] in one step [s] from both stages; supplies that are not relieving are as in ``moving_change``."""
    change = combine_flows(begun.first, 1.5 * step, second, 0.5 * step)
    supplied = admitted_flow(change.supplied, plant.relieving)
    kept = supplied - change.supplied
    to_1 = kept if begun.matrix.slopes.supplied_by_1 < begun.matrix.slopes.supplied_by_2 else 0.0
    to_2 = kept - to_1
    carries = enthalpy_flow_ratio(1.0, thermal.heat_capacity_ratio)
    return ThermalFlows(
        content_1=change.content_1 + to_1 * carries * begun.matrix.slopes.kept_1,
        content_2=change.content_2 + to_2 * carries * begun.matrix.slopes.kept_2,
        mass_1=change.mass_1 + to_1,
        mass_2=change.mass_2 + to_2,
        supplied=supplied,
        leaked=change.leaked,
        source_content=change.source_content + kept * carries,
        port_content=change.port_content + kept * carries,
        heat=change.heat,
    )


def thermal_error(plant: PlantParameters, begun: ThermalGas, second: ThermalFlows, step: float) -> float:
    """Estimated error of pressures and temperatures after a step [s] over what is allowed [-], as ``gas_error``.

    A chamber that gas flushes within a step has a pressure that is settled and a temperature that is not.
    """
    added = solve_thermal_stage(begun.matrix, combine_flows(begun.first, 1.0, second, 1.0))
    return 0.5 * max(over_allowed(plant, begun, added.content_1, added.content_2, step), warming(begun, added, step))


def warming(begun: ThermalGas, added: ThermalFlows, step: float) -> float:
    """Errors of contents and masses [kg/s] over a step [s], as the larger of both temperatures' over the allowed."""
    # The temperature over the reference is content over mass: what a little of both changes it by.
    mass_1, mass_2 = begun.end_masses.mass_1, begun.end_masses.mass_2
    warmer_1 = (added.content_1 - begun.end.mass_1 / mass_1 * added.mass_1) / mass_1
    warmer_2 = (added.content_2 - begun.end.mass_2 / mass_2 * added.mass_2) / mass_2
    return max(abs(warmer_1), abs(warmer_2)) * step / ALLOWED_OF_TEMPERATURE


def thermal_opening_error(plant: PlantParameters, begun: ThermalGas, shift: float, step: float) -> float:
    """Error of taking a valve's mean opening in a step [s] over what is allowed [-], as ``opening_error``."""
    response_1 = (begun.matrix.a - 1.0) * begun.first.content_1
    response_2 = (begun.matrix.d - 1.0) * begun.first.content_2
    return shift / (12.0 * GAMMA) * over_allowed(plant, begun, response_1, response_2, step)


def over_allowed(plant: PlantParameters, begun: ThermalGas, rate_1: float, rate_2: float, step: float) -> float:
    """Errors of both contents [kg/s] over a step [s], as the larger of both pressures' over what is allowed [-]."""
    end_1, end_2 = end_pressures(plant, begun)
    larger = max(
        abs(rate_1) / (begun.ended.volume_1 * pressure_that_matters(plant, end_1)),
        abs(rate_2) / (begun.ended.volume_2 * pressure_that_matters(plant, end_2)),
    )
    return larger * step * plant.gas_product / ALLOWED_OF_PRESSURE


def after_motion(
    plant: PlantParameters, thermal: ThermalParameters, state: PlantState, assumed_angle: float, angle: float
) -> PlantState:
    """State whose gas did its work up to the angle [rad] that the vane reached, where the stages assumed another."""
    assumed_1, assumed_2 = chamber_volumes(plant, assumed_angle)
    volume_1, volume_2 = chamber_volumes(plant, angle)
    half = 0.5 * (thermal.heat_capacity_ratio - 1.0)
    mean_1, mean_2 = 0.5 * (volume_1 + assumed_1), 0.5 * (volume_2 + assumed_2)
    work_1, work_2 = half * (volume_1 - assumed_1), half * (volume_2 - assumed_2)
    # The isentrope between two near volumes, to third order in their difference.
    return PlantState(
        angle=state.angle,
        angular_velocity=state.angular_velocity,
        mass_1=state.mass_1 * (mean_1 - work_1) / (mean_1 + work_1),
        mass_2=state.mass_2 * (mean_2 - work_2) / (mean_2 + work_2),
        supplied_mass=state.supplied_mass,
        vented_mass=state.vented_mass,
        leaked_mass=state.leaked_mass,
    )


def with_thermal_gas(state: PlantState, masses: ThermalState, change: ThermalFlows) -> tuple[PlantState, ThermalState]:
    """State, true masses and totals with the changes [kg] of one step added; work comes later."""
    vented = change.supplied - change.mass_1 - change.mass_2
    return (
        PlantState(
            angle=state.angle,
            angular_velocity=state.angular_velocity,
            mass_1=state.mass_1 + change.content_1,
            mass_2=state.mass_2 + change.content_2,
            supplied_mass=state.supplied_mass + change.supplied,
            vented_mass=state.vented_mass + vented,
            leaked_mass=state.leaked_mass + abs(change.leaked),
        ),
        ThermalState(
            mass_1=masses.mass_1 + change.mass_1,
            mass_2=masses.mass_2 + change.mass_2,
            supplied_content=masses.supplied_content + change.source_content,
            vented_content=masses.vented_content + change.source_content - change.port_content,
            heat_content=masses.heat_content + change.heat,
            gas_work=masses.gas_work,
        ),
    )


def with_work(plant: PlantParameters, masses: ThermalState, before: PlantState, after: PlantState) -> ThermalState:
    """True masses and totals with the work of the gas between two states, along the motion that happened."""
    before_1, before_2 = chamber_pressures(plant, before.angle, before.mass_1, before.mass_2)
    after_1, after_2 = chamber_pressures(plant, after.angle, after.mass_1, after.mass_2)
    # The mean of the pressures at both ends, over the motion that happened: the trapezoidal rule, as for the vane.
    difference = 0.5 * (before_1 - before_2 + after_1 - after_2)
    return ThermalState(
        mass_1=masses.mass_1,
        mass_2=masses.mass_2,
        supplied_content=masses.supplied_content,
        vented_content=masses.vented_content,
        heat_content=masses.heat_content,
        gas_work=masses.gas_work + difference * plant.displacement_per_radian * (after.angle - before.angle),
    )


def masses_at_start(
    _plant: PlantParameters,
    initial: PlantState,
    *,
    parts: ActuatorFunctions,  # noqa: ARG001 - those of a gas that is not ideal need them
) -> ThermalState:
    """True masses [kg] of gas at the reference temperature, where they are what the state counts, and no energy yet."""
    return ThermalState(
        mass_1=initial.mass_1,
        mass_2=initial.mass_2,
        supplied_content=0.0,
        vented_content=0.0,
        heat_content=0.0,
        gas_work=0.0,
    )
