"""The plant in continuous time with the exact flow functions, and the module of it that CVODE and others integrate."""

import math
import re
from collections.abc import Callable
from typing import NamedTuple

from ppafo.engine.continuous_time import free_motion
from ppafo.engine.entries import ARRAY, FLOAT, HEADER, INLINE, entry_text
from ppafo.engine.generator import StepText
from ppafo.engine.groups import Role, rows_of
from ppafo.engine.linking import link_program
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, row_expression
from ppafo.engine.source_text import SourceCollector, composed_lines
from ppafo.engine.step.lane import NoParameters
from ppafo.model.binding import made_of
from ppafo.model.effects.kind import PlantSnapshot
from ppafo.model.leg import FootLoad
from ppafo.model.orifice import ExactOrifice, exact_flow
from ppafo.model.plant import (
    ActuatorFunctions,
    Openings,
    PlantParameters,
    ThermalParameters,
    admitted_flow,
)
from ppafo.model.ports import exhaust_path, leakage_path, supply_path


class GasRates(NamedTuple):
    """Mass flows [kg/s]: into each chamber, from the source, to the atmosphere, across the vane (size)."""

    mass_1: float
    mass_2: float
    supplied: float
    vented: float
    leaked: float


class Transport(NamedTuple):
    """Mass and energy that pass [kg/s], the energy as a content of ``PlantState``."""

    mass: float
    content: float


class ThermalGasRates(NamedTuple):
    """As ``GasRates``, with the contents of ``PlantState`` [kg/s] before the true masses."""

    content_1: float
    content_2: float
    mass_1: float
    mass_2: float
    supplied: float
    vented: float
    leaked: float


def gas_rates(
    plant: PlantParameters,
    valve_orifice: ExactOrifice,
    leak_orifice: ExactOrifice,
    openings: Openings,
    pressure_1: float,
    pressure_2: float,
) -> GasRates:
    """All mass flows [kg/s] at two chamber pressures [Pa absolute]. Equations (8), (9)."""
    full = valve_orifice.conductance
    source_1 = exact_flow(plant.supply_pressure, pressure_1, supply_path(openings.source_1 * full), valve_orifice)
    source_2 = exact_flow(plant.dorsiflexion_pressure, pressure_2, supply_path(openings.source_2 * full), valve_orifice)
    source_1 = admitted_flow(source_1, plant.relieving)
    source_2 = admitted_flow(source_2, plant.relieving)
    vent_1 = exact_flow(pressure_1, plant.atmospheric_pressure, exhaust_path(openings.vent_1 * full), valve_orifice)
    vent_2 = exact_flow(pressure_2, plant.atmospheric_pressure, exhaust_path(openings.vent_2 * full), valve_orifice)
    leak_conductance = leakage_path(leak_orifice.conductance, pressure_1, pressure_2, plant.leak_curve)
    leak = exact_flow(pressure_1, pressure_2, leak_conductance, leak_orifice)
    return GasRates(
        mass_1=source_1 - vent_1 - leak,
        mass_2=source_2 - vent_2 + leak,
        supplied=source_1 + source_2,
        vented=vent_1 + vent_2,
        leaked=abs(leak),
    )


def transport(
    thermal: ThermalParameters, pressure_a: float, pressure_b: float, warmth_a: float, warmth_b: float, flow: float
) -> Transport:
    """What a flow [kg/s] that holds at the reference temperature carries, with the temperature of its upstream side.

    Warmths are T/T_0 [-] on both sides; flow from a to b. Equation (6).
    """
    warmth = warmth_a if pressure_a >= pressure_b else warmth_b
    mass = flow / math.sqrt(warmth)
    return Transport(mass, thermal.heat_capacity_ratio * warmth * mass)


NEAR = 1.0e-4
"""Angle [rad] on either side at which a volume is looked at for its slope."""


def thermal_gas_rates(
    plant: PlantParameters,
    thermal: ThermalParameters,
    valve_orifice: ExactOrifice,
    leak_orifice: ExactOrifice,
    openings: Openings,
    contents: tuple[float, float],
    masses: tuple[float, float],
    angle: float,
    angular_velocity: float,
    *,
    parts: ActuatorFunctions,
) -> ThermalGasRates:
    """All rates of gas with an energy balance [kg/s]; contents as in ``PlantState``. Equations (3), (6) to (9)."""
    source_pressure_1, source_pressure_2 = plant.supply_pressure, plant.dorsiflexion_pressure
    room, full = plant.atmospheric_pressure, valve_orifice.conductance
    pressure_1, pressure_2 = parts.pressures(plant, angle, contents[0], contents[1])
    here = parts.chambers(plant, angle, pressure_1, pressure_2)
    less = parts.chambers(plant, angle - NEAR, pressure_1, pressure_2)
    more = parts.chambers(plant, angle + NEAR, pressure_1, pressure_2)
    warmth_1, warmth_2 = contents[0] / masses[0], contents[1] / masses[1]
    supply_1 = exact_flow(source_pressure_1, pressure_1, supply_path(openings.source_1 * full), valve_orifice)
    supply_2 = exact_flow(source_pressure_2, pressure_2, supply_path(openings.source_2 * full), valve_orifice)
    supply_1, supply_2 = admitted_flow(supply_1, plant.relieving), admitted_flow(supply_2, plant.relieving)
    outlet_1 = exact_flow(pressure_1, room, exhaust_path(openings.vent_1 * full), valve_orifice)
    outlet_2 = exact_flow(pressure_2, room, exhaust_path(openings.vent_2 * full), valve_orifice)
    leak_conductance = leakage_path(leak_orifice.conductance, pressure_1, pressure_2, plant.leak_curve)
    across = exact_flow(pressure_1, pressure_2, leak_conductance, leak_orifice)
    source_1 = transport(thermal, source_pressure_1, pressure_1, 1.0, warmth_1, supply_1)
    source_2 = transport(thermal, source_pressure_2, pressure_2, 1.0, warmth_2, supply_2)
    vent_1 = transport(thermal, pressure_1, room, warmth_1, 1.0, outlet_1)
    vent_2 = transport(thermal, pressure_2, room, warmth_2, 1.0, outlet_2)
    leak = transport(thermal, pressure_1, pressure_2, warmth_1, warmth_2, across)
    ratio, per_content = thermal.heat_capacity_ratio, plant.gas_product
    growth_1 = (more.volume_1 - less.volume_1) / (2.0 * NEAR) * angular_velocity
    growth_2 = (more.volume_2 - less.volume_2) / (2.0 * NEAR) * angular_velocity
    enters_1 = source_1.content - vent_1.content - leak.content
    enters_1 = enters_1 + thermal.wall_exchange * here.volume_1 * (1.0 - warmth_1)
    enters_2 = source_2.content - vent_2.content + leak.content
    enters_2 = enters_2 + thermal.wall_exchange * here.volume_2 * (1.0 - warmth_2)
    # The pressure first, of a chamber that the angle widens and that gives: then the work on both.
    stiff_1 = here.volume_1 + ratio * pressure_1 * here.compliance_1
    stiff_2 = here.volume_2 + ratio * pressure_2 * here.compliance_2
    rise_1 = (per_content * enters_1 - ratio * pressure_1 * growth_1) / stiff_1
    rise_2 = (per_content * enters_2 - ratio * pressure_2 * growth_2) / stiff_2
    work_1 = (ratio - 1.0) * pressure_1 / per_content * (growth_1 + here.compliance_1 * rise_1)
    work_2 = (ratio - 1.0) * pressure_2 / per_content * (growth_2 + here.compliance_2 * rise_2)
    return ThermalGasRates(
        content_1=enters_1 - work_1,
        content_2=enters_2 - work_2,
        mass_1=source_1.mass - vent_1.mass - leak.mass,
        mass_2=source_2.mass - vent_2.mass + leak.mass,
        supplied=source_1.mass + source_2.mass,
        vented=vent_1.mass + vent_2.mass,
        leaked=abs(leak.mass),
    )


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
        **rows_of(program.gas.groups(program), Role.PARAMETER),
        "valve_orifice": ExactOrifice,
        "leak_orifice": ExactOrifice,
        "valve": program.valve.parameters,
        "path": NoParameters if program.angle is None else program.angle.parameters,
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
        "slopes[4] = gas.supplied",
        "slopes[5] = gas.vented",
        "slopes[6] = gas.leaked",
    ]
    if program.angle is None:
        motion = add(made_of(free_motion, "free_motion", program.functions))
        moved = f"{motion}(plant, y[0], y[1], pressure_1, pressure_2, added, way)"
        lines += [f"added = {torque_of_leg(program, collector)}", f"slopes[0], slopes[1] = {moved}"]
    else:
        lines += ["slopes[0] = 0.0", "slopes[1] = 0.0"]
    lines += [f"valve_state_moves = {add(program.valve.rates)}(valve, valve_state, command)"]
    if program.stated:
        seen = "angle, rate, pressure_1, pressure_2, gas.supplied, gas.vented, command"
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
    orifices = "valve_orifice, leak_orifice, openings"
    if not program.is_thermal:
        rates = f"gas = {add(gas_rates)}(plant, {orifices}, pressure_1, pressure_2)"
        return [rates, "slopes[2] = gas.mass_1", "slopes[3] = gas.mass_2"]
    given = "(y[2], y[3]), (y[7], y[8]), angle, rate"
    rates_of = add(made_of(thermal_gas_rates, "thermal_gas_rates", program.functions))
    return [
        f"gas = {rates_of}(plant, thermal, {orifices}, {given})",
        "slopes[2] = gas.content_1",
        "slopes[3] = gas.content_2",
        "slopes[7] = gas.mass_1",
        "slopes[8] = gas.mass_2",
    ]
