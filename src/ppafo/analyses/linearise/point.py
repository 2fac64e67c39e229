"""Operating point of a linear model: an instant of a run, or the steady state of a scenario."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.analyses.linearise.plant import (
    DRIVEN,
    VALVE,
    functions_in,
    one_sided_slopes,
    plant_of,
    side_of,
    size_of,
    valve_at,
    valve_states,
    without_slew_limit,
)
from ppafo.control.profiles import CONSTANT
from ppafo.engine.continuous_time import mode_at_rest, torque_at_rest
from ppafo.engine.in_python import in_program
from ppafo.engine.lanes import Floats, run_batch
from ppafo.engine.rows import numbers
from ppafo.engine.run import NEVER_FAILED, Run, batch_of, state_row_numbers
from ppafo.engine.scheme.actuators import pressures_of
from ppafo.errors import ScenarioError, SimulationError
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE, ControlledQuantity
from ppafo.model.plant import ThermalParameters
from ppafo.model.ports import friction_at_rest
from ppafo.report.kind import of_path
from ppafo.simulation.plan import plan_run
from ppafo.simulation.profiles import profile_values
from ppafo.simulation.python_controller import run_sampled
from ppafo.simulation.scenario import Scenario
from ppafo.wording import argument_text

STEADY = 1.0e-9
"""Largest time derivative divided by the size of the state [1/s] that counts as zero."""
_FIRST_COMMANDS = (0.01, 0.1, 0.003, 0.03, 0.3, 1.0)
"""Magnitudes of the command [-] from which the search for the steady state starts."""
_MOST_STEPS = 60


@dataclass(frozen=True, slots=True)
class Point:
    """Operating point of a plant: values of all states and inputs.

    ``time``: time [s] in the run; None for a steady state
    ``values``: all states and inputs by name [SI]
    ``direction``: direction of a free vane, 0 if friction or a stop holds it; None if the ankle is prescribed
    """

    time: float | None
    values: Mapping[str, float]
    direction: float | None


def point_at(scenario: Scenario, time: float) -> Point:
    """Return the operating point of a scenario's run at a time [s], rounded to the nearest step.

    Raises ScenarioError for a time outside the run.
    """
    # Allowance for rounding: the end of the run itself is a valid time.
    if not 0.0 <= time <= scenario.run.duration * (1.0 + 1.0e-12):
        raise ScenarioError(
            f"{scenario.name}: {argument_text('at', f'{time:g} s')} is outside the run, which lasts "
            f"{scenario.run.duration:g} s"
        )
    run = plan_run(scenario)
    steps = min(round(time / run.step), run.step_count)
    return Point(steps * run.step, *_after(scenario, run, steps))


def _after(scenario: Scenario, run: Run, steps: int) -> tuple[dict[str, float], float | None]:
    """Return the states and inputs after a number of steps of a run, and the direction of the vane."""
    batch = batch_of(replace(run, step_count=steps))
    custom = scenario.controller.custom
    outcome = run_batch(batch) if custom is None else run_sampled(batch, custom)
    rows = {name: float(outcome.states[row, 0]) for name, row in state_row_numbers(run).items()}
    if rows["result.failure_time"] < NEVER_FAILED or not all(map(np.isfinite, rows.values())):
        raise SimulationError(
            f"{scenario.name}: the run diverges before {steps * run.step:g} s; give an earlier {argument_text('at')}, "
            "or see the cause with 'ppafo simulate'"
        )
    angle, rate = rows["state.angle"], rows["state.angular_velocity"]
    if run.program.angle is not None:
        angle, rate, _ = run.program.angle.value(run.path, steps * run.step)
    pressure_1, pressure_2 = pressures_of(
        run.program.actuator, run.plant, angle, rows["state.mass_1"], rows["state.mass_2"]
    )
    values = {"angle": angle, "angular_velocity": rate, "command": rows["result.command"]}
    values |= {"pressure_1": float(pressure_1), "pressure_2": float(pressure_2)}
    values |= {name: float(getattr(run.plant, name)) for name in DRIVEN}
    values |= {name: rows[path] for name, path in valve_states(run.program).items()}
    if isinstance(run.thermal, ThermalParameters):
        warm = [rows[f"state.mass_{side}"] / rows[f"masses.mass_{side}"] for side in (1, 2)]
        values |= {f"temperature_{side}": run.thermal.temperature * warm[side - 1] for side in (1, 2)}
    return values, _direction(run, values, steps * run.step)


def _direction(run: Run, values: Mapping[str, float], time: float) -> float | None:
    """Direction of a free vane at a time [s], 0 if it is stuck; None if the ankle is prescribed."""
    if run.program.angle is not None:
        return None
    rate, angle = values["angular_velocity"], values["angle"]
    if rate != 0.0:
        return 1.0 if rate > 0.0 else -1.0
    limit, plant = in_program(friction_at_rest, run.program, run.effects), run.plant
    pressures = values["pressure_1"], values["pressure_2"]
    plant = plant._replace(static_torque=limit({}, plant.static_torque, *pressures))
    return mode_at_rest(plant, angle, torque_at_rest(run)({}, time, angle, *pressures))


def equilibrium(scenario: Scenario) -> Point:
    """Return the steady state of a scenario; ScenarioError if there is none.

    The ankle rests at its angle at the end of the run, and all states of chambers and valve are constant. The actuator
    torque, or the pressure that is controlled, is the last value of the reference; for a constant command, the command
    is given instead.
    """
    planned, give_a_time = plan_run(scenario), f"give a time of the run, such as {argument_text('at', '1 s')}"
    if planned.leg is not None and planned.program.shank is not CONSTANT:
        raise ScenarioError(f"{scenario.name}: there is no equilibrium while the shank moves; {give_a_time}")
    values, _ = _after(scenario, planned, planned.step_count)
    values["angular_velocity"] = 0.0
    is_open_loop, quantity = scenario.controller.is_open_loop, CONTROLLED[scenario.controlled]
    if quantity.name == ANGLE and not is_open_loop:
        raise ScenarioError(
            f"{scenario.name}: reference.of = '{ANGLE}': an equilibrium needs a reference of torque or pressure; "
            f"{give_a_time}"
        )
    end = np.array([scenario.run.duration])
    level = None if is_open_loop else float(profile_values(scenario.reference, end)[0][0])
    run = without_slew_limit(planned)
    rest = None if run.program.angle is not None else 0.0
    steady = _steady(run, rest, values, quantity, level)
    if steady is None:
        if level is None:
            raise ScenarioError(
                f"{scenario.name}: no equilibrium was found for the command {values['command']:g}; {give_a_time}"
            )
        kind = of_path("reference.level", quantity.level.unit, ".4g")
        reached = ""
        full = 1.0 if (level > 0.0) != scenario.device.supply.is_vacuum else -1.0
        fully_open = values | dict.fromkeys(("command", *opening_names(values)), full)
        most = _steady(run, rest, fully_open, quantity, None)
        if most is not None and quantity.name == TORQUE:
            most_torque = run.program.actuator.torque(run.plant, most["angle"], most["pressure_1"], most["pressure_2"])
            reached = f": with the valve fully open the actuator reaches {most_torque:.4g} N m"
        remedy = " or hold the ankle" if rest is not None else ""
        raise ScenarioError(
            f"{scenario.name}: there is no equilibrium at {kind.text(level)}, the last value of the "
            f"reference{reached}; set another reference{remedy}, or {give_a_time}"
        )
    direction = _direction(run, steady, scenario.run.duration)
    if direction:
        raise ScenarioError(
            f"{scenario.name}: there is no equilibrium, because the torque accelerates the vane at "
            f"{np.degrees(values['angle']):.4g} deg; {give_a_time}, or another reference"
        )
    # A valve that is closed but for rounding is closed.
    steady |= {name: 0.0 for name in ("command", *opening_names(steady)) if abs(steady[name]) < STEADY}
    # What the valve takes from its command at once was no unknown.
    at_rest = numbers(valve_at(run, functions_in(run), steady).state)
    return Point(None, steady | dict(zip(valve_states(run.program), at_rest, strict=True)), direction)


def _steady(
    run: Run,
    direction: float | None,
    values: Mapping[str, float],
    quantity: ControlledQuantity,
    level: float | None,
) -> dict[str, float] | None:
    """Return a steady state at a level of a quantity [SI], or at the present command; None if the search fails."""
    # Where the search begins: at the end of the run, then about the pressures that have the level.
    starts = [dict(values)]
    lowest = run.plant.atmospheric_pressure
    target = (level or 0.0) - (lowest if quantity.level.unit == "Pa_a" and level is not None else 0.0)
    surplus = abs(target) / (run.plant.torque_constant if quantity.name == TORQUE else 1.0)
    for size in _FIRST_COMMANDS:
        command = values["command"] if level is None else size if target * quantity.sign >= 0.0 else -size
        pressures = [1.001 * lowest + (surplus if is_fed else 0.0) for is_fed in (command > 0.0, command < 0.0)]
        start = {"pressure_1": pressures[0], "pressure_2": pressures[1], "command": command}
        starts.append({**values, **start, **dict.fromkeys(opening_names(values), command)})
    plant = plant_of(run, direction, values)
    # The unknowns are all states, and the command if a level is given.
    names = [*plant.at(values)[0], *([] if level is None else ["command"])]

    def imbalance(values: Mapping[str, float]) -> Floats:
        """Return time derivatives relative to the size of the states [1/s], and relative error of the level [-]."""
        rates_by_name, outputs = plant.at(values)
        # So that pascals and openings count alike.
        rates = [rate / size_of(name) for name, rate in rates_by_name.items()]
        if level is None:
            return np.array(rates)
        reached = quantity.value(values["angle"], values["pressure_1"], values["pressure_2"], outputs["torque"])
        return np.array([*rates, (reached - level) / quantity.size])

    roots = (_newton(imbalance, names, start) for start in starts)
    return next((root for root in roots if root is not None), None)


def opening_names(values: Mapping[str, float]) -> list[str]:
    """Return the names of the valve openings among named values."""
    return [name for name in values if name in (f"{VALVE}requested", f"{VALVE}opening")]


def _newton(
    function: Callable[[Mapping[str, float]], Floats], names: Sequence[str], start: Mapping[str, float]
) -> dict[str, float] | None:
    """Return a root of a function, found by Newton's method with damped steps; None if the search fails."""
    sizes = np.array([size_of(name) for name in names])
    values = dict(start)
    residual = function(values)

    def slopes_of(name: str) -> Floats:
        """Return the slopes of the function with respect to a named value (rows,)."""
        side, size = side_of(name, values, None), size_of(name)
        return one_sided_slopes(lambda value: function({**values, name: value}), values[name], side, size)[0]

    for _ in range(_MOST_STEPS):
        largest = float(np.max(np.abs(residual)))
        if largest < STEADY:
            return values if abs(values["command"]) <= 1.0 + STEADY else None
        slopes = np.array([slopes_of(name) for name in names]).T
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
            residual = function(moved)
            if np.isfinite(residual).all() and float(np.max(np.abs(residual))) < largest:
                break
            share *= 0.5
        else:
            return None
        values = moved
    return None
