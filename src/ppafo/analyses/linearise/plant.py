"""The plant of a run without its controller and sensors, in symbols of CasADi: rates of its states, and outputs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ppafo.engine.led_leg import LedLeg, shank_at
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, leaves, rebuilt
from ppafo.engine.run import Run
from ppafo.model.leg import FootLoad, ShankNow, torque_on_foot
from ppafo.model.plant import ThermalParameters
from ppafo.model.ports import at_valve
from ppafo.model.valves.proportional import NO_SLEW_LIMIT
from ppafo.translation.plant_rates import SINES, Turning, acceleration_of, gas_rates, thermal_gas_rates
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

        function = casadi.Function("of_values", list(self.symbols.values()), list(expressions))
        return lambda values: function.call([values[name] for name in self.symbols])


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
    symbols = {name: casadi.SX.sym(name) for name in names}
    supplies_and_torque: dict[str, Any] = {name: symbols[name] for name in driven[1:]}
    plant = run.plant._replace(**supplies_and_torque)
    openings, moves = valve_equations(run, [symbols[name] for name in valve_names], symbols["command"], compare)
    acting = dict(zip(program.effects, run.effects, strict=True))
    turn: tuple[Any, Any] = (symbols["angle"], symbols["angular_velocity"])
    pressures: tuple[Any, Any] = (symbols["pressure_1"], symbols["pressure_2"])
    turning = Turning(program.actuator, plant, *turn, pressures, compare, acting)
    if isinstance(run.thermal, ThermalParameters):
        temperatures = symbols["temperature_1"], symbols["temperature_2"]
        rates = thermal_gas_rates(turning, run.thermal, openings, temperatures)
    else:
        rates = gas_rates(turning, openings)
    gas = {name: getattr(rates, name) for name in ("pressure_1", "pressure_2", *warm)}
    spool = dict(zip(valve_names, moves, strict=True))
    moving: dict[str, Any] = {}
    # A vane that is held or prescribed has no acceleration: angle and velocity are no states then.
    if way:
        added = 0.0 if run.leg is None else _torque_of_leg(run.program, run.leg, time, symbols["angle"])
        acceleration = acceleration_of(turning, way, added)
        moving = {"angle": symbols["angular_velocity"], "angular_velocity": acceleration}
    outputs = {"torque": turning.torque()}
    outputs |= {name: symbols[name] for name in (*moving, *gas)}
    outputs |= {"supplied_flow": rates.supplied, "vented_flow": rates.vented}
    # What the valve takes from its command at once is no state: nothing asks for what it was before.
    used = casadi.vertcat(*gas.values(), *moves, *outputs.values())
    kept = {name: rate for name, rate in spool.items() if casadi.depends_on(used, symbols[name])}
    inputs = (*driven[:3], *(motion if way is None else driven[3:] if way else ()))
    return Plant(symbols, moving | gas | kept, inputs, outputs | {name: symbols[name] for name in kept})


def _torque_of_leg(program: Program, leg: LedLeg, time: float, angle: Any) -> Any:
    """Torque of a leg [N m] at an angle that is a symbol, with the shank as it is at a time [s]."""
    assert program.shank is not None, "a leg has a shank"
    torque = symbolic(torque_on_foot, FootLoad, ShankNow, float, around=SINES)
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


def opens_in_proportion(run: Run) -> bool:
    """Return whether a small change of the command changes the openings of the valve, or how fast they move."""
    import casadi

    command = casadi.SX.sym("command")
    start = leaves(run.program.valve.initial())
    openings, moves = valve_equations(without_slew_limit(run), start, command, both_sides)
    slopes = casadi.Function("slopes", [command], [casadi.jacobian(casadi.vertcat(*openings, *moves), command)])
    return any(abs(slope) > 0.0 for value in (-0.5, 0.5) for slope in slopes(value).nonzeros())
