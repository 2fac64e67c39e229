"""From a wearer, a gait, a device and a controller to a run of the engine."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.control.catalog import PROFILES
from ppafo.control.kind import ControllerKind
from ppafo.engine.program import NoParameters, Program
from ppafo.engine.refinement import filling_time
from ppafo.engine.run import Lines, Run, Walk, whole_and_rest
from ppafo.engine.scheme.walking import NO_CLEARANCE, DeviceShare, WalkState, foot_direction
from ppafo.gait import Gait
from ppafo.gait.gait import Curve
from ppafo.model.chambers import chamber_mass
from ppafo.model.contact import HEEL
from ppafo.model.fourier import Series
from ppafo.model.gait import GaitSeries, GaitTiming, gait_at
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
from ppafo.signals.recording import Floats
from ppafo.simulation.plan import controller_parameters, exact_orifice
from ppafo.walking.wearer import Wearer

HARMONICS = 8
"""Harmonics that the engine follows; those of the built-in gait above are below 0.04 deg and 0.4 % of body weight."""

FLAT_FROM, FLAT_TO = 0.15, 0.35
"""Phases between which every foot stands flat; the angle of the foot is taken from there."""

NEARLY_FLAT = math.radians(3.0)
"""The heel has left the ground when the foot is steeper than flat by this; the toes are about to meet it at as much."""

USUAL_HEEL_RISE, LATEST_HEEL_RISE = 0.6, 0.95
"""Shares of the stance at which the heel rises where the angles do not show it, and at the latest."""

EVENT_PHASES = np.linspace(0.0, 1.0, 1001)[150:]
"""Phases at which events are looked for, from the first flat foot on."""

CLEARANCE_FROM, CLEARANCE_TO = 0.2, 0.9
"""Shares of the swing between which the toes must clear the ground."""

ANGLES = (math.radians(60.0), math.radians(115.0))
"""Angles that the ankle keeps to in walking; the step is made for the chambers between them."""

STEPS_PER_FILLING = 15.0
"""Steps while the fastest of these chambers fills: at 1 kHz metrics then are good to 1 % (docs/decisions/0008)."""

ZERO = Series(*(0.0,) * 17)


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
    bare = plant_parameters(plan.device)
    plant = with_leg(bare, leg)
    walk = _walk(plan, leg, bare)
    valve, settings = walking_valve(plan.device.valve), plan.device.valve.settings
    delay = valve.command_delay(settings)
    coarse = max(1, math.ceil(plan.period / plan.step - 1.0e-9))
    steps = coarse * _parts(plant, plan.supply_lines, plan.period / coarse)
    step = plan.period / steps
    lag = whole_and_rest(delay, step)[1] * step
    record_every = max(1, round(plan.record_interval / step))
    return Run(
        program=_program(plan, valve, delay > 0.0),
        plant=plant,
        thermal=NoParameters(),
        valve_orifice=exact_orifice(plan.device.valve.orifice, plan.device),
        leak_orifice=exact_orifice(plan.device.actuator.leak, plan.device),
        initial=vented(plant, walk.initial.now.ankle, walk.initial.now.ankle_rate),
        valve=valve.prepare(settings, step - lag),
        early_valve=valve.prepare(settings, lag) if delay > 0.0 else (),
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
        share=DeviceShare(bare.inertia, bare.viscous_damping, bare.gravity_torque),
        gait=gait,
        timing=timing,
        sensors=plan.gait_sensors,
        initial=WalkState(HEEL, 0.0, start, foot, *(0.0,) * 4, NO_CLEARANCE, *(0.0,) * 6),
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


def gait_series(gait: Gait) -> GaitSeries:
    """The gait as the engine takes it; a moment, a force or a motion of the knee that nobody measured is 0."""
    return GaitSeries(
        _series(gait, "shank_angle"),
        _series(gait, "ankle_angle"),
        _series(gait, "ankle_moment"),
        _series(gait, "vertical_force"),
        _series(gait, "knee_forward"),
        _series(gait, "knee_up"),
    )


def _series(gait: Gait, name: str) -> Series:
    curve = gait.curves.get(name)
    if curve is None:
        return ZERO
    missing = (0.0,) * HARMONICS
    pairs = zip((*curve.cosines, *missing)[:HARMONICS], (*curve.sines, *missing)[:HARMONICS], strict=True)
    return Series(curve.mean, *[number for pair in pairs for number in pair])


def followed(curve: Curve) -> Curve:
    """The curve with the harmonics that the engine follows."""
    return replace(curve, cosines=curve.cosines[:HARMONICS], sines=curve.sines[:HARMONICS])


def heel_lever(gait: Gait, wearer: Wearer) -> float:
    """Lever [m] of the ground force about the ankle where the measured foot has nearly come down.

    From the measured moment; that of the heel itself bounds it, and stands in where moment or force are missing.
    """
    if gait.ankle_moment is None or gait.vertical_force is None:
        return wearer.heel_lever
    phases = np.linspace(0.0, FLAT_FROM, 151)
    down = _foot_angles(gait, phases) < gait_timing(gait).ground_angle + NEARLY_FLAT
    landing = float(phases[np.argmax(down)]) if down.any() else FLAT_FROM
    moment, force = followed(gait.ankle_moment).value(landing), followed(gait.vertical_force).value(landing)
    return min(max(-moment / max(force * STANDARD_GRAVITY, 1.0), 0.0), wearer.heel_lever)


def _foot_angles(gait: Gait, phases: Floats) -> Floats:
    """Angles [rad] of the measured foot over the horizontal."""
    shank, ankle = followed(gait.shank_angle), followed(gait.ankle_angle)
    return shank.sampled(phases) - ankle.sampled(phases) + 0.5 * math.pi


def gait_timing(gait: Gait) -> GaitTiming:
    """Events of the gait, the heel's rise and the flat foot's angle from its own angles."""
    foot = _foot_angles(gait, EVENT_PHASES)
    events = gait_events(foot[None, :], np.array([gait.stance_share]))
    return GaitTiming(1.0 / gait.stride_time, 0.0, *(float(values[0]) for values in events))


def gait_events(foot: Floats, stance_share: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """The fields of ``GaitTiming`` after ``start``, for feet that stand at angles [rad] (people, phases).

    ``foot`` is over the horizontal, at ``EVENT_PHASES``; ``stance_share`` is (people,).
    """
    flat = (EVENT_PHASES >= FLAT_FROM) & (EVENT_PHASES <= FLAT_TO)
    ground_angle = np.median(foot[:, flat], axis=1)
    steep = (foot < (ground_angle - NEARLY_FLAT)[:, None]) & (EVENT_PHASES > FLAT_TO)
    usual = USUAL_HEEL_RISE * stance_share
    heel_off = np.where(steep.any(axis=1), EVENT_PHASES[np.argmax(steep, axis=1)], usual)
    swing = 1.0 - stance_share
    return (
        np.minimum(heel_off, LATEST_HEEL_RISE * stance_share),
        stance_share,
        stance_share + CLEARANCE_FROM * swing,
        stance_share + CLEARANCE_TO * swing,
        ground_angle,
    )
