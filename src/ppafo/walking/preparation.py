"""Initial values and parameters of a walk, computed from its settings in SI units.

Pure functions of one run, as in ``simulation/plan.py``: Python uses them for planning, and an exported library contains
them in C. Results derived from the gait (series, events, heel rocker) are data for these functions.
"""

import math
from collections.abc import Mapping
from typing import Any

from ppafo.engine.scheme.pneumatics import filling_time
from ppafo.engine.scheme.walking import NO_CLEARANCE, DeviceShare, WalkState, foot_direction
from ppafo.model.actuators.kind import Chambers
from ppafo.model.columns import larger, rounded_up, smaller, truncated
from ppafo.model.contact import HEEL
from ppafo.model.elementary import exponential
from ppafo.model.gait import GaitNow
from ppafo.model.leg import LegParameters, foot_inertia_about_ankle
from ppafo.model.plant import PlantParameters
from ppafo.model.sensors import GaitSensors
from ppafo.simulation.plan import WHOLE, StepCounts
from ppafo.walking.wearer import HeelRocker

# Range of the ankle angle in walking [rad]; the time step is chosen for the chambers in this range.
LOWEST_ANGLE = math.radians(60.0)
HIGHEST_ANGLE = math.radians(115.0)

STEPS_PER_FILLING = 15.0
"""Steps per filling time of the smallest chamber: at 1 kHz metrics are accurate to 1 % (docs/decisions/0008)."""

_TURN = 2.0 * math.pi


def rocker_on_heel(flat: float, rise: float, half: float, heel_lever: float) -> HeelRocker:
    """Return the heel rocker fitted to a gait, bounded by the heel lever [m] of the wearer.

    ``flat`` [m] is the lever with the foot nearly flat, ``rise`` [m] the increase for a raised foot, ``half`` [rad] the
    tilt at half of the increase.
    """
    # A gait fitted on another foot may ask for a lever behind this heel.
    bounded = min(max(flat, 0.0), heel_lever)
    return HeelRocker(flat=bounded, raised=min(max(bounded + rise, bounded), heel_lever), half=half)


def device_share(plant: PlantParameters, gravity: float) -> DeviceShare:
    """Return the contribution of a device to the leg; ``plant`` is the bare device under ``gravity`` [m/s^2]."""
    return DeviceShare(
        inertia=plant.inertia, viscous_damping=plant.viscous_damping, mass_moment=plant.gravity_torque / gravity
    )


def with_leg(plant: PlantParameters, leg: LegParameters) -> PlantParameters:
    """Return the plant with the foot's inertia and the ankle's damping added; gravity is accounted for in the leg."""
    return plant._replace(
        viscous_damping=plant.viscous_damping + leg.ankle_damping,
        inertia=plant.inertia + foot_inertia_about_ankle(leg),
        gravity_torque=0.0,
        external_torque=0.0,
    )


def smallest_chamber(lowest: Chambers, highest: Chambers) -> Any:
    """Return the smallest volume [m^3] of either chamber, given the chambers at the extreme angles of a walk."""
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
    """Return the step counts of a walk: steps that resolve the gas, a whole number per sample; times in [s].

    ``volume`` [m^3] is the smallest volume downstream of the valve. ``stiffness`` [-] is the ratio of heat capacities
    for gas with an energy balance, whose chambers fill faster by this factor, and otherwise 1.
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


def walk_from_strike(now: GaitNow) -> WalkState:
    """Return the state of a leg that starts to walk at a heel strike."""
    return WalkState(
        contact=HEEL,
        offset=0.0,
        now=now,
        foot=foot_direction(now.shank, now.ankle),
        external_torque=0.0,
        heel_force=0.0,
        toe_force=0.0,
        toes_first=0.0,
        clearance=NO_CLEARANCE,
        strides=0.0,
        toe_landings=0.0,
        clearances=0.0,
        positive_push_off_work=0.0,
        net_push_off_work=0.0,
    )


def memory_of(bandwidth: float, period: float) -> float:
    """Return the weight of a sensor's previous value after one sample period [s]; 0 for a ``bandwidth`` of 0 [Hz]."""
    return exponential(-_TURN * bandwidth * period) if bandwidth > 0.0 else 0.0


def gait_sensors(settings: Mapping[str, float], period: float) -> GaitSensors:
    """Return the sensors with these settings [SI], at a sample period [s]."""
    return GaitSensors(
        follow_rate=_TURN * settings["force_bandwidth"],
        force_noise=settings["force_noise"],
        force_resolution=settings["force_resolution"],
        lost_share=settings["lost_share"],
        angle_memory=memory_of(settings["angle_bandwidth"], period),
        pressure_memory=memory_of(settings["pressure_bandwidth"], period),
        angle_lost_share=settings["angle_lost_share"],
        pressure_lost_share=settings["pressure_lost_share"],
    )
