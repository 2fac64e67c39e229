"""Chambers filled from lines behind regulators, against an ODE solver; mass; and the limit of an ideal supply."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from ppafo.control.profiles import CONSTANT
from ppafo.engine.lanes import run_batch
from ppafo.engine.program import Program
from ppafo.engine.run import Run, batch_of, state_row_numbers
from ppafo.engine.scheme.actuators import filled_state
from ppafo.engine.scheme.pneumatics import SlopedFlows, gas_flows
from ppafo.engine.step import gas as gas_of_step
from ppafo.engine.step import lines as lines_of_step
from ppafo.engine.step.lane import Lane
from ppafo.model.catalog import ACTUATORS
from ppafo.model.orifice import orifice_flow
from ppafo.model.plant import (
    PlantParameters,
    PlantState,
    SinglePort,
    chamber_pressures,
    chamber_volumes,
    single_port_flow,
)
from ppafo.model.regulator import LineState, SupplyLines, line_pressures, lines_at_start
from ppafo.model.valves.proportional import IDEAL
from ppafo.parameters import load_device
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import RegulatedLine, SupplyLine
from ppafo.walking import load_walk
from ppafo.walking.motion import with_duration

ANGLE = 1.7
DURATION = 0.06
RELIEVING = ("supply.relieving=true",)
LINES = SupplyLines(3.0e6, 10.0e-3, 10.0e-6, 30.0e6, 0.8e-3, 4.0e-6, 0.0)


def device(dorsiflexion: float = 0.7) -> PlantParameters:
    """The paper's device; dorsiflexion has its own, lower pressure."""
    plant = plant_parameters(load_device("ppafo2011"))
    return plant._replace(dorsiflexion_pressure=dorsiflexion * plant.supply_pressure, relieving=1.0)


def vented(plant: PlantParameters) -> PlantState:
    """Both chambers at the atmosphere, the vane at rest."""
    room = plant.atmospheric_pressure
    return filled_state(ACTUATORS["vane"].model, plant, ANGLE, 0.0, room, room)


class Filled(NamedTuple):
    """Chambers and lines after both chambers were filled."""

    state: PlantState
    lines: LineState


def open_ports(plant: PlantParameters) -> tuple[SinglePort, SinglePort]:
    """Both chambers joined to their supplies."""
    port_1 = SinglePort(plant.valve_conductance, plant.supply_pressure, 1.0, 1.0)
    return port_1, SinglePort(plant.valve_conductance, plant.dorsiflexion_pressure, 1.0, 1.0)


def flowing_now(plant: PlantParameters, state: PlantState, ports: tuple[SinglePort, SinglePort]) -> SlopedFlows:
    """All flows of a state."""
    pressures = chamber_pressures(plant, state.angle, state.mass_1, state.mass_2)
    return gas_flows(plant, *pressures, *ports, single_port_flow)


def end_step(parts: Program, lane: Lane, ports: tuple[SinglePort, SinglePort], step: float) -> None:
    """Set what a step [s] adds [kg], from its first stage."""
    stage = lane.gas_stage
    lane.passing = gas_flows(lane.plant, stage.end_1, stage.end_2, *ports, single_port_flow).flows
    gas_of_step.change(parts, lane, step)
    gas_of_step.add(parts, lane)


def filled(plant: PlantParameters, lines: SupplyLines, step: float) -> Filled:
    """Both chambers filled at once from full lines, the vane held."""
    state, gas = (
        vented(plant),
        lines_at_start(plant, lines),
    )
    parts = Program(IDEAL, CONSTANT, None, CONSTANT, True, False, feed=lines_of_step)
    lane = Lane()
    lane.plant, lane.lines, lane.state, lane.line_state = plant, lines, state, gas
    for _ in range(round(DURATION / step)):
        lane.flowing = flowing_now(plant, lane.state, open_ports(lines_of_step.source(parts, lane)))
        lines_of_step.begin(parts, lane, ANGLE, step)
        end_step(parts, lane, open_ports(lines_of_step.source_ahead(parts, lane)), step)
        lines_of_step.end(parts, lane, step)
        lane.state = lane.fed
    return Filled(lane.state, lane.line_state)


def regulator_flow(set_pressure: float, line_pressure: float, droop: float, largest_flow: float) -> float:
    """Mass flow [kg/s] through a regulator: over the fall of its pressure [Pa] by the droop [Pa s/kg], at most all."""
    return min(max((set_pressure - line_pressure) / droop, 0.0), largest_flow)


@cache
def solved(dorsiflexion: float, lines: SupplyLines) -> tuple[float, ...]:
    """Masses of both chambers and both lines and what came through the bottle's regulator, from an ODE solver."""
    from scipy.integrate import solve_ivp

    plant = device(dorsiflexion)
    volume_1, volume_2 = chamber_volumes(plant, ANGLE)

    def rates(_time: float, y: np.ndarray) -> list[float]:
        chamber_1, chamber_2 = y[0] * plant.gas_product / volume_1, y[1] * plant.gas_product / volume_2
        line_1, line_2 = y[2] * plant.gas_product / lines.volume_1, y[3] * plant.gas_product / lines.volume_2
        fed_1 = orifice_flow(line_1, chamber_1, plant.valve_conductance, 1.0, plant.valve_curve)[0]
        fed_2 = orifice_flow(line_2, chamber_2, plant.valve_conductance, 1.0, plant.valve_curve)[0]
        leak = orifice_flow(chamber_1, chamber_2, plant.leak_conductance, 1.0, plant.leak_curve)[0]
        bottle = regulator_flow(plant.supply_pressure, line_1, lines.droop_1, lines.largest_flow_1)
        level = min(plant.dorsiflexion_pressure, line_1)
        second = regulator_flow(level, line_2, lines.droop_2, lines.largest_flow_2)
        return [fed_1 - leak, fed_2 + leak, bottle - second - fed_1, second - fed_2, bottle]

    begin, gas = (
        vented(plant),
        lines_at_start(plant, lines),
    )
    start = [begin.mass_1, begin.mass_2, gas.mass_1, gas.mass_2, 0.0]
    solution = solve_ivp(rates, (0.0, DURATION), start, method="Radau", rtol=1e-10, atol=1e-15, max_step=1e-4)
    assert solution.success
    return tuple(float(value) for value in solution.y[:, -1])


def error(dorsiflexion: float, lines: SupplyLines, step: float) -> float:
    """Largest difference to the solver over the gas that came through."""
    made, exact = filled(device(dorsiflexion), lines, step), solved(dorsiflexion, lines)
    found = (made.state.mass_1, made.state.mass_2, *made.lines)
    return max(abs(one - other) for one, other in zip(found, exact, strict=True)) / exact[4]


@pytest.mark.parametrize(
    ("dorsiflexion", "lines"),
    [
        (0.7, LINES._replace(largest_flow_1=1.0, largest_flow_2=1.0)),
        (1.0, LINES._replace(largest_flow_1=1.0, largest_flow_2=1.0)),
    ],
)
def test_a_filling_is_of_second_order(dorsiflexion: float, lines: SupplyLines) -> None:
    errors = [error(dorsiflexion, lines, step) for step in (2.5e-4, 1.25e-4, 6.25e-5)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert orders.min() > 1.8, (errors, orders)
    assert errors[-1] < 1.0e-5, errors


@pytest.mark.parametrize("step", [1.0e-3, 1.0e-4])
def test_what_came_through_is_in_lines_and_chambers(step: float) -> None:
    plant = device()
    made, full, begin = (
        filled(plant, LINES, step),
        lines_at_start(plant, LINES),
        vented(plant),
    )
    gained = made.state.mass_1 - begin.mass_1 + made.state.mass_2 - begin.mass_2
    gained += made.lines.mass_1 - full.mass_1 + made.lines.mass_2 - full.mass_2
    assert made.lines.regulated_mass == pytest.approx(gained, rel=1e-12)
    assert abs(made.state.vented_mass) < 1e-12 * made.lines.regulated_mass


def test_without_droop_and_limit_a_filling_is_that_of_a_constant_supply() -> None:
    plant, step, parts, lane = device(), 2.5e-4, Program(IDEAL, CONSTANT, None, None, True, False), Lane()
    lane.plant, ports = plant, open_ports(plant)
    lane.state = vented(plant)
    for _ in range(round(DURATION / step)):
        lane.flowing = flowing_now(plant, lane.state, ports)
        gas_of_step.begin(parts, lane, ANGLE, step)
        end_step(parts, lane, ports, step)
        lane.state = lane.fed
    state = lane.state
    ideal = np.array(chamber_pressures(plant, ANGLE, state.mass_1, state.mass_2))
    away = []
    for droop in (1.0e7, 1.0e6, 1.0e5, 1.0):
        stiff = LINES._replace(droop_1=droop, droop_2=droop, largest_flow_1=1.0, largest_flow_2=1.0)
        made = filled(plant, stiff, step).state
        pressures = np.array(chamber_pressures(plant, ANGLE, made.mass_1, made.mass_2))
        away.append(float(np.abs(pressures / ideal - 1.0).max()))
    assert away == sorted(away, reverse=True), away
    assert away[-1] < 2.0e-4, away


def supply_line(lines: SupplyLines) -> SupplyLine:
    """The lines of a scenario with these numbers."""
    first = RegulatedLine(lines.droop_1, lines.largest_flow_1, lines.volume_1)
    return SupplyLine(first, RegulatedLine(lines.droop_2, lines.largest_flow_2, lines.volume_2))


def short_walk(name: str, lines: SupplyLines | None = None, overrides: tuple[str, ...] = ()) -> Run:
    """A few strides of a walk that comes with the package, perhaps with other lines or values."""
    plan = with_duration(load_walk(name, overrides), 5.0)
    return plan_run(plan if lines is None else replace(plan, supply_line=supply_line(lines)))


@pytest.mark.parametrize("name", ["solenoid-regulators", "proportional-regulators"])
def test_a_walk_keeps_its_gas_and_its_lines_between_zero_and_their_setting(name: str) -> None:
    run = short_walk(name)
    assert run.lines is not None
    outcome, rows = run_batch(batch_of(run)), state_row_numbers(run)
    record = {path: outcome.record[:, row, 0] for path, row in rows.items()}
    chambers = record["state.mass_1"] + record["state.mass_2"]
    lines = record["line_state.mass_1"] + record["line_state.mass_2"]
    through = record["line_state.regulated_mass"]
    inside = chambers + lines + record["state.vented_mass"]
    assert through[-1] > 1.0e-3
    assert np.abs(inside - inside[0] - through).max() < 1.0e-12 * through[-1]
    assert np.abs(lines - lines[0] + record["state.supplied_mass"] - through).max() < 1.0e-12 * through[-1]
    gas = LineState(record["line_state.mass_1"], record["line_state.mass_2"], through)  # type: ignore[arg-type]
    line_1, _ = line_pressures(run.lines.parameters, run.plant.gas_product, gas)
    assert np.min(line_1) > run.plant.atmospheric_pressure
    assert np.min(line_1) < run.plant.supply_pressure - 1.0e3


def test_a_walk_with_wide_lines_and_hardly_any_droop_is_the_walk_with_a_constant_relieving_supply() -> None:
    wide = SupplyLines(1.0e3, 1.0, 1.0e-3, 1.0e3, 1.0, 1.0e-3, 0.0)
    held, ideal = short_walk("solenoid", wide), short_walk("solenoid", None, RELIEVING)
    ends = [run_batch(batch_of(run)).states[state_row_numbers(run)["state.supplied_mass"], 0] for run in (held, ideal)]
    drooping = run_batch(batch_of(short_walk("solenoid", wide._replace(droop_1=3.0e8, volume_1=1.0e-5))))
    away = drooping.states[state_row_numbers(held)["state.supplied_mass"], 0]
    assert ends[0] == pytest.approx(ends[1], rel=2.0e-3)
    assert abs(away / ends[1] - 1.0) > 0.05
