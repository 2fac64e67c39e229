"""What the lanes do for the gas of a step: the valve, the flows of both stages, and the stages themselves."""

from ppafo.engine.lane_control import present_pressures
from ppafo.engine.lane_effects import chambers_of, states_ahead
from ppafo.engine.lane_rows import LaneRows
from ppafo.engine.scheme import joined_chambers, pneumatics, shaped_gas, stage_flows, supply_lines, thermal_gas


def open_valve(rows: LaneRows) -> list[str]:
    """The valve, and the flows with which the step begins."""
    valve, add = rows.program.valve, rows.add
    after = "next_valve" if rows.program.is_parted else "valve_state"
    return [
        f"shown, {after} = {add(valve.advance)}(valve, valve_state, command, time, length)",
        *connect(rows, "line_state"),
        *present_pressures(rows),
        f"flowing = {add(stage_flows.sloped_flows)}"
        f"(plant, pressure_1, pressure_2, port_1, port_2, {add(valve.port_flow_slopes)})",
        *rows.keep("flowing", "shown"),
        *(rows.keep("next_valve") if rows.program.is_parted else rows.store("valve_state")),
    ]


def pass_gas(rows: LaneRows) -> list[str]:
    """The flows of the second stage, at the pressures to which the first one leads."""
    program, add = rows.program, rows.add
    gas = chambers_of(rows)
    still = gas if program.keeps_volumes else f"{gas}.still"
    ends = f"{add(thermal_gas.end_pressures)}(plant, {gas})" if program.is_thermal else f"{still}.end_1, {still}.end_2"
    connected = connect(rows, "gas.lines.after")
    return [
        rows.load("gas"),
        rows.load("shown"),
        *states_ahead(rows, connected),
        *connected,
        f"pressure_1, pressure_2 = {ends}",
        f"passing = {add(stage_flows.stage_flows)}"
        f"(plant, pressure_1, pressure_2, port_1, port_2, {add(program.valve.port_flow)})",
        *rows.keep("passing"),
    ]


def connect(rows: LaneRows, line_state: str) -> list[str]:
    """The ports of both chambers; where there are lines, at the pressures that they have in ``line_state``.

    A valve that joins the chambers makes the leak between them as wide as it stands open.
    """
    source, valve = "plant", rows.program.valve
    if rows.program.has_lines:
        source = f"{rows.add(supply_lines.plant_at_line_pressures)}(plant, lines, {line_state})"
    lines = [f"port_1, port_2 = {rows.add(valve.connect)}({source}, shown)"]
    if valve.joint is not None:
        opening = f"{rows.add(valve.joint.opening)}(shown)"
        lines.append(f"plant = {rows.add(joined_chambers.plant_with_joined_chambers)}(plant, {opening})")
    return lines


def begin_gas(rows: LaneRows) -> str:
    """The first stage of the gas."""
    program, add = rows.program, rows.add
    given = "flowing, length"
    if program.has_lines:
        begun = f"state, masses, next_angle, {given}" if program.is_thermal else f"state, next_angle, {given}"
        if program.is_thermal:
            return f"gas = {add(supply_lines.begin_fed_thermal_gas)}(plant, thermal, lines, line_state, {begun})"
        return f"gas = {add(supply_lines.begin_fed_gas)}(plant, lines, line_state, {begun})"
    if program.is_thermal:
        return f"gas = {add(thermal_gas.begin_thermal_gas)}(plant, thermal, state, masses, next_angle, {given})"
    if program.keeps_volumes:
        return f"gas = {add(pneumatics.begin_still_gas)}(state, held, {given})"
    if program.has_shape:
        return f"gas = {add(shaped_gas.begin_shaped_gas)}(plant, state, next_angle, {given})"
    held = "held" if program.hands_chambers_on else f"{add(pneumatics.held_chambers)}(plant, state.angle)"
    return f"gas = {add(pneumatics.begin_moving_gas)}(plant, state, {held}, next_angle, {given})"


def feed(rows: LaneRows) -> list[str]:
    """The second stage: the gas of the step, and in parts that may be refused the error of the gas."""
    program, add = rows.program, rows.add
    gas, is_still = chambers_of(rows), program.keeps_volumes
    if program.is_thermal:
        second = f"{add(thermal_gas.second_thermal_stage)}(thermal, {gas}, passing)"
        change = f"{add(thermal_gas.thermal_change)}(plant, thermal, {gas}, second, length)"
        error = f"{add(thermal_gas.thermal_error)}(plant, {gas}, second, length)"
        shifted = f"{add(thermal_gas.thermal_opening_error)}(plant, {gas}, shift, length)"
    else:
        still = gas if is_still else f"{gas}.still"
        next_angle = "state.angle" if program.is_held else "begun.next_angle"
        stage = pneumatics.second_still_stage if is_still else pneumatics.second_moving_stage
        second = f"{add(stage)}({gas}, passing)"
        whole = pneumatics.still_change if is_still else pneumatics.moving_change
        change = f"{add(whole)}(plant, {still}, second, length)"
        error = f"{add(pneumatics.gas_error)}(plant, {still}, second, {next_angle}, length)"
        shifted = f"{add(pneumatics.opening_error)}(plant, {still}, shift, {next_angle}, length)"
    lines = [rows.load(name) for name in ("begun", "gas", "shown", "passing")]
    lines += [f"second = {second}", f"change = {change}", *feed_lines(rows)]
    if not program.is_adaptive:
        return lines
    if program.has_lines:
        error = f"max({error}, {add(supply_lines.line_error)}(plant, lines, gas.lines.after, next_lines))"
    moves = program.valve.shift
    if moves is not None:
        lines += [rows.load("next_valve"), f"shift = {add(moves)}(valve_state, next_valve)"]
    return [*lines, f"gas_error = {error}" + (f" + {shifted}" if moves else "")]


def feed_lines(rows: LaneRows) -> list[str]:
    """Lines that bring regulators and lines to the end of the step, kept apart where it may be refused."""
    program, add = rows.program, rows.add
    if not program.has_lines:
        return []
    end = supply_lines.end_thermal_lines if program.is_thermal else supply_lines.end_lines
    before, moved = ("plant, thermal", "second") if program.is_thermal else ("plant", "change")
    given = f"{before}, lines, line_state, gas, {moved}, passing.in_2.from_source, length"
    if program.is_parted:
        return [f"next_lines = {add(end)}({given})", *rows.keep("next_lines")]
    return [f"line_state = {add(end)}({given})", *rows.store("line_state")]
