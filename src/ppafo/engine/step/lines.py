"""Supply lines behind regulators in an integration step, solved together with the gas of the chambers."""

from ppafo.engine.groups import Groups, given, handed, kept
from ppafo.engine.program import Program
from ppafo.engine.scheme import supply_lines
from ppafo.engine.scheme.supply_lines import FedGas, FedThermalGas
from ppafo.engine.step.lane import Lane
from ppafo.model.plant import PlantParameters
from ppafo.model.regulator import LineState, SupplyLines


def groups(parts: Program) -> Groups:
    """Groups for supply lines: lines with regulators, first stage with the gas, and lines at the end of a part."""
    return {
        "lines": given(SupplyLines),
        "line_state": kept(LineState),
        **({"fed_thermal_gas": handed(FedThermalGas)} if parts.is_thermal else {"fed_gas": handed(FedGas)}),
        **({"next_lines": handed(LineState)} if parts.is_parted else {}),
    }


def after_first(parts: Program, lane: Lane) -> LineState:
    """Return the state of both lines after the first stage."""
    return lane.fed_thermal_gas.lines.after if parts.is_thermal else lane.fed_gas.lines.after


def source(parts: Program, lane: Lane) -> PlantParameters:
    """Return the plant with the present line pressures as supply pressures."""
    return supply_lines.plant_at_line_pressures(lane.plant, lane.lines, lane.line_state)


def source_ahead(parts: Program, lane: Lane) -> PlantParameters:
    """Return the plant with the line pressures after the first stage as supply pressures."""
    return supply_lines.plant_at_line_pressures(lane.plant, lane.lines, after_first(parts, lane))


def begin(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage of the step, with chambers and lines solved together."""
    if parts.is_thermal:
        lane.fed_thermal_gas = supply_lines.begin_fed_thermal_gas(
            lane.plant,
            lane.thermal,
            lane.lines,
            lane.line_state,
            lane.state,
            lane.masses,
            next_angle,
            lane.flowing,
            length,
            parts=parts.functions,
        )
    else:
        lane.fed_gas = supply_lines.begin_fed_gas(
            lane.plant, lane.lines, lane.line_state, lane.state, next_angle, lane.flowing, length, parts=parts.functions
        )


def ended(parts: Program, lane: Lane, length: float) -> LineState:
    """Return the state of both lines at the end of the step."""
    from_2 = lane.passing.in_2.from_source
    if parts.is_thermal:
        return supply_lines.end_thermal_lines(
            lane.plant,
            lane.thermal,
            lane.lines,
            lane.line_state,
            lane.fed_thermal_gas,
            lane.thermal_second,
            from_2,
            length,
        )
    return supply_lines.end_lines(lane.plant, lane.lines, lane.line_state, lane.fed_gas, lane.change, from_2, length)


def end(parts: Program, lane: Lane, length: float) -> None:
    """Set the lines at the end of the step; a part that may be refused changes the state only when accepted."""
    if parts.is_parted:
        lane.next_lines = ended(parts, lane, length)
    else:
        lane.line_state = ended(parts, lane, length)


def error(parts: Program, lane: Lane) -> float:
    """Return the error of both line pressures divided by the allowed error [-]."""
    return supply_lines.line_error(lane.plant, lane.lines, after_first(parts, lane), lane.next_lines)
