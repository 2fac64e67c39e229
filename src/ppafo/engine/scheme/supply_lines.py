"""Integration step of both chambers with supply lines, isothermal or with an energy balance.

The stages of ``pneumatics`` keep their second order with any matrix. The matrix here includes the gas that a line loses
to its chamber, so that a chamber in equilibrium with a small line does not require small steps. The lines are
integrated after each stage, with the gas drawn by the valves; line 2 draws from line 1, so its flow is needed alone.
Gas in a line has the reference temperature: warm gas pushed back from a chamber gives its heat to the walls.
"""

import math
from typing import NamedTuple

from ppafo.engine.scheme.pneumatics import (
    ALLOWED_OF_PRESSURE,
    SHORTEST,
    GasChange,
    Linearisation,
    MovingGas,
    SlopedFlows,
    begin_moving_gas,
    held_chambers,
    linearise,
    pressure_that_matters,
)
from ppafo.engine.scheme.thermal_gas import ThermalFlows, ThermalGas, begin_thermal_stage, chambers_at_begin, transport
from ppafo.model.plant import (
    ActuatorFunctions,
    PlantParameters,
    PlantState,
    PortSlopes,
    ThermalParameters,
    ThermalState,
)
from ppafo.model.regulator import LineState, LineStep, SupplyLines, line_pressures, step_lines


class FedGas(NamedTuple):
    """First stage of a step with supply lines.

    Attributes:
        chambers: first stage of the gas in both chambers
        taken_2: flow out of line 2 [kg/s]
        drift_2: gamma h times the time derivative of the flow out of line 2 [kg/s]
        lines: both lines after the stage
    """

    chambers: MovingGas
    taken_2: float
    drift_2: float
    lines: LineStep


def plant_at_line_pressures(plant: PlantParameters, lines: SupplyLines, state: LineState) -> PlantParameters:
    """Plant whose supply pressures are the line pressures instead of the set pressures of the regulators."""
    pressure_1, pressure_2 = line_pressures(lines, plant.gas_product, state)
    return plant._replace(supply_pressure=pressure_1, dorsiflexion_pressure=pressure_2)


def lines_after(
    plant: PlantParameters,
    lines: SupplyLines,
    state: LineState,
    taken_1: float,
    taken_2: float,
    inlet_rise: float,
    step: float,
) -> LineStep:
    """Both lines after a step [s], as ``step_lines``, with the supply pressures of the plant as set pressures."""
    set_1, set_2 = plant.supply_pressure, plant.dorsiflexion_pressure
    return step_lines(lines, set_1, set_2, plant.gas_product, state, taken_1, taken_2, inlet_rise, step)


def with_lines(linear: Linearisation, ratio_1: float, ratio_2: float) -> Linearisation:
    """Linearisation that includes the gas lost by the lines; ``ratio`` is chamber volume divided by line volume [-]."""
    # A chamber that draws gas lowers its own supply: the flow responds more strongly.
    added_1, added_2 = linear.supplied_by_1 * ratio_1, linear.supplied_by_2 * ratio_2
    a, d = linear.a - added_1, linear.d - added_2
    scale = 1.0 / (a * d - linear.b * linear.c)
    supplied_by_1, supplied_by_2 = linear.supplied_by_1 + added_1, linear.supplied_by_2 + added_2
    return linear._replace(a=a, d=d, scale=scale, supplied_by_1=supplied_by_1, supplied_by_2=supplied_by_2)


def begin_fed_gas(
    plant: PlantParameters,
    lines: SupplyLines,
    line_state: LineState,
    state: PlantState,
    next_angle: float,
    flowing: SlopedFlows,
    step: float,
    *,
    parts: ActuatorFunctions,
) -> FedGas:
    """First stage of one step [s] with ports at line pressures and volumes that change up to ``next_angle`` [rad]."""
    fixed = held_chambers(plant, state.angle, parts=parts)
    linear = linearise(fixed.per_mass_1, fixed.per_mass_2, flowing, step)
    volume_1, volume_2 = parts.rest_volumes(plant, state.angle)
    linear = with_lines(linear, volume_1 / lines.volume_1, volume_2 / lines.volume_2)
    chambers = begin_moving_gas(plant, state, fixed, next_angle, linear, flowing.flows, step, parts=parts)
    first = chambers.still.first
    # The same stage for the flow out of line 2 alone, of which ``supplied`` is the sum with line 1.
    growth_2 = (volume_2 - parts.rest_volumes(plant, next_angle)[1]) / (volume_2 * max(step, SHORTEST))
    drift_2 = linear.supplied_by_2 * state.mass_2 * growth_2
    taken_2 = flowing.flows.in_2.from_source + drift_2 + linear.supplied_by_2 * first.mass_2
    stepped = lines_after(plant, lines, line_state, step * (first.supplied - taken_2), step * taken_2, 0.0, step)
    return FedGas(chambers=chambers, taken_2=taken_2, drift_2=drift_2, lines=stepped)


def end_lines(
    plant: PlantParameters,
    lines: SupplyLines,
    line_state: LineState,
    begun: FedGas,
    change: GasChange,
    from_2: float,
    step: float,
) -> LineState:
    """Both lines at the end of the step [s]; ``change`` has the mass changes of chambers and totals in the step.

    ``from_2`` is the flow [kg/s] out of line 2 in the second stage.
    """
    still = begun.chambers.still
    second_2 = from_2 - 2.0 * begun.taken_2 - begun.drift_2
    # The change of chamber 2 beyond the first stage is half the rate of the second: the response of the flow to it.
    responded_2 = still.linear.supplied_by_2 * (change.mass_2 - 1.5 * step * still.first.mass_2)
    taken_2 = step * (1.5 * begun.taken_2 + 0.5 * second_2) + responded_2
    inlet_rise = begun.lines.inlet_rise
    return lines_after(plant, lines, line_state, change.supplied - taken_2, taken_2, inlet_rise, step).after


def line_error(plant: PlantParameters, lines: SupplyLines, first: LineState, after: LineState) -> float:
    """Ratio of the estimated error of both line pressures after a step to the allowed error [-], as ``gas_error``.

    ``first`` are the lines after the first stage, which is of first order; the error is half the change by the second.
    """
    first_1, first_2 = line_pressures(lines, plant.gas_product, first)
    after_1, after_2 = line_pressures(lines, plant.gas_product, after)
    return (0.5 / ALLOWED_OF_PRESSURE) * max(
        abs(after_1 - first_1) / pressure_that_matters(plant, after_1),
        abs(after_2 - first_2) / pressure_that_matters(plant, after_2),
    )


class FedThermalGas(NamedTuple):
    """First stage of a step with supply lines and an energy balance; fields as in ``FedGas``."""

    chambers: ThermalGas
    taken_2: float
    drift_2: float
    lines: LineStep


def with_line(slopes: PortSlopes, ratio: float) -> PortSlopes:
    """Derivatives of the flow of a port that include the gas lost by its line; ``ratio`` as in ``with_lines``."""
    added = slopes.from_source * ratio
    return PortSlopes(slopes.total + added, slopes.from_source + added)


def mass_from_source(thermal: ThermalParameters, flow: float, state: PlantState, masses: ThermalState) -> float:
    """True mass flow [kg/s] out of line 2, from the flow at the reference temperature; below 0, warm gas returns."""
    return flow * transport(thermal, flow, 1.0, math.sqrt(state.mass_2 / masses.mass_2)).mass


def begin_fed_thermal_gas(
    plant: PlantParameters,
    thermal: ThermalParameters,
    lines: SupplyLines,
    line_state: LineState,
    state: PlantState,
    masses: ThermalState,
    next_angle: float,
    flowing: SlopedFlows,
    step: float,
    *,
    parts: ActuatorFunctions,
) -> FedThermalGas:
    """First stage of one step [s] as ``begin_fed_gas``, for gas with an energy balance."""
    at_begin = chambers_at_begin(plant, state, next_angle, step, parts=parts)
    start, heat_ratio = at_begin.chambers, thermal.heat_capacity_ratio
    # A compliant chamber takes more gas for a rise of its pressure.
    ratio_1 = start.volume_1 * (1.0 + heat_ratio * start.give_1) / lines.volume_1
    ratio_2 = start.volume_2 * (1.0 + heat_ratio * start.give_2) / lines.volume_2
    # Gas from a line brings more energy than mass, by the ratio of heat capacities.
    flowing = flowing._replace(
        slopes_1=with_line(flowing.slopes_1, 1.0 / heat_ratio * ratio_1),
        slopes_2=with_line(flowing.slopes_2, 1.0 / heat_ratio * ratio_2),
    )
    from_2 = flowing.flows.in_2.from_source
    chambers = begin_thermal_stage(plant, thermal, state, masses, at_begin, next_angle, flowing, step, parts=parts)
    first, supplied_by_2 = chambers.first, chambers.matrix.slopes.supplied_by_2
    drift_2 = -supplied_by_2 * state.mass_2 * start.growth_2 / start.volume_2
    taken_2 = mass_from_source(thermal, from_2, state, masses) + drift_2 + supplied_by_2 * first.content_2
    stepped = lines_after(plant, lines, line_state, step * (first.supplied - taken_2), step * taken_2, 0.0, step)
    return FedThermalGas(chambers=chambers, taken_2=taken_2, drift_2=drift_2, lines=stepped)


def end_thermal_lines(
    plant: PlantParameters,
    thermal: ThermalParameters,
    lines: SupplyLines,
    line_state: LineState,
    begun: FedThermalGas,
    second: ThermalFlows,
    flow_2: float,
    step: float,
) -> LineState:
    """Both lines at the end of the step [s], from the second stage of the gas and ``flow_2`` [kg/s] out of line 2."""
    gas = begun.chambers
    from_2 = mass_from_source(thermal, flow_2, gas.end, gas.end_masses)
    second_2 = from_2 - 2.0 * begun.taken_2 - begun.drift_2 + gas.matrix.slopes.supplied_by_2 * second.content_2
    taken_2 = step * (1.5 * begun.taken_2 + 0.5 * second_2)
    supplied = step * (1.5 * gas.first.supplied + 0.5 * second.supplied)
    return lines_after(plant, lines, line_state, supplied - taken_2, taken_2, begun.lines.inlet_rise, step).after
