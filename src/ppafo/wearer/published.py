"""The wearer of H. Geyer and H. Herr: body, muscles, ends of joints and ground, and how the walker starts.

IEEE Trans. Neural Syst. Rehabil. Eng. 18 (2010) 263, doi:10.1109/TNSRE.2010.2047592: tables and appendix. An adult of
80 kg and 1.8 m; angles are in degrees there and in rad here.
"""

import math
from typing import Any

from ppafo.model.elementary import QUARTER_TURN
from ppafo.wearer.model.ground import Ground, Point
from ppafo.wearer.model.muscle import Fibre, Lever, Muscle
from ppafo.wearer.model.reflexes import Balance, Felt, Gains, Gait, Stimulation
from ppafo.wearer.model.segments import Body, Limb, Pose, Segment
from ppafo.wearer.model.walker import (
    HALF_TURN,
    Answer,
    Assist,
    Fibres,
    Joints,
    LegState,
    Muscles,
    Stop,
    Walker,
    Wearer,
    joints,
    leg_now,
    pull,
)
from ppafo.wearer.model.way import LEVEL

GRAVITY = 9.81
"""m/s^2, as the publication takes it."""

BODY = Body(
    trunk=Segment(length=0.8, mass_centre=0.35, mass=53.5, inertia=3.0),
    thigh=Segment(length=0.5, mass_centre=0.2, mass=8.5, inertia=0.15),
    shank=Segment(length=0.5, mass_centre=0.2, mass=3.5, inertia=0.05),
    foot=Segment(length=0.16, mass_centre=0.02, mass=1.25, inertia=0.005),
    heel=0.04,
    gravity=GRAVITY,
)
"""Trunk with head and arms, and segments of a leg; mass centres are reported from the distal end."""

MASS = BODY.trunk.mass + 2.0 * (BODY.thigh.mass + BODY.shank.mass + BODY.foot.mass)
WEIGHT = MASS * GRAVITY


def _lever(length: float, largest_at: float, rest_at: float, share: float) -> Lever:
    """A lever [m] whose angles are in degrees."""
    return Lever(lever=length, largest_at=math.radians(largest_at), rest_at=math.radians(rest_at), share=share)


MUSCLES = Muscles(
    soleus=Muscle(force=4000.0, optimum=0.04, velocity=6.0, slack=0.26, slow=0.80),
    tibialis=Muscle(force=800.0, optimum=0.06, velocity=12.0, slack=0.24, slow=0.70),
    gastrocnemius=Muscle(force=1500.0, optimum=0.05, velocity=12.0, slack=0.40, slow=0.54),
    vastus=Muscle(force=6000.0, optimum=0.08, velocity=12.0, slack=0.23, slow=0.50),
    hamstring=Muscle(force=3000.0, optimum=0.10, velocity=12.0, slack=0.31, slow=0.49),
    gluteus=Muscle(force=1500.0, optimum=0.11, velocity=12.0, slack=0.13, slow=0.55),
    flexor=Muscle(force=2000.0, optimum=0.11, velocity=12.0, slack=0.10, slow=0.50),
    soleus_ankle=_lever(0.05, 110.0, 80.0, 0.5),
    tibialis_ankle=_lever(0.04, 80.0, 110.0, 0.7),
    gastrocnemius_ankle=_lever(0.05, 110.0, 80.0, 0.7),
    gastrocnemius_knee=_lever(0.05, 140.0, 165.0, 0.7),
    vastus_knee=_lever(0.06, 165.0, 125.0, 0.7),
    hamstring_knee=_lever(0.05, 180.0, 180.0, 0.7),
    # At the hip levers do not depend on the angle.
    hamstring_hip=_lever(0.08, 0.0, 155.0, 0.7),
    gluteus_hip=_lever(0.10, 0.0, 150.0, 0.5),
    flexor_hip=_lever(0.10, 0.0, 180.0, 0.5),
    ankle_stiffness=0.0,
    ankle_rest=math.radians(90.0),
)
"""The seven muscles of a leg: soleus, tibialis anterior, gastrocnemius, vasti, hamstrings, glutei and hip flexors.

Shares of slow fibres, which the publication has not: T. K. Uchida et al., PLoS ONE 11 (2016) e0150378; means over the
heads of a muscle.
"""

STOP = Stop(
    stiffness=0.3 / math.radians(1.0),
    relaxing=math.radians(1.0),
    ankle_low=math.radians(70.0),
    ankle_high=math.radians(130.0),
    knee=math.radians(175.0),
    hip=math.radians(230.0),
)

GROUND = Ground(
    stiffness=WEIGHT / 0.01,
    stiffness_along=WEIGHT / 0.1,
    relaxing=0.03,
    sticking=0.9,
    sliding=0.8,
    rest_speed=0.01,
)


def with_size(wearer: Wearer, lengths: Any, masses: Any) -> Wearer:
    """Return a wearer of another size: factors [-] of all lengths and all masses, which may be arrays (runs,).

    Segments, levers, fibres and tendons keep their proportions, forces of muscles go with the weight, so that joint
    torques over weight and length, and gains, stay as they are. The ground gives as much under the weight as before.
    """
    body = wearer.body
    trunk, thigh, shank, foot = (
        Segment(
            length=segment.length * lengths,
            mass_centre=segment.mass_centre * lengths,
            mass=segment.mass * masses,
            inertia=segment.inertia * masses * lengths * lengths,
        )
        for segment in (body.trunk, body.thigh, body.shank, body.foot)
    )
    return wearer._replace(
        body=body._replace(trunk=trunk, thigh=thigh, shank=shank, foot=foot, heel=body.heel * lengths),
        left=_muscles_with_size(wearer.left, lengths, masses),
        right=_muscles_with_size(wearer.right, lengths, masses),
        stop=wearer.stop._replace(stiffness=wearer.stop.stiffness * masses * lengths),
        ground=wearer.ground._replace(
            stiffness=wearer.ground.stiffness * masses, stiffness_along=wearer.ground.stiffness_along * masses
        ),
        weight=wearer.weight * masses,
    )


def _muscles_with_size(muscles: Muscles, lengths: Any, masses: Any) -> Muscles:
    # Velocities are in optimum lengths a second: they grow with the lengths by themselves.
    changed: dict[str, Any] = {}
    for name, own in muscles._asdict().items():
        if isinstance(own, Muscle):
            changed[name] = own._replace(
                force=own.force * masses, optimum=own.optimum * lengths, slack=own.slack * lengths
            )
        elif isinstance(own, Lever):
            changed[name] = own._replace(lever=own.lever * lengths)
    return muscles._replace(**changed, ankle_stiffness=muscles.ankle_stiffness * masses * lengths)


def start_with_size(walker: Walker, lengths: Any) -> Walker:
    """Return the start of a wearer of another size: the same angles and speed, with all lengths by a factor [-]."""

    def of_leg(leg: LegState) -> LegState:
        fibres: dict[str, Any] = {
            name: fibre._replace(length=fibre.length * lengths) for name, fibre in leg.fibres._asdict().items()
        }
        return leg._replace(fibres=Fibres(**fibres))

    pose = walker.pose._replace(y=walker.pose.y * lengths)
    return walker._replace(pose=pose, left=of_leg(walker.left), right=of_leg(walker.right))


START_LEAN = 0.1
"""Lean [rad] of the trunk at the start."""


def published_wearer(left: Gains, right: Gains) -> Wearer:
    """The body of the publication with these gains of both legs; the published ones are in the file ``geyer-herr``."""
    return Wearer(
        body=BODY,
        left=MUSCLES,
        right=MUSCLES,
        left_gains=left,
        right_gains=right,
        stop=STOP,
        ground=GROUND,
        way=LEVEL,
        weight=WEIGHT,
    )


def limb_of(angles: Joints, lean: float) -> Limb:
    """Angles of the segments of a leg [rad] from its joints, the other way round than ``joints``."""
    thigh = HALF_TURN - angles.hip - lean
    shank = angles.knee - HALF_TURN + thigh
    return Limb(thigh, shank, shank - angles.ankle + QUARTER_TURN)


def start_of(wearer: Wearer, speed: float) -> Walker:
    """A wearer who stands on the left leg, the right in front, and moves at a speed [m/s] without turning anywhere."""
    left = limb_of(Joints(math.radians(85.0), math.radians(175.0), math.radians(175.0)), START_LEAN)
    right = limb_of(Joints(math.radians(90.0), math.radians(175.0), math.radians(140.0)), START_LEAN)
    body = wearer.body
    ankle = -body.thigh.length * math.cos(left.thigh) - body.shank.length * math.cos(left.shank)
    # Heel or ball, whichever is lower.
    lowest = ankle + min(-body.heel * math.sin(left.foot), body.foot.length * math.sin(left.foot))
    still = Limb(0.0, 0.0, 0.0)
    rates = Pose(x=speed, y=0.0, lean=0.0, left=still, right=still)
    return Walker(
        # The lower end of the foot is 3 mm in the ground.
        pose=Pose(x=0.0, y=-lowest - 0.003, lean=START_LEAN, left=left, right=right),
        rates=rates,
        halfway=rates,
        last=0.0,
        left=_leg_at_start(wearer.left, joints(left, START_LEAN)),
        right=_leg_at_start(wearer.right, joints(right, START_LEAN)),
    )


def _leg_at_start(muscles: Muscles, angles: Joints) -> LegState:
    """A leg that does not touch the ground yet, whose tendons are just without force."""
    fibre = Fibre(activation=0.05, length=0.1, velocity=0.0)
    wholes = pull(muscles, Fibres._make([fibre] * 7), angles, Joints(0.0, 0.0, 0.0), 0.0)
    none = Point(anchor=0.0, anchor_height=0.0, sticks=0.0, touches=0.0)
    return LegState(
        Fibres(
            soleus=fibre._replace(length=wholes.soleus - muscles.soleus.slack),
            tibialis=fibre._replace(length=wholes.tibialis - muscles.tibialis.slack),
            gastrocnemius=fibre._replace(length=wholes.gastrocnemius - muscles.gastrocnemius.slack),
            vastus=fibre._replace(length=wholes.vastus - muscles.vastus.slack),
            hamstring=fibre._replace(length=wholes.hamstring - muscles.hamstring.slack),
            gluteus=fibre._replace(length=wholes.gluteus - muscles.gluteus.slack),
            flexor=fibre._replace(length=wholes.flexor - muscles.flexor.slack),
        ),
        heel=none,
        ball=none,
    )


def first_answer() -> Answer:
    """What the reflexes order at the start: the least, with the left leg in stance and the right one in swing."""
    # The least stimulation that a muscle falls to.
    least = Stimulation._make([0.01] * 7)
    return Answer(to_left=least, to_right=least, left=Gait(1.0, 0.3, START_LEAN), right=Gait(0.0, 0.0, START_LEAN))


def felt_at(wearer: Wearer, walker: Walker, step: float) -> tuple[Felt, Felt, Balance]:
    """What both legs and the trunk feel in a state: what is on its way along the nerves at the start."""
    none = Assist(0.0, 0.0, 0.0)
    pose, rates, halfway = walker.pose, walker.rates, walker.halfway
    left = leg_now(wearer, wearer.left, walker.left, walker, pose.left, rates.left, halfway.left, none, step)
    right = leg_now(wearer, wearer.right, walker.right, walker, pose.right, rates.right, halfway.right, none, step)
    return left.felt, right.felt, Balance(pose.lean, rates.lean)
