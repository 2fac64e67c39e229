"""Initial numbers of a walk, computed from its settings in SI units.

Pure functions of one run, as in ``simulation/plan.py``: Python plans with them, and an exported library has them
in C. What a gait comes to (series, events, the fit of the heel) is data.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ppafo.engine.scheme.pneumatics import filling_time
from ppafo.engine.scheme.walking import NO_CLEARANCE, DeviceShare, WalkState, foot_direction
from ppafo.model.actuators.kind import Chambers
from ppafo.model.columns import larger, rounded_up, smaller, truncated
from ppafo.model.contact import FLAT, HEEL
from ppafo.model.elementary import exponential
from ppafo.model.gait import GaitNow
from ppafo.model.leg import LegParameters, foot_inertia_about_ankle, foot_load, torque_of_shank
from ppafo.model.plant import PlantParameters, PlantState
from ppafo.model.sensors import Fault, GaitSensors
from ppafo.model.shut_off import NEVER
from ppafo.simulation.plan import WHOLE, StepCounts, state_with_volumes
from ppafo.walking.wearer import HeelRocker

LOWEST_ANGLE, HIGHEST_ANGLE = math.radians(60.0), math.radians(115.0)
"""Angles that the ankle keeps to in walking; the step is made for the chambers between them."""

STEPS_PER_FILLING = 15.0
"""Steps while the fastest of these chambers fills: at 1 kHz metrics then are good to 1 % (docs/decisions/0008)."""

_TURN = 2.0 * math.pi

DISTORTED, FROZEN = "distorted", "frozen"
DISTORTING = ("time", "period", "gain", "offset", "drift", "crosstalk", "lag", "lost_share", "delay")
"""Numbers of a distorted sensor, in the order of ``distorting_fault``; the angle has no crosstalk, which is 0."""


def rocker_on_heel(flat: float, rise: float, half: float, heel_lever: float) -> HeelRocker:
    """Heel rocker fitted to a gait, bounded by the lever [m] of the heel.

    ``flat`` and ``rise`` [m] are the lever nearly flat and how much longer it is far up, ``half`` [rad] as there.
    """
    # A gait fitted on another foot may ask for a lever behind this heel.
    bounded = min(max(flat, 0.0), heel_lever)
    return HeelRocker(flat=bounded, raised=min(max(bounded + rise, bounded), heel_lever), half=half)


def device_share(plant: PlantParameters, gravity: float) -> DeviceShare:
    """Contribution of a device to a leg; ``plant`` is the bare device under ``gravity`` [m/s^2]."""
    return DeviceShare(
        inertia=plant.inertia,
        viscous_damping=plant.viscous_damping,
        mass_moment=plant.gravity_torque / gravity,
    )


def with_leg(plant: PlantParameters, leg: LegParameters) -> PlantParameters:
    """The plant with the foot's inertia and the ankle's damping; its own gravity is accounted for in the leg."""
    return plant._replace(
        viscous_damping=plant.viscous_damping + leg.ankle_damping,
        inertia=plant.inertia + foot_inertia_about_ankle(leg),
        gravity_torque=0.0,
        external_torque=0.0,
    )


def smallest_chamber(lowest: Chambers, highest: Chambers) -> Any:
    """Smallest volume [m^3] of either chamber, from those at the lowest and at the highest angle of walking, vented."""
    # Chamber 1 is smallest in dorsiflexion, chamber 2 in plantarflexion.
    return smaller(lowest.volume_1, highest.volume_2)


def walk_step_counts(
    duration: float,
    time_step: float,
    output_interval: float,
    period: float,
    plant: PlantParameters,
    volume: float,
    stiffness: float,
) -> StepCounts:
    """Whole steps that follow the gas, as many to a sample of the controller as that asks for; times in [s].

    ``volume`` [m^3] is the smallest behind the valve. ``stiffness`` [-] is the ratio of heat capacities for gas with an
    energy balance, whose chambers fill faster by it, else 1.
    """
    # A quotient that is whole but for rounding asks for no step more.
    coarse = larger(1.0, rounded_up(period / time_step - WHOLE))
    filling = filling_time(plant, volume)
    parts = larger(1.0, rounded_up(period / coarse * STEPS_PER_FILLING * stiffness / filling - WHOLE))
    steps = coarse * parts
    step = period / steps
    record_every = larger(1.0, truncated(output_interval / step + 0.5))
    return StepCounts(
        step=step,
        # Whole intervals of the record, so that the last step is recorded.
        step_count=rounded_up(duration / (step * record_every) - WHOLE) * record_every,
        steps_per_sample=steps,
        record_every=record_every,
    )


def vented_state(plant: PlantParameters, filled: Chambers, angle: float, angular_velocity: float) -> PlantState:
    """State at an angle [rad] and its rate [rad/s] with both chambers there at atmospheric pressure."""
    room = plant.atmospheric_pressure
    return state_with_volumes(plant, angle, angular_velocity, filled.volume_1, filled.volume_2, room, room)


def walk_from_strike(now: GaitNow) -> WalkState:
    """State of a leg that begins to walk at a heel strike."""
    return walk_from(now, HEEL, 0.0)


def walk_from_standing(now: GaitNow) -> WalkState:
    """A leg that begins standing, its weight on heel and toes alike."""
    return walk_from(now, FLAT, 0.5 * now.force)


def walk_from(now: GaitNow, contact: float, shown_force: float) -> WalkState:
    """A leg at its start, with the force [N] that the sensors under heel and toes show."""
    return WalkState(
        contact=contact,
        offset=0.0,
        now=now,
        foot=foot_direction(now.shank, now.ankle),
        external_torque=0.0,
        heel_force=shown_force,
        toe_force=shown_force,
        toes_first=0.0,
        clearance=NO_CLEARANCE,
        strides=0.0,
        toe_landings=0.0,
        clearances=0.0,
        positive_push_off_work=0.0,
        net_push_off_work=0.0,
    )


def standing_on(
    leg: LegParameters, ground_angle: float, sine_foot: float, cosine_foot: float, phase: float, load: float
) -> GaitNow:
    """Shank vertical, foot flat, both at rest: how a task sequence begins, at a phase [turns] and load [body weights].

    Sine and cosine belong to the flat foot's angle [rad]. Numbers may be arrays (wearers,).
    """
    upright = 0.0 * ground_angle
    return GaitNow(
        phase=phase,
        shank=upright,
        shank_rate=upright,
        shank_acceleration=upright,
        ankle=0.5 * math.pi - ground_angle,
        ankle_rate=upright,
        ankle_acceleration=upright,
        moment=upright,
        force=leg.body_mass * leg.gravity * load,
        knee_forward=upright,
        knee_up=upright,
        sine_shank=upright,
        cosine_shank=1.0 + upright,
        sine_healthy_foot=sine_foot,
        healthy_torque=torque_of_shank(foot_load(leg), 0.0, 1.0, sine_foot, cosine_foot, 0.0, 0.0, 0.0, 0.0),
    )


def memory_of(bandwidth: float, period: float) -> float:
    """Remaining weight of a sensor's last value after a sample [s]; 0 at a ``bandwidth`` [Hz] of 0."""
    return exponential(-_TURN * bandwidth * period) if bandwidth > 0.0 else 0.0


def gait_sensors(
    settings: Mapping[str, float],
    period: float,
    heel_fault: Fault,
    toe_fault: Fault,
    angle_fault: Fault,
    pressure_1_fault: Fault,
    pressure_2_fault: Fault,
) -> GaitSensors:
    """Sensors by their settings [SI], at a sample period [s]."""
    return GaitSensors(
        follow_rate=_TURN * settings["force_bandwidth"],
        force_noise=settings["force_noise"],
        force_resolution=settings["force_resolution"],
        lost_share=settings["lost_share"],
        angle_memory=memory_of(settings["angle_bandwidth"], period),
        pressure_memory=memory_of(settings["pressure_bandwidth"], period),
        angle_lost_share=settings["angle_lost_share"],
        pressure_lost_share=settings["pressure_lost_share"],
        heel_fault=heel_fault,
        toe_fault=toe_fault,
        angle_fault=angle_fault,
        pressure_1_fault=pressure_1_fault,
        pressure_2_fault=pressure_2_fault,
    )


def fixed_fault(time: float, holds: float, reading: float, fault_period: float) -> Fault:
    """A sensor that keeps its last value from ``time`` [s] on (``holds`` 1), or gives a fixed reading."""
    return Fault(
        time=time,
        holds=holds,
        reading=reading,
        distorts=0.0,
        gain=1.0,
        offset=0.0,
        drift=0.0,
        crosstalk=0.0,
        memory=0.0,
        lost_fraction=0.0,
        period=fault_period,
        late_samples=0.0,
    )


def distorting_fault(
    time: float,
    fault_period: float,
    gain: float,
    offset: float,
    drift: float,
    crosstalk: float,
    lag: float,
    lost_share: float,
    delay: float,
    period: float,
) -> Fault:
    """A sensor that gives a wrong reading from ``time`` [s] on, at a sample period [s] of the controller.

    ``lag`` and ``delay`` in [s], the latter taken to the nearest whole sample; the others as in ``Fault``.
    """
    return Fault(
        time=time,
        holds=0.0,
        reading=0.0,
        distorts=1.0,
        gain=gain,
        offset=offset,
        drift=drift,
        crosstalk=crosstalk,
        # Without a lag it follows at once, and keeps nothing of the last sample.
        memory=exponential(-period / lag) if lag > 0.0 else 0.0,
        lost_fraction=lost_share,
        period=fault_period,
        # A delay is whole samples in the engine: the nearest number of them.
        late_samples=truncated(delay / period + 0.5),
    )


def longest_delay(sensors: GaitSensors) -> float:
    """Most samples by which a fault makes a sensor late."""
    forces = max(sensors.heel_fault.late_samples, sensors.toe_fault.late_samples)
    pressures = max(sensors.pressure_1_fault.late_samples, sensors.pressure_2_fault.late_samples)
    return max(forces, pressures, sensors.angle_fault.late_samples)


@dataclass(frozen=True, slots=True)
class FaultSettings:
    """A kind of ``declaration.FAULTS`` and its numbers [SI]; no kind is a sensor without a fault."""

    kind: str = ""
    numbers: Mapping[str, float] = field(default_factory=dict)


def fault_of(fault: FaultSettings, period: float) -> Fault:
    """Return the fault of a sensor with its numbers [SI], at a sample period [s] of the controller."""
    settings = fault.numbers
    if not fault.kind:
        # A sound sensor has a fault that never begins, so that one program serves both.
        return fixed_fault(NEVER, 0.0, 0.0, 0.0)
    if fault.kind != DISTORTED:
        holds = 1.0 if fault.kind == FROZEN else 0.0
        return fixed_fault(settings["time"], holds, settings.get("reading", 0.0), settings["period"])
    numbers = [settings.get(name, 0.0) for name in DISTORTING]
    return distorting_fault(*[*numbers, period])
