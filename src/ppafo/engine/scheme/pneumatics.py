"""One step of both chambers: two-stage L-stable Rosenbrock method on the two masses.

The method is ROS2 of Verwer, Spee, Blom and Hundsdorfer (SIAM J. Sci. Comput. 20, 1999), gamma = 1 - 1/sqrt(2), with
the exact Jacobian and the time derivative that comes from the moving volumes, which run linearly through the step.
Gas totals are integrated by the same method as further unknowns, so that mass is conserved to rounding.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from ppafo.model.orifice import orifice_flow, orifice_flow_slopes
from ppafo.model.plant import PlantParameters, PlantState, chamber_pressures, chamber_volumes
from ppafo.model.ports import PortFlowSlopes

GAMMA = 0.2928932188134524


class GasChange(NamedTuple):
    """What one step adds to both chambers, to the gas drawn from the source and to the vane leak (1 to 2) [kg]."""

    mass_1: float
    mass_2: float
    supplied: float
    leaked: float


class Stage(NamedTuple):
    """Stage slopes of the four unknowns [kg/s]."""

    mass_1: float
    mass_2: float
    supplied: float
    leaked: float


class Linearisation(NamedTuple):
    """Derivatives of the flows with respect to both masses [1/s], their drift in time over gamma h, and the inverse.

    ``a`` to ``d`` is the matrix 1 - gamma h J by rows, ``scale`` one over its determinant.
    """

    a: float
    b: float
    c: float
    d: float
    scale: float
    supplied_by_1: float
    supplied_by_2: float
    leaked_by_1: float
    leaked_by_2: float
    drift_1: float
    drift_2: float
    supplied_drift: float
    leaked_drift: float


def solve_stage(
    linear: Linearisation, flow_1: float, flow_2: float, supplied: float, leaked: float, weight: float
) -> Stage:
    """Stage slopes from the right-hand sides of both chambers and both totals [kg/s]; ``weight`` is gamma h [s]."""
    slope_1 = (linear.d * flow_1 - linear.b * flow_2) * linear.scale
    slope_2 = (linear.a * flow_2 - linear.c * flow_1) * linear.scale
    supplied_slope = supplied + weight * (linear.supplied_by_1 * slope_1 + linear.supplied_by_2 * slope_2)
    leaked_slope = leaked + weight * (linear.leaked_by_1 * slope_1 + linear.leaked_by_2 * slope_2)
    return Stage(slope_1, slope_2, supplied_slope, leaked_slope)


def linearised(
    plant: PlantParameters,
    state: PlantState,
    volumes: tuple[float, float],
    next_volumes: tuple[float, float],
    in_1: PortFlowSlopes,
    in_2: PortFlowSlopes,
    leak_by_1: float,
    leak_by_2: float,
    step: float,
) -> Linearisation:
    """Derivatives of all flows at the beginning of a step, and the inverse that both stages use."""
    per_mass_1 = plant.gas_product / volumes[0]
    per_mass_2 = plant.gas_product / volumes[1]
    weight = GAMMA * step
    a = 1.0 - weight * (in_1.total_slope - leak_by_1) * per_mass_1
    b = weight * leak_by_2 * per_mass_2
    c = -weight * leak_by_1 * per_mass_1
    d = 1.0 - weight * (in_2.total_slope + leak_by_2) * per_mass_2
    # Pressure change that the moving volumes alone would make in this step, times gamma.
    drift_1 = -GAMMA * state.mass_1 * per_mass_1 * (next_volumes[0] - volumes[0]) / volumes[0]
    drift_2 = -GAMMA * state.mass_2 * per_mass_2 * (next_volumes[1] - volumes[1]) / volumes[1]
    leaked_drift = leak_by_1 * drift_1 + leak_by_2 * drift_2
    return Linearisation(
        a,
        b,
        c,
        d,
        1.0 / (a * d - b * c),
        in_1.source_slope * per_mass_1,
        in_2.source_slope * per_mass_2,
        leak_by_1 * per_mass_1,
        leak_by_2 * per_mass_2,
        in_1.total_slope * drift_1 - leaked_drift,
        in_2.total_slope * drift_2 + leaked_drift,
        in_1.source_slope * drift_1 + in_2.source_slope * drift_2,
        leaked_drift,
    )


def advance_gas(
    plant: PlantParameters,
    state: PlantState,
    next_angle: float,
    port_1: Any,
    port_2: Any,
    step: float,
    port_flow: Callable[..., Any],
    port_flow_slopes: Callable[..., Any],
) -> GasChange:
    """Changes of mass [kg] in one step [s] in which the volumes run linearly to those of ``next_angle`` [rad].

    Equations (3) to (9).
    """
    volumes = chamber_volumes(plant, state.angle)
    next_volumes = chamber_volumes(plant, next_angle)
    pressure_1, pressure_2 = chamber_pressures(plant, state.angle, state.mass_1, state.mass_2)
    in_1 = port_flow_slopes(pressure_1, port_1, plant.valve_curve)
    in_2 = port_flow_slopes(pressure_2, port_2, plant.valve_curve)
    leak, leak_by_1, leak_by_2 = orifice_flow_slopes(pressure_1, pressure_2, plant.leak_conductance, plant.leak_curve)
    linear = linearised(plant, state, volumes, next_volumes, in_1, in_2, leak_by_1, leak_by_2, step)
    first = solve_stage(
        linear,
        in_1.total - leak + linear.drift_1,
        in_2.total + leak + linear.drift_2,
        in_1.from_source + in_2.from_source + linear.supplied_drift,
        leak + linear.leaked_drift,
        GAMMA * step,
    )

    end_1, end_2 = chamber_pressures(
        plant, next_angle, state.mass_1 + step * first.mass_1, state.mass_2 + step * first.mass_2
    )
    flow_1 = port_flow(end_1, port_1, plant.valve_curve)
    flow_2 = port_flow(end_2, port_2, plant.valve_curve)
    leak_end = orifice_flow(end_1, end_2, plant.leak_conductance, plant.leak_curve)
    second = solve_stage(
        linear,
        flow_1.total - leak_end - 2.0 * first.mass_1 - linear.drift_1,
        flow_2.total + leak_end - 2.0 * first.mass_2 - linear.drift_2,
        flow_1.from_source + flow_2.from_source - 2.0 * first.supplied - linear.supplied_drift,
        leak_end - 2.0 * first.leaked - linear.leaked_drift,
        GAMMA * step,
    )
    return GasChange(
        step * (1.5 * first.mass_1 + 0.5 * second.mass_1),
        step * (1.5 * first.mass_2 + 0.5 * second.mass_2),
        step * (1.5 * first.supplied + 0.5 * second.supplied),
        step * (1.5 * first.leaked + 0.5 * second.leaked),
    )
