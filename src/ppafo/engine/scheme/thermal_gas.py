"""Integration step of the gas with an energy balance: the Rosenbrock method of ``pneumatics`` on energies and masses.

The energy of a chamber is expressed as its gas content, ``P V M / (R T_0)`` [kg]: the mass that would give its pressure
at the reference temperature. Content divided by true mass is ``T / T_0``. Gas from the source and from the atmosphere
enters at ``T_0``. For isothermal gas the content is the mass, so that code which reads pressures from ``PlantState``
applies unchanged; the true masses are stored in addition. True masses and the contents that the gas carries are both
``Flows`` as of isothermal gas, with a ratio for each path. The matrix neglects the dependence of the flows on the
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

from ppafo.engine.composer import each
from ppafo.engine.scheme.pneumatics import (
    GAMMA,
    Flows,
    GasFlows,
    Linearisation,
    SlopedFlows,
    added_flows,
    flow_rates,
    linearise,
    response,
    with_gas,
)
from ppafo.model.gas import enthalpy_flow_ratio, mass_flow_ratio
from ppafo.model.plant import (
    ActuatorFunctions,
    PlantParameters,
    PlantState,
    PortFlow,
    PortSlopes,
    ThermalParameters,
    ThermalState,
    pressures_per_mass,
)

ALLOWED_OF_TEMPERATURE = 2.5e-4
"""Allowed error of one step divided by the reference temperature [-]; the error of a run then stays below 2e-3."""
NEARLY_EQUAL = 1.0e-4
"""Relative difference of two pressures [-] below which the flow may reverse within a step."""


class WarmGas(NamedTuple):
    """Gas in both chambers: contents and true masses [kg]."""

    content_1: float
    content_2: float
    mass_1: float
    mass_2: float


class ThermalFlows(NamedTuple):
    """Rates of gas with an energy balance [kg/s].

    Attributes:
        mass_1, mass_2: contents of both chambers, the masses of ``PlantState``
        gas: true masses
        energy: contents that the gas carries through ports and leakage
        heat: content equivalent to the heat from the chamber walls
    """

    mass_1: float
    mass_2: float
    gas: Flows
    energy: Flows
    heat: float


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


class PathRatios(NamedTuple):
    """A number for the gas in each path [-]: ``sqrt(T / T_0)`` upstream, or a flow over that at ``T_0``."""

    source_1: float
    vent_1: float
    source_2: float
    vent_2: float
    leak: float


def upstream_roots(gas: WarmGas, flowing: GasFlows, turns_1: float, turns_2: float) -> PathRatios:
    """Roots ``sqrt(T / T_0)`` of the gas in each path [-]; the larger of both sides in a vent whose flow may reverse.

    ``turns_1`` and ``turns_2`` [kg/s] are the flows through the vents below which they may reverse within a step. When
    the flow of a settled chamber reverses, outflowing cold gas becomes inflowing warm gas, more than the matrix
    assumes. A matrix that is too steep damps this error; a matrix that is too flat lets the error grow from step to
    step.
    """
    root_1 = math.sqrt(gas.content_1 / gas.mass_1)
    root_2 = math.sqrt(gas.content_2 / gas.mass_2)
    in_1 = flowing.in_1
    in_2 = flowing.in_2
    vent_1 = in_1.total - in_1.from_source
    vent_2 = in_2.total - in_2.from_source
    return PathRatios(
        source_1=1.0 if in_1.from_source >= 0.0 else root_1,
        vent_1=max(1.0, root_1) if abs(vent_1) < turns_1 else (1.0 if vent_1 >= 0.0 else root_1),
        source_2=1.0 if in_2.from_source >= 0.0 else root_2,
        vent_2=max(1.0, root_2) if abs(vent_2) < turns_2 else (1.0 if vent_2 >= 0.0 else root_2),
        leak=root_1 if flowing.leak >= 0.0 else root_2,
    )


def enthalpy_ratios(thermal: ThermalParameters, roots: PathRatios) -> PathRatios:
    """Content that the gas in each path carries, over its mass flow at the reference temperature [-]."""
    ratio = thermal.heat_capacity_ratio
    return PathRatios(
        source_1=enthalpy_flow_ratio(roots.source_1, ratio),
        vent_1=enthalpy_flow_ratio(roots.vent_1, ratio),
        source_2=enthalpy_flow_ratio(roots.source_2, ratio),
        vent_2=enthalpy_flow_ratio(roots.vent_2, ratio),
        leak=enthalpy_flow_ratio(roots.leak, ratio),
    )


def carried(flowing: GasFlows, by: PathRatios) -> GasFlows:
    """Flows [kg/s], each times the ratio of its path."""
    in_1 = flowing.in_1
    in_2 = flowing.in_2
    fed_1 = in_1.from_source * by.source_1
    fed_2 = in_2.from_source * by.source_2
    return GasFlows(
        PortFlow(fed_1 + (in_1.total - in_1.from_source) * by.vent_1, fed_1),
        PortFlow(fed_2 + (in_2.total - in_2.from_source) * by.vent_2, fed_2),
        flowing.leak * by.leak,
    )


def carried_slopes(flowing: SlopedFlows, by: PathRatios) -> SlopedFlows:
    """Flows whose derivatives are those of what each path carries; their temperature is constant."""
    to_1 = flowing.slopes_1
    to_2 = flowing.slopes_2
    fed_1 = to_1.from_source * by.source_1
    fed_2 = to_2.from_source * by.source_2
    return SlopedFlows(
        flowing.flows,
        PortSlopes(fed_1 + (to_1.total - to_1.from_source) * by.vent_1, fed_1),
        PortSlopes(fed_2 + (to_2.total - to_2.from_source) * by.vent_2, fed_2),
        flowing.leak_by_1 * by.leak,
        flowing.leak_by_2 * by.leak,
    )


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


def thermal_flows(thermal: ThermalParameters, gas: WarmGas, at: WarmChambers, flowing: GasFlows) -> ThermalFlows:
    """All rates of gas with an energy balance [kg/s], from the flows at the reference temperature [kg/s]."""
    roots = upstream_roots(gas, flowing, 0.0, 0.0)
    energy = flow_rates(carried(flowing, enthalpy_ratios(thermal, roots)))
    heat_1 = wall_rate(thermal, at.volume_1, gas.content_1, gas.mass_1)
    heat_2 = wall_rate(thermal, at.volume_2, gas.content_2, gas.mass_2)
    # In units of content, the work P dV of a chamber is (k - 1) times its content over its volume.
    less = thermal.heat_capacity_ratio - 1.0
    work_1 = less * at.growth_1 * gas.content_1 / at.volume_1
    work_2 = less * at.growth_2 * gas.content_2 / at.volume_2
    return ThermalFlows(
        mass_1=content_rate(thermal, energy.mass_1, work_1, heat_1, at.give_1),
        mass_2=content_rate(thermal, energy.mass_2, work_2, heat_2, at.give_2),
        gas=flow_rates(carried(flowing, each(mass_flow_ratio, roots))),
        energy=energy,
        heat=heat_1 + heat_2,
    )


class ThermalMatrix(NamedTuple):
    """Matrix of a step with an energy balance, after elimination of the true masses.

    Attributes:
        a, b, c, d: matrix elements by rows, for the contents [-]
        gas, energy: derivatives of true masses and of carried contents with respect to the contents
        kept_1, kept_2: fractions of the entering energy that stay in the chambers [-]
        wall_1, wall_2: gamma h times the derivatives of the wall heat with respect to the masses [-]
        cooling_1, cooling_2: gamma h times the decrease of the wall heat with the contents [-]
    """

    a: float
    b: float
    c: float
    d: float
    gas: Linearisation
    energy: Linearisation
    kept_1: float
    kept_2: float
    wall_1: float
    wall_2: float
    cooling_1: float
    cooling_2: float


class ThermalStage(NamedTuple):
    """First stage of a step with an energy balance.

    Attributes:
        linear: matrix of the step
        scale: 1 divided by the determinant of the matrix [-]
        first: stage slopes [kg/s]
        lost_1, lost_2: rates of the contents that lower the pressures as the growing volumes do [kg/s]
        gas, at: gas and chambers after the stage
        end_1, end_2: absolute pressures after the stage [Pa]
    """

    linear: ThermalMatrix
    scale: float
    first: ThermalFlows
    lost_1: float
    lost_2: float
    gas: WarmGas
    at: WarmChambers
    end_1: float
    end_2: float


def thermal_matrix(
    plant: PlantParameters,
    thermal: ThermalParameters,
    gas: WarmGas,
    at: WarmChambers,
    flowing: SlopedFlows,
    step: float,
) -> ThermalMatrix:
    """Matrix of a step [s] with an energy balance."""
    ratio = thermal.heat_capacity_ratio
    weight = GAMMA * step
    room_1 = at.volume_1 * (1.0 + at.give_1)
    room_2 = at.volume_2 * (1.0 + at.give_2)
    per_content_1, per_content_2 = pressures_per_mass(plant.gas_product, room_1, room_2)
    vented_1 = abs(flowing.slopes_1.total - flowing.slopes_1.from_source)
    vented_2 = abs(flowing.slopes_2.total - flowing.slopes_2.from_source)
    turns_1 = vented_1 * (NEARLY_EQUAL * per_content_1 * gas.content_1)
    turns_2 = vented_2 * (NEARLY_EQUAL * per_content_2 * gas.content_2)
    roots = upstream_roots(gas, flowing.flows, turns_1, turns_2)
    by_mass = linearise(per_content_1, per_content_2, carried_slopes(flowing, each(mass_flow_ratio, roots)), step)
    by_energy = linearise(per_content_1, per_content_2, carried_slopes(flowing, enthalpy_ratios(thermal, roots)), step)
    cooling_1 = weight * thermal.wall_exchange * at.volume_1 / gas.mass_1
    cooling_2 = weight * thermal.wall_exchange * at.volume_2 / gas.mass_2
    wall_1 = cooling_1 * gas.content_1 / gas.mass_1
    wall_2 = cooling_2 * gas.content_2 / gas.mass_2
    work_1 = weight * (ratio - 1.0) * at.growth_1 / (at.volume_1 * (1.0 + ratio * at.give_1))
    work_2 = weight * (ratio - 1.0) * at.growth_2 / (at.volume_2 * (1.0 + ratio * at.give_2))
    kept_1 = kept_share(ratio, at.give_1)
    kept_2 = kept_share(ratio, at.give_2)
    # The masses are eliminated first: they respond to the contents alone, so that a 2 by 2 matrix is left.
    return ThermalMatrix(
        a=1.0 - kept_1 * (1.0 - by_energy.a - cooling_1 + wall_1 * (1.0 - by_mass.a)) + work_1,
        b=kept_1 * (by_energy.b + wall_1 * by_mass.b),
        c=kept_2 * (by_energy.c + wall_2 * by_mass.c),
        d=1.0 - kept_2 * (1.0 - by_energy.d - cooling_2 + wall_2 * (1.0 - by_mass.d)) + work_2,
        gas=by_mass,
        energy=by_energy,
        kept_1=kept_1,
        kept_2=kept_2,
        wall_1=wall_1,
        wall_2=wall_2,
        cooling_1=cooling_1,
        cooling_2=cooling_2,
    )


def thermal_response(matrix: ThermalMatrix, content_1: float, content_2: float) -> ThermalFlows:
    """Gamma h times the rate of change of all flows except heat [kg/s], for given rates of both contents [kg/s]."""
    energy = response(matrix.energy, content_1, content_2)
    return ThermalFlows(
        mass_1=matrix.kept_1 * energy.mass_1,
        mass_2=matrix.kept_2 * energy.mass_2,
        gas=response(matrix.gas, content_1, content_2),
        energy=energy,
        heat=0.0,
    )


def solve_thermal_stage(matrix: ThermalMatrix, scale: float, right: ThermalFlows) -> ThermalFlows:
    """Stage slopes [kg/s] of a step with an energy balance, from the right-hand sides [kg/s]."""
    # Right-hand sides of the contents after the masses are eliminated.
    right_1 = right.mass_1 + matrix.kept_1 * matrix.wall_1 * right.gas.mass_1
    right_2 = right.mass_2 + matrix.kept_2 * matrix.wall_2 * right.gas.mass_2
    content_1 = (matrix.d * right_1 - matrix.b * right_2) * scale
    content_2 = (matrix.a * right_2 - matrix.c * right_1) * scale
    by_contents = thermal_response(matrix, content_1, content_2)
    gas = added_flows(right.gas, by_contents.gas)
    warmed_1 = matrix.wall_1 * gas.mass_1 - matrix.cooling_1 * content_1
    warmed_2 = matrix.wall_2 * gas.mass_2 - matrix.cooling_2 * content_2
    return ThermalFlows(
        mass_1=content_1,
        mass_2=content_2,
        gas=gas,
        energy=added_flows(right.energy, by_contents.energy),
        heat=right.heat + warmed_1 + warmed_2,
    )


def added_thermal_flows(one: ThermalFlows, other: ThermalFlows) -> ThermalFlows:
    """Sum of two sets of rates [kg/s]."""
    return ThermalFlows(
        mass_1=one.mass_1 + other.mass_1,
        mass_2=one.mass_2 + other.mass_2,
        gas=added_flows(one.gas, other.gas),
        energy=added_flows(one.energy, other.energy),
        heat=one.heat + other.heat,
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


def with_thermal_gas(state: PlantState, masses: ThermalState, change: ThermalFlows) -> tuple[PlantState, ThermalState]:
    """Plant state, gas masses and energy totals after the changes [kg] of one step, without the work of the gas."""
    source = change.energy.supplied_1 + change.energy.supplied_2
    after = with_gas(state, change.gas)
    return (
        after._replace(mass_1=state.mass_1 + change.mass_1, mass_2=state.mass_2 + change.mass_2),
        masses._replace(
            mass_1=masses.mass_1 + change.gas.mass_1,
            mass_2=masses.mass_2 + change.gas.mass_2,
            supplied_content=masses.supplied_content + source,
            vented_content=masses.vented_content + source - change.energy.mass_1 - change.energy.mass_2,
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
