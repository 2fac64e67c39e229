"""Plan of a run, for a scenario or a walk: step sizes, rows of parameters, initial gas.

The formulas are pure functions of one run or of columns of runs: Python plans with them, and an exported library has
them in C.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from ppafo.control.catalog import PROFILES
from ppafo.control.kind import ProfileKind
from ppafo.engine.program import Program
from ppafo.engine.rows import rebuilt
from ppafo.engine.run import LedLeg, Lines, Run, Walk
from ppafo.engine.scheme.actuators import filled_chambers, filled_state
from ppafo.engine.scheme.pneumatics import KEPT_OF_PRESSURE, is_slow
from ppafo.errors import ScenarioError
from ppafo.model.binding import made_of
from ppafo.model.catalog import ACTUATORS, VALVES
from ppafo.model.columns import Problem, at, choose, first, larger, over_runs, rounded_up, smaller, truncated, whole
from ppafo.model.controlled import OF_TORQUE, TORQUE, error_functions
from ppafo.model.declaration import EmptyRow
from ppafo.model.gas import wall_exchange
from ppafo.model.plant import PlantParameters, PlantState, ThermalParameters
from ppafo.model.sensors import SensorParameters
from ppafo.parameters.device import Gas
from ppafo.parameters.effects import effect_rows, effects_of
from ppafo.parameters.plant import first_settings, plant_parameters, valve_settings, venting_valve
from ppafo.simulation.clock import MAXIMUM_STEPS
from ppafo.simulation.profiles import of_profile, profile_bounds, profile_parameters
from ppafo.simulation.scenario import GasModel, Scenario, vane_motion

WHOLE = 1.0e-9
"""Relative difference up to which a number of steps counts as an integer."""


def plan_run(scenario: Scenario) -> Run:
    """Planned run of a scenario; with a Python controller it records every step, because delayed signals need the past.

    Raises ScenarioError for too many steps.
    """
    run, problems = scenario.motion.motion_kind.plan(scenario)
    for is_bad, line in problems:
        if is_bad:
            raise ScenarioError(f"{scenario.name}: {line(0)}")
    return run


@dataclass(frozen=True, slots=True)
class CarriedLeg:
    """Leg on a free vane: profile of its shank, and a function that adds the leg to a plant.

    ``put_on(plant)`` returns the plant with the foot's load and the leg as the engine takes it.
    """

    shank: ProfileKind
    put_on: Callable[[PlantParameters], "tuple[PlantParameters, LedLeg]"]


class StepCounts(NamedTuple):
    """Step length [s], number of steps, and steps per controller sample and per recorded sample [-]."""

    step: float
    step_count: float
    steps_per_sample: float
    record_every: float


TimeGrid = tuple[StepCounts, Any, Any]
"""Step counts, whether error control divides steps into parts, and the allowed error over the default one [-]."""


def compose_run(
    scenario: Scenario,
    plant: PlantParameters,
    time_grid_of: Callable[[PlantParameters], TimeGrid],
    initial_state_of: Callable[[PlantParameters], PlantState],
    walk: Walk | None = None,
    leg: CarriedLeg | None = None,
) -> tuple[Run, tuple[Problem, ...]]:
    """Assemble the run of a scenario or a walk, with its possible problems.

    Every controller, valve, motion, gas and supply can be combined. ``time_grid_of`` gives the time grid and
    ``initial_state_of`` the initial state, both of the plant with lines and leg; ``plant`` is the plant without them.
    ``walk`` is a walking leg, ``leg`` one without ground contact.
    """
    device = scenario.device
    control = scenario.controller
    supply_lines = scenario.supply_lines
    # Where no torque is requested, an object in charge is asked between the steps of a program without a law.
    law = None if control.is_outside and not control.settings else scenario.motion.motion_kind.law(scenario)
    numbers: Mapping[str, Any] = control.settings
    problems: tuple[Problem, ...] = ()
    # A fixed-point controller has integers, which follow from its gains, its period and the range of its reference.
    if law is not None and law.plan is not None:
        bounds = profile_bounds(scenario.reference)
        numbers, problems = law.plan(numbers, control.period, plant.torque_constant, bounds)
    controller: Any = ()
    if law is not None:
        # The numbers that a plan made have no settings of their names; they come in the order of the law's parameters.
        names = numbers if law.plan is not None else [quantity.name for quantity in law.quantities]
        controller = rebuilt(law.parameters, [numbers[name] for name in names])
        errors = error_functions(scenario.controlled, device.supply.is_vacuum)
        if law.controls != (TORQUE,) and errors != OF_TORQUE:
            law = replace(law, update=made_of(law.update, law.update.__name__, errors))
    # Lines take back what a chamber pushes out, whether or not their regulators do.
    plant = plant if supply_lines is None else plant._replace(relieving=1.0)
    plant, led = (plant, None) if leg is None else leg.put_on(plant)
    counts, needs_parts, tolerance = time_grid_of(plant)
    settings = valve_settings(device.valve)
    model = VALVES[device.valve.kind].choose(first_settings(device.valve))
    valve = model if walk is None else venting_valve(device.valve)
    delay = valve.command_delay(settings)
    signal_delay = scenario.sensors.delay
    path = None if walk is not None else vane_motion(scenario).profile
    sections = {} if walk is not None else {"sensors": scenario.sensors}
    feed: ModuleType | None = None
    foot: ModuleType | None = None
    walking: ModuleType | None = None
    # Most runs have neither lines nor a leg, and keep their temperature.
    lines = None
    if supply_lines is not None:
        from ppafo.engine.step import lines as feed
        from ppafo.model.regulator import lines_at_start

        lines = Lines(supply_lines, lines_at_start(plant, supply_lines))
    if leg is not None:
        from ppafo.engine.step import foot
    if walk is not None:
        from ppafo.engine.step import walk as walking
    program = Program(
        actuator=ACTUATORS[device.actuator.kind].model,
        valve=valve,
        reference=PROFILES[scenario.reference.kind],
        controller=law,
        angle=None if path is None else PROFILES[path.kind],
        # A delay alone leaves the sensors ideal: the lanes then read an earlier state.
        ideal_sensors=not any(first(flaw) for flaw in scenario.motion.motion_kind.flaws(scenario)[1:]),
        # Of the first run, for all runs of one program have a delay or none has.
        late_commands=first(delay) > 0.0,
        late_signals=first(signal_delay) > 0.0,
        is_thermal=scenario.gas_model is not None,
        leg=walking,
        feed=feed,
        is_adaptive=bool(first(needs_parts)),
        # A broken number of steps to a sample puts samples inside steps.
        samples_inside=bool(first(counts.record_every % 1.0)),
        effects=effects_of(device, sections),
        shank=None if leg is None else leg.shank,
        foot=foot,
        controlled=scenario.controlled,
        has_one_chamber=device.actuator.has_one_chamber,
    )
    run = Run(
        program=program,
        plant=plant,
        thermal=EmptyRow() if scenario.gas_model is None else thermal_gas(scenario.gas_model, device.gas),
        initial=initial_state_of(plant),
        valve=over_runs(lambda *values: valve.prepare(type(settings)(*values)), *settings),
        controller=controller,
        reference=profile_parameters(scenario.reference),
        path=() if path is None else profile_parameters(path),
        # Noise and quantisation of the sensors as the engine takes them.
        sensors=SensorParameters(*(getattr(scenario.sensors, name) for name in SensorParameters._fields)),
        step=counts.step,
        step_count=whole(counts.step_count),
        steps_per_sample=whole(counts.steps_per_sample),
        record_every=counts.record_every,
        signal_delay=signal_delay,
        command_delay=delay,
        needs_parts=needs_parts,
        tolerance=tolerance,
        walk=walk,
        lines=lines,
        effects=effect_rows(device, sections),
        leg=led,
    )

    def too_many_steps(of_run: int) -> str:
        duration, length, count = (at(each, of_run) for each in (scenario.run.duration, run.step, run.step_count))
        return (
            f"run.duration = {duration:.6g} s takes {count:.3g} steps of {length:.3g} s, at most {MAXIMUM_STEPS:.0e} "
            "are allowed: shorten the run or increase run.step"
        )

    return run, ((run.step_count > MAXIMUM_STEPS, too_many_steps), *problems)


def plan_vane(scenario: Scenario, leg: CarriedLeg | None = None) -> tuple[Run, tuple[Problem, ...]]:
    """Return the planned run of a scenario without walking, and its possible problems; ``leg`` adds a foot in the air.

    Numbers may be arrays (runs,) of an ensemble of one program: each setting of the valve and the sensors is then
    either 0 for all runs or nonzero for all.
    """
    return compose_run(
        scenario,
        plant_parameters(scenario.device, vane_motion(scenario).outside_torque),
        time_grid_of=lambda whole_plant: time_grid(scenario, whole_plant),
        initial_state_of=lambda whole_plant: initial_state(scenario, whole_plant),
        leg=leg,
    )


def time_grid(scenario: Scenario, plant: PlantParameters) -> TimeGrid:
    """Time grid of a scenario: the largest step that divides the sample period, divided into parts by error control."""
    counts = step_counts(
        scenario.run.duration, scenario.run.step, scenario.run.output_interval, scenario.controller.period
    )
    tolerance = relative_tolerance(scenario.run.tolerance)
    # The error decides about the parts of a step, but for a locked joint whose chambers no pressure widens, and which
    # are slow enough for plain steps.
    model = ACTUATORS[scenario.device.actuator.kind].model
    device = scenario.device
    regulates = VALVES[device.valve.kind].regulation is not None
    is_alone = scenario.supply_lines is None and not (model.gives or regulates)
    angle = vane_motion(scenario).locked_angle if is_alone else None
    if angle is None:
        return counts, True, tolerance
    # A stricter tolerance counts as a longer step; a looser one as the default.
    step = counts.step / smaller(1.0, tolerance)
    locked_angle = smaller(larger(angle, plant.angle_min), plant.angle_max)
    room = plant.atmospheric_pressure
    volumes = filled_chambers(model, plant, locked_angle, room, room)[:2]
    return counts, np.logical_not(is_slow(plant, step, *volumes, scenario.stiffness)), tolerance


def relative_tolerance(tolerance: float) -> float:
    """Allowed pressure error divided by the default allowed error [-], from ``run.tolerance`` [-]."""
    return tolerance / KEPT_OF_PRESSURE


def initial_state(scenario: Scenario, plant: PlantParameters) -> PlantState:
    """Initial angle, angular velocity and gas."""
    motion = vane_motion(scenario)
    if motion.profile is None:
        angle = motion.angle
        rate = motion.angular_velocity
    else:
        value = PROFILES[motion.profile.kind].value
        angle, rate, _ = of_profile(lambda numbers: value(numbers, 0.0), motion.profile)
    pressures = scenario.initial.pressure_1, scenario.initial.pressure_2
    model = ACTUATORS[scenario.device.actuator.kind].model
    return filled_state(model, plant, angle, rate, *pressures)


def step_counts(duration: float, time_step: float, output_interval: float, period: float) -> StepCounts:
    """Largest steps that divide the sample period of the controller and do not exceed ``time_step``; all times in s."""
    # WHOLE off first: a quotient that rounding put above a whole number would cost one more step.
    steps_per_sample = larger(1.0, rounded_up(period / time_step - WHOLE))
    step = period / steps_per_sample
    # An integer if it differs from one only by rounding.
    recorded = output_interval / step
    nearest = truncated(recorded + 0.5)
    return StepCounts(
        step=step,
        step_count=rounded_up(duration / step - WHOLE),
        steps_per_sample=steps_per_sample,
        record_every=choose(abs(recorded - nearest) <= WHOLE * recorded, nearest, recorded),
    )


def thermal_gas(walls: GasModel, gas: Gas) -> ThermalParameters:
    """Parameters of a gas with an energy balance and heat exchange with the walls."""
    exchange = wall_exchange(
        walls.heat_transfer_coefficient, walls.wall_area_per_volume, gas.heat_capacity_ratio, gas.specific_gas_constant
    )
    return ThermalParameters(
        heat_capacity_ratio=gas.heat_capacity_ratio, wall_exchange=exchange, temperature=gas.temperature
    )
