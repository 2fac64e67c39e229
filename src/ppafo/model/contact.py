"""Foot on the ground: four contact states, the state after a step, and the forces under heel and toes.

In the swing and while rolling on the heel the foot moves by its own dynamics. A flat foot stands still and the ankle
follows the shank. While rolling over the toes the ankle follows the measured gait. At a transition the difference of
the ankle angles decays, so that the ankle does not jump.
"""

from typing import NamedTuple

from ppafo.model.elementary import QUARTER_TURN
from ppafo.model.gait import GaitNow, GaitTiming
from ppafo.model.leg import LegParameters

SWING = 0.0
HEEL = 1.0
FLAT = 2.0
TOE = 3.0

FADING_TIME = 0.02
"""Time [s] in which an angle difference at a transition decays to a third: about the time of a foot slap."""

NEARLY_FLAT = 0.05235987755982989
"""Angle to the ground [rad], 3 deg, below which the measured foot stands on heel and toes; above it the heel is up.

Assumed: pad and sole of a loaded heel yield by some millimetres, so that the toes touch before the foot is flat.
"""
SETTLES = 3.0
"""A foot that landed on its toes stands on its heel after the time to heel-off divided by this number."""


class Ankle(NamedTuple):
    """Ankle motion prescribed by ground and shank: angle [rad], rate [rad/s] and acceleration [rad/s^2]."""

    angle: float
    rate: float
    acceleration: float


class Landing(NamedTuple):
    """Contact state after a step, offset [rad] between the ankle and its prescribed angle, and events of the step.

    ``strikes`` and ``leaves`` are 1 if the foot struck or left the ground in the step.
    """

    contact: float
    offset: float
    strikes: float
    leaves: float


def is_free(contact: float, keeps_gait: float) -> bool:
    """Return whether the foot moves by its own dynamics; never for a wearer who keeps the gait (1)."""
    return contact < 1.5 and keeps_gait < 0.5


def foot_angle(shank: float, ankle: float) -> float:
    """Angle [rad] of the foot to the horizontal, positive with the toes up, for the angles of equation (12)."""
    return shank - ankle + QUARTER_TURN


def prescribed_ankle(contact: float, now: GaitNow, ground_angle: float, keeps_gait: float) -> Ankle:
    """Ankle motion prescribed by the ground: by the shank for a flat foot, else as measured.

    For a wearer who keeps the gait (1) the ankle is always as measured.
    """
    # Contacts are whole numbers kept as floats: 1.5 and 2.5 tell FLAT from HEEL and TOE.
    flat = contact > 1.5 and contact < 2.5 and keeps_gait < 0.5
    return Ankle(
        now.shank + QUARTER_TURN - ground_angle if flat else now.ankle,
        now.shank_rate if flat else now.ankle_rate,
        now.shank_acceleration if flat else now.ankle_acceleration,
    )


def landing(
    contact: float, timing: GaitTiming, now: GaitNow, angle: float, offset: float, keeps_gait: float
) -> Landing:
    """Contact state at the end of a step from the previous contact, the present gait and the ankle angle [rad].

    The foot of a wearer who keeps the gait (1) rolls its last degrees slowly, while its toes are already loaded.
    """
    # The gait says when the foot is on the ground, the device's own motion only how it comes to lie flat.
    stance = now.phase < timing.toe_off
    strikes = contact == SWING and stance
    flat_angle = now.shank + QUARTER_TURN - timing.ground_angle
    touches_angle = flat_angle - (NEARLY_FLAT if keeps_gait > 0.5 else 0.0)
    falls_flat = contact == HEEL and angle >= touches_angle and now.phase < timing.heel_off
    # Also from HEEL: a foot that the device kept up until heel-off never was flat.
    rises = contact > 0.5 and contact < 2.5 and now.phase >= timing.heel_off
    leaves = contact != SWING and not stance
    # Later lines win: a foot that falls flat and lifts its heel in one step ends on the toes, and toe-off ends them
    # all.
    after = HEEL if strikes else contact
    after = FLAT if falls_flat else after
    after = TOE if rises else after
    after = SWING if leaves else after
    # The offset from the angle of the new contact fades from here on, so that the ankle does not jump.
    difference = angle - (now.ankle if keeps_gait > 0.5 else flat_angle) if falls_flat else offset
    difference = angle - now.ankle if rises else difference
    return Landing(contact=after, offset=difference, strikes=1.0 if strikes else 0.0, leaves=1.0 if leaves else 0.0)


def heel_fraction(contact: float, timing: GaitTiming, phase: float, toes_first: float) -> float:
    """Fraction [-] of the ground force under the heel: 1 while rolling on the heel, 0 on the toes, linear in between.

    A foot that landed on its toes (``toes_first`` 1) starts with a fraction of 0.
    """
    passed = max(0.0, min(1.0, phase / timing.heel_off))
    flat = 1.0 - passed
    rolling = 1.0 if contact == HEEL else flat
    # The heel takes its load over the first third of that time; it is not there at once.
    fraction = flat * min(1.0, SETTLES * passed) if toes_first > 0.5 else rolling
    return fraction if contact > 0.5 and contact < 2.5 else 0.0


def ground_lever(leg: LegParameters, tilt: float) -> float:
    """Lever arm [m] of the ground force behind the ankle for a tilt [rad]; it decreases as the heel rolls down."""
    # The tilt where it is above 0, else 0, and a fraction that saturates: smooth enough for the step's error estimate.
    raised = 0.5 * (tilt + abs(tilt))
    return leg.flat_heel_lever + (leg.heel_lever - leg.flat_heel_lever) * raised / (raised + leg.heel_roll_angle)


def heel_torque(contact: float, now: GaitNow, leg: LegParameters, ground_angle: float, angle: float) -> float:
    """Torque [N m] of the ground about the ankle while the foot rolls on its heel, positive in plantarflexion.

    The torque is the part of the measured moment that does not move the healthy foot or, for a flat foot, the force
    times the lever arm of a nearly flat heel. At an ankle angle [rad] at which this foot is tilted up further, the same
    force has a longer lever arm: the ground force has rolled less far forward, which turns a loaded foot down.
    """
    lever = ground_lever(leg, foot_angle(now.shank, angle) - ground_angle)
    healthy = ground_lever(leg, foot_angle(now.shank, now.ankle) - ground_angle)
    # At least the ground force on the lever of a nearly flat heel: a moment measured in dorsiflexion would otherwise
    # lift the foot.
    measured = now.healthy_torque + max(-now.moment, now.force * leg.flat_heel_lever)
    return measured + now.force * (lever - healthy) if contact == HEEL else 0.0


def ground_forces(contact: float, timing: GaitTiming, now: GaitNow, toes_first: float) -> tuple[float, float]:
    """Forces [N] under heel and toes; none in the swing."""
    total = 0.0 if contact == SWING else now.force
    fraction = heel_fraction(contact, timing, now.phase, toes_first)
    return total * fraction, total * (1.0 - fraction)
