"""Plant of a run without controller and sensors as a function of named values, and its one-sided slopes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ppafo.engine.continuous_time import free_motion, isothermal_rates, thermal_rates, turning_chambers
from ppafo.engine.in_python import PythonFunctions, functions_of
from ppafo.engine.lanes import Floats
from ppafo.engine.led_leg import torque_of_leg
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, numbers, rebuilt
from ppafo.engine.run import Run
from ppafo.errors import SimulationError
from ppafo.model.plant import Openings, ThermalParameters
from ppafo.model.ports import at_valve
from ppafo.model.valves.proportional import NO_SLEW_LIMIT

VALVE = "valve_"
"""Prefix of the names of valve states."""
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
"""SI units of all signals of a linear model."""
DRIVEN = ("supply_pressure", "dorsiflexion_pressure", "external_torque")
"""Inputs of a linear model that are fields of ``PlantParameters``."""
_SIZES = {"Pa": 1.0e5, "K": 300.0}
"""Reference size for values with a unit [SI]; 1 for any other unit."""


def size_of(name: str) -> float:
    """Return the reference size of a state or an input [SI], by which steps of finite differences are scaled."""
    return _SIZES.get(UNITS.get(name, ""), 1.0)


@dataclass(frozen=True, slots=True)
class LinearisedPlant:
    """Plant of a run without controller and sensors, as a function of states and inputs.

    ``direction``: direction of a free vane, 0 if friction or a stop holds it; None if the ankle is prescribed, so that
        angle and angular velocity are inputs
    ``time``: time [s] for which the shank of a leg is fixed
    ``functions``: functions of the model, as used in the run
    """

    run: Run
    direction: float | None
    time: float
    functions: PythonFunctions

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs of the linear model."""
        more = (
            ("angle", "angular_velocity") if self.direction is None else ("external_torque",) if self.direction else ()
        )
        supplies = DRIVEN[:1] if self.run.program.has_one_chamber else DRIVEN[:2]
        return ("command", *supplies, *more)

    def at(self, values: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
        """Return time derivatives and outputs for values of all states and inputs by name [SI].

        A valve state that follows the command immediately does not count as a state: its derivative is 0.
        """
        run, program, call = self.run, self.run.program, self.functions.of
        driven: dict[str, Any] = {name: values[name] for name in DRIVEN}
        plant = run.plant._replace(**driven)
        angle, rate = values["angle"], values["angular_velocity"]
        pressures = values["pressure_1"], values["pressure_2"]
        valve = valve_at(run, self.functions, values)
        chambers = call(turning_chambers)(plant, angle, rate, *pressures, parts=program.functions)
        motion_rates, temperature_rates = {}, {}
        if isinstance(run.thermal, ThermalParameters):
            temperatures = values["temperature_1"], values["temperature_2"]
            gas = call(thermal_rates)(plant, run.thermal, valve.openings, chambers, *pressures, *temperatures)
            temperature_rates = {"temperature_1": gas.temperature_1, "temperature_2": gas.temperature_2}
        else:
            gas = call(isothermal_rates)(plant, valve.openings, chambers, *pressures)
        # A vane that is held or prescribed has no acceleration: angle and velocity are no states then.
        if self.direction:
            added = 0.0 if run.leg is None else torque_of_leg(program, run.leg, self.time, angle)
            moved = call(free_motion)(plant, angle, rate, *pressures, added, self.direction, parts=program.functions)
            motion_rates = dict(zip(("angle", "angular_velocity"), moved, strict=True))
        pressure_rates = {"pressure_1": gas.pressure_1, "pressure_2": gas.pressure_2}
        rates = motion_rates | pressure_rates | temperature_rates
        outputs = {"torque": program.actuator.torque(plant, angle, *pressures)} | {name: values[name] for name in rates}
        outputs |= {"supplied_flow": gas.supplied, "vented_flow": gas.vented}
        return rates | valve.rates, outputs | {name: values[name] for name in valve.rates}


def plant_of(run: Run, direction: float | None, values: Mapping[str, float], time: float = 0.0) -> LinearisedPlant:
    """Return the plant of a run near given states and inputs; other arguments as in ``LinearisedPlant``.

    If the valve has reached its requested opening, the slew limit is inactive: the valve follows a small command
    immediately. Raises SimulationError for an effect that has a state.
    """
    limitless, functions = without_slew_limit(run), functions_in(run)
    has_arrived = valve_at(run, functions, values).state == valve_at(limitless, functions, values).state
    return LinearisedPlant(limitless if has_arrived else run, direction, time, functions)


def functions_in(run: Run) -> PythonFunctions:
    """Return the functions of the model as used in a run.

    Raises SimulationError for an effect of the device that has a state; sensors are no part of the plant.
    """
    for effect in run.program.effects:
        if effect.state is not None and effect.is_of_device:
            raise SimulationError(
                f"effect '{effect.name}' has state variables, which the linear model does not include; switch the "
                "effect off"
            )
    effects = zip(run.program.effects, run.effects, strict=True)
    return functions_of(run.program, {effect.name: row for effect, row in effects})


def valve_states(program: Program) -> dict[str, str]:
    """Return the names of the valve states, each with its path in the rows of the simulation."""
    paths = leaf_paths(program.valve.state, "valve_state")
    return {VALVE + path.removeprefix("valve_state.").replace(".", "_"): path for path in paths}


class _SettledValve(NamedTuple):
    """Valve state after its immediate changes, openings [-], and time derivatives of the states by name."""

    state: Any
    openings: Openings
    rates: dict[str, float]


def valve_at(run: Run, functions: PythonFunctions, values: Mapping[str, float]) -> _SettledValve:
    """Return the valve of a run for given valve states and command, by name."""
    valve, names = run.program.valve, valve_states(run.program)
    command = functions.of(at_valve)(values["command"])
    state = rebuilt(valve.state, [values[name] for name in names])
    settled = functions.of(valve.settle)(run.valve, state, command, 0.0)
    openings = functions.of(valve.instant)(run.valve, settled, command)
    rates = numbers(functions.of(valve.rates)(run.valve, settled, command))
    return _SettledValve(settled, openings, dict(zip(names, rates, strict=True)))


def without_slew_limit(run: Run) -> Run:
    """Return the run with a valve that follows its command without a slew limit."""
    is_limited = hasattr(run.valve, "slew_limit")
    return replace(run, valve=run.valve._replace(slew_limit=NO_SLEW_LIMIT)) if is_limited else run


def opens_in_proportion(run: Run) -> bool:
    """Return whether a small change of the command changes the openings or their rates."""
    limitless = without_slew_limit(run)
    start = dict(zip(valve_states(run.program), numbers(run.program.valve.initial()), strict=True))
    functions = functions_in(limitless)
    for half in (-0.5, 0.5):
        valves = [valve_at(limitless, functions, start | {"command": half + change}) for change in (1.0e-4, 2.0e-4)]
        first, second = ([*valve.openings, *valve.rates.values()] for valve in valves)
        if first != second:
            return True
    return False


# Slopes by differences: towards one side of a point, where the model may have a kink.

LONGEST = 1.0e-2
"""Largest step of the finite differences divided by the reference size [-]."""
SHORTER, LENGTHS = 4.0, 8
"""Ratio of successive steps of the finite differences [-], and their number: the last is about 1e-6 of the size."""
ORDERS = 5
"""Number of error orders eliminated by the extrapolation."""


def one_sided_slopes(function: Callable[[float], Floats], at: float, side: float, size: float) -> tuple[Floats, Floats]:
    """Return the one-sided slopes of a function (rows,) towards ``side`` (1 or -1), and estimates of their errors.

    Finite differences on that side, with steps from a hundredth to a millionth of ``size``, are extrapolated to zero
    step by Ridders' method (Adv. Eng. Softw. 4, 1982). For each row, the extrapolation with the smallest estimated
    error is taken. The function is not evaluated at the value itself, so a jump there has no effect.
    """
    steps = at + side * LONGEST * size / SHORTER ** np.arange(LENGTHS)
    values = np.array([function(step) for step in steps.tolist()])
    slopes = np.diff(values, axis=0) / np.diff(steps)[:, None]
    best, errors = slopes[-1], np.full(slopes.shape[1], np.inf)
    for order in range(1, ORDERS + 1):
        better = slopes[1:] + np.diff(slopes, axis=0) / (SHORTER**order - 1.0)
        error = np.maximum(np.abs(better - slopes[1:]), np.abs(better - slopes[:-1]))
        nearest = np.nanargmin(np.where(np.isfinite(error), error, np.inf), axis=0), np.arange(best.size)
        is_better = error[nearest] < errors
        best, errors = np.where(is_better, better[nearest], best), np.where(is_better, error[nearest], errors)
        slopes = better
    return best, errors


def side_of(name: str, values: Mapping[str, float], direction: float | None) -> float:
    """Return the side of a value (1 or -1) for which a linear model holds.

    The command and the valve opening increase, or decrease from full opening. Angle, pressure 1 and its supply
    increase; the angular velocity changes in the direction of motion; all other values decrease.
    """
    if name == "command":
        return 1.0 if abs(values[name]) < 1.0 else -float(np.sign(values[name]))
    if name in (f"{VALVE}requested", f"{VALVE}opening"):
        return 1.0 if values[name] < 1.0 else -1.0
    if name == "angular_velocity" and direction:
        return direction
    return 1.0 if name in ("pressure_1", "supply_pressure", "angle", "angular_velocity") else -1.0
