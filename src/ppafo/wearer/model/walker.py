"""A step of the whole wearer: muscles pull, the ground pushes, reflexes answer what was felt, segments move.

H. Geyer and H. Herr, IEEE Trans. Neural Syst. Rehabil. Eng. 18 (2010) 263.
"""

from typing import NamedTuple

from ppafo.model.elementary import QUARTER_TURN
from ppafo.wearer.model.ground import Ground, Point, contact
from ppafo.wearer.model.muscle import Fibre, Lever, Muscle, arm_and_way, next_fibre, tendon_force
from ppafo.wearer.model.reflexes import Balance, Felt, Gains, Gait, Stimulation, next_gait, stimulation
from ppafo.wearer.model.segments import (
    Body,
    Damping,
    LegMatrix,
    Limb,
    Pose,
    accelerations,
    circle,
    freed,
    leg_matrix,
)
from ppafo.wearer.model.way import Way, footing

HALF_TURN = 3.141592653589793


class Muscles(NamedTuple):
    """Muscles of a leg, how they pass ankle, knee and hip, and what else resists the ankle.

    That is ``ankle_stiffness`` [N m/rad] around ``ankle_rest`` [rad], 0 in a healthy leg, whose ends are in ``Stop``.
    """

    soleus: Muscle
    tibialis: Muscle
    gastrocnemius: Muscle
    vastus: Muscle
    hamstring: Muscle
    gluteus: Muscle
    flexor: Muscle
    soleus_ankle: Lever
    tibialis_ankle: Lever
    gastrocnemius_ankle: Lever
    gastrocnemius_knee: Lever
    vastus_knee: Lever
    hamstring_knee: Lever
    hamstring_hip: Lever
    gluteus_hip: Lever
    flexor_hip: Lever
    ankle_stiffness: float
    ankle_rest: float


class Stop(NamedTuple):
    """Soft ends of joints: stiffness [N m/rad], rate at which they relax [rad/s], angles [rad]."""

    stiffness: float
    relaxing: float
    ankle_low: float
    ankle_high: float
    knee: float
    hip: float


class Wearer(NamedTuple):
    """A wearer: body, muscles of both legs, gains of both legs, ends of joints, ground, way, weight [N]."""

    body: Body
    left: Muscles
    right: Muscles
    left_gains: Gains
    right_gains: Gains
    stop: Stop
    ground: Ground
    way: Way
    weight: float


class Fibres(NamedTuple):
    """State of the muscles of a leg."""

    soleus: Fibre
    tibialis: Fibre
    gastrocnemius: Fibre
    vastus: Fibre
    hamstring: Fibre
    gluteus: Fibre
    flexor: Fibre


class LegState(NamedTuple):
    """State of a leg beside its angles: muscles, heel and ball on the ground."""

    fibres: Fibres
    heel: Point
    ball: Point


class Walker(NamedTuple):
    """State of a wearer, without what is on its way along the nerves.

    ``halfway`` are the rates in the middle of the ``last`` step [s], from which the next step leaps; ``rates`` those at
    the pose, by the accelerations of that step.
    """

    pose: Pose
    rates: Pose
    halfway: Pose
    last: float
    left: LegState
    right: LegState


class Assist(NamedTuple):
    """What a device does to an ankle: torque [N m], plantarflexion above 0, damping [N m s/rad], inertia [kg m^2]."""

    torque: float
    damping: float
    inertia: float


class Joints(NamedTuple):
    """Angles of ankle, knee and hip [rad], or rates; 90 deg, straight and straight at 90, 180 and 180 deg."""

    ankle: float
    knee: float
    hip: float


class Pull(NamedTuple):
    """A leg's muscles: lengths with tendons halfway through the step [m], torques on the joints [N m], what is felt.

    A torque above 0 makes the angle of its joint grow.
    """

    soleus: float
    tibialis: float
    gastrocnemius: float
    vastus: float
    hamstring: float
    gluteus: float
    flexor: float
    ankle: float
    knee: float
    hip: float
    felt: Felt


def whole(muscle: Muscle, way: float) -> float:
    """Length of muscle and tendon [m] where the fibres have moved from rest [m]."""
    return muscle.optimum + muscle.slack + way


def force(muscle: Muscle, fibre: Fibre, length: float) -> float:
    """Force of the tendon [largest forces] at a length of muscle and tendon [m]."""
    return tendon_force(muscle, length - fibre.length)


def pull(muscles: Muscles, fibres: Fibres, angle: Joints, rate: Joints, ahead: float) -> Pull:
    """How the muscles of a leg pull at joint angles [rad], and how long they are a time ``ahead`` [s] at these rates.

    The load that is felt is not known here.
    """
    soleus_arm, soleus_way = arm_and_way(muscles.soleus_ankle, angle.ankle)
    tibialis_arm, tibialis_way = arm_and_way(muscles.tibialis_ankle, angle.ankle)
    calf_arm, calf_way = arm_and_way(muscles.gastrocnemius_ankle, angle.ankle)
    back_arm, back_way = arm_and_way(muscles.gastrocnemius_knee, angle.knee)
    vastus_arm, vastus_way = arm_and_way(muscles.vastus_knee, angle.knee)
    ham_arm, ham_way = arm_and_way(muscles.hamstring_knee, angle.knee)
    # At the hip levers do not depend on the angle, so the way is in proportion to it.
    hip_share = muscles.hamstring_hip.share * muscles.hamstring_hip.lever
    gluteus_share = muscles.gluteus_hip.share * muscles.gluteus_hip.lever
    flexor_share = muscles.flexor_hip.share * muscles.flexor_hip.lever
    soleus = whole(muscles.soleus, -soleus_way)
    tibialis = whole(muscles.tibialis, tibialis_way)
    gastrocnemius = whole(muscles.gastrocnemius, back_way - calf_way)
    vastus = whole(muscles.vastus, -vastus_way)
    hamstring = whole(muscles.hamstring, ham_way + hip_share * (muscles.hamstring_hip.rest_at - angle.hip))
    gluteus = whole(muscles.gluteus, gluteus_share * (muscles.gluteus_hip.rest_at - angle.hip))
    flexor = whole(muscles.flexor, flexor_share * (angle.hip - muscles.flexor_hip.rest_at))
    # Forces pull now, at the lengths of now; the fibres move with the lengths halfway through the step, below.
    soleus_force = force(muscles.soleus, fibres.soleus, soleus)
    tibialis_force = force(muscles.tibialis, fibres.tibialis, tibialis)
    calf_force = force(muscles.gastrocnemius, fibres.gastrocnemius, gastrocnemius)
    vastus_force = force(muscles.vastus, fibres.vastus, vastus)
    ham_force = force(muscles.hamstring, fibres.hamstring, hamstring)
    gluteus_force = force(muscles.gluteus, fibres.gluteus, gluteus)
    flexor_force = force(muscles.flexor, fibres.flexor, flexor)
    ankle_turn, knee_turn, hip_turn = ahead * rate.ankle, ahead * rate.knee, ahead * rate.hip
    calf_turn = muscles.gastrocnemius_knee.share * back_arm * knee_turn
    calf_turn -= muscles.gastrocnemius_ankle.share * calf_arm * ankle_turn
    calf = calf_force * muscles.gastrocnemius.force
    ham = ham_force * muscles.hamstring.force
    return Pull(
        soleus=soleus - muscles.soleus_ankle.share * soleus_arm * ankle_turn,
        tibialis=tibialis + muscles.tibialis_ankle.share * tibialis_arm * ankle_turn,
        gastrocnemius=gastrocnemius + calf_turn,
        vastus=vastus - muscles.vastus_knee.share * vastus_arm * knee_turn,
        hamstring=hamstring + muscles.hamstring_knee.share * ham_arm * knee_turn - hip_share * hip_turn,
        gluteus=gluteus - gluteus_share * hip_turn,
        flexor=flexor + flexor_share * hip_turn,
        ankle=soleus_force * muscles.soleus.force * soleus_arm
        + calf * calf_arm
        - tibialis_force * muscles.tibialis.force * tibialis_arm,
        knee=vastus_force * muscles.vastus.force * vastus_arm - calf * back_arm - ham * ham_arm,
        hip=ham * muscles.hamstring_hip.lever
        + gluteus_force * muscles.gluteus.force * muscles.gluteus_hip.lever
        - flexor_force * muscles.flexor.force * muscles.flexor_hip.lever,
        felt=Felt(
            soleus=soleus_force,
            gastrocnemius=calf_force,
            soleus_stretch=fibres.soleus.velocity / muscles.soleus.optimum,
            gastrocnemius_stretch=fibres.gastrocnemius.velocity / muscles.gastrocnemius.optimum,
            tibialis=fibres.tibialis.length / muscles.tibialis.optimum,
            vastus=vastus_force,
            knee=angle.knee,
            knee_rate=rate.knee,
            hamstring=ham_force,
            gluteus=gluteus_force,
            hamstring_length=fibres.hamstring.length / muscles.hamstring.optimum,
            flexor_length=fibres.flexor.length / muscles.flexor.optimum,
            load=0.0,
        ),
    )


class End(NamedTuple):
    """Torque of a soft end on a joint [N m], growing its angle, and its damping [N m s/rad]."""

    torque: float
    damping: float


def end_of_joint(stop: Stop, low: float, high: float, angle: float, rate: float) -> End:
    """Soft ends at ``low`` and ``high`` [rad] of a joint, which never pull."""
    # Both factors may not fall below 0: an end that a joint leaves quickly would pull it back.
    above, below = max(angle - high, 0.0), max(low - angle, 0.0)
    closing = 1.0 + rate / stop.relaxing
    opening = 1.0 - rate / stop.relaxing
    torque = stop.stiffness * (below * max(opening, 0.0) - above * max(closing, 0.0))
    damping = stop.stiffness / stop.relaxing * ((above if closing > 0.0 else 0.0) + (below if opening > 0.0 else 0.0))
    return End(torque, damping)


def joints(limb: Limb, lean: float) -> Joints:
    """Joint angles [rad] of a leg: ankle grows in plantarflexion, knee and hip in extension."""
    return Joints(
        limb.shank - limb.foot + QUARTER_TURN, HALF_TURN + limb.shank - limb.thigh, HALF_TURN - limb.thigh - lean
    )


def rates_of_joints(limb: Limb, lean: float) -> Joints:
    """Rates of the joints [rad/s] from those of the segments."""
    return Joints(limb.shank - limb.foot, limb.shank - limb.thigh, -limb.thigh - lean)


class LegNow(NamedTuple):
    """A leg in a step: what it feels, its equations, the points on the ground after it, torque on the hip, and forces.

    Forces of the ground [N]: forward and up in all, and normal to it under heel and ball. ``place`` is the ankle in
    front of the hip [m], ``toes`` the height of the ball over the ground below it [m], at the begin of the step.
    """

    pull: Pull
    felt: Felt
    matrix: LegMatrix
    heel: Point
    ball: Point
    hip: float
    force_x: float
    force_y: float
    heel_up: float
    ball_up: float
    place: float
    toes: float


def leg_now(
    wearer: Wearer,
    muscles: Muscles,
    state: LegState,
    walker: Walker,
    limb: Limb,
    limb_rates: Limb,
    limb_halfway: Limb,
    assist: Assist,
    step: float,
) -> LegNow:
    """Everything about one leg before the body moves."""
    body, ground, pose, rates = wearer.body, wearer.ground, walker.pose, walker.rates
    angle, rate = joints(limb, pose.lean), rates_of_joints(limb_rates, rates.lean)
    # How much faster all moves than halfway through the last step, where the implicit damping begins.
    gained = Limb(
        limb_rates.thigh - limb_halfway.thigh,
        limb_rates.shank - limb_halfway.shank,
        limb_rates.foot - limb_halfway.foot,
    )
    turned = circle(limb)
    x = pose.x + body.thigh.length * turned.thigh_sine + body.shank.length * turned.shank_sine
    y = pose.y - body.thigh.length * turned.thigh_cosine - body.shank.length * turned.shank_cosine
    thigh_speed, shank_speed = body.thigh.length * limb_rates.thigh, body.shank.length * limb_rates.shank
    speed_x = rates.x + thigh_speed * turned.thigh_cosine + shank_speed * turned.shank_cosine
    speed_y = rates.y + thigh_speed * turned.thigh_sine + shank_speed * turned.shank_sine
    # The foot's angle from the vertical is its angle over the ground plus 90 deg: its direction is (sine, -cosine).
    along, up = turned.foot_sine, -turned.foot_cosine
    heel_x, ball_x, ball_y = x - body.heel * along, x + body.foot.length * along, y + body.foot.length * up
    under_ball = footing(wearer.way, ball_x)
    thigh_gained, shank_gained = body.thigh.length * gained.thigh, body.shank.length * gained.shank
    gained_x = rates.x - walker.halfway.x + thigh_gained * turned.thigh_cosine + shank_gained * turned.shank_cosine
    gained_y = rates.y - walker.halfway.y + thigh_gained * turned.thigh_sine + shank_gained * turned.shank_sine
    heel_gained_x, heel_gained_y = gained_x + body.heel * up * gained.foot, gained_y - body.heel * along * gained.foot
    ball_gained_x = gained_x - body.foot.length * up * gained.foot
    ball_gained_y = gained_y + body.foot.length * along * gained.foot
    heel = contact(
        ground,
        footing(wearer.way, heel_x),
        state.heel,
        heel_x,
        y - body.heel * up,
        speed_x + body.heel * up * limb_rates.foot,
        speed_y - body.heel * along * limb_rates.foot,
        walker.last,
    )
    ball = contact(
        ground,
        under_ball,
        state.ball,
        ball_x,
        ball_y,
        speed_x - body.foot.length * up * limb_rates.foot,
        speed_y + body.foot.length * along * limb_rates.foot,
        walker.last,
    )
    pulled = pull(muscles, state.fibres, angle, rate, 0.5 * step)
    ankle_end = end_of_joint(wearer.stop, wearer.stop.ankle_low, wearer.stop.ankle_high, angle.ankle, rate.ankle)
    knee_end = end_of_joint(wearer.stop, 0.0, wearer.stop.knee, angle.knee, rate.knee)
    hip_end = wearer.stop.stiffness * max(angle.hip - wearer.stop.hip, 0.0)
    stiff = muscles.ankle_stiffness * (angle.ankle - muscles.ankle_rest)
    ankle_damping = ankle_end.damping + assist.damping
    ankle = pulled.ankle + ankle_end.torque - stiff + assist.torque - assist.damping * rate.ankle
    ankle += ankle_damping * (gained.shank - gained.foot)
    knee = pulled.knee + knee_end.torque + knee_end.damping * (gained.shank - gained.thigh)
    hip = pulled.hip - hip_end
    damping = Damping(
        heel_xx=heel.damping_xx,
        heel_xy=heel.damping_xy,
        heel_yx=heel.damping_yx,
        heel_yy=heel.damping_yy,
        ball_xx=ball.damping_xx,
        ball_xy=ball.damping_xy,
        ball_yx=ball.damping_yx,
        ball_yy=ball.damping_yy,
        ankle=ankle_damping,
        knee=knee_end.damping,
        ankle_inertia=assist.inertia,
    )
    matrix = leg_matrix(
        body,
        turned,
        limb_rates,
        Limb(-knee - hip, ankle + knee, -ankle),
        heel.force_x + heel.damping_xx * heel_gained_x + heel.damping_xy * heel_gained_y,
        heel.force_y + heel.damping_yx * heel_gained_x + heel.damping_yy * heel_gained_y,
        ball.force_x + ball.damping_xx * ball_gained_x + ball.damping_xy * ball_gained_y,
        ball.force_y + ball.damping_yx * ball_gained_x + ball.damping_yy * ball_gained_y,
        damping,
        0.5 * walker.last,
    )
    felt = pulled.felt
    return LegNow(
        pull=pulled,
        felt=Felt(
            soleus=felt.soleus,
            gastrocnemius=felt.gastrocnemius,
            soleus_stretch=felt.soleus_stretch,
            gastrocnemius_stretch=felt.gastrocnemius_stretch,
            tibialis=felt.tibialis,
            vastus=felt.vastus,
            knee=felt.knee,
            knee_rate=felt.knee_rate,
            hamstring=felt.hamstring,
            gluteus=felt.gluteus,
            hamstring_length=felt.hamstring_length,
            flexor_length=felt.flexor_length,
            load=(heel.normal + ball.normal) / wearer.weight,
        ),
        matrix=matrix,
        heel=heel.after,
        ball=ball.after,
        hip=hip,
        force_x=heel.force_x + ball.force_x,
        force_y=heel.force_y + ball.force_y,
        heel_up=heel.normal,
        ball_up=ball.normal,
        place=x - pose.x,
        toes=ball_y - under_ball.height,
    )


def next_fibres(muscles: Muscles, fibres: Fibres, given: Stimulation, now: Pull, step: float) -> Fibres:
    """The muscles of a leg after a step [s]."""
    return Fibres(
        soleus=next_fibre(muscles.soleus, fibres.soleus, given.soleus, now.soleus, step),
        tibialis=next_fibre(muscles.tibialis, fibres.tibialis, given.tibialis, now.tibialis, step),
        gastrocnemius=next_fibre(
            muscles.gastrocnemius, fibres.gastrocnemius, given.gastrocnemius, now.gastrocnemius, step
        ),
        vastus=next_fibre(muscles.vastus, fibres.vastus, given.vastus, now.vastus, step),
        hamstring=next_fibre(muscles.hamstring, fibres.hamstring, given.hamstring, now.hamstring, step),
        gluteus=next_fibre(muscles.gluteus, fibres.gluteus, given.gluteus, now.gluteus, step),
        flexor=next_fibre(muscles.flexor, fibres.flexor, given.flexor, now.flexor, step),
    )


def moved_limb(limb: Limb, by: Limb, step: float) -> Limb:
    """A leg after a step [s] at these rates."""
    return Limb(limb.thigh + step * by.thigh, limb.shank + step * by.shank, limb.foot + step * by.foot)


def moved(pose: Pose, by: Pose, step: float) -> Pose:
    """A pose after a step [s] at these rates."""
    return Pose(
        x=pose.x + step * by.x,
        y=pose.y + step * by.y,
        lean=pose.lean + step * by.lean,
        left=moved_limb(pose.left, by.left, step),
        right=moved_limb(pose.right, by.right, step),
    )


class Stepped(NamedTuple):
    """A wearer after a step; both legs, and what they and the trunk felt, at its begin."""

    after: Walker
    left: LegNow
    right: LegNow
    left_felt: Felt
    right_felt: Felt
    balance: Balance


def next_walker(
    wearer: Wearer,
    walker: Walker,
    to_left: Stimulation,
    to_right: Stimulation,
    left_assist: Assist,
    right_assist: Assist,
    push: float,
    step: float,
) -> Stepped:
    """A wearer after a step [s] in which the muscles are stimulated so, and devices act on the ankles.

    ``push`` [N] is on the trunk, forward above 0. Rates leap from the middle of the last step to that of this one
    (Stoermer and Verlet): what depends on the pose is then of second order as it is, and damping by the mean of both.
    """
    pose, rates, halfway = walker.pose, walker.rates, walker.halfway
    left = leg_now(wearer, wearer.left, walker.left, walker, pose.left, rates.left, halfway.left, left_assist, step)
    right = leg_now(
        wearer, wearer.right, walker.right, walker, pose.right, rates.right, halfway.right, right_assist, step
    )
    pushed = accelerations(
        wearer.body, pose.lean, rates.lean, -left.hip - right.hip, push, freed(left.matrix), freed(right.matrix)
    )
    # Steps may differ in length: from the middle of the last one to the middle of this one.
    after = moved(halfway, pushed, 0.5 * (walker.last + step))
    left_fibres = next_fibres(wearer.left, walker.left.fibres, to_left, left.pull, step)
    right_fibres = next_fibres(wearer.right, walker.right.fibres, to_right, right.pull, step)
    return Stepped(
        after=Walker(
            pose=moved(pose, after, step),
            rates=moved(after, pushed, 0.5 * step),
            halfway=after,
            last=step,
            left=LegState(left_fibres, left.heel, left.ball),
            right=LegState(right_fibres, right.heel, right.ball),
        ),
        left=left,
        right=right,
        left_felt=left.felt,
        right_felt=right.felt,
        balance=Balance(pose.lean, rates.lean),
    )


class Answer(NamedTuple):
    """What reflexes order until their next sample, and the phases of both legs."""

    to_left: Stimulation
    to_right: Stimulation
    left: Gait
    right: Gait


def answer(
    wearer: Wearer,
    left: Gait,
    right: Gait,
    left_felt: Felt,
    right_felt: Felt,
    balance: Balance,
    period: float,
) -> Answer:
    """The reflexes at a sample, a ``period`` [s] after the last; felt is what has come along the nerves by now."""
    left_gait = next_gait(left, left_felt.load, balance.lean, period)
    right_gait = next_gait(right, right_felt.load, balance.lean, period)
    # In double support the leg that has stood longer is the rear one, which prepares its swing.
    both = left_gait.stands > 0.5 and right_gait.stands > 0.5
    left_trails = 1.0 if both and left_gait.since > right_gait.since else 0.0
    right_trails = 1.0 if both and right_gait.since > left_gait.since else 0.0
    return Answer(
        to_left=stimulation(wearer.left_gains, left_felt, balance, left_gait, right_felt.load, left_trails),
        to_right=stimulation(wearer.right_gains, right_felt, balance, right_gait, left_felt.load, right_trails),
        left=left_gait,
        right=right_gait,
    )
