"""Integration step of the gas in both chambers: two-stage L-stable Rosenbrock method on the two masses.

The method is ROS2 of Verwer, Spee, Blom and Hundsdorfer (SIAM J. Sci. Comput. 20, 1999), gamma = 1 - 1/sqrt(2), with
the exact Jacobian and the time derivative due to the moving volumes, which change linearly through the step. Gas totals
are integrated by the same method as further unknowns, so that mass is conserved to rounding.

Order of a step: the flows at the start with their derivatives (``gas_flows``), the first stage, the flows at the
pressures after the first stage, the second stage, and the changes by both stages. The flows of many runs are computed
in short loops of their own, because a division or a square root has a long latency and the processor overlaps several
runs meanwhile. The first stage alone is a step of first order, and the contribution of the second stage is the error
estimate.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from ppafo.model.columns import smaller
from ppafo.model.orifice import orifice_flow
from ppafo.model.plant import (
    ActuatorFunctions,
    PlantParameters,
    PlantState,
    PortFlow,
    PortSlopes,
    admitted_flow,
    pressures_per_mass,
)
from ppafo.model.ports import leakage_path

# gamma = 1 - 1/sqrt(2) makes the method L-stable; SHORTEST keeps a part without length from dividing by 0.
GAMMA = 0.2928932188134524
SHORTEST = 1.0e-30
ALLOWED_OF_PRESSURE = 2.5e-5
"""Allowed error of one step divided by the reference pressure [-]; a run then stays within ``KEPT_OF_PRESSURE``."""
KEPT_OF_PRESSURE = 1.0e-3
"""Error of a pressure divided by the pressure range [-] that a run does not exceed at the default tolerance."""
MINIMUM_PRESSURE = 0.02
"""Lowest reference pressure for errors, as a fraction of the atmospheric pressure [-]."""
OF_STAGES = 0.5 / ALLOWED_OF_PRESSURE
"""Weight of a step's error: half the sum of both stages, divided by the allowed error [-]."""
OF_OPENING = 1.0 / (12.0 * GAMMA * ALLOWED_OF_PRESSURE)
"""Weight of the error due to a moving valve: the mean of a product exceeds that of means by a twelfth of both changes.

The matrix of the step gives gamma times the change of the flow.
"""

# Found by trying: with fewer steps for a filling the error of a plain step passes 1e-3 (docs/decisions/0002).
STEPS_PER_FILLING = 70.0


class GasFlows(NamedTuple):
    """Flows into both chambers, and leakage flow across the vane from chamber 1 to 2 [kg/s]."""

    in_1: PortFlow
    in_2: PortFlow
    leak: float


class SlopedFlows(NamedTuple):
    """All flows [kg/s] with their derivatives by the pressures of both chambers [kg/(s Pa)]."""

    flows: GasFlows
    slopes_1: PortSlopes
    slopes_2: PortSlopes
    leak_by_1: float
    leak_by_2: float


def gas_flows(
    plant: PlantParameters,
    pressure_1: float,
    pressure_2: float,
    port_1: Any,
    port_2: Any,
    port_flow: Callable[..., tuple[PortFlow, PortSlopes]],
) -> SlopedFlows:
    """All flows [kg/s] at two absolute chamber pressures [Pa], with derivatives [kg/(s Pa)]. Equations (6) to (8).

    Where an effect makes the leakage depend on the pressures, its derivatives are those of a constant leakage; the
    method keeps its order with any matrix.
    """
    leaking = leakage_path(plant.leak_conductance, pressure_1, pressure_2, plant.leak_curve)
    in_1, slopes_1 = port_flow(pressure_1, port_1, plant.valve_curve)
    in_2, slopes_2 = port_flow(pressure_2, port_2, plant.valve_curve)
    leak, by_1, by_2 = orifice_flow(pressure_1, pressure_2, leaking, 1.0, plant.leak_curve)
    return SlopedFlows(GasFlows(in_1, in_2, leak), slopes_1, slopes_2, by_1, by_2)


class Flows(NamedTuple):
    """Rates of both chamber masses, of both supplied masses and of the leaked mass [kg/s]; over a step, changes [kg].

    The leak is the flow across the vane from chamber 1 to 2.
    """

    mass_1: float
    mass_2: float
    supplied_1: float
    supplied_2: float
    leaked: float


def flow_rates(flowing: GasFlows) -> Flows:
    """Rates of all masses [kg/s] from the flows through ports and leakage. Equation (9)."""
    in_1 = flowing.in_1
    in_2 = flowing.in_2
    leak = flowing.leak
    return Flows(
        mass_1=in_1.total - leak,
        mass_2=in_2.total + leak,
        supplied_1=in_1.from_source,
        supplied_2=in_2.from_source,
        leaked=leak,
    )


class Linearisation(NamedTuple):
    """Linearised flows of a step: the matrix ``1 - gamma h J`` of both masses, and the derivatives of the supply flows.

    Attributes:
        a, b, c, d: matrix elements by rows [-]
        supplied_by_1, supplied_by_2: gamma h times the derivatives of both supply flows, each by its chamber's mass [-]

    The leakage needs no elements of its own: gamma h times its derivatives are ``-c`` and ``b``.
    """

    a: float
    b: float
    c: float
    d: float
    supplied_by_1: float
    supplied_by_2: float


class GasStage(NamedTuple):
    """First stage of a step: linearised flows, stage slopes [kg/s], and absolute pressures [Pa] after the stage.

    ``scale`` [-] is 1 divided by the determinant of the matrix, ``drift`` gamma h times the time derivative of all
    flows between moving volumes [kg/s].
    """

    linear: Linearisation
    scale: float
    first: Flows
    drift: Flows
    end_1: float
    end_2: float


STILL = Flows(0.0, 0.0, 0.0, 0.0, 0.0)
"""Time derivative of the flows between fixed volumes [kg/s]."""


class HeldChambers(NamedTuple):
    """Pressure divided by mass [Pa/kg] of both chambers, at an angle [rad].

    For chambers that expand under pressure, the ratios apply at the supply pressures; pressures are computed from the
    angle.
    """

    per_mass_1: float
    per_mass_2: float
    angle: float


def held_chambers(plant: PlantParameters, angle: float, *, parts: ActuatorFunctions) -> HeldChambers:
    """Ratios of pressure to mass of both chambers at an angle [rad]. Equation (3)."""
    volume_1, volume_2 = parts.rest_volumes(plant, angle)
    per_mass_1, per_mass_2 = pressures_per_mass(plant.gas_product, volume_1, volume_2)
    return HeldChambers(per_mass_1=per_mass_1, per_mass_2=per_mass_2, angle=angle)


def held_pressures(_plant: PlantParameters, held: HeldChambers, state: PlantState) -> tuple[float, float]:
    """Absolute pressures [Pa] of both chambers from stored pressure-to-mass ratios, as ``chamber_pressures``."""
    return state.mass_1 * held.per_mass_1, state.mass_2 * held.per_mass_2


def response(linear: Linearisation, rate_1: float, rate_2: float) -> Flows:
    """Gamma h times the rate of change of all flows [kg/s], for given rates of change of both masses [kg/s]."""
    return Flows(
        mass_1=(1.0 - linear.a) * rate_1 - linear.b * rate_2,
        mass_2=(1.0 - linear.d) * rate_2 - linear.c * rate_1,
        supplied_1=linear.supplied_by_1 * rate_1,
        supplied_2=linear.supplied_by_2 * rate_2,
        leaked=linear.b * rate_2 - linear.c * rate_1,
    )


def added_flows(one: Flows, other: Flows) -> Flows:
    """Sum of two sets of flows [kg/s]."""
    return Flows(
        mass_1=one.mass_1 + other.mass_1,
        mass_2=one.mass_2 + other.mass_2,
        supplied_1=one.supplied_1 + other.supplied_1,
        supplied_2=one.supplied_2 + other.supplied_2,
        leaked=one.leaked + other.leaked,
    )


def solve_stage(linear: Linearisation, scale: float, right: Flows) -> Flows:
    """Stage slopes k [kg/s] from the right-hand sides of both masses and both totals [kg/s].

    ``(1 - gamma h J) k = right`` is solved by Cramer's rule; the totals follow, because no flow depends on them.
    """
    rate_1 = (linear.d * right.mass_1 - linear.b * right.mass_2) * scale
    rate_2 = (linear.a * right.mass_2 - linear.c * right.mass_1) * scale
    return Flows(
        mass_1=rate_1,
        mass_2=rate_2,
        supplied_1=right.supplied_1 + linear.supplied_by_1 * rate_1,
        supplied_2=right.supplied_2 + linear.supplied_by_2 * rate_2,
        leaked=right.leaked + linear.b * rate_2 - linear.c * rate_1,
    )


def linearise(per_mass_1: float, per_mass_2: float, flowing: SlopedFlows, step: float) -> Linearisation:
    """Linearised flows at the start of a step [s]. Equations (3), (6) to (9).

    ``per_mass_1`` and ``per_mass_2`` are pressure divided by mass [Pa/kg].
    """
    weight_1 = GAMMA * step * per_mass_1
    weight_2 = GAMMA * step * per_mass_2
    return Linearisation(
        a=1.0 - (flowing.slopes_1.total - flowing.leak_by_1) * weight_1,
        b=flowing.leak_by_2 * weight_2,
        c=-flowing.leak_by_1 * weight_1,
        d=1.0 - (flowing.slopes_2.total + flowing.leak_by_2) * weight_2,
        supplied_by_1=flowing.slopes_1.from_source * weight_1,
        supplied_by_2=flowing.slopes_2.from_source * weight_2,
    )


def inverse_determinant(a: float, b: float, c: float, d: float) -> float:
    """Inverse of the determinant of a matrix [-], whose elements are given by rows."""
    return 1.0 / (a * d - b * c)


def second_right(flows: Flows, first: Flows, drift: Flows) -> Flows:
    """Right-hand sides of the second stage [kg/s]: the flows after the first, less twice that stage and the drift."""
    return Flows(
        mass_1=flows.mass_1 - 2.0 * first.mass_1 - drift.mass_1,
        mass_2=flows.mass_2 - 2.0 * first.mass_2 - drift.mass_2,
        supplied_1=flows.supplied_1 - 2.0 * first.supplied_1 - drift.supplied_1,
        supplied_2=flows.supplied_2 - 2.0 * first.supplied_2 - drift.supplied_2,
        leaked=flows.leaked - 2.0 * first.leaked - drift.leaked,
    )


def of_both_stages(first: float, second: float, step: float) -> float:
    """Change in a step [s] from the rates of both stages, with the weights of the method."""
    return step * (1.5 * first + 0.5 * second)


def refused_backflow(plant: PlantParameters, supplied: float) -> float:
    """Gas [kg or kg/s] that a supply without relief does not take back, and which stays in its chamber.

    If the pressure of a chamber rises above its supply inside a step, the linearised flow would push it there.
    """
    return admitted_flow(supplied, plant.relieving) - supplied


def change_by_stages(first: Flows, second: Flows, step: float, kept_1: float, kept_2: float) -> Flows:
    """Changes [kg] in one step [s] from both stages, with what the supplies did not take back [kg]."""
    return Flows(
        mass_1=of_both_stages(first.mass_1, second.mass_1, step) + kept_1,
        mass_2=of_both_stages(first.mass_2, second.mass_2, step) + kept_2,
        supplied_1=of_both_stages(first.supplied_1, second.supplied_1, step) + kept_1,
        supplied_2=of_both_stages(first.supplied_2, second.supplied_2, step) + kept_2,
        leaked=of_both_stages(first.leaked, second.leaked, step),
    )


def kept_gas(plant: PlantParameters, first: Flows, second: Flows, step: float) -> tuple[float, float]:
    """Gas [kg] that either supply did not take back in one step [s], from both stages."""
    kept_1 = refused_backflow(plant, of_both_stages(first.supplied_1, second.supplied_1, step))
    return kept_1, refused_backflow(plant, of_both_stages(first.supplied_2, second.supplied_2, step))


def with_gas(state: PlantState, gas: Flows) -> PlantState:
    """State of the plant after adding the gas of a step [kg], with the angle and the angular velocity unchanged."""
    supplied = gas.supplied_1 + gas.supplied_2
    vented = supplied - gas.mass_1 - gas.mass_2
    return state._replace(
        mass_1=state.mass_1 + gas.mass_1,
        mass_2=state.mass_2 + gas.mass_2,
        supplied_mass=state.supplied_mass + supplied,
        vented_mass=state.vented_mass + vented,
        leaked_mass=state.leaked_mass + abs(gas.leaked),
    )


def pressure_error(
    plant: PlantParameters,
    weight: float,
    rate_1: float,
    rate_2: float,
    end_1: float,
    end_2: float,
    next_angle: float,
    step: float,
    *,
    parts: ActuatorFunctions,
) -> float:
    """Larger ratio of the error of a pressure in a step [s] to the allowed error [-], from error rates [kg/s].

    ``end_1`` and ``end_2`` [Pa] are the pressures after the first stage, ``weight`` is ``OF_STAGES``, or ``OF_OPENING``
    times the relative change of the opening; with that the error rates are those of ``opening_response``.
    """
    volume_1, volume_2 = parts.rest_volumes(plant, next_angle)
    content_1 = volume_1 * pressure_that_matters(plant, end_1)
    content_2 = volume_2 * pressure_that_matters(plant, end_2)
    return weight * step * plant.gas_product * larger_share(abs(rate_1), content_1, abs(rate_2), content_2)


def larger_share(part_1: float, whole_1: float, part_2: float, whole_2: float) -> float:
    """Larger of ``part_1 / whole_1`` and ``part_2 / whole_2`` with positive denominators, in one division."""
    # A division costs ten products.
    return max(part_1 * whole_2, part_2 * whole_1) / (whole_1 * whole_2)


def pressure_that_matters(plant: PlantParameters, pressure: float) -> float:
    """Reference pressure for errors [Pa]: the gauge pressure of the supplies or of the chamber, whichever is larger."""
    return max(supply_range(plant), abs(pressure - plant.atmospheric_pressure))


def supply_range(plant: PlantParameters) -> float:
    """Largest difference between a supply and the atmosphere [Pa], at least a fraction of the atmospheric pressure."""
    room = plant.atmospheric_pressure
    supplied = max(abs(plant.supply_pressure - room), abs(plant.dorsiflexion_pressure - room))
    return max(supplied, MINIMUM_PRESSURE * room)


def filling_time(plant: PlantParameters, volume: float) -> float:
    """Shortest time constant [s] of a chamber of ``volume`` [m^3] filled through the open valve and the leakage."""
    return volume / ((plant.valve_conductance + plant.leak_conductance) * plant.gas_product)


def is_slow(plant: PlantParameters, step: float, volume_1: float, volume_2: float, stiffness: float) -> bool:
    """Return whether a step [s] is at most 1/70 of the filling time of either chamber; volumes in m^3.

    The error of an undivided step then stays below 1e-3 of the pressure range (docs/decisions/0002). ``stiffness`` [-]
    is the stiffness of the gas divided by the isothermal stiffness: 1, or the heat capacity ratio for adiabatic
    chambers, which also fill faster. Any argument may be an array (runs,), and the result is then an array.
    """
    # The smaller chamber fills fastest. 1e-9 above, so that a step that was made from this very limit passes.
    filling = filling_time(plant, smaller(volume_1, volume_2))
    return step * STEPS_PER_FILLING * stiffness <= filling * (1.0 + 1.0e-9)
