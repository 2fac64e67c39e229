"""Supply lines of both chambers in an integration step, for gas of either kind.

The stages of ``pneumatics`` keep their second order with any matrix. The matrix here includes the gas that a line loses
to its chamber, so that a chamber in equilibrium with a small line does not require small steps. The lines are
integrated after each stage, with the gas drawn by the valves.
Gas in a line has the reference temperature: warm gas pushed back from a chamber gives its heat to the walls.
"""

from ppafo.engine.scheme.pneumatics import ALLOWED_OF_PRESSURE, SlopedFlows, pressure_that_matters
from ppafo.model.plant import ActuatorFunctions, PlantParameters, PlantState, PortSlopes
from ppafo.model.regulator import LineState, LineStep, SupplyLines, line_pressures, step_lines


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


def with_line(slopes: PortSlopes, ratio: float) -> PortSlopes:
    """Derivatives of the flow of a port with the gas lost by its line; ``ratio`` is gas taken over gas lost [-]."""
    # A chamber that draws gas lowers its own supply: the flow responds more strongly.
    added = slopes.from_source * ratio
    return PortSlopes(slopes.total + added, slopes.from_source + added)


def with_lines(
    plant: PlantParameters,
    lines: SupplyLines,
    state: PlantState,
    flowing: SlopedFlows,
    heat_ratio: float,
    *,
    parts: ActuatorFunctions,
) -> SlopedFlows:
    """Flows whose derivatives include the gas lost by the lines; ``heat_ratio`` is 1 for isothermal gas [-]."""
    pressure_1, pressure_2 = parts.pressures(plant, state.angle, state.mass_1, state.mass_2)
    here = parts.chambers(plant, state.angle, pressure_1, pressure_2)
    # A compliant chamber takes more gas for a rise of its pressure, and gas from a line brings more energy than mass.
    taken_1 = here.volume_1 / heat_ratio + pressure_1 * here.compliance_1
    taken_2 = here.volume_2 / heat_ratio + pressure_2 * here.compliance_2
    return flowing._replace(
        slopes_1=with_line(flowing.slopes_1, taken_1 / lines.volume_1),
        slopes_2=with_line(flowing.slopes_2, taken_2 / lines.volume_2),
    )


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
