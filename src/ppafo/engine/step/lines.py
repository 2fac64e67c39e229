"""Supply lines behind regulators in an integration step, solved together with the gas of the chambers."""

from ppafo.engine.groups import Groups, given, handed, kept
from ppafo.engine.program import Program
from ppafo.engine.scheme import supply_lines
from ppafo.engine.step import gas
from ppafo.engine.step.lane import Lane
from ppafo.model.plant import PlantParameters
from ppafo.model.regulator import LineState, LineStep, SupplyLines


def groups(parts: Program) -> Groups:
    """Groups for supply lines: lines with regulators, and lines after the first stage and at the end of a part."""
    return {
        "lines": given(SupplyLines),
        "line_state": kept(LineState),
        "line_stage": handed(LineStep),
        **({"next_lines": handed(LineState)} if parts.is_parted else {}),
    }


def source(parts: Program, lane: Lane) -> PlantParameters:
    """Return the plant with the present line pressures as supply pressures."""
    return supply_lines.plant_at_line_pressures(lane.plant, lane.lines, lane.line_state)


def source_ahead(parts: Program, lane: Lane) -> PlantParameters:
    """Return the plant with the line pressures after the first stage as supply pressures."""
    return supply_lines.plant_at_line_pressures(lane.plant, lane.lines, lane.line_stage.after)


def begin(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage of the step, with chambers and lines solved together."""
    ratio = lane.thermal.heat_capacity_ratio if parts.is_thermal else 1.0
    lane.flowing = supply_lines.with_lines(
        lane.plant, lane.lines, lane.state, lane.flowing, ratio, parts=parts.functions
    )
    gas.begin(parts, lane, next_angle, length)
    first = gas.first(parts, lane)
    lane.line_stage = supply_lines.lines_after(
        lane.plant, lane.lines, lane.line_state, length * first.supplied_1, length * first.supplied_2, 0.0, length
    )


def end(parts: Program, lane: Lane, length: float) -> None:
    """Set the lines at the end of the step; a part that may be refused changes the state only when accepted."""
    change = gas.changes(parts, lane)
    rise = lane.line_stage.inlet_rise
    ended = supply_lines.lines_after(
        lane.plant, lane.lines, lane.line_state, change.supplied_1, change.supplied_2, rise, length
    )
    if parts.is_parted:
        lane.next_lines = ended.after
    else:
        lane.line_state = ended.after


def error(parts: Program, lane: Lane) -> float:
    """Return the error of both line pressures divided by the allowed error [-]."""
    return supply_lines.line_error(lane.plant, lane.lines, lane.line_stage.after, lane.next_lines)
