"""Supply lines behind regulators in an integration step, solved together with the gas of the chambers.

The stages of the gas keep their second order with any matrix. The matrix here includes the gas that a line loses to its
chamber, so that a chamber in equilibrium with a small line does not require small steps. The lines are integrated after
each stage, with the gas drawn by the valves. Gas in a line has the reference temperature: warm gas pushed back from a
chamber gives its heat to the walls.
"""

from ppafo.engine.groups import Groups, given, handed, kept
from ppafo.engine.program import Program
from ppafo.engine.scheme.pneumatics import ALLOWED_OF_PRESSURE, pressure_that_matters
from ppafo.engine.step import gas
from ppafo.engine.step.lane import Lane
from ppafo.model.plant import PlantParameters, PortSlopes
from ppafo.model.regulator import LineState, LineStep, SupplyLines, line_pressures, step_lines


def groups(parts: Program) -> Groups:
    """Groups for supply lines: lines with regulators, and lines after the first stage and at the end of a part."""
    return {
        "lines": given(SupplyLines),
        "line_state": kept(LineState),
        "line_stage": handed(LineStep),
        **({"next_lines": handed(LineState)} if parts.is_parted else {}),
    }


def fed_at(plant: PlantParameters, pressures: tuple[float, float]) -> PlantParameters:
    """Plant whose supply pressures are those of its lines [Pa absolute]."""
    return plant._replace(supply_pressure=pressures[0], dorsiflexion_pressure=pressures[1])


def source(parts: Program, lane: Lane) -> PlantParameters:
    """Return the plant with the present line pressures as supply pressures."""
    return fed_at(lane.plant, line_pressures(lane.lines, lane.plant.gas_product, lane.line_state))


def source_ahead(parts: Program, lane: Lane) -> PlantParameters:
    """Return the plant with the line pressures after the first stage as supply pressures."""
    return fed_at(lane.plant, line_pressures(lane.lines, lane.plant.gas_product, lane.line_stage.after))


def with_line(slopes: PortSlopes, ratio: float) -> PortSlopes:
    """Derivatives of the flow of a port with the gas lost by its line; ``ratio`` is gas taken over gas lost [-]."""
    # A chamber that draws gas lowers its own supply: the flow responds more strongly.
    added = slopes.from_source * ratio
    return PortSlopes(slopes.total + added, slopes.from_source + added)


def after(parts: Program, lane: Lane, taken_1: float, taken_2: float, inlet_rise: float, length: float) -> LineStep:
    """Return both lines after ``length`` [s], as ``step_lines``; the supply pressures of the plant are those set."""
    set_1 = lane.plant.supply_pressure
    set_2 = lane.plant.dorsiflexion_pressure
    product = lane.plant.gas_product
    return step_lines(lane.lines, set_1, set_2, product, lane.line_state, taken_1, taken_2, inlet_rise, length)


def begin(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage of the step, with chambers and lines solved together."""
    state = lane.state
    ratio = lane.thermal.heat_capacity_ratio if parts.is_thermal else 1.0
    pressure_1, pressure_2 = parts.actuator.pressures(lane.plant, state.angle, state.mass_1, state.mass_2)
    here = parts.actuator.chambers(lane.plant, state.angle, pressure_1, pressure_2)
    # A compliant chamber takes more gas for a rise of its pressure, and gas from a line brings more energy than mass.
    taken_1 = here.volume_1 / ratio + pressure_1 * here.compliance_1
    taken_2 = here.volume_2 / ratio + pressure_2 * here.compliance_2
    lane.flowing = lane.flowing._replace(
        slopes_1=with_line(lane.flowing.slopes_1, taken_1 / lane.lines.volume_1),
        slopes_2=with_line(lane.flowing.slopes_2, taken_2 / lane.lines.volume_2),
    )
    gas.begin(parts, lane, next_angle, length)
    first = gas.first(parts, lane)
    lane.line_stage = after(parts, lane, length * first.supplied_1, length * first.supplied_2, 0.0, length)


def end(parts: Program, lane: Lane, length: float) -> None:
    """Set the lines at the end of the step; a part that may be refused changes the state only when accepted."""
    change = gas.changes(parts, lane)
    ended = after(parts, lane, change.supplied_1, change.supplied_2, lane.line_stage.inlet_rise, length)
    if parts.is_parted:
        lane.next_lines = ended.after
    else:
        lane.line_state = ended.after


def error(parts: Program, lane: Lane) -> float:
    """Return the error of both line pressures divided by the allowed error [-].

    The first stage is of first order; the error is half the change by the second.
    """
    first_1, first_2 = line_pressures(lane.lines, lane.plant.gas_product, lane.line_stage.after)
    after_1, after_2 = line_pressures(lane.lines, lane.plant.gas_product, lane.next_lines)
    return (0.5 / ALLOWED_OF_PRESSURE) * max(
        abs(after_1 - first_1) / pressure_that_matters(lane.plant, after_1),
        abs(after_2 - first_2) / pressure_that_matters(lane.plant, after_2),
    )
