"""One step of both chambers with the lines that feed them: the gas scheme with supply pressures that change.

The stages are those of ``pneumatics``, which keep their second order with any matrix: this one says that a line loses
what its chamber gains, so that a chamber that has come to the pressure of a small line asks for no small step. The
lines follow after each stage, with what the valves took from each of them.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from ppafo.engine.scheme.pneumatics import (
    SHORTEST,
    GasChange,
    Linearisation,
    MovingGas,
    begin_moving_stage,
    linearise,
)
from ppafo.model.plant import PlantParameters, PlantState, chamber_pressures, chamber_volumes
from ppafo.model.regulator import LineState, LineStep, SupplyLines, line_pressures, step_lines


class FedGas(NamedTuple):
    """First stage: both chambers, flow out of line 2 and gamma h times its change [kg/s], both lines after it."""

    chambers: MovingGas
    taken_2: float
    drift_2: float
    lines: LineStep


def fed_plant(plant: PlantParameters, lines: SupplyLines, state: LineState) -> PlantParameters:
    """The plant with the pressures of its lines in place of those that the regulators are set to."""
    pressure_1, pressure_2 = line_pressures(lines, plant.gas_product, state)
    return PlantParameters(
        plant.gas_product,
        plant.torque_constant,
        plant.volume_per_angle,
        plant.angle_min,
        plant.angle_max,
        plant.dead_volume_1,
        plant.dead_volume_2,
        plant.restitution,
        plant.static_torque,
        plant.dynamic_torque,
        plant.viscous_damping,
        plant.inertia,
        plant.gravity_torque,
        plant.external_torque,
        pressure_1,
        pressure_2,
        plant.atmospheric_pressure,
        plant.valve_conductance,
        plant.leak_conductance,
        plant.valve_curve,
        plant.leak_curve,
        plant.relieving,
    )


def with_lines(linear: Linearisation, share_1: float, share_2: float) -> Linearisation:
    """The linearisation with lines that lose what their chambers gain; shares are volumes of chamber over line [-]."""
    more_1, more_2 = linear.supplied_by_1 * share_1, linear.supplied_by_2 * share_2
    a, d = linear.a - more_1, linear.d - more_2
    scale = 1.0 / (a * d - linear.b * linear.c)
    return Linearisation(a, linear.b, linear.c, d, scale, linear.supplied_by_1 + more_1, linear.supplied_by_2 + more_2)


def begin_fed_gas(
    plant: PlantParameters,
    lines: SupplyLines,
    line_state: LineState,
    state: PlantState,
    next_angle: float,
    port_1: Any,
    port_2: Any,
    step: float,
    port_flow_slopes: Callable[..., Any],
) -> FedGas:
    """First stage of one step [s] with volumes that run to those of ``next_angle`` [rad]; ports at line pressures."""
    linear, flows = linearise(plant, state, port_1, port_2, step, port_flow_slopes)
    volumes = chamber_volumes(plant, state.angle)
    linear = with_lines(linear, volumes[0] / lines.volume_1, volumes[1] / lines.volume_2)
    chambers = begin_moving_stage(plant, state, next_angle, linear, flows, step)
    first = chambers.still.first
    # What of the sums is line 2's: the same stage once more, for one number.
    pressure_2 = chamber_pressures(plant, state.angle, state.mass_1, state.mass_2)[1]
    growth = (volumes[1] - chamber_volumes(plant, next_angle)[1]) / (volumes[1] * max(step, SHORTEST))
    drift_2 = linear.supplied_by_2 * state.mass_2 * growth
    from_2 = port_flow_slopes(pressure_2, port_2, plant.valve_curve).from_source
    taken_2 = from_2 + drift_2 + linear.supplied_by_2 * first.mass_2
    stepped = step_lines(
        lines,
        plant.supply_pressure,
        plant.dorsiflexion_pressure,
        plant.gas_product,
        line_state,
        step * (first.supplied - taken_2),
        step * taken_2,
        0.0,
        step,
    )
    return FedGas(chambers, taken_2, drift_2, stepped)


def end_lines(
    plant: PlantParameters,
    lines: SupplyLines,
    line_state: LineState,
    begun: FedGas,
    change: GasChange,
    port_2: Any,
    step: float,
    port_flow: Callable[..., Any],
) -> LineState:
    """Both lines at the end of the step [s]; ``change`` is what the chambers and totals gained in it."""
    still = begun.chambers.still
    from_2 = port_flow(still.end_2, port_2, plant.valve_curve).from_source
    second = from_2 - 2.0 * begun.taken_2 - begun.drift_2
    # Half the second stage's rate of chamber 2 is what the change has beside the first stage.
    responded = still.linear.supplied_by_2 * (change.mass_2 - 1.5 * step * still.first.mass_2)
    taken_2 = step * (1.5 * begun.taken_2 + 0.5 * second) + responded
    return step_lines(
        lines,
        plant.supply_pressure,
        plant.dorsiflexion_pressure,
        plant.gas_product,
        line_state,
        change.supplied - taken_2,
        taken_2,
        begun.lines.inlet_rise,
        step,
    ).after
