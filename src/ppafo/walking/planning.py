"""From a wearer, a gait, a device and a controller to a run of the engine."""

from dataclasses import dataclass

from ppafo.control.kind import ControllerKind
from ppafo.engine.run import Run, Walk
from ppafo.gait import Gait
from ppafo.model.gait import gait_at
from ppafo.model.gait_sensors import GaitSensors
from ppafo.model.leg import LegParameters
from ppafo.model.plant import PlantParameters
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
from ppafo.walking.preparation import (
    device_share,
    longest_delay,
    smallest_chamber,
    vented_state,
    walk_from_standing,
    walk_from_strike,
    walk_step_counts,
    with_leg,
)
from ppafo.walking.wearer import Wearer, leg_parameters

NO_REFERENCE = ProfileChoice("constant", {"level": 0.0})
"""A controller of walking makes its own."""


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
    leg = leg_parameters(plan.wearer, heel_rocker(plan.gait, plan.wearer))
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


def walk_steps(plan: WalkPlan, plant: PlantParameters) -> Steps:
    """The steps of a walk: whole ones that follow the gas, as many to a sample of the controller as that asks for."""
    lines, volume = plan.supply_lines, smallest_chamber(plant)
    volume = volume if lines is None else min(volume, lines.volume_1, lines.volume_2)
    # Adiabatic chambers fill faster than isothermal ones, by the ratio of heat capacities.
    stiffness = 1.0 if plan.thermal is None else plan.device.gas.heat_capacity_ratio
    counts = walk_step_counts(plan.duration, plan.step, plan.record_interval, plan.period, plant, volume, stiffness)
    return Steps(
        step=counts.step,
        step_count=int(counts.step_count),
        steps_per_sample=int(counts.steps_per_sample),
        record_every=int(counts.record_every),
        needs_parts=False,
    )


def _walk(plan: WalkPlan, leg: LegParameters, bare: PlantParameters) -> Walk:
    """The leg of a walk, at its first heel strike or standing; ``bare`` is the device without it."""
    gait, timing = gait_series(plan.gait), gait_timing(plan.gait)
    course = None if plan.course is None else planned_course(plan.course, plan.gait).course
    if course is None:
        initial = walk_from_strike(gait_at(gait, timing, leg, 0.0))
    else:
        initial = walk_from_standing(standing_gait(leg, timing, course))
    return Walk(
        leg=leg,
        share=device_share(bare, leg),
        gait=gait,
        timing=timing,
        sensors=plan.gait_sensors,
        initial=initial,
        course=course,
    )


def planned_course(course: WalkingCourse, gait: Gait) -> PlannedCourse:
    """A course in time, walked by the person of a gait; ScenarioError for what this gait does not allow."""
    timing = gait_timing(gait)
    return plan_course(course, gait, timing.frequency, timing, strike_angle(gait))


def course_of_walk(configuration: Configuration) -> PlannedCourse | None:
    """The course of a walk in time, None where it has none; ScenarioError for what its gait does not allow."""
    return None if configuration.course is None else planned_course(configuration.course, configuration.gait)


def walking_valve(valve: Valve) -> ValveModel:
    """The valve of a walking device; a proportional one has a dump valve for free motion."""
    return dump.choose(valve.settings) if valve.kind == "proportional" else VALVES[valve.kind].choose(valve.settings)
