"""From a scenario to a run: step sizes, rows of parameters, initial gas."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.kind import ControllerKind, ProfileKind
from ppafo.engine.program import NoParameters, Program
from ppafo.engine.reference.derivative import ExactOrifice
from ppafo.engine.refinement import is_slow
from ppafo.engine.rows import rebuilt
from ppafo.engine.run import Run
from ppafo.errors import ScenarioError
from ppafo.model.chambers import chamber_mass
from ppafo.model.columns import at, first, larger, over_runs, smaller, whole
from ppafo.model.plant import PlantParameters, PlantState, ThermalParameters, chamber_volumes
from ppafo.model.sensors import SensorParameters, SensorRates
from ppafo.model.thermal import wall_exchange
from ppafo.model.valves.catalog import VALVES
from ppafo.model.valves.kind import ValveModel
from ppafo.parameters.device import Device, Orifice, SonicOrifice
from ppafo.parameters.plant import orifice_conductance, plant_parameters
from ppafo.simulation.scenario import PYTHON_CONTROLLER, FreeMotion, LedMotion, ProfileChoice, Scenario

MOST_STEPS = 1.0e9
WHOLE = 1.0e-9

Problem = tuple[Any, Callable[[int], str]]
"""What may be wrong with a run: a truth value, or an array of them (runs,), and the line about one of the runs."""


def plan_run(scenario: Scenario) -> Run:
    """The run of a scenario; with a Python controller it records every step, because that controller needs the past."""
    run, problems = plan_runs(scenario)
    for is_bad, line in problems:
        if is_bad:
            raise ScenarioError(f"{scenario.name}: {line(0)}")
    return run


def plan_runs(scenario: Scenario) -> tuple[Run, tuple[Problem, ...]]:
    """The run of a scenario, and what may be wrong with it; any number in both may be an array (runs,).

    All runs of an ensemble must ask for one program: of a valve's and the sensors' settings, each is 0 for all or none.
    """
    device, motion, control = scenario.device, scenario.motion, scenario.control
    plant = plant_parameters(device, motion.external_torque if isinstance(motion, FreeMotion) else 0.0)
    settings = device.valve.settings
    valve = VALVES[device.valve.kind].choose({name: first(value) for name, value in settings.items()})
    delay = valve.command_delay(settings)
    in_lanes = control.kind != PYTHON_CONTROLLER
    controller = CONTROLLERS[control.kind] if in_lanes else None
    steps_per_sample = larger(1, whole(np.ceil(scenario.control.period / scenario.time_step - WHOLE)))
    step = scenario.control.period / steps_per_sample
    needs_parts = is_adaptive(scenario, plant, step)
    record_every = nearly_whole(scenario.output_interval / step)
    program = Program(
        valve=valve,
        reference=PROFILES[scenario.reference.kind],
        controller=controller,
        angle=None if isinstance(motion, FreeMotion) else PROFILES[motion.profile.kind],
        ideal_sensors=has_ideal_sensors(scenario),
        late_commands=first(delay) > 0.0,
        late_signals=first(scenario.sensors.delay) > 0.0,
        is_thermal=scenario.thermal is not None,
        slow_sensors=any(first(bandwidth) > 0.0 for bandwidth in scenario.sensors.bandwidths),
        is_adaptive=bool(first(needs_parts)),
        samples_inside=bool(first(record_every % 1.0)),
    )
    step_count = whole(np.ceil(scenario.duration / step - WHOLE))
    run = Run(
        program=program,
        plant=plant,
        thermal=thermal_parameters(scenario),
        valve_orifice=exact_orifice(device.valve.orifice, device),
        leak_orifice=exact_orifice(device.actuator.leak, device),
        initial=initial_state(scenario, plant),
        valve=prepared_valve(valve, settings),
        controller=() if controller is None else controller_parameters(controller, control.settings),
        reference=profile_parameters(scenario.reference),
        path=() if isinstance(motion, FreeMotion) else profile_parameters(motion.profile),
        sensors=sensor_parameters(scenario),
        step=step,
        step_count=step_count,
        steps_per_sample=steps_per_sample,
        record_every=record_every,
        signal_delay=scenario.sensors.delay,
        command_delay=delay,
        needs_parts=needs_parts,
        sensor_rates=sensor_rates(scenario) if program.slow_sensors else NoParameters(),
    )
    return run, (_too_many_steps(scenario, step, step_count),)


def prepared_valve(valve: ValveModel, settings: Mapping[str, float]) -> Any:
    """Parameters of a valve; settings may be arrays (runs,)."""

    def prepare(*values: float) -> Any:
        return valve.prepare(dict(zip(settings, values, strict=True)))

    return over_runs(prepare, *settings.values())


def _too_many_steps(scenario: Scenario, step: float, step_count: int) -> Problem:
    def line(run: int) -> str:
        duration, length, count = (at(number, run) for number in (scenario.duration, step, step_count))
        return (
            f"run.duration = {duration:.6g} s takes {count:.3g} steps of {length:.3g} s, at most {MOST_STEPS:.0e} are "
            "allowed: shorten the run or take a larger run.step"
        )

    return step_count > MOST_STEPS, line


def thermal_parameters(scenario: Scenario) -> ThermalParameters | NoParameters:
    """How the gas takes up heat, where it has an energy balance."""
    if scenario.thermal is None:
        return NoParameters()
    gas, walls = scenario.device.gas, scenario.thermal
    exchange = wall_exchange(
        walls.heat_transfer_coefficient, walls.area_per_volume, gas.heat_capacity_ratio, gas.specific_gas_constant
    )
    return ThermalParameters(gas.heat_capacity_ratio, exchange)


def has_ideal_sensors(scenario: Scenario) -> bool:
    """True where the controller sees what is there, without noise or rounding."""
    return not any(first(flaw) for flaw in scenario.sensors.flaws[1:])


def sensor_parameters(scenario: Scenario) -> SensorParameters:
    """Noise and quantisation as the engine takes them."""
    sensors = scenario.sensors
    return SensorParameters(
        sensors.angle_noise,
        sensors.pressure_noise,
        sensors.angle_quantum,
        sensors.pressure_quantum,
        sensors.seed,
    )


def sensor_rates(scenario: Scenario) -> SensorRates:
    """How fast the sensors follow; bandwidths may be arrays (runs,)."""
    return SensorRates(*(2.0 * math.pi * bandwidth for bandwidth in scenario.sensors.bandwidths))


def controller_parameters(kind: ControllerKind, settings: Mapping[str, Any]) -> Any:
    """The NamedTuple of a controller, nested ones filled in the order of its quantities; settings may be arrays."""
    return rebuilt(kind.parameters, [settings[item.name] for item in kind.quantities])


def profile_parameters(choice: ProfileChoice) -> tuple[float, ...]:
    """The NamedTuple of a profile."""
    parameters: tuple[float, ...] = PROFILES[choice.kind].parameters(**choice.settings)
    return parameters


def profile_values(choice: ProfileChoice, times: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> np.ndarray:
    """Value, rate and second derivative of a profile at times [s], shape (3, times)."""
    kind: ProfileKind = PROFILES[choice.kind]
    parameters = profile_parameters(choice)
    return np.array([kind.value(parameters, float(time)) for time in times]).T


def is_adaptive(scenario: Scenario, plant: PlantParameters, step: float) -> Any:
    """True where the error decides about the parts of a step [s]; not where a held vane's chambers are slow enough.

    For arrays (runs,) in the scenario an array of truth values.
    """
    if not isinstance(scenario.motion, LedMotion) or scenario.motion.profile.kind != "constant":
        return True
    lowest, highest = angle_range(scenario, plant)
    stiffness = 1.0 if scenario.thermal is None else scenario.device.gas.heat_capacity_ratio
    return np.logical_not(is_slow(plant, step, lowest, highest, stiffness))


def nearly_whole(steps: Any) -> Any:
    """A number of steps, or an array (runs,) of them, to the whole number where it is one to rounding."""
    counted = np.rint(steps)
    count = np.where(np.abs(steps - counted) <= WHOLE * steps, counted, steps)
    return count if isinstance(steps, np.ndarray) else float(count)


def angle_range(scenario: Scenario, plant: PlantParameters) -> tuple[float, float]:
    """Smallest and largest angle [rad] that the vane can reach in this scenario."""
    if isinstance(scenario.motion, FreeMotion):
        return plant.angle_min, plant.angle_max
    lowest, highest = profile_bounds(scenario.motion.profile)
    return larger(lowest, plant.angle_min), smaller(highest, plant.angle_max)


def profile_bounds(choice: ProfileChoice) -> tuple[float, float]:
    """Lowest and highest value of a profile."""
    kind = PROFILES[choice.kind]
    lowest, highest = over_runs(lambda *values: kind.bounds(kind.parameters(*values)), *profile_parameters(choice))
    return lowest, highest


def initial_state(scenario: Scenario, plant: PlantParameters) -> PlantState:
    """Angle, angular velocity and gas at the start."""
    motion = scenario.motion
    if isinstance(motion, FreeMotion):
        angle, rate = motion.angle, motion.angular_velocity
    else:
        kind, parameters = PROFILES[motion.profile.kind], profile_parameters(motion.profile)
        angle, rate, _ = over_runs(lambda *values: kind.value(kind.parameters(*values), 0.0), *parameters)
    volume_1, volume_2 = chamber_volumes(plant, angle)
    mass_1 = chamber_mass(scenario.initial_pressure_1, volume_1, plant.gas_product)
    mass_2 = chamber_mass(scenario.initial_pressure_2, volume_2, plant.gas_product)
    return PlantState(angle, rate, mass_1, mass_2, 0.0, 0.0, 0.0)


def exact_orifice(orifice: Orifice | SonicOrifice, device: Device) -> ExactOrifice:
    """An orifice for the reference solver, with the exact flow function."""
    conductance = orifice_conductance(orifice, device.gas)
    if isinstance(orifice, SonicOrifice):
        return ExactOrifice(conductance, 1.0, orifice.critical_ratio, device.flow.linear_ratio)
    return ExactOrifice(conductance, 0.0, device.gas.heat_capacity_ratio, device.flow.linear_ratio)
