"""From a wearer, a gait, a device and a controller to a run of the engine."""

import math
from dataclasses import dataclass

from ppafo.control.catalog import PROFILES
from ppafo.control.kind import ControllerKind
from ppafo.engine.program import NoParameters, Program
from ppafo.engine.refinement import filling_time
from ppafo.engine.run import Lines, Run, Walk
from ppafo.engine.scheme.ankle_torque import DeviceShare, foot_direction
from ppafo.engine.scheme.walking import NO_CLEARANCE, WalkState
from ppafo.gait import Gait
from ppafo.model.chambers import chamber_mass
from ppafo.model.contact import HEEL
from ppafo.model.gait import gait_at
from ppafo.model.gait_sensors import GaitSensors
from ppafo.model.leg import LegParameters, foot_inertia_about_ankle
from ppafo.model.plant import PlantParameters, PlantState, chamber_volumes
from ppafo.model.regulator import LineState, SupplyLines
from ppafo.model.sensors import SensorParameters
from ppafo.model.valves import dump
from ppafo.model.valves.catalog import VALVES
from ppafo.model.valves.kind import ValveModel
from ppafo.parameters.device import Device, Valve
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.plan import controller_parameters, exact_orifice
from ppafo.walking.followed_gait import gait_series, gait_timing, heel_lever
from ppafo.walking.wearer import Wearer

ANGLES = (math.radians(60.0), math.radians(115.0))
"""Angles that the ankle keeps to in walking; the step is made for the chambers between them."""

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


def plan_walk(plan: WalkPlan) -> Run:
    """The run of a walk, which begins at a heel strike with the healthy ankle and vented chambers."""
    leg = plan.wearer.leg()._replace(heel_lever=heel_lever(plan.gait, plan.wearer))
    bare = _fed_plant(plan)
    plant = with_leg(bare, leg)
    walk = _walk(plan, leg, bare)
    valve, settings = walking_valve(plan.device.valve), plan.device.valve.settings
    delay = valve.command_delay(settings)
    coarse = max(1, math.ceil(plan.period / plan.step - 1.0e-9))
    steps = coarse * _parts(plant, plan.supply_lines, plan.period / coarse)
    step = plan.period / steps
    record_every = max(1, round(plan.record_interval / step))
    return Run(
        program=_program(plan, valve, delay > 0.0),
        plant=plant,
        thermal=NoParameters(),
        valve_orifice=exact_orifice(plan.device.valve.orifice, plan.device),
        leak_orifice=exact_orifice(plan.device.actuator.leak, plan.device),
        initial=vented(plant, walk.initial.now.ankle, walk.initial.now.ankle_rate),
        valve=valve.prepare(settings),
        controller=controller_parameters(plan.controller, plan.settings),
        reference=PROFILES["constant"].parameters(0.0),
        path=(),
        sensors=plan.sensors,
        step=step,
        step_count=math.ceil(plan.duration / (step * record_every) - 1.0e-9) * record_every,
        steps_per_sample=steps,
        record_every=record_every,
        signal_delay=0.0,
        command_delay=delay,
        walk=walk,
        lines=None if plan.supply_lines is None else Lines(plan.supply_lines, full_lines(plant, plan.supply_lines)),
    )


def _fed_plant(plan: WalkPlan) -> PlantParameters:
    """The device; the lines between regulator and valve, where there are any, take back what a chamber pushes out."""
    plant = plant_parameters(plan.device)
    return plant if plan.supply_lines is None else plant._replace(relieving=1.0)


def _program(plan: WalkPlan, valve: ValveModel, late_commands: bool) -> Program:
    return Program(
        valve=valve,
        reference=PROFILES["constant"],
        controller=plan.controller,
        angle=None,
        ideal_sensors=plan.has_ideal_sensors,
        late_commands=late_commands,
        walks=True,
        has_lines=plan.supply_lines is not None,
    )


def _walk(plan: WalkPlan, leg: LegParameters, bare: PlantParameters) -> Walk:
    """The leg of a walk, at its first heel strike; ``bare`` is the device without it."""
    gait, timing = gait_series(plan.gait), gait_timing(plan.gait)
    start = gait_at(gait, timing, leg, 0.0)
    foot = foot_direction(start.shank, start.ankle)
    return Walk(
        leg=leg,
        share=DeviceShare(bare.inertia, bare.viscous_damping, bare.gravity_torque / leg.gravity),
        gait=gait,
        timing=timing,
        sensors=plan.gait_sensors,
        initial=WalkState(HEEL, 0.0, start, foot, *(0.0,) * 5, NO_CLEARANCE, *(0.0,) * 6),
    )


def _parts(plant: PlantParameters, lines: SupplyLines | None, step: float) -> int:
    """Parts of a step [s] that follow the chambers at the angles of walking, and the lines that feed them."""
    volume = min(chamber_volumes(plant, ANGLES[0])[0], chamber_volumes(plant, ANGLES[1])[1])
    volume = volume if lines is None else min(volume, lines.volume_1, lines.volume_2)
    return max(1, math.ceil(step * STEPS_PER_FILLING / filling_time(plant, volume) - 1.0e-9))


def with_leg(plant: PlantParameters, leg: LegParameters) -> PlantParameters:
    """The plant with the inertia of the foot and the damping of the ankle in it; its own gravity goes to the leg."""
    return plant._replace(
        inertia=plant.inertia + foot_inertia_about_ankle(leg),
        viscous_damping=plant.viscous_damping + leg.ankle_damping,
        gravity_torque=0.0,
        external_torque=0.0,
    )


def walking_valve(valve: Valve) -> ValveModel:
    """The valve of a walking device; a proportional one has a dump valve for free motion."""
    return dump.choose(valve.settings) if valve.kind == "proportional" else VALVES[valve.kind].choose(valve.settings)


def vented(plant: PlantParameters, angle: float, angular_velocity: float) -> PlantState:
    """State at an angle [rad] with both chambers at the atmosphere."""
    volumes = chamber_volumes(plant, angle)
    mass_1, mass_2 = (chamber_mass(plant.atmospheric_pressure, volume, plant.gas_product) for volume in volumes)
    return PlantState(angle, angular_velocity, mass_1, mass_2, 0.0, 0.0, 0.0)


def full_lines(plant: PlantParameters, lines: SupplyLines) -> LineState:
    """Both lines at the pressures that their regulators are set to, and nothing let through yet."""
    mass_1 = chamber_mass(plant.supply_pressure, lines.volume_1, plant.gas_product)
    return LineState(mass_1, chamber_mass(plant.dorsiflexion_pressure, lines.volume_2, plant.gas_product), 0.0)
