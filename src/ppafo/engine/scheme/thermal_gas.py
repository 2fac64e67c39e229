"""Integration step of the gas with an energy balance: the Rosenbrock method of ``pneumatics`` on energies and masses.

The energy of a chamber is expressed as its gas content, ``P V M / (R T_0)`` [kg]: the mass that would give its pressure
at the reference temperature. Content divided by true mass is ``T / T_0``. Gas from the source and from the atmosphere
enters at ``T_0``. For isothermal gas the content is the mass, so that code which reads pressures from ``PlantState``
applies unchanged; the true masses are stored in addition. The matrix neglects the dependence of the flows on the
upstream temperature, which changes no faster than a chamber fills; the method keeps its order with any matrix.

A chamber may expand under pressure. With its volume ``V(angle, P)``, part of the entering energy becomes work on the
wall. Let ``c`` be the content, ``e`` the rate of content that enters with gas and heat, ``g`` the rate of change of the
volume due to the angle alone, ``x = P/V dV/dP``, and ``k`` the heat capacity ratio. The energy balance of ``P V/(k -
1)`` is

    dc/dt = e - (k - 1) c/V dV/dt,   dV/dt = g + dV/dP dP/dt,   P V = R T_0/M c.

The time derivative of the last equation, ``dP/dt (V + P dV/dP) = R T_0/M dc/dt - P g``, eliminates dP/dt and dV/dt:

    dc/dt = (e (1 + x) - (k - 1) c g/V) / (1 + k x).

A rigid chamber has ``x`` 0 (docs/equations.md).
"""

import math
from typing import NamedTuple

from ppafo.engine.scheme.pneumatics import (
    ALLOWED_OF_PRESSURE,
    GAMMA,
    SHORTEST,
    GasFlows,
    SlopedFlows,
    pressure_that_matters,
    refused_backflow,
)
from ppafo.model.gas import enthalpy_flow_ratio, mass_flow_ratio
from ppafo.model.plant import (
    ActuatorFunctions,
    PlantParameters,
    PlantState,
    ThermalParameters,
    ThermalState,
)


class ThermalFlows(NamedTuple):
    """Rates of gas with an energy balance [kg/s].

    Attributes:
        content_1, content_2: contents of both chambers
        mass_1, mass_2: true masses of both chambers
        supplied_1, supplied_2: masses drawn from both supplies
        leaked: mass through the vane leakage from chamber 1 to 2
        source_content: content drawn from the source
        port_content: content through both ports
        heat: content equivalent to the heat from the chamber walls
    """

    content_1: float
    content_2: float
    mass_1: float
    mass_2: float
    supplied_1: float
    supplied_2: float
    leaked: float
    source_content: float
    port_content: float
    heat: float


class _FlowSlopes(NamedTuple):
    """Gamma h times the derivatives of ``ThermalFlows`` with respect to both contents [-], without walls and work.

    Derivatives of contents apply to the content that enters the chambers; the chambers retain the fractions ``kept_1``
    and ``kept_2`` [-].
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
    """Both chambers at one end of a step: volumes [m^3], and rates of volume change due to the angle [m^3/s].

    ``give`` is the relative compliance ``P/V dV/dP`` [-], 0 for a rigid chamber.
    """

    volume_1: float
    volume_2: float
    growth_1: float
    growth_2: float
    give_1: float
    give_2: float


class Transport(NamedTuple):
    """Mass and content carried by a flow, each divided by the flow at the reference temperature [-]."""

    mass: float
    content: float


def transport(thermal: ThermalParameters, flow: float, root_from: float, root_to: float) -> Transport:
    """Mass and content carried by a flow according to its direction; roots are ``sqrt(T / T_0)`` [-]."""
    root = root_from if flow >= 0.0 else root_to
    return Transport(mass_flow_ratio(root), enthalpy_flow_ratio(root, thermal.heat_capacity_ratio))


ALLOWED_OF_TEMPERATURE = 2.5e-4
"""Allowed error of one step divided by the reference temperature [-]; the error of a run then stays below 2e-3."""
NEARLY_EQUAL = 1.0e-4
"""Relative difference of two pressures [-] below which the flow may reverse within a step."""


def steeper_transport(
    thermal: ThermalParameters, flow: float, turns: float, root_from: float, root_to: float
) -> Transport:
    """Transport of a flow [kg/s]; the larger value of both sides below ``turns`` [kg/s], where the flow may reverse.

    When the flow of a settled chamber reverses, outflowing cold gas becomes inflowing warm gas, more than the matrix
    assumes. A matrix that is too steep damps this error; a matrix that is too flat lets the error grow from step to
    step.
    """
    steeper = max(root_from, root_to)
    is_settled = abs(flow) < turns
    return transport(thermal, flow, steeper if is_settled else root_from, steeper if is_settled else root_to)


def wall_rate(thermal: ThermalParameters, volume: float, content: float, mass: float) -> float:
    """Heat flow from the wall of a chamber to its gas, as a rate of content [kg/s]."""
    return thermal.wall_exchange * volume * (1.0 - content / mass)


def kept_share(ratio: float, give: float) -> float:
    """Fraction of the entering energy that stays in a chamber [-]; the rest is work on a compliant wall."""
    return (1.0 + give) / (1.0 + ratio * give)


def content_rate(thermal: ThermalParameters, entering: float, work: float, heat: float, give: float) -> float:
    """Rate of a content [kg/s] from the entering gas, the work due to the angle and the heat from the wall [kg/s]."""
    kept = 1.0 + give
    return (entering * kept - work + heat * kept) / (1.0 + thermal.heat_capacity_ratio * give)


def thermal_flows(
    thermal: ThermalParameters,
    state: PlantState,
    masses: ThermalState,
    at: WarmChambers,
    flowing: GasFlows,
) -> ThermalFlows:
    """All rates of gas with an energy balance [kg/s], from the flows at the reference temperature [kg/s]."""
    in_1, in_2, leak = flowing.in_1, flowing.in_2, flowing.leak
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
        supplied_1=supplied_1,
        supplied_2=supplied_2,
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
    flowing: SlopedFlows,
    near_1: float,
    near_2: float,
    at: WarmChambers,
) -> _FlowSlopes:
    """Gamma h times the derivatives of all flows with respect to both contents [-].

    ``root_1`` and ``root_2`` are ``sqrt(T / T_0)`` of both chambers [-]. The weights are gamma h times pressure divided
    by content [Pa s/kg]. ``near_1`` and ``near_2`` [Pa] are pressure differences below which a flow may reverse.
    """
    in_1, in_2, leak = flowing.flows.in_1, flowing.flows.in_2, flowing.flows.leak
    slopes_1, slopes_2 = flowing.slopes_1, flowing.slopes_2
    leak_carries = transport(thermal, leak, root_1, root_2)
    source_1 = transport(thermal, in_1.from_source, 1.0, root_1)
    source_2 = transport(thermal, in_2.from_source, 1.0, root_2)
    vent_slope_1 = slopes_1.total - slopes_1.from_source
    vent_slope_2 = slopes_2.total - slopes_2.from_source
    turns_1, turns_2 = abs(vent_slope_1) * near_1, abs(vent_slope_2) * near_2
    vent_1 = steeper_transport(thermal, in_1.total - in_1.from_source, turns_1, 1.0, root_1)
    vent_2 = steeper_transport(thermal, in_2.total - in_2.from_source, turns_2, 1.0, root_2)
    by_1 = flowing.leak_by_1 * weight_1
    by_2 = flowing.leak_by_2 * weight_2
    return _FlowSlopes(
        content_1_by_1=(slopes_1.from_source * source_1.content + vent_slope_1 * vent_1.content) * weight_1
        - by_1 * leak_carries.content,
        content_1_by_2=-by_2 * leak_carries.content,
        content_2_by_1=by_1 * leak_carries.content,
        content_2_by_2=(slopes_2.from_source * source_2.content + vent_slope_2 * vent_2.content) * weight_2
        + by_2 * leak_carries.content,
        mass_1_by_1=(slopes_1.from_source * source_1.mass + vent_slope_1 * vent_1.mass) * weight_1
        - by_1 * leak_carries.mass,
        mass_1_by_2=-by_2 * leak_carries.mass,
        mass_2_by_1=by_1 * leak_carries.mass,
        mass_2_by_2=(slopes_2.from_source * source_2.mass + vent_slope_2 * vent_2.mass) * weight_2
        + by_2 * leak_carries.mass,
        supplied_by_1=slopes_1.from_source * source_1.mass * weight_1,
        supplied_by_2=slopes_2.from_source * source_2.mass * weight_2,
        leaked_by_1=by_1 * leak_carries.mass,
        leaked_by_2=by_2 * leak_carries.mass,
        source_content_by_1=slopes_1.from_source * source_1.content * weight_1,
        source_content_by_2=slopes_2.from_source * source_2.content * weight_2,
        kept_1=kept_share(thermal.heat_capacity_ratio, at.give_1),
        kept_2=kept_share(thermal.heat_capacity_ratio, at.give_2),
    )


def flow_response(slopes: _FlowSlopes, content_1: float, content_2: float) -> ThermalFlows:
    """Gamma h times the rate of change of all flows except heat [kg/s], for given rates of both contents [kg/s]."""
    return ThermalFlows(
        content_1=slopes.kept_1 * (slopes.content_1_by_1 * content_1 + slopes.content_1_by_2 * content_2),
        content_2=slopes.kept_2 * (slopes.content_2_by_1 * content_1 + slopes.content_2_by_2 * content_2),
        mass_1=slopes.mass_1_by_1 * content_1 + slopes.mass_1_by_2 * content_2,
        mass_2=slopes.mass_2_by_1 * content_1 + slopes.mass_2_by_2 * content_2,
        supplied_1=slopes.supplied_by_1 * content_1,
        supplied_2=slopes.supplied_by_2 * content_2,
        leaked=slopes.leaked_by_1 * content_1 + slopes.leaked_by_2 * content_2,
        source_content=slopes.source_content_by_1 * content_1 + slopes.source_content_by_2 * content_2,
        port_content=(slopes.content_1_by_1 + slopes.content_2_by_1) * content_1
        + (slopes.content_1_by_2 + slopes.content_2_by_2) * content_2,
        heat=0.0,
    )


def combine_flows(one: ThermalFlows, factor_one: float, other: ThermalFlows, factor_other: float) -> ThermalFlows:
    """Sum of two sets of rates [kg/s], each multiplied by a factor [-]."""
    return ThermalFlows(
        content_1=factor_one * one.content_1 + factor_other * other.content_1,
        content_2=factor_one * one.content_2 + factor_other * other.content_2,
        mass_1=factor_one * one.mass_1 + factor_other * other.mass_1,
        mass_2=factor_one * one.mass_2 + factor_other * other.mass_2,
        supplied_1=factor_one * one.supplied_1 + factor_other * other.supplied_1,
        supplied_2=factor_one * one.supplied_2 + factor_other * other.supplied_2,
        leaked=factor_one * one.leaked + factor_other * other.leaked,
        source_content=factor_one * one.source_content + factor_other * other.source_content,
        port_content=factor_one * one.port_content + factor_other * other.port_content,
        heat=factor_one * one.heat + factor_other * other.heat,
    )


class _ThermalMatrix(NamedTuple):
    """Matrix of a step with an energy balance, after elimination of the masses.

    Attributes:
        slopes: derivatives of all flows with respect to both contents
        a, b, c, d: matrix elements by rows [-]
        scale: 1 divided by the determinant [-]
        wall_1, wall_2: gamma h times the derivatives of the wall heat with respect to the masses [-]
        cooling_1, cooling_2: gamma h times the decrease of the wall heat with the contents [-]
    """

    slopes: _FlowSlopes
    a: float
    b: float
    c: float
    d: float
    scale: float
    wall_1: float
    wall_2: float
    cooling_1: float
    cooling_2: float


class ThermalGas(NamedTuple):
    """First stage of a step with an energy balance.

    Attributes:
        matrix: matrix of the step
        first: stage slopes [kg/s]
        drift: gamma h times the time derivatives of all flows [kg/s]
        end: state of the plant after the stage
        end_masses: true masses and totals after the stage
        ended: chambers after the stage
    """

    matrix: _ThermalMatrix
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
    slopes: _FlowSlopes,
) -> _ThermalMatrix:
    """Matrix of a step with an energy balance; ``weight`` is gamma h [s]."""
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
    return _ThermalMatrix(
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


def solve_thermal_stage(matrix: _ThermalMatrix, right: ThermalFlows) -> ThermalFlows:
    """Stage slopes [kg/s] of a step with an energy balance, from the right-hand sides [kg/s]."""
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
        supplied_1=right.supplied_1 + by_contents.supplied_1,
        supplied_2=right.supplied_2 + by_contents.supplied_2,
        leaked=right.leaked + by_contents.leaked,
        source_content=right.source_content + by_contents.source_content,
        port_content=right.port_content + by_contents.port_content,
        heat=right.heat + warmed_1 + warmed_2,
    )


def warm_chambers(
    plant: PlantParameters,
    pressure_1: float,
    pressure_2: float,
    at: float,
    angle: float,
    next_angle: float,
    rate: float,
    *,
    parts: ActuatorFunctions,
) -> WarmChambers:
    """Both chambers at the angle ``at`` [rad]; their volumes grow by those between two angles, times ``rate`` [1/s]."""
    now = parts.chambers(plant, at, pressure_1, pressure_2)
    # Volumes at both angles at one pressure: their difference is what the angle alone does.
    here = parts.chambers(plant, angle, pressure_1, pressure_2)
    ahead = parts.chambers(plant, next_angle, pressure_1, pressure_2)
    return WarmChambers(
        volume_1=now.volume_1,
        volume_2=now.volume_2,
        growth_1=(ahead.volume_1 - here.volume_1) * rate,
        growth_2=(ahead.volume_2 - here.volume_2) * rate,
        give_1=pressure_1 * now.compliance_1 / now.volume_1,
        give_2=pressure_2 * now.compliance_2 / now.volume_2,
    )


def begin_thermal_gas(
    plant: PlantParameters,
    thermal: ThermalParameters,
    state: PlantState,
    masses: ThermalState,
    next_angle: float,
    flowing: SlopedFlows,
    step: float,
    *,
    parts: ActuatorFunctions,
) -> ThermalGas:
    """First stage of one step [s] with an energy balance; volumes change linearly up to ``next_angle`` [rad]."""
    rate = 1.0 / max(step, SHORTEST)
    pressure_1, pressure_2 = parts.pressures(plant, state.angle, state.mass_1, state.mass_2)
    at = warm_chambers(plant, pressure_1, pressure_2, state.angle, state.angle, next_angle, rate, parts=parts)
    per_content_1 = plant.gas_product / (at.volume_1 * (1.0 + at.give_1))
    per_content_2 = plant.gas_product / (at.volume_2 * (1.0 + at.give_2))
    flows = thermal_flows(thermal, state, masses, at, flowing.flows)
    weight = GAMMA * step
    root_1 = math.sqrt(state.mass_1 / masses.mass_1)
    root_2 = math.sqrt(state.mass_2 / masses.mass_2)
    near_1, near_2 = NEARLY_EQUAL * per_content_1 * state.mass_1, NEARLY_EQUAL * per_content_2 * state.mass_2
    weight_1, weight_2 = weight * per_content_1, weight * per_content_2
    slopes = flow_slopes(thermal, root_1, root_2, weight_1, weight_2, flowing, near_1, near_2, at)
    matrix = thermal_matrix(thermal, state, masses, at, weight, slopes)
    # A growing volume lowers the pressure as a loss of content at this rate would.
    lost_1, lost_2 = -state.mass_1 * at.growth_1 / at.volume_1, -state.mass_2 * at.growth_2 / at.volume_2
    drift = flow_response(slopes, lost_1, lost_2)
    first = solve_thermal_stage(matrix, combine_flows(flows, 1.0, drift, 1.0))
    change = combine_flows(first, step, first, 0.0)
    end, end_masses = with_thermal_gas(state, masses, change)
    end_1, end_2 = parts.pressures(plant, next_angle, end.mass_1, end.mass_2)
    return ThermalGas(
        matrix=matrix,
        first=first,
        drift=drift,
        end=end,
        end_masses=end_masses,
        ended=warm_chambers(plant, end_1, end_2, next_angle, state.angle, next_angle, rate, parts=parts),
    )


def end_pressures(plant: PlantParameters, begun: ThermalGas) -> tuple[float, float]:
    """Absolute pressures [Pa] of both chambers after the first stage. Equation (3)."""
    return (
        begun.end.mass_1 * plant.gas_product / begun.ended.volume_1,
        begun.end.mass_2 * plant.gas_product / begun.ended.volume_2,
    )


def second_thermal_stage(thermal: ThermalParameters, begun: ThermalGas, flowing: GasFlows) -> ThermalFlows:
    """Slopes of the second stage [kg/s] of a step with an energy balance."""
    flows = thermal_flows(thermal, begun.end, begun.end_masses, begun.ended, flowing)
    # Right-hand side of ROS2: the flows at the end of the first stage less twice that stage, less the drift.
    right = combine_flows(combine_flows(flows, 1.0, begun.first, -2.0), 1.0, begun.drift, -1.0)
    return solve_thermal_stage(begun.matrix, right)


def thermal_change(
    plant: PlantParameters, thermal: ThermalParameters, begun: ThermalGas, second: ThermalFlows, step: float
) -> ThermalFlows:
    """Changes [kg] in one step [s] from both stages; supplies without relief are treated as in ``gas_change``."""
    change = combine_flows(begun.first, 1.5 * step, second, 0.5 * step)
    kept_1 = refused_backflow(plant, change.supplied_1)
    kept_2 = refused_backflow(plant, change.supplied_2)
    carries = enthalpy_flow_ratio(1.0, thermal.heat_capacity_ratio)
    return ThermalFlows(
        content_1=change.content_1 + kept_1 * carries * begun.matrix.slopes.kept_1,
        content_2=change.content_2 + kept_2 * carries * begun.matrix.slopes.kept_2,
        mass_1=change.mass_1 + kept_1,
        mass_2=change.mass_2 + kept_2,
        supplied_1=change.supplied_1 + kept_1,
        supplied_2=change.supplied_2 + kept_2,
        leaked=change.leaked,
        source_content=change.source_content + (kept_1 + kept_2) * carries,
        port_content=change.port_content + (kept_1 + kept_2) * carries,
        heat=change.heat,
    )


def thermal_error(plant: PlantParameters, begun: ThermalGas, second: ThermalFlows, step: float) -> float:
    """Estimated error of pressures and temperatures after a step [s] divided by the allowed error, as ``gas_error``.

    In a chamber that is flushed within a step, the pressure is settled but the temperature is not.
    """
    added = solve_thermal_stage(begun.matrix, combine_flows(begun.first, 1.0, second, 1.0))
    return 0.5 * max(over_allowed(plant, begun, added.content_1, added.content_2, step), warming(begun, added, step))


def warming(begun: ThermalGas, added: ThermalFlows, step: float) -> float:
    """Larger temperature error of both chambers divided by the allowed error [-], from error rates [kg/s]."""
    # The temperature over the reference is content over mass: what a little of both changes it by.
    mass_1, mass_2 = begun.end_masses.mass_1, begun.end_masses.mass_2
    warmer_1 = (added.content_1 - begun.end.mass_1 / mass_1 * added.mass_1) / mass_1
    warmer_2 = (added.content_2 - begun.end.mass_2 / mass_2 * added.mass_2) / mass_2
    return max(abs(warmer_1), abs(warmer_2)) * step / ALLOWED_OF_TEMPERATURE


def thermal_opening_error(plant: PlantParameters, begun: ThermalGas, shift: float, step: float) -> float:
    """Error due to the mean valve opening of a step [s] divided by the allowed error [-], as ``opening_error``."""
    response_1 = (begun.matrix.a - 1.0) * begun.first.content_1
    response_2 = (begun.matrix.d - 1.0) * begun.first.content_2
    return shift / (12.0 * GAMMA) * over_allowed(plant, begun, response_1, response_2, step)


def over_allowed(plant: PlantParameters, begun: ThermalGas, rate_1: float, rate_2: float, step: float) -> float:
    """Larger pressure error of both chambers divided by the allowed error [-], from error rates [kg/s]."""
    end_1, end_2 = end_pressures(plant, begun)
    larger = max(
        abs(rate_1) / (begun.ended.volume_1 * pressure_that_matters(plant, end_1)),
        abs(rate_2) / (begun.ended.volume_2 * pressure_that_matters(plant, end_2)),
    )
    return larger * step * plant.gas_product / ALLOWED_OF_PRESSURE


def after_motion(
    plant: PlantParameters,
    thermal: ThermalParameters,
    state: PlantState,
    assumed_angle: float,
    angle: float,
    *,
    parts: ActuatorFunctions,
) -> PlantState:
    """State after isentropic correction of the gas from the assumed angle [rad] to the angle reached [rad]."""
    ratio = thermal.heat_capacity_ratio
    pressure_1, pressure_2 = parts.pressures(plant, assumed_angle, state.mass_1, state.mass_2)
    assumed = parts.chambers(plant, assumed_angle, pressure_1, pressure_2)
    turned = parts.chambers(plant, angle, pressure_1, pressure_2)
    # The isentrope k P dV = -V dP, of which the wall's part goes with the pressure: the pressure there, then the work.
    reached_1 = pressure_1 - ratio * pressure_1 * (turned.volume_1 - assumed.volume_1) / (
        assumed.volume_1 + ratio * pressure_1 * assumed.compliance_1
    )
    reached_2 = pressure_2 - ratio * pressure_2 * (turned.volume_2 - assumed.volume_2) / (
        assumed.volume_2 + ratio * pressure_2 * assumed.compliance_2
    )
    reached = parts.chambers(plant, angle, reached_1, reached_2)
    half = 0.5 * (ratio - 1.0)
    mean_1, mean_2 = 0.5 * (reached.volume_1 + assumed.volume_1), 0.5 * (reached.volume_2 + assumed.volume_2)
    work_1, work_2 = half * (reached.volume_1 - assumed.volume_1), half * (reached.volume_2 - assumed.volume_2)
    return state._replace(
        mass_1=state.mass_1 * (mean_1 - work_1) / (mean_1 + work_1),
        mass_2=state.mass_2 * (mean_2 - work_2) / (mean_2 + work_2),
    )


def with_thermal_gas(state: PlantState, masses: ThermalState, change: ThermalFlows) -> tuple[PlantState, ThermalState]:
    """Plant state, gas masses and energy totals after the changes [kg] of one step, without the work of the gas."""
    supplied = change.supplied_1 + change.supplied_2
    vented = supplied - change.mass_1 - change.mass_2
    return (
        state._replace(
            mass_1=state.mass_1 + change.content_1,
            mass_2=state.mass_2 + change.content_2,
            supplied_mass=state.supplied_mass + supplied,
            vented_mass=state.vented_mass + vented,
            leaked_mass=state.leaked_mass + abs(change.leaked),
        ),
        masses._replace(
            mass_1=masses.mass_1 + change.mass_1,
            mass_2=masses.mass_2 + change.mass_2,
            supplied_content=masses.supplied_content + change.source_content,
            vented_content=masses.vented_content + change.source_content - change.port_content,
            heat_content=masses.heat_content + change.heat,
        ),
    )


def with_work(
    plant: PlantParameters, masses: ThermalState, before: PlantState, after: PlantState, *, parts: ActuatorFunctions
) -> ThermalState:
    """Gas masses and energy totals, updated by the gas work on shaft and expanding walls between two states."""
    before_1, before_2 = parts.pressures(plant, before.angle, before.mass_1, before.mass_2)
    after_1, after_2 = parts.pressures(plant, after.angle, after.mass_1, after.mass_2)
    first = parts.chambers(plant, before.angle, before_1, before_2)
    last = parts.chambers(plant, after.angle, after_1, after_2)
    # The trapezoidal rule over the volumes: exact along a wall that gives in proportion to the pressure.
    work_1 = 0.5 * (before_1 + after_1) * (last.volume_1 - first.volume_1)
    work_2 = 0.5 * (before_2 + after_2) * (last.volume_2 - first.volume_2)
    return masses._replace(gas_work=masses.gas_work + work_1 + work_2)


def masses_at_start(initial: PlantState) -> ThermalState:
    """Initial gas masses [kg] at the reference temperature, equal to the masses in the plant state, and zero totals."""
    return ThermalState(
        mass_1=initial.mass_1,
        mass_2=initial.mass_2,
        supplied_content=0.0,
        vented_content=0.0,
        heat_content=0.0,
        gas_work=0.0,
    )
