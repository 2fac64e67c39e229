"""Seven rigid segments in the sagittal plane: trunk, and thigh, shank and foot of both legs; a step of their motion.

Coordinates: the hip (x forward, y up, against gravity), the lean of the trunk from the vertical, forward above 0, and
the angles of the segments of each leg: thigh and shank from the vertical, above 0 where the lower end is in front; the
foot over the horizontal, above 0 with the toes up. The foot is a line from heel to ball through the ankle, without a
height.

Body: H. Geyer and H. Herr, IEEE Trans. Neural Syst. Rehabil. Eng. 18 (2010) 263, table of segments.
"""

from typing import NamedTuple

from ppafo.model.elementary import TURNS_OF_RADIAN, sine_and_cosine_of_turns


class Segment(NamedTuple):
    """Length [m], distance of the mass centre from the joint above [m], mass [kg], inertia about it [kg m^2]."""

    length: float
    mass_centre: float
    mass: float
    inertia: float


class Body(NamedTuple):
    """Segments of a wearer, SI units.

    Of the foot ``length`` is from ankle to ball, and ``heel`` [m] is behind the ankle; the trunk begins at the hip.
    ``gravity`` [m/s^2].
    """

    trunk: Segment
    thigh: Segment
    shank: Segment
    foot: Segment
    heel: float
    gravity: float


class Limb(NamedTuple):
    """Angles [rad], rates [rad/s] or torques [N m] of thigh, shank and foot."""

    thigh: float
    shank: float
    foot: float


class Pose(NamedTuple):
    """The hip [m] and all angles [rad], or their rates, or generalised forces on them."""

    x: float
    y: float
    lean: float
    left: Limb
    right: Limb


class Damping(NamedTuple):
    """Linear damping of a leg that a step takes implicitly.

    Of the ground under heel and ball, forward and up [N s/m], with what a speed up damps forward, ``xy``, and the other
    way round; of ankle and knee [N m s/rad]; and the inertia that a device adds to the ankle [kg m^2].
    """

    heel_xx: float
    heel_xy: float
    heel_yx: float
    heel_yy: float
    ball_xx: float
    ball_xy: float
    ball_yx: float
    ball_yy: float
    ankle: float
    knee: float
    ankle_inertia: float


class Circle(NamedTuple):
    """Sine and cosine of the angle of each segment of a leg from the vertical; of the foot of that plus 90 deg."""

    thigh_sine: float
    thigh_cosine: float
    shank_sine: float
    shank_cosine: float
    foot_sine: float
    foot_cosine: float


class LegMatrix(NamedTuple):
    """A leg in the equations of motion: its block, the columns and rows that couple it to the hip, its forces.

    1 is the thigh, 2 the shank, 3 the foot; ``hip_xx`` to ``hip_yy`` and ``force_x``, ``force_y`` go to the hip.
    Columns are ``x`` and ``y``, rows ``along`` and ``up``: friction follows the normal force, and nothing answers it.
    """

    m11: float
    m12: float
    m13: float
    m21: float
    m22: float
    m23: float
    m31: float
    m32: float
    m33: float
    x1: float
    x2: float
    x3: float
    y1: float
    y2: float
    y3: float
    along1: float
    along2: float
    along3: float
    up1: float
    up2: float
    up3: float
    b1: float
    b2: float
    b3: float
    hip_xx: float
    hip_xy: float
    hip_yx: float
    hip_yy: float
    force_x: float
    force_y: float


def circle(limb: Limb) -> Circle:
    """Sines and cosines of a leg's angles [rad]."""
    thigh_sine, thigh_cosine = sine_and_cosine_of_turns(limb.thigh * TURNS_OF_RADIAN)
    shank_sine, shank_cosine = sine_and_cosine_of_turns(limb.shank * TURNS_OF_RADIAN)
    sine, cosine = sine_and_cosine_of_turns(limb.foot * TURNS_OF_RADIAN)
    return Circle(
        thigh_sine=thigh_sine,
        thigh_cosine=thigh_cosine,
        shank_sine=shank_sine,
        shank_cosine=shank_cosine,
        foot_sine=cosine,
        foot_cosine=-sine,
    )


def leg_matrix(
    body: Body,
    turned: Circle,
    rates: Limb,
    torques: Limb,
    heel_force_x: float,
    heel_force_y: float,
    ball_force_x: float,
    ball_force_y: float,
    damping: Damping,
    lag: float,
) -> LegMatrix:
    """The leg's part of (M + h J' D J) a = Q - c, with torques [N m] and forces of the ground [N] in Q.

    M and c are Lagrange's for a chain of links at a hip that moves. D is the damping of ground and joints, whose forces
    at rates v are in Q: with a ``lag`` h [s] they are then those at the rates v + h a.
    """
    mass = body.thigh.mass + body.shank.mass + body.foot.mass
    below = body.shank.mass + body.foot.mass
    s1 = body.thigh.mass * body.thigh.mass_centre + below * body.thigh.length
    s2 = body.shank.mass * body.shank.mass_centre + body.foot.mass * body.shank.length
    s3 = body.foot.mass * body.foot.mass_centre
    p11 = body.thigh.inertia + body.thigh.mass * body.thigh.mass_centre * body.thigh.mass_centre
    p11 += below * body.thigh.length * body.thigh.length
    p22 = body.shank.inertia + body.shank.mass * body.shank.mass_centre * body.shank.mass_centre
    p22 += body.foot.mass * body.shank.length * body.shank.length
    p33 = body.foot.inertia + s3 * body.foot.mass_centre
    p12, p13, p23 = s2 * body.thigh.length, s3 * body.thigh.length, s3 * body.shank.length
    c12 = turned.thigh_cosine * turned.shank_cosine + turned.thigh_sine * turned.shank_sine
    c13 = turned.thigh_cosine * turned.foot_cosine + turned.thigh_sine * turned.foot_sine
    c23 = turned.shank_cosine * turned.foot_cosine + turned.shank_sine * turned.foot_sine
    s12 = turned.thigh_sine * turned.shank_cosine - turned.thigh_cosine * turned.shank_sine
    s13 = turned.thigh_sine * turned.foot_cosine - turned.thigh_cosine * turned.foot_sine
    s23 = turned.shank_sine * turned.foot_cosine - turned.shank_cosine * turned.foot_sine
    w1, w2, w3 = rates.thigh * rates.thigh, rates.shank * rates.shank, rates.foot * rates.foot
    # Levers of the contacts: how far each angle moves heel and ball, along x by the cosine and y by the sine.
    l1, l2, heel, ball = body.thigh.length, body.shank.length, -body.heel, body.foot.length
    x1, x2, x3 = l1 * turned.thigh_cosine, l2 * turned.shank_cosine, turned.foot_cosine
    y1, y2, y3 = l1 * turned.thigh_sine, l2 * turned.shank_sine, turned.foot_sine
    force_x, force_y = heel_force_x + ball_force_x, heel_force_y + ball_force_y
    moment_x, moment_y = heel * heel_force_x + ball * ball_force_x, heel * heel_force_y + ball * ball_force_y
    # Damping of the ground: sums over heel and ball of the damping times levers; dc and dd are what couples x and y.
    dx0, dx1 = damping.heel_xx + damping.ball_xx, heel * damping.heel_xx + ball * damping.ball_xx
    dx2 = heel * heel * damping.heel_xx + ball * ball * damping.ball_xx
    dc0, dc1 = damping.heel_xy + damping.ball_xy, heel * damping.heel_xy + ball * damping.ball_xy
    dc2 = heel * heel * damping.heel_xy + ball * ball * damping.ball_xy
    dd0, dd1 = damping.heel_yx + damping.ball_yx, heel * damping.heel_yx + ball * damping.ball_yx
    dd2 = heel * heel * damping.heel_yx + ball * ball * damping.ball_yx
    dy0, dy1 = damping.heel_yy + damping.ball_yy, heel * damping.heel_yy + ball * damping.ball_yy
    dy2 = heel * heel * damping.heel_yy + ball * ball * damping.ball_yy
    ankle = damping.ankle_inertia + lag * damping.ankle
    knee = lag * damping.knee
    m12, m13 = (
        p12 * c12 + lag * (dx0 * x1 * x2 + dy0 * y1 * y2) - knee,
        p13 * c13 + lag * (dx1 * x1 * x3 + dy1 * y1 * y3),
    )
    m23 = p23 * c23 + lag * (dx1 * x2 * x3 + dy1 * y2 * y3) - ankle
    along1, along2 = s1 * turned.thigh_cosine + lag * dx0 * x1, s2 * turned.shank_cosine + lag * dx0 * x2
    along3 = s3 * turned.foot_cosine + lag * dx1 * x3
    up1, up2 = s1 * turned.thigh_sine + lag * dy0 * y1, s2 * turned.shank_sine + lag * dy0 * y2
    up3 = s3 * turned.foot_sine + lag * dy1 * y3
    return LegMatrix(
        m11=p11 + lag * (dx0 * x1 * x1 + dy0 * y1 * y1 + (dc0 + dd0) * x1 * y1) + knee,
        m12=m12 + lag * (dc0 * x1 * y2 + dd0 * x2 * y1),
        m13=m13 + lag * (dc1 * x1 * y3 + dd1 * x3 * y1),
        m21=m12 + lag * (dc0 * x2 * y1 + dd0 * x1 * y2),
        m22=p22 + lag * (dx0 * x2 * x2 + dy0 * y2 * y2 + (dc0 + dd0) * x2 * y2) + knee + ankle,
        m23=m23 + lag * (dc1 * x2 * y3 + dd1 * x3 * y2),
        m31=m13 + lag * (dc1 * x3 * y1 + dd1 * x1 * y3),
        m32=m23 + lag * (dc1 * x3 * y2 + dd1 * x2 * y3),
        m33=p33 + lag * (dx2 * x3 * x3 + dy2 * y3 * y3 + (dc2 + dd2) * x3 * y3) + ankle,
        x1=along1 + lag * dd0 * y1,
        x2=along2 + lag * dd0 * y2,
        x3=along3 + lag * dd1 * y3,
        y1=up1 + lag * dc0 * x1,
        y2=up2 + lag * dc0 * x2,
        y3=up3 + lag * dc1 * x3,
        along1=along1 + lag * dc0 * y1,
        along2=along2 + lag * dc0 * y2,
        along3=along3 + lag * dc1 * y3,
        up1=up1 + lag * dd0 * x1,
        up2=up2 + lag * dd0 * x2,
        up3=up3 + lag * dd1 * x3,
        b1=torques.thigh
        - p12 * s12 * w2
        - p13 * s13 * w3
        - s1 * (body.gravity * turned.thigh_sine)
        + x1 * force_x
        + y1 * force_y,
        b2=torques.shank
        + p12 * s12 * w1
        - p23 * s23 * w3
        - s2 * (body.gravity * turned.shank_sine)
        + x2 * force_x
        + y2 * force_y,
        b3=torques.foot
        + p13 * s13 * w1
        + p23 * s23 * w2
        - s3 * (body.gravity * turned.foot_sine)
        + x3 * moment_x
        + y3 * moment_y,
        hip_xx=mass + lag * dx0,
        hip_xy=lag * dc0,
        hip_yx=lag * dd0,
        hip_yy=mass + lag * dy0,
        force_x=force_x + s1 * turned.thigh_sine * w1 + s2 * turned.shank_sine * w2 + s3 * turned.foot_sine * w3,
        force_y=force_y
        - mass * body.gravity
        - s1 * turned.thigh_cosine * w1
        - s2 * turned.shank_cosine * w2
        - s3 * turned.foot_cosine * w3,
    )


class Column(NamedTuple):
    """One number for thigh, shank and foot: what a leg's block makes of a column."""

    first: float
    second: float
    third: float


def solved(leg: LegMatrix, first: float, second: float, third: float) -> Column:
    """The leg's block times the result is the column given; by Gauss's elimination."""
    # Without an exchange of rows: the masses on the diagonal keep it away from 0.
    l21, l31 = leg.m21 / leg.m11, leg.m31 / leg.m11
    u22, u23 = leg.m22 - l21 * leg.m12, leg.m23 - l21 * leg.m13
    l32 = (leg.m32 - l31 * leg.m12) / u22
    u33 = leg.m33 - l31 * leg.m13 - l32 * u23
    z2 = second - l21 * first
    z3 = (third - l31 * first - l32 * z2) / u33
    z2 = (z2 - u23 * z3) / u22
    return Column((first - leg.m12 * z2 - leg.m13 * z3) / leg.m11, z2, z3)


class Freed(NamedTuple):
    """What a leg that moves freely adds to the hip's equations, and its accelerations without those of the hip."""

    free: Column
    along: Column
    upward: Column
    xx: float
    xy: float
    yx: float
    yy: float
    x: float
    y: float


def freed(leg: LegMatrix) -> Freed:
    """Eliminate the angles of a leg from the equations of the hip (Schur's complement)."""
    free = solved(leg, leg.b1, leg.b2, leg.b3)
    along = solved(leg, leg.x1, leg.x2, leg.x3)
    upward = solved(leg, leg.y1, leg.y2, leg.y3)
    return Freed(
        free=free,
        along=along,
        upward=upward,
        xx=leg.hip_xx - (leg.along1 * along.first + leg.along2 * along.second + leg.along3 * along.third),
        xy=leg.hip_xy - (leg.along1 * upward.first + leg.along2 * upward.second + leg.along3 * upward.third),
        yx=leg.hip_yx - (leg.up1 * along.first + leg.up2 * along.second + leg.up3 * along.third),
        yy=leg.hip_yy - (leg.up1 * upward.first + leg.up2 * upward.second + leg.up3 * upward.third),
        x=leg.force_x - (leg.along1 * free.first + leg.along2 * free.second + leg.along3 * free.third),
        y=leg.force_y - (leg.up1 * free.first + leg.up2 * free.second + leg.up3 * free.third),
    )


def turned_limb(leg: Freed, hip_x: float, hip_y: float) -> Limb:
    """Accelerations of a leg's angles [rad/s^2] at an acceleration of the hip [m/s^2]."""
    return Limb(
        leg.free.first - hip_x * leg.along.first - hip_y * leg.upward.first,
        leg.free.second - hip_x * leg.along.second - hip_y * leg.upward.second,
        leg.free.third - hip_x * leg.along.third - hip_y * leg.upward.third,
    )


def accelerations(
    body: Body, lean: float, lean_rate: float, torque: float, push: float, left: Freed, right: Freed
) -> Pose:
    """Accelerations of all coordinates [m/s^2], [rad/s^2], with a torque on the lean of the trunk [N m].

    ``push`` [N] acts forward on the trunk's mass centre.
    """
    sine, cosine = sine_and_cosine_of_turns(lean * TURNS_OF_RADIAN)
    moment = body.trunk.mass * body.trunk.mass_centre
    inertia = body.trunk.inertia + moment * body.trunk.mass_centre
    along, upward = moment * cosine, -moment * sine
    turning = torque + moment * (body.gravity * sine) + push * body.trunk.mass_centre * cosine
    whirl = moment * lean_rate * lean_rate
    xx = left.xx + right.xx + body.trunk.mass - along * along / inertia
    xy = left.xy + right.xy - along * upward / inertia
    yx = left.yx + right.yx - along * upward / inertia
    yy = left.yy + right.yy + body.trunk.mass - upward * upward / inertia
    x = left.x + right.x + whirl * sine + push - along * turning / inertia
    y = left.y + right.y + whirl * cosine - body.trunk.mass * body.gravity - upward * turning / inertia
    # The trunk is eliminated as the legs are: two equations for the hip are left, by Cramer's rule.
    determinant = xx * yy - xy * yx
    hip_x, hip_y = (x * yy - y * xy) / determinant, (y * xx - x * yx) / determinant
    return Pose(
        x=hip_x,
        y=hip_y,
        lean=(turning - along * hip_x - upward * hip_y) / inertia,
        left=turned_limb(left, hip_x, hip_y),
        right=turned_limb(right, hip_x, hip_y),
    )
