"""The module of the plant in continuous time that CVODE and others integrate."""

import re
from collections.abc import Callable

from ppafo.engine.continuous_time import chambers_in_motion, flows_at, free_motion
from ppafo.engine.entries import ARRAY, FLOAT, HEADER, INLINE, entry_text
from ppafo.engine.generator import StepText
from ppafo.engine.linking import link_program
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, row_expression
from ppafo.engine.scheme.pneumatics import flow_rates
from ppafo.engine.scheme.thermal_gas import WarmGas, thermal_flows
from ppafo.engine.source_text import SourceCollector, composed_lines
from ppafo.model.binding import made_of
from ppafo.model.declaration import EmptyRow
from ppafo.model.effects.kind import PlantSnapshot
from ppafo.model.leg import FootLoad
from ppafo.model.plant import ThermalParameters

PLANT_UNKNOWNS = 7


def gas_unknowns(program: Program) -> int:
    """Unknowns of plant and gas: the plant's, and the true masses of gas with an energy balance."""
    return PLANT_UNKNOWNS + (2 if program.is_thermal else 0)


def unknowns_before_valve(program: Program) -> int:
    """Unknowns before those of the valve: those of plant and gas, and states of effects."""
    return gas_unknowns(program) + sum(len(leaf_paths(row, name)) for name, row in program.effect_states.items())


# Parameters of the right-hand side.
ARRAYS = ("y", "slopes", "parameters")
NUMBERS = ("t", "command", "way")


def parameter_groups(program: Program) -> dict[str, type]:
    """Groups of numbers that the right-hand side needs, in order."""
    return {
        "plant": program.actuator.plant,
        **({"thermal": ThermalParameters} if program.is_thermal else {}),
        "valve": program.valve.parameters,
        "path": EmptyRow if program.angle is None else program.angle.parameters,
        **({} if program.shank is None else {"load": FootLoad, "shank": program.shank.parameters}),
        **{effect.name: effect.parameters for effect in program.effects},
    }


def right_hand_side_source(program: Program) -> str:
    """Source of the module whose ``fill(y, slopes, parameters, t, command, way)`` writes the slopes of all unknowns.

    The unknowns are angle, angular velocity, both masses, the three gas totals, the true masses of gas with an energy
    balance, the states of effects, and the state of the valve.
    """
    collector = SourceCollector(INLINE)
    link_program(program, collector.replacements)
    add = collector.add
    cells: dict[str, str] = {}
    for name, row in parameter_groups(program).items():
        for path in leaf_paths(row, name):
            cells[path] = f"parameters[{len(cells)}]"
    lines = [f"{name} = {row_expression(row, name, cells, add)}" for name, row in parameter_groups(program).items()]
    if program.angle is None:
        lines += ["angle = y[0]", "rate = y[1] if way != 0.0 else 0.0"]
    else:
        lines += [f"angle, rate, _ = {add(program.angle.value)}(path, t)"]
    lines += [*state_lines(program, add), *slope_lines(program, collector)]
    fill = entry_text(
        "fill", dict.fromkeys(ARRAYS, ARRAY) | dict.fromkeys(NUMBERS, FLOAT), composed_lines(lines, collector.needs)
    )
    return "\n\n\n".join([HEADER, collector.text(), fill])


def state_cells(program: Program) -> dict[str, str]:
    """Where among the unknowns ``y`` the states of effects and of the valve are, by path."""
    rows = program.effect_states | {"valve_state": program.valve.state}
    paths = [path for name, row in rows.items() for path in leaf_paths(row, name)]
    return {path: f"y[{place}]" for place, path in enumerate(paths, gas_unknowns(program))}


def state_lines(program: Program, add: Callable[..., str]) -> list[str]:
    """Lines that make the states of effects and of the valve from the unknowns ``y``."""
    cells = state_cells(program)
    rows = {"valve_state": program.valve.state} | program.effect_states
    return [f"{name} = {row_expression(row, name, cells, add)}" for name, row in rows.items()]


def torque_of_leg(program: Program, collector: SourceCollector) -> str:
    """Expression for the torque of a leg on the vane [N m]; the rows that it asks for are handed over later."""
    if program.foot is None:
        return "0.0"
    composed = StepText(program, collector).phase(program.foot.torque)
    own = {"time": "t", "angle": "y[0]"}
    return f"{composed.name}({', '.join(own[name] for name in composed.effects.takes)})"


def slope_lines(program: Program, collector: SourceCollector) -> list[str]:
    """Lines from parameters, ``angle``, ``rate`` and states at a time ``t`` to the ``slopes`` of the unknowns ``y``."""
    add = collector.add
    lines = [
        f"openings = {add(program.valve.instant)}(valve, valve_state, command)",
        f"pressure_1, pressure_2 = {add(program.actuator.pressures)}(plant, angle, y[2], y[3])",
        *gas_lines(program, add),
        "supplied = gas.supplied_1 + gas.supplied_2",
        "vented = supplied - gas.mass_1 - gas.mass_2",
        "slopes[4] = supplied",
        "slopes[5] = vented",
        "slopes[6] = abs(gas.leaked)",
    ]
    if program.angle is None:
        motion = add(made_of(free_motion, "free_motion", program.functions))
        moved = f"{motion}(plant, y[0], y[1], pressure_1, pressure_2, added, way)"
        lines += [f"added = {torque_of_leg(program, collector)}", f"slopes[0], slopes[1] = {moved}"]
    else:
        lines += ["slopes[0] = 0.0", "slopes[1] = 0.0"]
    lines += [f"valve_state_moves = {add(program.valve.rates)}(valve, valve_state, command)"]
    if program.stated:
        seen = "angle, rate, pressure_1, pressure_2, supplied, vented, command"
        lines.append(f"now = {add(PlantSnapshot)}({seen})")
    for name, kind in program.stated.items():
        lines.append(f"{name}_state_moves = {add(kind.slopes)}({name}, {name}_state, now)")
    lines += [f"{cell.replace('y', 'slopes', 1)} = {_moves(path)}" for path, cell in state_cells(program).items()]
    return lines


def _moves(path: str) -> str:
    """The rate of a state by its path."""
    return re.sub(r"^\w+", lambda name: f"{name[0]}_moves", path)


def gas_lines(program: Program, add: Callable[..., str]) -> list[str]:
    """Lines that find the rates ``gas`` and write the slopes of what is in the chambers."""
    flowing = f"flowing = {add(flows_at)}(plant, openings, pressure_1, pressure_2)"
    if not program.is_thermal:
        rates = f"gas = {add(flow_rates)}(flowing)"
        return [flowing, rates, "slopes[2] = gas.mass_1", "slopes[3] = gas.mass_2"]
    moved = add(made_of(chambers_in_motion, "chambers_in_motion", program.functions))
    return [
        flowing,
        f"chambers = {moved}(plant, (angle, rate), (pressure_1, pressure_2))",
        f"warm = {add(thermal_flows)}(thermal, {add(WarmGas)}(y[2], y[3], y[7], y[8]), chambers, flowing)",
        "gas = warm.gas",
        "slopes[2] = warm.mass_1",
        "slopes[3] = warm.mass_2",
        "slopes[7] = gas.mass_1",
        "slopes[8] = gas.mass_2",
    ]
