"""Writes the source of the right-hand side that the reference solver and the benchmark's solvers integrate."""

from collections.abc import Callable

from ppafo.engine.entries import ARRAY, FLOAT, HEADER, INLINE, entry_text
from ppafo.engine.links import link_program
from ppafo.engine.program import NoParameters, Program
from ppafo.engine.reference.derivative import (
    ExactOrifice,
    free_motion,
    gas_rates,
    joined_gas_rates,
    joined_thermal_rates,
    thermal_gas_rates,
)
from ppafo.engine.rows import leaf_paths, row_expression
from ppafo.engine.source_text import SourceCollector, woven
from ppafo.model.effects.kind import Moment
from ppafo.model.plant import ThermalParameters, chamber_pressures

PLANT_UNKNOWNS = 7


def gas_unknowns(program: Program) -> int:
    """Unknowns of plant and gas: the plant's, and the true masses of gas with an energy balance."""
    return PLANT_UNKNOWNS + (2 if program.is_thermal else 0)


def unknowns_before_valve(program: Program) -> int:
    """Unknowns before those of the valve: those of plant and gas, and states of effects."""
    return gas_unknowns(program) + sum(len(leaf_paths(row, name)) for name, row in program.effect_states.items())


ARRAYS, NUMBERS = ("y", "slopes", "parameters"), ("t", "command", "way")
"""Parameters of the right-hand side."""


def parameter_groups(program: Program) -> dict[str, type]:
    """Groups of numbers that the right-hand side needs, in order."""
    return {
        "plant": program.actuator.plant,
        "thermal": ThermalParameters if program.is_thermal else NoParameters,
        "valve_orifice": ExactOrifice,
        "leak_orifice": ExactOrifice,
        "valve": program.valve.parameters,
        "path": NoParameters if program.angle is None else program.angle.parameters,
        **{effect.name: effect.parameters for effect in program.effects},
    }


def right_hand_side_source(program: Program) -> str:
    """Source of the module whose ``fill(y, slopes, parameters, t, command, way)`` writes the slopes of all unknowns.

    The unknowns are angle, angular velocity, both masses, the three gas totals, the true masses of gas with an energy
    balance, the states of effects, and the state of the valve.
    """
    collector = SourceCollector(INLINE)
    link_program(program, collector)
    add = collector.add
    cells: dict[str, str] = {}
    for name, row in parameter_groups(program).items():
        for path in leaf_paths(row, name):
            cells[path] = f"parameters[{len(cells)}]"
    valve_paths = leaf_paths(program.valve.state, "valve_state")
    cells |= {path: f"y[{unknowns_before_valve(program) + number}]" for number, path in enumerate(valve_paths)}
    states = program.effect_states
    state_paths = [path for name, row in states.items() for path in leaf_paths(row, name)]
    cells |= {path: f"y[{gas_unknowns(program) + number}]" for number, path in enumerate(state_paths)}
    groups = parameter_groups(program) | {"valve_state": program.valve.state} | states
    lines = [f"{name} = {row_expression(row, name, cells, add)}" for name, row in groups.items()]
    lines += [f"openings = {add(program.valve.instant)}(valve, valve_state, command)"]
    if program.angle is None:
        lines += ["angle = y[0]", "rate = y[1] if way != 0.0 else 0.0"]
    else:
        lines += [f"angle, rate, _ = {add(program.angle.value)}(path, t)"]
    lines += [
        f"pressure_1, pressure_2 = {add(chamber_pressures)}(plant, angle, y[2], y[3])",
        *gas_lines(program, add),
        "slopes[4] = gas.supplied",
        "slopes[5] = gas.vented",
        "slopes[6] = gas.leaked",
    ]
    if program.angle is None:
        lines += [f"slopes[0], slopes[1] = {add(free_motion)}(plant, y[0], y[1], pressure_1, pressure_2, way)"]
    else:
        lines += ["slopes[0] = 0.0", "slopes[1] = 0.0"]
    lines += [f"moves = {add(program.valve.rates)}(valve, valve_state, command)"]
    lines += [
        f"slopes[{unknowns_before_valve(program) + number}] = {path.replace('valve_state', 'moves', 1)}"
        for number, path in enumerate(valve_paths)
    ]
    if program.stated:
        seen = "angle, rate, pressure_1, pressure_2, gas.supplied, gas.vented, command"
        lines.append(f"now = {add(Moment)}({seen})")
    for name, kind in program.stated.items():
        lines.append(f"{name}_state_moves = {add(kind.slopes)}({name}, {name}_state, now)")
    lines += [
        f"slopes[{place}] = {path.replace('.', '_moves.', 1)}"
        for place, path in enumerate(state_paths, gas_unknowns(program))
    ]
    fill = entry_text(
        "fill", dict.fromkeys(ARRAYS, ARRAY) | dict.fromkeys(NUMBERS, FLOAT), woven(lines, collector.needs)
    )
    return "\n\n\n".join([HEADER, collector.text(), fill])


def gas_lines(program: Program, add: Callable[..., str]) -> list[str]:
    """Lines that find the rates ``gas`` and write the slopes of what is in the chambers."""
    orifices, joint = "valve_orifice, leak_orifice, openings", program.valve.joint
    joined = [] if joint is None else [f"joined = {add(joint.instant)}(valve, valve_state, command)"]
    if not program.is_thermal:
        if joint is not None:
            joined.append(f"gas = {add(joined_gas_rates)}(gas, valve_orifice, joined, pressure_1, pressure_2)")
        return [
            f"gas = {add(gas_rates)}(plant, {orifices}, pressure_1, pressure_2)",
            *joined,
            "slopes[2] = gas.mass_1",
            "slopes[3] = gas.mass_2",
        ]
    given = "(y[2], y[3]), (y[7], y[8]), angle, rate"
    if joint is not None:
        across = "valve_orifice, joined, pressure_1, pressure_2, y[2] / y[7], y[3] / y[8]"
        joined.append(f"gas = {add(joined_thermal_rates)}(gas, thermal, {across})")
    return [
        f"gas = {add(thermal_gas_rates)}(plant, thermal, {orifices}, {given})",
        *joined,
        "slopes[2] = gas.content_1",
        "slopes[3] = gas.content_2",
        "slopes[7] = gas.mass_1",
        "slopes[8] = gas.mass_2",
    ]
