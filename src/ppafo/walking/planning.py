"""From a wearer, a gait, a device and a controller to a run of the engine."""

import math
from dataclasses import dataclass

from ppafo.control.kind import ControllerKind
from ppafo.engine.refinement import filling_time
from ppafo.engine.run import Run, Walk
from ppafo.engine.scheme.ankle_torque import DeviceShare, foot_direction
from ppafo.engine.scheme.walking import NO_CLEARANCE, WalkState
from ppafo.gait import Gait
from ppafo.model.chambers import chamber_mass
from ppafo.model.contact import FLAT, HEEL
from ppafo.model.gait import gait_at
from ppafo.model.gait_sensors import Fault, GaitSensors
from ppafo.model.leg import LegParameters, foot_inertia_about_ankle
from ppafo.model.plant import PlantParameters, PlantState, chamber_volumes
from ppafo.model.regulator import SupplyLines
from ppafo.model.sensors import SensorParameters
from ppafo.model.valves import dump
from ppafo.model.valves.catalog import VALVES
from ppafo.model.valves.kind import ValveModel
from ppafo.parameters.device import Device, Valve
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.plan import Pieces, Steps, compose_run
from ppafo.simulation.scenario import ProfileChoice, Thermal
from ppafo.walking.configuration import Configuration
from ppafo.walking.course import WalkingCourse
from ppafo.walking.course_planning import PlannedCourse, plan_course, standing_gait
from ppafo.walking.gait_series import gait_series, gait_timing, strike_angle
from ppafo.walking.heel_rocker import heel_rocker
from ppafo.walking.wearer import Wearer

ANGLES = (math.radians(60.0), math.radians(115.0))
"""Angles that the ankle keeps to in walking; the step is made for the chambers between them."""

NO_REFERENCE = ProfileChoice("constant", {"level": 0.0})
"""A controller of walking makes its own."""

STEPS_PER_FILLING = 15.0
"""Steps while the fastest of these chambers fills: at 1 kHz metrics then are good to 1 % (docs/decisions/0008)."""


@dataclass(frozen=True, slots=True)
class WalkPlan:
    """What a walk is made of; ``settings`` of the controller in SI; ``period`` and ``step`` [s]."""

    device: Device
    wearer: Wearer
    gait: Gait
    controller: ControllerKind
    settings: dict[str, float]
    sensors: SensorParameters
    gait_sensors: GaitSensors
    has_ideal_sensors: bool
    duration: float
    period: float = 1.0e-3
    step: float = 1.0e-3
    record_interval: float = 1.0e-3
    supply_lines: SupplyLines | None = None
    thermal: Thermal | None = None
    course: WalkingCourse | None = None


def plan_walk(plan: WalkPlan) -> Run:
    """The run of a walk with vented chambers, which begins at a heel strike, or on a course standing."""
    rocker = heel_rocker(plan.gait, plan.wearer)
    leg = plan.wearer.leg()._replace(heel_lever=rocker.raised, flat_heel_lever=rocker.flat, heel_roll_angle=rocker.half)
    bare = plant_parameters(plan.device)
    walk = _walk(plan, leg, bare)
    pieces = Pieces(
        device=plan.device,
        valve=walking_valve(plan.device.valve),
        controller=plan.controller,
        settings=plan.settings,
        reference=NO_REFERENCE,
        path=None,
        sensors=plan.sensors,
        has_ideal_sensors=plan.has_ideal_sensors,
        thermal=plan.thermal,
        supply_lines=plan.supply_lines,
        signal_delay=longest_delay(plan.gait_sensors) * plan.period,
    )
    return compose_run(
        pieces,
        with_leg(bare, leg),
        lambda plant: walk_steps(plan, plant),
        lambda plant: vented_state(plant, walk.initial.now.ankle, walk.initial.now.ankle_rate),
        walk,
    )


def longest_delay(sensors: GaitSensors) -> float:
    """Most samples by which a fault makes a sensor late."""
    return max(value.late_samples for value in sensors if isinstance(value, Fault))


def walk_steps(plan: WalkPlan, plant: PlantParameters) -> Steps:
    """The steps of a walk: whole ones that follow the gas, as many to a sample of the controller as that asks for."""
    coarse = max(1, math.ceil(plan.period / plan.step - 1.0e-9))
    steps = coarse * _parts(plan, plant, plan.period / coarse)
    step = plan.period / steps
    record_every = max(1, round(plan.record_interval / step))
    return Steps(
        step=step,
        step_count=math.ceil(plan.duration / (step * record_every) - 1.0e-9) * record_every,
        steps_per_sample=steps,
        record_every=record_every,
        needs_parts=False,
    )


def _walk(plan: WalkPlan, leg: LegParameters, bare: PlantParameters) -> Walk:
    """The leg of a walk, at its first heel strike or standing; ``bare`` is the device without it."""
    gait, timing = gait_series(plan.gait), gait_timing(plan.gait)
    course = None if plan.course is None else planned_course(plan.course, plan.gait).course
    start = gait_at(gait, timing, leg, 0.0) if course is None else standing_gait(leg, timing, course)
    foot = foot_direction(start.shank, start.ankle)
    return Walk(
        leg=leg,
        share=DeviceShare(
            inertia=bare.inertia,
            viscous_damping=bare.viscous_damping,
            mass_moment=bare.gravity_torque / leg.gravity,
        ),
        gait=gait,
        timing=timing,
        sensors=plan.gait_sensors,
        initial=WalkState(
            contact=HEEL if course is None else FLAT,
            offset=0.0,
            now=start,
            foot=foot,
            external_torque=0.0,
            heel_force=0.0 if course is None else 0.5 * start.force,
            toe_force=0.0 if course is None else 0.5 * start.force,
            toes_first=0.0,
            slap_rate=0.0,
            clearance=NO_CLEARANCE,
            strides=0.0,
            landings=0.0,
            toe_landings=0.0,
            slap_rates=0.0,
            clearances=0.0,
            push_off_work=0.0,
        ),
        course=course,
    )


def planned_course(course: WalkingCourse, gait: Gait) -> PlannedCourse:
    """A course in time, walked by the person of a gait; ScenarioError for what this gait does not allow."""
    timing = gait_timing(gait)
    return plan_course(course, gait, timing.frequency, timing, strike_angle(gait))


def course_of_walk(configuration: Configuration) -> PlannedCourse | None:
    """The course of a walk in time, None where it has none; ScenarioError for what its gait does not allow."""
    return None if configuration.course is None else planned_course(configuration.course, configuration.gait)


def _parts(plan: WalkPlan, plant: PlantParameters, step: float) -> int:
    """Parts of a step [s] that follow the chambers at the angles of walking, and the lines that feed them."""
    volume = min(chamber_volumes(plant, ANGLES[0])[0], chamber_volumes(plant, ANGLES[1])[1])
    lines = plan.supply_lines
    volume = volume if lines is None else min(volume, lines.volume_1, lines.volume_2)
    # Adiabatic chambers fill faster than isothermal ones, by the ratio of heat capacities.
    stiffness = 1.0 if plan.thermal is None else plan.device.gas.heat_capacity_ratio
    return max(1, math.ceil(step * STEPS_PER_FILLING * stiffness / filling_time(plant, volume) - 1.0e-9))


def with_leg(plant: PlantParameters, leg: LegParameters) -> PlantParameters:
    """The plant with the foot's inertia and the ankle's damping; its own gravity is accounted for in the leg."""
    return plant._replace(
        inertia=plant.inertia + foot_inertia_about_ankle(leg),
        viscous_damping=plant.viscous_damping + leg.ankle_damping,
        gravity_torque=0.0,
        external_torque=0.0,
    )


def walking_valve(valve: Valve) -> ValveModel:
    """The valve of a walking device; a proportional one has a dump valve for free motion."""
    return dump.choose(valve.settings) if valve.kind == "proportional" else VALVES[valve.kind].choose(valve.settings)


def vented_state(plant: PlantParameters, angle: float, angular_velocity: float) -> PlantState:
    """State at an angle [rad] and its rate [rad/s] with both chambers at atmospheric pressure."""
    volumes = chamber_volumes(plant, angle)
    mass_1, mass_2 = (chamber_mass(plant.atmospheric_pressure, volume, plant.gas_product) for volume in volumes)
    return PlantState(
        angle=angle,
        angular_velocity=angular_velocity,
        mass_1=mass_1,
        mass_2=mass_2,
        supplied_mass=0.0,
        vented_mass=0.0,
        leaked_mass=0.0,
    )
