"""Plan of a walk as a run of the engine; any number may be an array (runs,), one value for each run."""

import math
from dataclasses import replace
from typing import Any

from ppafo.control.controllers import switching
from ppafo.control.kind import ControllerKind
from ppafo.control.walking.catalog import walking_controllers
from ppafo.control.walking.outside import OUTSIDE
from ppafo.engine.in_python import in_program
from ppafo.engine.rows import of_each
from ppafo.engine.run import Run, Walk, states_at_start
from ppafo.engine.scheme.actuators import filled_chambers, filled_state
from ppafo.model.catalog import ACTUATORS
from ppafo.model.columns import Problem, at, larger, over_runs, smaller
from ppafo.model.elementary import QUARTER_TURN
from ppafo.model.gait import gait_at
from ppafo.model.plant import PlantParameters, PlantState
from ppafo.model.ports import load_torque
from ppafo.model.sensors import GaitSensors
from ppafo.parameters.device import Device
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.plan import TimeGrid, compose_run
from ppafo.simulation.scenario import ProfileChoice, Scenario
from ppafo.walking.declaration import FORCES, WALK_SENSORS
from ppafo.walking.gait_series import gait_series, gait_timing, heel_rocker
from ppafo.walking.motion import walk_of
from ppafo.walking.preparation import (
    HIGHEST_ANGLE,
    LOWEST_ANGLE,
    device_share,
    gait_sensors,
    smallest_chamber,
    walk_from_strike,
    walk_step_counts,
    with_leg,
)
from ppafo.walking.wearer import leg_parameters

NO_REFERENCE = ProfileChoice("constant", {"level": 0.0})
"""Reference of a walk: none, because a walking controller generates its own."""
FASTEST_FOOT = 5.0
"""Angular velocity of the ankle [rad/s] up to which loads must be resolved; it occurs in push-off."""
SMALL_TURN = 0.01
"""Angle difference [rad] for the numerical stiffness of a load."""
TINY = 1.0e-30


def plan_walks(scenario: Scenario) -> tuple[Run, tuple[Problem, ...]]:
    """Return the run of a walk that starts with vented chambers at a heel strike, and its possible problems.

    Numbers of both may be arrays (runs,). All runs of an ensemble must need the same program: each of ``flaws`` is 0
    for all runs or for none.
    """
    motion = walk_of(scenario)
    scenario = replace(scenario, device=fed_device(scenario))
    device = scenario.device
    leg = leg_parameters(motion.wearer, heel_rocker(motion.gait, motion.wearer))
    gait = gait_series(motion.gait)
    timing = gait_timing(motion.gait)
    bare = plant_parameters(device)
    walk = Walk(
        leg=leg,
        share=device_share(bare, leg.gravity),
        gait=gait,
        timing=timing,
        sensors=gait_sensors_of(scenario),
        initial=of_each(lambda leg: walk_from_strike(gait_at(gait, timing, leg, 0.0)), leg),
    )
    now = walk.initial.now
    lines = scenario.supply_lines
    times = scenario.run.duration, scenario.run.step, scenario.run.output_interval, scenario.controller.period

    def steps(plant: PlantParameters) -> TimeGrid:
        """Time grid: steps that resolve the gas, a whole number per sample of the controller."""
        model = ACTUATORS[device.actuator.kind].model
        room = plant.atmospheric_pressure
        chamber = smallest_chamber(
            *(filled_chambers(model, plant, angle, room, room) for angle in (LOWEST_ANGLE, HIGHEST_ANGLE))
        )
        # Lines may be smaller than any chamber, and then fill first.
        volume = chamber if lines is None else smaller(chamber, smaller(lines.volume_1, lines.volume_2))
        return walk_step_counts(*times, plant, volume, scenario.stiffness), False, 1.0

    def start(plant: PlantParameters) -> PlantState:
        """Initial state: both chambers vented."""
        room = plant.atmospheric_pressure
        actuator = ACTUATORS[device.actuator.kind].model
        return filled_state(actuator, plant, now.ankle, now.ankle_rate, room, room)

    run, problems = compose_run(
        scenario,
        with_leg(bare, leg),
        steps,
        start,
        walk,
    )
    return run, (*problems, *stiff_loads(run))


def stiff_loads(run: Run) -> tuple[Problem, ...]:
    """Return the problems of loads at the joint that change too much within the fixed step of a walk.

    A step uses the load predicted at its end. The prediction converges if within a step the drag reduces the speed of
    the foot by less than twice this speed, and if a spring advances its oscillation by less than 1 rad.
    """
    program = run.program
    inertia = run.plant.inertia
    if all(load_torque not in effect.laws for effect in program.effects):
        return ()

    def growths(*rows: Any) -> tuple[float, float]:
        count = len(program.effects)
        taken = in_program(load_torque, program, rows[:count])
        states = dict(zip(program.effect_states, rows[count:], strict=True))
        at_rates = [taken(states, 0.0, QUARTER_TURN, share * FASTEST_FOOT) for share in (-1.0, -0.99, 0.99, 1.0)]
        at_angles = [taken(states, 0.0, QUARTER_TURN + turned, 0.0) for turned in (-SMALL_TURN, SMALL_TURN)]
        damping = max(at_rates[1] - at_rates[0], at_rates[3] - at_rates[2]) / (0.01 * FASTEST_FOOT)
        return damping, (at_angles[1] - at_angles[0]) / (2.0 * SMALL_TURN)

    damping, stiffness = of_each(growths, *run.effects, *states_at_start(run))
    dragged = 2.0 * inertia / larger(damping, TINY)
    sprung = over_runs(math.sqrt, inertia / larger(stiffness, TINY))
    longest = smaller(dragged, sprung)
    names = ", ".join(f"effects.{effect.name}" for effect in program.effects if load_torque in effect.laws)

    def line(number: int) -> str:
        step = at(run.step, number)
        most = at(longest, number)
        cause = (
            f"drag of {at(damping, number):.3g} N m s/rad at {FASTEST_FOOT:g} rad/s"
            if at(dragged, number) < at(sprung, number)
            else f"stiffness of {at(stiffness, number):.3g} N m/rad"
        )
        return (
            f"{names}: a {cause} needs steps of at most {1.0e3 * most:.2g} ms, but a walk has fixed steps of "
            f"{1.0e3 * step:.3g} ms: set run.step = {0.5e3 * most:.2g} ms"
        )

    return ((run.step > longest, line),)


def gait_sensors_of(scenario: Scenario) -> GaitSensors:
    """Return the sensors of a walk at the sample period of the controller."""
    numbers = sensor_numbers(scenario)

    def made(period: float, *values: float) -> GaitSensors:
        return gait_sensors(dict(zip(numbers, values, strict=True)), period)

    return over_runs(made, scenario.controller.period, *numbers.values())


def sensor_numbers(scenario: Scenario) -> dict[str, Any]:
    """Return the sensor settings of a walk in SI units, by name; each may be an array (runs,)."""
    shared = (quantity.name for quantity in WALK_SENSORS if quantity.name not in FORCES)
    return {**{name: getattr(scenario.sensors, name) for name in shared}, **walk_of(scenario).forces}


def flaws(scenario: Scenario) -> tuple[Any, ...]:
    """Return the delay, and the imperfections of the sensors of a walk; 0 for an ideal sensor.

    Each must be 0 for all runs of a program or for none. The bandwidth of the force sensors is not included, because
    every walk has it.
    """
    numbers = sensor_numbers(scenario).items()
    return scenario.sensors.delay, *(number for name, number in numbers if name != "force_bandwidth")


def law_of(scenario: Scenario) -> ControllerKind:
    """Return the controller of a walk; for an object of Python, the frame that requests torques of it.

    The controller with a constant command occurs only in an exported plant, not in a walk file.
    """
    if scenario.controller.is_outside:
        return OUTSIDE
    if scenario.controller.kind == switching.CONSTANT.name:
        return switching.CONSTANT
    return walking_controllers()[scenario.controller.kind]


def requests_torque(law: ControllerKind) -> bool:
    """Return True if a walking controller requests a torque, False if it only switches valves."""
    return hasattr(law.initial, "request")


def fed_device(scenario: Scenario) -> Device:
    """Return the device with the gas temperature of its supply at the start, which is low for a bottle."""
    bottle = walk_of(scenario).bottle
    device = scenario.device
    if bottle is None:
        return device
    return replace(device, gas=replace(device.gas, temperature=bottle.offers_first().gas_temperature))
