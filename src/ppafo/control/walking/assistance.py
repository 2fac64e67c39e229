"""What torque a walking device wants in each phase of the gait, whatever law then follows it.

Landing: a profile in dorsiflexion against the slap, about a spring and damper that hold the foot. Mid-stance: free.
Push-off: a profile in plantarflexion. Swing: a profile in dorsiflexion about the same spring and damper.
"""

from typing import NamedTuple, Protocol

from ppafo.control.walking import phases, safety
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.safety import SafetyRules, SafetyState
from ppafo.control.walking.torque_profile import TorqueProfile, profile_torque
from ppafo.model.command import VENT
from ppafo.model.gait_sensors import GaitMeasurement
from ppafo.model.sensors import Measurement


class Hold(NamedTuple):
    """Angle of the lifted foot [rad], stiffness [N m/rad], damping [N m s/rad], filter of the angle's rate [s]."""

    swing_angle: float
    stiffness: float
    damping: float
    rate_filter: float


class Assistance(NamedTuple):
    """The hold, the profiles of landing and swing (in dorsiflexion) and of push-off, and the largest torque [N m]."""

    hold: Hold
    landing: TorqueProfile
    push_off: TorqueProfile
    swing: TorqueProfile
    largest_torque: float


class Wish(NamedTuple):
    """Angle one sample ago [rad], 0 before the first, its filtered rate [rad/s], and the torque wanted [N m]."""

    angle: float
    rate: float
    torque: float


class Assisted(NamedTuple):
    """A sample: phase, safety, wish; 1 where the task is that of the sample before; 1 where the device acts."""

    phase: PhaseState
    safety: SafetyState
    wish: Wish
    goes_on: float
    acts: float


class AssistingParameters(Protocol):
    """Parameters of every law that assists."""

    @property
    def assistance(self) -> Assistance:
        """What is wanted."""

    @property
    def phases(self) -> PhaseRules:
        """Rules of the phases."""

    @property
    def safety(self) -> SafetyRules:
        """Rules of safety."""


class AssistingState(Protocol):
    """State of every law that assists."""

    @property
    def phase(self) -> PhaseState:
        """Where the wearer is."""

    @property
    def safety(self) -> SafetyState:
        """What safety has seen."""

    @property
    def wish(self) -> Wish:
        """What was wanted."""


START = Wish(0.0, 0.0, 0.0)


def wanted_torque(rules: Assistance, phase: PhaseState, angle: float, rate: float) -> float:
    """Torque wanted [N m], above 0 in plantarflexion, at an angle [rad] and its rate [rad/s]; 0 in mid-stance."""
    share = phase.since_strike / phase.stride_time
    hold = rules.hold
    held = hold.stiffness * (hold.swing_angle - angle) - hold.damping * rate
    landing, swing = profile_torque(rules.landing, share), profile_torque(rules.swing, share)
    lifted = held - (landing if phase.phase == phases.LANDING else swing)
    pushed = profile_torque(rules.push_off, share) if phase.phase == phases.PUSH_OFF else 0.0
    torque = lifted if phases.lifts(phase.phase) else pushed
    return max(-rules.largest_torque, min(rules.largest_torque, torque))


def same_task(before: float, after: float) -> bool:
    """True where two phases have the same task: landing and swing both hold the foot."""
    return phases.lifts(before) == phases.lifts(after) and (before == phases.PUSH_OFF) == (after == phases.PUSH_OFF)


def followed(
    parameters: AssistingParameters, state: AssistingState, measurement: GaitMeasurement, period: float
) -> Assisted:
    """Phase, safety and the torque wanted after a sample."""
    phase = phases.followed_phase(parameters.phases, state.phase, measurement.heel_force, measurement.toe_force, period)
    watch = safety.watched(parameters.safety, state.safety, state.phase, phase, measurement, period)
    last = state.wish
    turned = measurement.angle - last.angle if last.angle > 0.0 else 0.0
    rate = last.rate + (turned - period * last.rate) / (period + parameters.assistance.hold.rate_filter)
    torque = wanted_torque(parameters.assistance, phase, measurement.angle, rate)
    works = phases.lifts(phase.phase) or phase.phase == phases.PUSH_OFF
    return Assisted(
        phase=phase,
        safety=watch,
        wish=Wish(measurement.angle, rate, torque),
        goes_on=1.0 if same_task(state.phase.phase, phase.phase) else 0.0,
        acts=1.0 if works and watch.vented < 0.5 else 0.0,
    )


def torque_seen(measurement: GaitMeasurement) -> Measurement:
    """What a law of the torque task sees of it."""
    return Measurement(
        angle=measurement.angle,
        pressure_1=measurement.pressure_1,
        pressure_2=measurement.pressure_2,
        torque=measurement.torque,
    )


def given(assisted: Assisted, command: float, period: float) -> tuple[float, SafetyState]:
    """What goes to the valve, the law's command where the device acts and else ``VENT``, and what safety remembers."""
    return safety.carried_out(assisted.safety, command if assisted.acts > 0.5 else VENT, period)
