"""A linear model at a point: an instant of a run, or the steady state that it has; the plant there, symbolically."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.analyses.linearise.answer import ON_THE_EDGE, Delays, Edge, LinearModel, Variable
from ppafo.control.kind import OPEN_LOOP
from ppafo.control.profiles import CONSTANT
from ppafo.engine.continuous_time import mode_at_rest, torque_on_vane
from ppafo.engine.lanes import Floats, run_batch
from ppafo.engine.led_leg import LedLeg, shank_at, torque_of_leg
from ppafo.engine.linking import python_place
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, leaves, numbers, rebuilt
from ppafo.engine.run import NEVER_FAILED, Run, batch_of, state_row_numbers
from ppafo.errors import ScenarioError, SimulationError
from ppafo.model.elementary import TURN, sine_and_cosine_of_turns
from ppafo.model.leg import FootLoad, ShankNow, torque_on_foot
from ppafo.model.orifice import FlowCurve
from ppafo.model.plant import (
    Openings,
    ThermalParameters,
    actuator_torque,
    chamber_mass,
    chamber_pressures,
    chamber_volumes,
)
from ppafo.model.ports import at_valve, friction_at_rest
from ppafo.model.valves.proportional import NO_SLEW_LIMIT
from ppafo.parameters.joint import Joint
from ppafo.simulation.plan import plan_run
from ppafo.simulation.profiles import profile_values
from ppafo.simulation.sampled import run_sampled
from ppafo.simulation.scenario import FreeMotion, Scenario
from ppafo.translation.plant_rates import (
    gas_rates,
    thermal_gas_rates,
    vane_acceleration,
)
from ppafo.translation.symbolic import Compare, both_sides, symbolic

VALVE = "valve_"
"""Begins the names of the states of a valve."""
UNITS = {
    "angle": "rad",
    "angular_velocity": "rad/s",
    "pressure_1": "Pa",
    "pressure_2": "Pa",
    "temperature_1": "K",
    "temperature_2": "K",
    f"{VALVE}requested": "1",
    f"{VALVE}opening": "1",
    f"{VALVE}rate": "1/s",
    "command": "1",
    "external_torque": "N m",
    "supply_pressure": "Pa",
    "dorsiflexion_pressure": "Pa",
    "torque": "N m",
    "supplied_flow": "kg/s",
    "vented_flow": "kg/s",
}
"""Units of all that a linear model names, in SI."""


@dataclass(frozen=True, slots=True)
class Plant:
    """Symbols by name, and expressions by name: ``rates`` of states, ``outputs``; ``inputs`` are names of symbols."""

    symbols: Mapping[str, Any]
    rates: Mapping[str, Any]
    inputs: tuple[str, ...]
    outputs: Mapping[str, Any]

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return tuple(self.rates)

    def function(self, expressions: Sequence[Any]) -> Callable[[Mapping[str, float]], Any]:
        """A function of the values of all symbols by name; it returns a column for each expression."""
        # CasADi is an optional package: this module can be imported without it.
        import casadi

        made = casadi.Function("of_values", list(self.symbols.values()), list(expressions))
        return lambda values: made.call([values[name] for name in self.symbols])


def valve_states(program: Program) -> dict[str, str]:
    """Name of each state of the valve to its path in the rows of the lanes."""
    paths = leaf_paths(program.valve.state, "valve_state")
    return {VALVE + path.removeprefix("valve_state.").replace(".", "_"): path for path in paths}


def plant_of(run: Run, way: float | None, compare: Compare = both_sides, time: float = 0.0) -> Plant:
    """The plant of a run without its controller and sensors; the shank of a leg is where it is at ``time`` [s].

    ``way`` is the direction of a free vane, 0 for one that is held by friction or a stop; None where the ankle is
    prescribed: angle and angular velocity are inputs then.
    """
    import casadi

    program = run.program
    valve_names = valve_states(program)
    motion, warm = ("angle", "angular_velocity"), ("temperature_1", "temperature_2") if program.is_thermal else ()
    driven = ("command", "supply_pressure", "dorsiflexion_pressure", "external_torque")
    names = (*motion, "pressure_1", "pressure_2", *warm, *valve_names, *driven)
    at = {name: casadi.SX.sym(name) for name in names}
    given: dict[str, Any] = {name: at[name] for name in driven[1:]}
    plant = run.plant._replace(**given)
    openings, moves = valve_equations(run, [at[name] for name in valve_names], at["command"], compare)
    acting = dict(zip(program.effects, run.effects, strict=True))
    turn: tuple[Any, Any] = (at["angle"], at["angular_velocity"])
    pressures: tuple[Any, Any] = (at["pressure_1"], at["pressure_2"])
    if isinstance(run.thermal, ThermalParameters):
        temperatures = at["temperature_1"], at["temperature_2"]
        found = thermal_gas_rates(plant, run.thermal, openings, *turn, pressures, temperatures, compare, acting)
    else:
        found = gas_rates(plant, openings, *turn, pressures, compare=compare, acting=acting)
    gas = {name: getattr(found, name) for name in ("pressure_1", "pressure_2", *warm)}
    spool = dict(zip(valve_names, moves, strict=True))
    turning: dict[str, Any] = {}
    # A vane that is held or prescribed has no acceleration: angle and velocity are no states then.
    if way:
        added = 0.0 if run.leg is None else _torque_of_leg(run.program, run.leg, time, at["angle"])
        acceleration = vane_acceleration(plant, *turn, pressures, way, compare, acting, added)
        turning = {"angle": at["angular_velocity"], "angular_velocity": acceleration}
    outputs = {"torque": actuator_torque(*pressures, plant.torque_constant)}
    outputs |= {name: at[name] for name in (*turning, *gas)}
    outputs |= {"supplied_flow": found.supplied, "vented_flow": found.vented}
    # What the valve takes from its command at once is no state: nothing asks for what it was before.
    used = casadi.vertcat(*gas.values(), *moves, *outputs.values())
    kept = {name: rate for name, rate in spool.items() if casadi.depends_on(used, at[name])}
    inputs = (*driven[:3], *(motion if way is None else driven[3:] if way else ()))
    return Plant(at, turning | gas | kept, inputs, outputs | {name: at[name] for name in kept})


def _torque_of_leg(program: Program, leg: LedLeg, time: float, angle: Any) -> Any:
    """Torque of a leg [N m] at an angle that is a symbol, with the shank as it is at a time [s]."""
    import casadi

    def turned(_own: Any, turns: Any) -> tuple[Any, Any]:
        return casadi.sin(TURN * turns), casadi.cos(TURN * turns)

    assert program.shank is not None, "a leg has a shank"
    torque = symbolic(torque_on_foot, FootLoad, ShankNow, float, around={sine_and_cosine_of_turns: turned})
    return torque(leg.load, shank_at(program.shank, leg.shank, time), angle)


def valve_equations(run: Run, state: list[Any], command: Any, compare: Compare) -> tuple[Any, list[Any]]:
    """Openings of the valve [-] and the rates of its states, after the changes that it makes at once."""
    valve, acting = run.program.valve, dict(zip(run.program.effects, run.effects, strict=True))
    types = (valve.parameters, valve.state, float)
    command = symbolic(at_valve, float, compare=compare, acting=acting)(command)
    settled = symbolic(valve.settle, *types, float, compare=compare, acting=acting)(
        run.valve, rebuilt(valve.state, state), command, 0.0
    )
    openings = symbolic(valve.instant, *types, compare=compare)(run.valve, settled, command)
    return openings, leaves(symbolic(valve.rates, *types, compare=compare)(run.valve, settled, command))


def without_slew_limit(run: Run) -> Run:
    """The run with a valve that requests the opening of its command at once: at rest no slew limit is at work."""
    is_limited = hasattr(run.valve, "slew_limit")
    return replace(run, valve=run.valve._replace(slew_limit=NO_SLEW_LIMIT)) if is_limited else run


STEADY = 1.0e-9
"""Largest rate of a state [1/s], over the size of the state, that counts as none."""
FIRST_COMMANDS = (0.01, 0.1, 0.003, 0.03, 0.3, 1.0)
"""Sizes of commands [-] from which the steady state is looked for."""
SIZES = {"pressure": 1.0e5, "temperature": 300.0, "torque": 1.0}
MOST_STEPS = 60


@dataclass(frozen=True, slots=True)
class Point:
    """Values of all symbols of the plant by name [SI], at a ``time`` [s] of the run; None for a steady state.

    ``way`` is the direction of a free vane, 0 where friction or a stop holds it; None where the ankle is prescribed.
    """

    time: float | None
    values: Mapping[str, float]
    way: float | None


def point_at(scenario: Scenario, time: float) -> Point:
    """The point that the run of a scenario passes at a time [s], to the nearest step; ScenarioError outside the run."""
    # Allowance for rounding: the end of the run itself is a valid time.
    if not 0.0 <= time <= scenario.run.duration * (1.0 + 1.0e-12):
        raise ScenarioError(
            f"{scenario.name}: --at {time:g} s is outside the run, which lasts {scenario.run.duration:g} s"
        )
    whole = plan_run(scenario)
    steps = min(round(time / whole.step), whole.step_count)
    return Point(steps * whole.step, *_after(scenario, whole, steps))


def _after(scenario: Scenario, run: Run, steps: int) -> tuple[dict[str, float], float | None]:
    """Values after some steps of a run, and the way of its vane."""
    batch = batch_of(replace(run, step_count=steps))
    custom = scenario.controller.custom
    outcome = run_batch(batch) if custom is None else run_sampled(batch, custom)
    rows = {name: float(outcome.states[row, 0]) for name, row in state_row_numbers(run).items()}
    if rows["result.failure_time"] < NEVER_FAILED or not all(map(np.isfinite, rows.values())):
        raise SimulationError(f"{scenario.name}: the run diverges before {steps * run.step:g} s (ppafo simulate)")
    angle, rate = rows["state.angle"], rows["state.angular_velocity"]
    if run.program.angle is not None:
        angle, rate, _ = run.program.angle.value(run.path, steps * run.step)
    pressure_1, pressure_2 = chamber_pressures(run.plant, angle, rows["state.mass_1"], rows["state.mass_2"])
    values = {"angle": angle, "angular_velocity": rate, "command": rows["result.command"]}
    values |= {"pressure_1": float(pressure_1), "pressure_2": float(pressure_2)}
    driven = ("supply_pressure", "dorsiflexion_pressure", "external_torque")
    values |= {name: float(getattr(run.plant, name)) for name in driven}
    values |= {name: rows[path] for name, path in valve_states(run.program).items()}
    if isinstance(run.thermal, ThermalParameters):
        warm = [rows[f"state.mass_{side}"] / rows[f"masses.mass_{side}"] for side in (1, 2)]
        values |= {f"temperature_{side}": run.thermal.temperature * warm[side - 1] for side in (1, 2)}
    return values, _way(run, values, steps * run.step)


def _way(run: Run, values: Mapping[str, float], time: float) -> float | None:
    """Direction of a free vane, 0 where it is held, at a time [s]."""
    if run.program.angle is not None:
        return None
    rate, angle = values["angular_velocity"], values["angle"]
    if rate != 0.0:
        return 1.0 if rate > 0.0 else -1.0
    volumes, product = chamber_volumes(run.plant, angle), run.plant.gas_product
    masses = [chamber_mass(values[f"pressure_{side}"], volumes[side - 1], product) for side in (1, 2)]
    limit, plant = python_place(friction_at_rest, run.program.effects, run.effects), run.plant
    if limit is not None:
        pressures = values["pressure_1"], values["pressure_2"]
        plant = plant._replace(static_torque=limit({}, plant.static_torque, *pressures))
    added = 0.0 if run.leg is None else torque_of_leg(run.program, run.leg, time, angle)
    return mode_at_rest(plant, angle, torque_on_vane(plant, angle, *masses) + added)


def equilibrium(scenario: Scenario) -> Point:
    """The steady state that a scenario asks for; ScenarioError where there is none.

    The ankle stands where it is at the end of the run, with no velocity; nothing in the chambers or in the valve
    changes any more; the actuator has the torque that the reference has at the end of the run, or, where the
    controller is a constant command, the command is that one.
    """
    whole = plan_run(scenario)
    if whole.leg is not None and whole.program.shank is not CONSTANT:
        raise ScenarioError(f"{scenario.name}: no equilibrium while the shank of the leg moves; take --at with a time")
    values, _ = _after(scenario, whole, whole.step_count)
    values["angular_velocity"] = 0.0
    is_open_loop = scenario.controller.kind == OPEN_LOOP
    end = np.array([scenario.run.duration])
    wanted = None if is_open_loop else float(profile_values(scenario.reference, end)[0][0])
    run = without_slew_limit(whole)
    held = None if run.program.angle is not None else 0.0
    found = _steady(run, held, values, wanted)
    if found is None:
        if wanted is None:
            line = f"no equilibrium found for the command {values['command']:g}"
            raise ScenarioError(f"{scenario.name}: {line}; take --at with a time")
        line = f"no equilibrium at {wanted:.4g} N m, the last value of the reference"
        full = dict.fromkeys(("command", *_spool(values)), 1.0 if wanted > 0.0 else -1.0)
        most = _steady(run, held, {**values, **full}, None)
        if most is not None:
            torque = run.plant.torque_constant * (most["pressure_1"] - most["pressure_2"])
            line += f": with the valve fully open the actuator comes to {torque:.4g} N m"
        other = " or hold the ankle" if isinstance(scenario.motion, FreeMotion) else ""
        raise ScenarioError(f"{scenario.name}: {line}; set another reference{other}, or take --at with a time")
    way = _way(run, found, scenario.run.duration)
    if way:
        raise ScenarioError(
            f"{scenario.name}: no equilibrium: at {np.degrees(values['angle']):.4g} deg the torque moves the vane; "
            "take --at with a time, or another torque"
        )
    # A valve that is closed but for rounding is closed.
    found |= {name: 0.0 for name in ("command", *_spool(found)) if abs(found[name]) < STEADY}
    # What the valve takes from its command at once was no unknown.
    at_rest = dict(zip(valve_states(run.program), numbers(_settled(run, found)), strict=True))
    return Point(None, found | at_rest, way)


def _steady(run: Run, held: float | None, values: Mapping[str, float], wanted: float | None) -> dict[str, float] | None:
    """Values of a steady state with a torque [N m], or with the present command; None where none is found."""
    # Where the search begins: at the end of the run, then about the pressures that have the torque.
    starts = [dict(values)]
    lowest, torque = run.plant.atmospheric_pressure, wanted or 0.0
    surplus = abs(torque) / run.plant.torque_constant
    for size in FIRST_COMMANDS:
        command = values["command"] if wanted is None else size if torque >= 0.0 else -size
        pressures = [1.001 * lowest + (surplus if is_fed else 0.0) for is_fed in (command > 0.0, command < 0.0)]
        fed = {"pressure_1": pressures[0], "pressure_2": pressures[1], "command": command}
        starts.append({**values, **fed, **dict.fromkeys(_spool(values), command)})
    import casadi

    # All rates, and the torque where one is wanted, as functions of all states, and the command where that is free.
    plant = plant_of(run, held)
    names = [*plant.states, *([] if wanted is None else ["command"])]
    sizes = np.array([SIZES.get(name.partition("_")[0], 1.0) for name in names])
    # Rates over the sizes of their states, so that pascals and openings count alike.
    rates = [plant.rates[name] / size for name, size in zip(plant.states, sizes.tolist(), strict=False)]
    unknowns = casadi.vertcat(*(plant.symbols[name] for name in names))
    residual = casadi.vertcat(*rates, *([] if wanted is None else [plant.outputs["torque"] - wanted]))
    function = plant.function([residual, casadi.jacobian(residual, unknowns)])
    reached = (_newton(function, names, sizes, start) for start in starts)
    return next((found for found in reached if found is not None), None)


def _spool(values: Mapping[str, float]) -> list[str]:
    """Names of the openings of the valve among some values."""
    return [name for name in values if name in (f"{VALVE}requested", f"{VALVE}opening")]


def _newton(
    function: Callable[[Mapping[str, float]], Any], names: Sequence[str], sizes: Floats, start: Mapping[str, float]
) -> dict[str, float] | None:
    """Values at which a function is 0, by Newton's method with steps cut where they lead too far; None where none."""

    def at(values: Mapping[str, float]) -> tuple[Floats, Floats]:
        residual, slopes = (np.array(item) for item in function(values))
        return residual.ravel(), slopes

    values = dict(start)
    residual, slopes = at(values)
    for _ in range(MOST_STEPS):
        largest = float(np.max(np.abs(residual)))
        if largest < STEADY:
            return values if abs(values["command"]) <= 1.0 + STEADY else None
        if not (np.isfinite(largest) and np.isfinite(slopes).all()):
            return None
        # Least squares instead of a solver that refuses: in a dead band the slopes are singular.
        step = np.linalg.lstsq(slopes * sizes, -residual, rcond=None)[0] * sizes
        share = 1.0
        while share > 1.0e-6:
            # Values after a step, pressures at least half of what they were, the command within -1 to 1.
            moved = dict(values)
            for name, change in zip(names, (share * step).tolist(), strict=True):
                moved[name] = values[name] + change
                if name.startswith(("pressure", "temperature")):
                    moved[name] = max(moved[name], 0.5 * values[name])
                if name == "command":
                    moved[name] = min(max(moved[name], -1.0), 1.0)
            residual, slopes = at(moved)
            if np.isfinite(residual).all() and float(np.max(np.abs(residual))) < largest:
                break
            share *= 0.5
        else:
            return None
        values = moved
    return None


def _settled(run: Run, values: Mapping[str, float]) -> Any:
    """State of the valve after the changes that it makes at once."""
    state: Any = rebuilt(run.program.valve.state, [values[name] for name in valve_states(run.program)])
    return run.program.valve.settle(run.valve, state, values["command"], 0.0)


EQUILIBRIUM = "equilibrium"
MISSING_CASADI = "a linear model needs CasADi: pip install ppafo[control]"
EQUAL = 1.0e-12
"""Two sides that differ by less than this, over the larger one, are equal."""
DEAF = "no small change of the command changes it (dead band, slew limit, beyond full): the command's column is 0"


class _Sides:
    """Decides every comparison at a point, one of them on its ``other_side``, and keeps those that lie on an edge.

    Of two equal numbers that one counts as larger which grows faster along one direction, so that all comparisons are
    decided as they are at one point nearby.
    """

    def __init__(self, values: Mapping[str, float], other_side: str = "") -> None:
        self._values, self._other_side = values, other_side
        self.edges: dict[str, Edge] = {}

    def __call__(self, sign: str, left: Any, right: Any, place: str) -> bool:
        import casadi

        # Both values at the point, and how fast the one grows beyond the other along the direction.
        symbols = casadi.symvar(casadi.vertcat(left, right))
        onward = casadi.DM([_direction(symbol.name(), self._values) for symbol in symbols])
        surplus = casadi.SX(left) - casadi.SX(right)
        growth = casadi.jtimes(surplus, casadi.vertcat(*symbols), onward) if symbols else 0.0
        known = [self._values[symbol.name()] for symbol in symbols]
        found = casadi.Function("values", symbols, [casadi.vertcat(left, right, growth)]).call(known)[0]
        one, other, ahead = (float(item) for item in found.nonzeros())
        larger = max(abs(one), abs(other))
        beyond = one - other if abs(one - other) > EQUAL * larger else ahead
        tests = {"<": beyond < 0.0, "<=": beyond <= 0.0, ">": beyond > 0.0, ">=": beyond >= 0.0}
        # Signs that are not in the table are == and !=: they have no edge.
        is_true = tests.get(sign, (one == other) == (sign == "=="))
        if sign in tests and abs(one - other) <= ON_THE_EDGE * larger:
            self.edges[place] = Edge(place, is_true)
        return is_true != (place == self._other_side)


def _direction(name: str, values: Mapping[str, float]) -> float:
    """Where the point nearby lies: the command goes up, or back from full opening; the rest counts less."""
    if name == "command":
        return 1.0 if abs(values[name]) < 1.0 else -values[name]
    if name in (f"{VALVE}requested", f"{VALVE}opening"):
        return 1.0e-6 if values[name] < 1.0 else -1.0e-6
    first = ("pressure_1", "supply_pressure", "angle", "angular_velocity")
    return 1.0e-6 * max(1.0, abs(values[name])) * (1.0 if name in first else -0.5)


def model_at(scenario: Scenario, run: Run, point: Point) -> LinearModel:
    """The linear model at a point, from the smooth piece that the point lies on."""
    values = dict(point.values)
    decided = _Sides(values)
    time = point.time or 0.0
    plant = plant_of(run, point.way, decided, time)
    matrices = _matrices(plant, values)
    edges = []
    for place, edge in decided.edges.items():
        others = _matrices(plant_of(run, point.way, _Sides(values, place), time), values)
        # An edge counts only where the linear model on its other side is another one, or of other states.
        pairs = list(zip(matrices[:4], others[:4], strict=True))
        is_same = all(one.shape == other.shape for one, other in pairs) and all(
            np.allclose(one, other, rtol=ON_THE_EDGE, atol=0.0, equal_nan=True) for one, other in pairs
        )
        edges += [] if is_same else [edge]
    a, b, c, d, found, shown = matrices
    sides = sides_of(run, point, scenario.device.joint)
    if not np.any(b[:, 0]) and not np.any(d[:, 0]):
        sides["valve"] += f"; {DEAF}"
    return LinearModel(
        scenario=scenario,
        time=point.time,
        states=tuple(Variable(name, UNITS[name], values[name]) for name in plant.states),
        inputs=tuple(Variable(name, UNITS[name], values[name]) for name in plant.inputs),
        outputs=tuple(
            Variable(name, UNITS[name], float(value))
            for name, value in zip(plant.outputs, shown.ravel().tolist(), strict=True)
        ),
        a=a,
        b=b,
        c=c,
        d=d,
        rates=found.ravel(),
        sides=sides,
        edges=tuple(edges),
        delays=Delays(run.command_delay, run.signal_delay, run.period),
    )


def _matrices(plant: Plant, values: Mapping[str, float]) -> list[Floats]:
    """A, B, C and D of a plant at some values; then its rates and outputs there, as columns."""
    import casadi

    x, u = (casadi.vertcat(*(plant.symbols[name] for name in names)) for names in (plant.states, plant.inputs))
    rates, outputs = casadi.vertcat(*plant.rates.values()), casadi.vertcat(*plant.outputs.values())
    wanted = [casadi.jacobian(item, by) for item in (rates, outputs) for by in (x, u)]
    return [np.array(item) for item in plant.function([*wanted, rates, outputs])(values)]


def sides_of(run: Run, point: Point, joint: Joint) -> dict[str, str]:
    """Which side of each limit the point lies on, in words by place; ``joint`` names what moves."""
    # Openings of the valve [-] at a point.
    found: Openings = run.program.valve.instant(run.valve, _settled(run, point.values), point.values["command"])
    at, plant, openings = point.values, run.plant, found
    room, first, second = plant.atmospheric_pressure, at["pressure_1"], at["pressure_2"]
    paths = {
        "source to chamber 1": (at["supply_pressure"], first, openings.source_1),
        "chamber 1 to atmosphere": (first, room, openings.vent_1),
        "source to chamber 2": (at["dorsiflexion_pressure"], second, openings.source_2),
        "chamber 2 to atmosphere": (second, room, openings.vent_2),
    }
    said = {name: _regime(plant.valve_curve, *values) for name, values in paths.items()}
    said["leak over the vane"] = _regime(plant.leak_curve, first, second, 1.0)
    motion = {
        None: "prescribed",
        0.0: "at rest",
        1.0: f"slides in {joint.positive}",
        -1.0: f"slides in {joint.negative}",
    }
    vane = motion[point.way]
    if point.way == 0.0:
        is_at_stop = not plant.angle_min < at["angle"] < plant.angle_max
        vane = "against a stop" if is_at_stop else "sticks: friction holds it"
    valve = f"feeds chamber {1 if openings.source_1 > 0.0 else 2}, open by {max(openings):.4g}" if any(openings) else ""
    return {"valve": valve or "closed", joint.name: vane, **said}


def _regime(curve: FlowCurve, pressure_a: float, pressure_b: float, opening: float) -> str:
    """How gas flows between two pressures [Pa]."""
    if opening == 0.0:
        return "closed"
    ratio = min(pressure_a, pressure_b) / max(pressure_a, pressure_b)
    if ratio <= curve.critical_ratio:
        return f"choked, pressure ratio {ratio:.3f}"
    near = ", on the straight line near equal pressures" if ratio > curve.linear_ratio else ""
    return f"below choking, pressure ratio {ratio:.4f}{near}"
