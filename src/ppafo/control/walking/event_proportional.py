"""Event-based control of a proportional valve: a torque profile in push-off, an angle in swing and landing.

The profile is the one of the exoskeleton literature: zero, a smooth rise to a peak, a smooth fall to zero, given by
the peak, its time, and the times of rise and fall, all times as shares of the stride.
"""

from typing import NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.control.walking import phases, safety
from ppafo.control.walking.declaration import PHASE_QUANTITIES, SAFETY_QUANTITIES
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.safety import SafetyRules, SafetyState
from ppafo.model.command import VENT
from ppafo.model.declaration import Quantity
from ppafo.model.gait_sensors import GaitMeasurement


class TorqueProfile(NamedTuple):
    """Peak [N m], its time, and the times of rise and fall, in turns from the heel strike."""

    peak_torque: float
    peak_time: float
    rise_time: float
    fall_time: float


class EventProportionalParameters(NamedTuple):
    """Swing angle [rad], gains on angle [1/rad], [s/rad] and torque [1/(N m)], [1/(N m s)], profile, and rules."""

    swing_angle: float
    angle_gain: float
    angle_rate_gain: float
    torque_gain: float
    torque_integral_gain: float
    profile: TorqueProfile
    phases: PhaseRules
    safety: SafetyRules


class EventProportionalState(NamedTuple):
    """Phase, safety, integral of the torque error [N m s], last angle [rad]."""

    phase: PhaseState
    safety: SafetyState
    integral: float
    angle: float


def smooth(share: float) -> float:
    """From 0 to 1 with level ends, for a share from 0 to 1."""
    inside = max(0.0, min(1.0, share))
    return inside * inside * (3.0 - 2.0 * inside)


def profile_torque(profile: TorqueProfile, phase: float) -> float:
    """Torque wanted [N m] at a phase in turns from the heel strike."""
    rise = smooth((phase - profile.peak_time + profile.rise_time) / profile.rise_time)
    fall = smooth((phase - profile.peak_time) / profile.fall_time)
    return profile.peak_torque * (rise - fall)


def update(
    parameters: EventProportionalParameters,
    state: EventProportionalState,
    reference: float,
    measurement: GaitMeasurement,
    period: float,
) -> tuple[float, EventProportionalState]:
    """Command from -1 to 1, or ``VENT``; the reference is not used."""
    phase = phases.followed_phase(parameters.phases, state.phase, measurement.heel_force, measurement.toe_force, period)
    watch = safety.watched(parameters.safety, state.safety, state.phase, phase, measurement, period)
    wanted = profile_torque(parameters.profile, phase.since_strike / phase.stride_time)
    error = wanted - measurement.torque
    pushes = phase.phase == phases.PUSH_OFF
    proposed = parameters.torque_gain * error + state.integral
    added = parameters.torque_integral_gain * error * period
    # The integral waits while the valve is fully open: more of it could not be carried out.
    integral = state.integral + (added if abs(proposed) < 1.0 else 0.0) if pushes else 0.0
    rate = (measurement.angle - state.angle) / period if state.angle > 0.0 else 0.0
    held = parameters.angle_gain * (parameters.swing_angle - measurement.angle) - parameters.angle_rate_gain * rate
    command = held if phases.lifts(phase.phase) else VENT
    command = max(-1.0, min(1.0, proposed)) if pushes else command
    command = max(-1.0, min(1.0, command)) if command < VENT else VENT
    command, watch = safety.carried_out(watch, command, period)
    return command, EventProportionalState(phase, watch, integral, measurement.angle)


KIND = ControllerKind(
    name="event_proportional",
    summary="Event-based: angle held in swing and landing, free in mid-stance, a torque profile in push-off.",
    source="the paper, figures 1A and 6; profile of four parameters as in J. Zhang et al., Science 356 (2017) 1280",
    quantities=(
        Quantity("swing_angle", "rad", "angle at which the foot is held in the swing", 1.5707963267948966, 0.5, 2.5),
        Quantity("angle_gain", "1/rad", "opening per angle error", 3.0, 0.0, 1.0e3),
        Quantity("angle_rate_gain", "s/rad", "opening per angular velocity", 0.2, 0.0, 1.0e3),
        Quantity("torque_gain", "1/(N m)", "opening per torque error", 0.6, 0.0, 1.0e3),
        Quantity("torque_integral_gain", "1/(N m s)", "opening per integral of the torque error", 1.0, 0.0, 1.0e3),
        Quantity("peak_torque", "N m", "peak of the torque in push-off", 5.0, 0.0, 1.0e3),
        Quantity("peak_time", "1", "phase of the peak, share of the stride time", 0.53, 0.1, 0.9),
        Quantity("rise_time", "1", "share of the stride time from zero to the peak", 0.15, 0.01, 0.8),
        Quantity("fall_time", "1", "share of the stride time from the peak to zero", 0.09, 0.01, 0.8),
        *PHASE_QUANTITIES,
        *SAFETY_QUANTITIES,
    ),
    parameters=EventProportionalParameters,
    initial=EventProportionalState(phases.START, safety.START, 0.0, 0.0),
    update=update,
)
