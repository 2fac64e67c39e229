"""The plant of a run as expressions of named states and inputs, from the text that the lanes step."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, leaves, rebuilt
from ppafo.engine.run import Run
from ppafo.model.plant import ThermalParameters
from ppafo.model.valves.proportional import NO_SLEW_LIMIT
from ppafo.model.vane import actuator_torque
from ppafo.translation.plant_rates import PlantRates, gas_rates, thermal_gas_rates, vane_acceleration
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
        import casadi

        made = casadi.Function("of_values", list(self.symbols.values()), list(expressions))
        return lambda values: made.call([values[name] for name in self.symbols])


def valve_states(program: Program) -> dict[str, str]:
    """Name of each state of the valve to its path in the rows of the lanes."""
    paths = leaf_paths(program.valve.state, "valve_state")
    return {VALVE + path.removeprefix("valve_state.").replace(".", "_"): path for path in paths}


def plant_of(run: Run, way: float | None, compare: Compare = both_sides) -> Plant:
    """The plant of a run without its controller and sensors.

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
    openings, moves = _valve(run, [at[name] for name in valve_names], at["command"], compare)
    found = _gas(run, plant, openings, at, compare)
    gas = {name: getattr(found, name) for name in ("pressure_1", "pressure_2", *warm)}
    spool = dict(zip(valve_names, moves, strict=True))
    pressures: tuple[Any, Any] = (at["pressure_1"], at["pressure_2"])
    turning: dict[str, Any] = {}
    if way:
        angle, rate = (at[name] for name in motion)
        acting = dict(zip(program.effects, run.effects, strict=True))
        turning = {
            "angle": rate,
            "angular_velocity": vane_acceleration(plant, angle, rate, pressures, way, compare, acting),
        }
    outputs = {"torque": actuator_torque(*pressures, plant.torque_constant)}
    outputs |= {name: at[name] for name in (*turning, *gas)}
    outputs |= {"supplied_flow": found.supplied, "vented_flow": found.vented}
    # What the valve takes from its command at once is no state: nothing asks for what it was before.
    used = casadi.vertcat(*gas.values(), *moves, *outputs.values())
    kept = {name: rate for name, rate in spool.items() if casadi.depends_on(used, at[name])}
    inputs = (*driven[:3], *(motion if way is None else driven[3:] if way else ()))
    return Plant(at, turning | gas | kept, inputs, outputs | {name: at[name] for name in kept})


def _valve(run: Run, state: list[Any], command: Any, compare: Compare) -> tuple[Any, list[Any]]:
    """Openings of the valve [-] and the rates of its states, after the changes that it makes at once."""
    valve = run.program.valve
    types = (valve.parameters, valve.state, float)
    settled = symbolic(valve.settle, *types, float, compare=compare)(
        run.valve, rebuilt(valve.state, state), command, 0.0
    )
    openings = symbolic(valve.instant, *types, compare=compare)(run.valve, settled, command)
    return openings, leaves(symbolic(valve.rates, *types, compare=compare)(run.valve, settled, command))


def _gas(run: Run, plant: Any, openings: Any, at: Mapping[str, Any], compare: Compare) -> PlantRates:
    """Rates of the gas in both chambers."""
    acting = dict(zip(run.program.effects, run.effects, strict=True))
    pressures = at["pressure_1"], at["pressure_2"]
    motion = at["angle"], at["angular_velocity"]
    if not isinstance(run.thermal, ThermalParameters):
        return gas_rates(plant, openings, *motion, pressures, compare=compare, acting=acting)
    temperatures = at["temperature_1"], at["temperature_2"]
    return thermal_gas_rates(plant, run.thermal, openings, *motion, pressures, temperatures, compare, acting)


def without_slew_limit(run: Run) -> Run:
    """The run with a valve that requests the opening of its command at once: at rest no slew limit is at work."""
    is_limited = hasattr(run.valve, "slew_limit")
    return replace(run, valve=run.valve._replace(slew_limit=NO_SLEW_LIMIT)) if is_limited else run


def answers_to_command(run: Run) -> bool:
    """False for a valve that is on or off: no small change of the command changes its openings or its movement."""
    import casadi

    command = casadi.SX.sym("command")
    start = leaves(run.program.valve.initial())
    openings, moves = _valve(without_slew_limit(run), start, command, both_sides)
    slopes = casadi.Function("slopes", [command], [casadi.jacobian(casadi.vertcat(*openings, *moves), command)])
    return any(abs(slope) > 0.0 for value in (-0.5, 0.5) for slope in slopes(value).nonzeros())
