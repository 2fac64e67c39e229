"""Isothermal real gas, whose pressure is not proportional to its density: the step of ``pneumatics`` on true masses.

``PlantState`` stores the gas content, ``P V M / (R T_0)``, so that code which reads pressures applies unchanged; the
true masses are stored in addition. The ports ``gas_density`` and ``ideal_density`` give the equation of state.
"""

from typing import NamedTuple

from ppafo.engine.scheme.pneumatics import (
    SHORTEST,
    Flows,
    GasChange,
    MovingGas,
    SlopedFlows,
    StillGas,
    added_flows,
    linearise,
    moving_change,
    response,
    solve_stage,
)
from ppafo.model.plant import ActuatorFunctions, PlantParameters, PlantState, TrueMasses
from ppafo.model.ports import gas_density, ideal_density


class RealGas(NamedTuple):
    """First stage of a step with real gas, and both chamber volumes [m^3] at its end."""

    moving: MovingGas
    volume_1: float
    volume_2: float


class RealChange(NamedTuple):
    """Changes over one step [kg]: true masses and totals as in ``GasChange``, and gas contents of both chambers."""

    gas: GasChange
    content_1: float
    content_2: float


def true_mass(content: float, volume: float) -> float:
    """True mass [kg] of gas with the given content [kg] in a volume [m^3]. Equation (3)."""
    return volume * gas_density(content / volume)


def masses_at_start(plant: PlantParameters, initial: PlantState, *, parts: ActuatorFunctions) -> TrueMasses:
    """True masses [kg] of the gas in both chambers, for a state whose masses are ideal-gas contents."""
    volume_1, volume_2 = parts.rest_volumes(plant, initial.angle)
    return TrueMasses(true_mass(initial.mass_1, volume_1), true_mass(initial.mass_2, volume_2))


def content_of(mass: float, volume: float) -> float:
    """Content [kg] of a true mass [kg] in a volume [m^3]: mass of ideal gas at the same pressure. Equation (3)."""
    ideal, _ = ideal_density(mass / volume)
    return volume * ideal


def content_rate(content: float, volume: float, growth: float, flow: float) -> float:
    """Rate of a content [kg/s] in a volume [m^3] that grows at ``growth`` [m^3/s], with an inflow ``flow`` [kg/s].

    With the ideal-gas density u and the true density rho, ``d(u V)/dt = du/drho (flow - rho V') + u V'``.
    """
    density = gas_density(content / volume)
    ideal, stiffness = ideal_density(density)
    return stiffness * (flow - density * growth) + ideal * growth


def begin_real_gas(
    plant: PlantParameters,
    state: PlantState,
    masses: TrueMasses,
    next_angle: float,
    flowing: SlopedFlows,
    step: float,
    *,
    parts: ActuatorFunctions,
) -> RealGas:
    """First stage of one step [s] as ``begin_moving_gas``, for a real gas; the angle runs to ``next_angle`` [rad]."""
    volume_1, volume_2 = parts.rest_volumes(plant, state.angle)
    next_1, next_2 = parts.rest_volumes(plant, next_angle)
    density_1, density_2 = masses.mass_1 / volume_1, masses.mass_2 / volume_2
    _, stiffness_1 = ideal_density(density_1)
    _, stiffness_2 = ideal_density(density_2)
    per_mass_1, per_mass_2 = plant.gas_product * stiffness_1 / volume_1, plant.gas_product * stiffness_2 / volume_2
    linear, flows = linearise(per_mass_1, per_mass_2, flowing, step)
    # A growing volume lowers the pressure as a loss of mass at this rate would; parts of a step may have no length.
    per_duration = 1.0 / max(step, SHORTEST)
    drift = response(
        linear, density_1 * (volume_1 - next_1) * per_duration, density_2 * (volume_2 - next_2) * per_duration
    )
    first = solve_stage(linear, added_flows(flows, drift))
    end_1 = content_of(masses.mass_1 + step * first.mass_1, next_1) * plant.gas_product / next_1
    end_2 = content_of(masses.mass_2 + step * first.mass_2, next_2) * plant.gas_product / next_2
    return RealGas(MovingGas(StillGas(linear=linear, first=first, end_1=end_1, end_2=end_2), drift), next_1, next_2)


def real_change(
    plant: PlantParameters, state: PlantState, masses: TrueMasses, begun: RealGas, second: Flows, step: float
) -> RealChange:
    """Changes [kg] in one step [s] from both stages."""
    # The totals count true masses; the contents follow from these at the volumes of the end.
    gas = moving_change(plant, begun.moving.still, second, step)
    return RealChange(
        gas=gas,
        content_1=content_of(masses.mass_1 + gas.mass_1, begun.volume_1) - state.mass_1,
        content_2=content_of(masses.mass_2 + gas.mass_2, begun.volume_2) - state.mass_2,
    )


def with_real_gas(state: PlantState, masses: TrueMasses, change: RealChange) -> tuple[PlantState, TrueMasses]:
    """State and true masses after adding the gas of one step."""
    gas = change.gas
    vented = gas.supplied - gas.mass_1 - gas.mass_2
    return (
        state._replace(
            mass_1=state.mass_1 + change.content_1,
            mass_2=state.mass_2 + change.content_2,
            supplied_mass=state.supplied_mass + gas.supplied,
            vented_mass=state.vented_mass + vented,
            leaked_mass=state.leaked_mass + abs(gas.leaked),
        ),
        TrueMasses(masses.mass_1 + gas.mass_1, masses.mass_2 + gas.mass_2),
    )


def at_angle(
    plant: PlantParameters, state: PlantState, masses: TrueMasses, angle: float, *, parts: ActuatorFunctions
) -> PlantState:
    """State with the gas contents at the angle [rad] reached by the vane."""
    volume_1, volume_2 = parts.rest_volumes(plant, angle)
    return state._replace(mass_1=content_of(masses.mass_1, volume_1), mass_2=content_of(masses.mass_2, volume_2))
