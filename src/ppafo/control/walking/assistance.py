"""Torque that a walking device requests in each phase of the gait, independent of the law that tracks the torque.

Landing: a profile in dorsiflexion that lowers the foot, plus a spring and damper that support it. Mid-stance: vented.
Push-off: a profile in plantarflexion. Swing: a profile in dorsiflexion plus the same spring and damper.

The profile has the four parameters of the exoskeleton literature, J. Zhang et al., Science 356 (2017) 1280: zero, a
smooth rise to the peak, a smooth fall, zero; cubic with zero slope at its ends.
"""

from typing import NamedTuple

from ppafo.control.torque_loop import whole_reach
from ppafo.control.walking import phases
from ppafo.control.walking.phases import PHASE_QUANTITIES, PhaseState
from ppafo.model.declaration import Quantity
from ppafo.model.helping import LANDING, MID_STANCE, PUSH_OFF

PEAKS = ("peak_torque", "landing_peak_torque", "swing_peak_torque")
"""Settings that ``largest_torque`` limits."""
EASING_TIME = 0.1
"""Time [s] after a landing on the toes in which the law removes a torque in plantarflexion; later the chambers vent."""
EASED = 0.3
"""Torque in plantarflexion [N m] above which the law removes it; a limit of the wearer, not of the actuator."""
LARGEST_PRESS = 0.7
"""Largest torque in plantarflexion [N m] requested in the swing: about the weight of a foot with its shoe."""


class TorqueProfile(NamedTuple):
    """Peak torque [N m], and peak time, rise time and fall time [strides] after the heel strike."""

    peak_torque: float
    peak_time: float
    rise_time: float
    fall_time: float


def smooth(fraction: float) -> float:
    """Cubic x^2 (3 - 2 x) from 0 to 1 with zero slope at both ends, at a fraction x [-]."""
    inside = max(0.0, min(1.0, fraction))
    return inside * inside * (3.0 - 2.0 * inside)


def profile_torque(profile: TorqueProfile, phase: float) -> float:
    """Requested torque [N m] at a phase p in turns from the heel strike, with S the cubic of ``smooth``:

    peak_torque (S((p - peak_time + rise_time) / rise_time) - S((p - peak_time) / fall_time))
    """
    rise = smooth((phase - profile.peak_time + profile.rise_time) / profile.rise_time)
    fall = smooth((phase - profile.peak_time) / profile.fall_time)
    return profile.peak_torque * (rise - fall)


# The requested torque is a prescription for a wearer, not a number of the device: by default the paper's, whatever
# the actuator could give. Only the limit of it follows the device.

HOLD_QUANTITIES = (
    Quantity("swing_angle", "rad", "target angle of the lifted foot", 1.28, 0.5, 2.5),
    Quantity("hold_stiffness", "N m/rad", "requested torque per angle from the target (stiffness)", 3.7, 0.0, 1.0e3),
    Quantity(
        "hold_damping", "N m s/rad", "requested torque per angular velocity, opposing it (damping)", 0.35, 0.0, 1.0e3
    ),
    Quantity("angle_rate_filter", "s", "time constant of the filter on the angle's rate", 0.006, 0.0, 1.0),
)

PUSH_OFF_QUANTITIES = (
    Quantity("peak_torque", "N m", "peak of the torque in push-off", 5.0, 0.0, 1.0e3),
    Quantity("peak_time", "1", "phase of the peak, fraction of the stride time", 0.53, 0.1, 0.9),
    Quantity("rise_time", "1", "fraction of the stride time from zero to the peak", 0.15, 0.01, 0.8),
    Quantity("fall_time", "1", "fraction of the stride time from the peak to zero", 0.09, 0.01, 0.8),
)

ASSISTANCE_QUANTITIES = (
    *HOLD_QUANTITIES,
    Quantity("landing_peak_torque", "N m", "peak of the torque in dorsiflexion while landing", 5.0, 0.0, 1.0e3),
    Quantity("landing_peak_time", "1", "phase of that peak", 0.046, 0.0, 0.9),
    Quantity("landing_rise_time", "1", "fraction of the stride time from zero to that peak", 0.09, 0.01, 0.8),
    Quantity("landing_fall_time", "1", "fraction of the stride time from that peak to zero", 0.078, 0.01, 0.8),
    *PUSH_OFF_QUANTITIES,
    Quantity("swing_peak_torque", "N m", "peak of the torque in dorsiflexion in the swing", 2.7, 0.0, 1.0e3),
    Quantity("swing_peak_time", "1", "phase of that peak", 0.805, 0.1, 1.0),
    Quantity("swing_rise_time", "1", "fraction of the stride time from zero to that peak", 0.24, 0.01, 0.8),
    Quantity("swing_fall_time", "1", "fraction of the stride time from that peak to zero", 0.14, 0.01, 0.8),
    Quantity(
        "largest_torque",
        "N m",
        "limit of the magnitude of the requested torque; default: the torque that the actuator reaches",
        None,
        0.0,
        1.0e3,
        follows=whole_reach,
    ),
)
"""Fields of ``Assistance`` in order."""


ASSISTING_QUANTITIES = (*ASSISTANCE_QUANTITIES, *PHASE_QUANTITIES)
"""Settings that every law with ``assistance`` declares after those of the law."""


class Assistance(NamedTuple):
    """Assistance settings: spring and damper for the lifted foot, torque profiles, and torque limit [N m].

    Spring and damper have an equilibrium ``swing_angle`` [rad], a ``stiffness`` [N m/rad], a ``damping`` [N m s/rad]
    and a ``rate_filter`` on the angular rate [s]. The profiles ``landing`` and ``swing`` are in dorsiflexion,
    ``push_off`` is in plantarflexion.
    """

    swing_angle: float
    stiffness: float
    damping: float
    rate_filter: float
    landing: TorqueProfile
    push_off: TorqueProfile
    swing: TorqueProfile
    largest_torque: float


class TorqueRequest(NamedTuple):
    """Previous angle [rad] (0 at the first sample), filtered angular rate [rad/s], and requested torque [N m]."""

    angle: float = 0.0
    rate: float = 0.0
    torque: float = 0.0


START = TorqueRequest()


def requested_torque(rules: Assistance, phase: PhaseState, angle: float, rate: float) -> float:
    """Requested torque [N m], positive in plantarflexion, at an angle q [rad] and its rate [rad/s]; 0 in mid-stance.

    Landing and swing: stiffness (swing_angle - q) - damping dq/dt, minus the profile of the phase. Push-off: its
    profile.
    """
    fraction = phase.since_strike / phase.stride_time
    hold = rules.stiffness * (rules.swing_angle - angle) - rules.damping * rate
    landing = profile_torque(rules.landing, fraction)
    swing = profile_torque(rules.swing, fraction)
    lands = phase.phase == LANDING
    # Profiles of landing and swing are given as torques in dorsiflexion, hence the minus.
    lifted = hold - (landing if lands else swing)
    # On the heel nothing presses the toes down, and in the air little: an angle that is read too low asks for it.
    lifted = min(lifted, 0.0 if lands else LARGEST_PRESS)
    pushed = profile_torque(rules.push_off, fraction) if phase.phase == PUSH_OFF else 0.0
    torque = lifted if phases.lifts(phase.phase) else pushed
    return max(-rules.largest_torque, min(rules.largest_torque, torque))


def same_task(before: float, after: float) -> bool:
    """Return whether two phases (0 to 3) have the same task; landing and swing share the task of lifting the foot."""
    return phases.lifts(before) == phases.lifts(after) and (before == PUSH_OFF) == (after == PUSH_OFF)


def next_request(
    rules: Assistance, last: TorqueRequest, phase: PhaseState, angle: float, period: float
) -> TorqueRequest:
    """Requested torque after a sample of the angle [rad], taken every ``period`` [s], in the present phase."""
    # An angle of 0 marks that there was no sample before.
    turned = angle - last.angle if last.angle > 0.0 else 0.0
    # A filter of first order, with an implicit step: stable for any time constant.
    rate = last.rate + (turned - period * last.rate) / (period + rules.rate_filter)
    return TorqueRequest(angle, rate, requested_torque(rules, phase, angle, rate))


def acts(phase: PhaseState, torque: float) -> bool:
    """Return whether the law commands the valve at a torque of the actuator [N m]; else both chambers are vented."""
    # A foot that lands on its toes turns far, and gas left in the chamber would then push on a loaded heel: the law
    # takes it off. A stance that began on the toes has been in mid-stance since its strike: it had no landing.
    on_toes = phase.phase == MID_STANCE and phase.in_phase >= phase.since_strike
    is_eased = on_toes and phase.since_strike < EASING_TIME and torque > EASED
    has_task = phases.lifts(phase.phase) or phase.phase == PUSH_OFF or is_eased
    return has_task and not phases.lacks_event(phase)
